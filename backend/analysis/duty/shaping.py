"""Command shaping: impulses whose convolution with a command leaves a slow vibration at rest. Pure.

N. C. Singer and W. P. Seering, "Preshaping command inputs to reduce system vibration" (1990) has
ZV and ZVD; W. Singhose, W. Seering and N. Singer, "Residual vibration reduction using vector
diagrams to generate shaped inputs" (1994) the extra-insensitive shaper (EI).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

FloatArray = npt.NDArray[np.float64]
Kind = Literal["zv", "zvd", "ei"]
_TURN = 2.0 * np.pi
#: Vibration that an EI shaper leaves at the stated frequency, as a share of the unshaped one.
EI_LEAVES = 0.05
#: A vibration counts as found if a damped oscillation explains this share of the signal's power.
_EXPLAINED = 0.5
_MOST_DAMPED = 0.4


@dataclass(frozen=True)
class Vibration:
    """A damped oscillation: ``amplitude`` at the begin of the observation, in its signal's unit."""

    frequency_hz: float
    damping: float
    amplitude: float
    explained: float


@dataclass(frozen=True)
class Shaper:
    """Impulses [k]: times in s from 0, and shares that add up to one."""

    kind: Kind
    times_s: FloatArray
    shares: FloatArray

    @property
    def delay_s(self) -> float:
        """What the shaped command lasts longer."""
        return float(self.times_s[-1])

    def applied(self, command: FloatArray, rate_hz: float) -> FloatArray:
        """The shaped command, longer by `delay_s`; impulses between samples are divided."""
        longer = int(np.ceil(self.delay_s * rate_hz)) + 1
        given = np.concatenate([command, np.full(longer, command[-1])])
        at = np.arange(given.size, dtype=np.float64)
        parts = [
            share * np.interp(at - time * rate_hz, at, given, left=float(command[0]))
            for time, share in zip(self.times_s, self.shares, strict=True)
        ]
        return np.asarray(np.sum(parts, axis=0))

    def leaves(self, frequency_hz: float, damping: float) -> float:
        """Residual vibration of a mode that rings like this, as a share of the unshaped one."""
        omega = _TURN * frequency_hz
        ringing = omega * np.sqrt(1.0 - damping**2)
        grown = self.shares * np.exp(damping * omega * self.times_s)
        both = np.hypot(
            np.sum(grown * np.cos(ringing * self.times_s)),
            np.sum(grown * np.sin(ringing * self.times_s)),
        )
        return float(both * np.exp(-damping * omega * self.delay_s))


def designed(kind: Kind, frequency_hz: float, damping: float) -> Shaper:
    """The shaper of this kind for a mode; EI for a small damping."""
    period = 1.0 / (frequency_hz * np.sqrt(1.0 - damping**2))
    k = float(np.exp(-damping * np.pi / np.sqrt(1.0 - damping**2)))
    if kind == "zv":
        shares, halves = np.array([1.0, k]), 2
    elif kind == "zvd":
        shares, halves = np.array([1.0, 2.0 * k, k * k]), 3
    else:
        # The undamped shaper, its impulses lessened as the mode itself decays between them.
        v = EI_LEAVES
        even = np.array([(1.0 + v) / 4.0, (1.0 - v) / 2.0, (1.0 + v) / 4.0])
        shares, halves = even * k ** np.arange(3), 3
    return Shaper(kind, 0.5 * period * np.arange(halves), shares / np.sum(shares))


def vibration_of(
    signal: FloatArray, rate_hz: float, low_hz: float, high_hz: float
) -> Vibration | None:
    """The strongest damped oscillation of a signal that rings out; None where there is none.

    The frequency is sought in this range; offset and drift of the signal are taken out.
    """
    time = np.arange(signal.size) / rate_hz
    if signal.size < 32 or time[-1] * low_hz < 1.5:
        return None
    drift = np.polynomial.Polynomial.fit(time, signal, 1)
    centred = signal - drift(time)
    power = float(np.sum(centred**2))
    if power <= 0.0:
        return None
    size = 1 << int(np.ceil(np.log2(8 * signal.size)))
    lines = np.fft.rfftfreq(size, 1.0 / rate_hz)
    inside = (lines >= low_hz) & (lines <= high_hz)
    spectrum = np.abs(np.fft.rfft(centred * np.hanning(2 * centred.size)[centred.size :], size))
    if not np.any(inside):
        return None
    begin = float(lines[inside][np.argmax(spectrum[inside])])

    def parts(shape: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Columns fitted to the signal by least squares, and what they leave."""
        frequency, damping = float(shape[0]), float(shape[1])
        decay = np.exp(-damping * _TURN * frequency * time)
        turning = _TURN * frequency * np.sqrt(1.0 - damping**2) * time
        columns = np.column_stack(
            [decay * np.cos(turning), decay * np.sin(turning), np.ones(time.size), time]
        )
        found = np.linalg.lstsq(columns, signal, rcond=None)[0]
        return found, signal - columns @ found

    best = least_squares(
        lambda shape: parts(shape)[1], np.array([begin, 0.03]), x_scale=np.array([1.0, 0.02]),
        bounds=(np.array([0.7 * low_hz, 0.0]), np.array([1.3 * high_hz, _MOST_DAMPED])),
    )  # fmt: skip
    amplitudes, left = parts(best.x)
    explained = 1.0 - float(np.sum(left**2)) / power
    if explained < _EXPLAINED or not low_hz <= best.x[0] <= high_hz:
        return None
    amplitude = float(np.hypot(amplitudes[0], amplitudes[1]))
    return Vibration(float(best.x[0]), float(best.x[1]), amplitude, explained)


def settled_s(signal: FloatArray, rate_hz: float, window: float) -> float | None:
    """When a signal stays within ``window`` of where it ends; None where it does not.

    Where it ends is the mean of its last fifth; the last tenth must be inside.
    """
    end = float(np.mean(signal[-max(1, signal.size // 5) :]))
    outside = np.flatnonzero(np.abs(signal - end) > window)
    if not outside.size:
        return 0.0
    last = int(outside[-1]) + 1
    return None if last > 0.9 * signal.size else last / rate_hz
