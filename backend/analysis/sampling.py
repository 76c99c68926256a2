"""What lies between an injected sequence and the drive's continuous signals.

The bus sends one value per cycle of length T; the drive holds it (zero-order), or interpolates
towards it when 60C2h is in use (linear, one cycle later), passes it through the current loop
(first order here) and a delay. All of that is known and can be divided out; what sampling folds
back above half the sample rate is not, see :mod:`backend.analysis.sampled_model`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares
from scipy.signal import lfilter

from backend.analysis.arrays import ComplexArray, FloatArray

Hold = Literal["zero", "linear"]

#: Direct estimates hold to this share of the sample rate, sampled-data models to the second.
DIRECT_SHARE = 0.25
MODEL_SHARE = 0.4

#: A drive interpolates in the steps of its own loop (50 µs) and so is half a step ahead of a line.
STEP_LEAD_S = 25e-6
#: Set-points are in force after this many cycles at most.
_MOST_CYCLES = 3


@dataclass(frozen=True)
class SignalPath:
    """Known parts around the mechanics.

    ``current_bandwidth_hz`` is the current loop's corner (None: fast enough to ignore).
    ``command_delay_s`` lies between the sent value and the torque, ``response_delay_s`` between
    the true and the reported velocity. ``direct_gain`` is the torque that one unit of injection
    causes at once: 1 for torque offsets, the speed gain for velocity offsets. ``loop_delay_s``
    is what the drive's own loop adds by computing in steps (half of its 50 µs period).
    ``response_bandwidth_hz`` is the corner of the drive's speed filter, where the reported speed
    passes one (None: not filtered).
    """

    sample_rate_hz: float
    hold: Hold = "zero"
    current_bandwidth_hz: float | None = None
    command_delay_s: float = 0.0
    response_delay_s: float = 0.0
    direct_gain: float = 1.0
    loop_delay_s: float = 25e-6
    response_bandwidth_hz: float | None = None


def hold_response(frequency_hz: FloatArray, sample_rate_hz: float, hold: Hold) -> ComplexArray:
    """Frequency response of the hold, unit gain at 0 Hz."""
    x = np.asarray(frequency_hz, dtype=np.float64) / sample_rate_hz
    zero = np.sinc(x) * np.exp(-1j * np.pi * x)
    # Linear interpolation reaches a value one cycle after it was sent: the square of the hold.
    return np.asarray(zero if hold == "zero" else zero**2, dtype=np.complex128)


def lag_response(frequency_hz: FloatArray, bandwidth_hz: float | None) -> ComplexArray:
    """First-order lag with this corner; None is no lag."""
    f = np.asarray(frequency_hz, dtype=np.float64)
    if bandwidth_hz is None:
        return np.ones(f.shape, dtype=np.complex128)
    return np.asarray(1.0 / (1.0 + 1j * f / bandwidth_hz), dtype=np.complex128)


def delay_response(frequency_hz: FloatArray, delay_s: float) -> ComplexArray:
    """Pure delay."""
    f = np.asarray(frequency_hz, dtype=np.float64)
    return np.asarray(np.exp(-2j * np.pi * f * delay_s), dtype=np.complex128)


def command_response(frequency_hz: FloatArray, path: SignalPath) -> ComplexArray:
    """From the sent sequence to the continuous torque it causes directly."""
    return (
        path.direct_gain
        * hold_response(frequency_hz, path.sample_rate_hz, path.hold)
        * lag_response(frequency_hz, path.current_bandwidth_hz)
        * delay_response(frequency_hz, path.command_delay_s)
    )


def reported_response(frequency_hz: FloatArray, path: SignalPath) -> ComplexArray:
    """From the true to the reported quantity: speed filter and delay."""
    return lag_response(frequency_hz, path.response_bandwidth_hz) * delay_response(
        frequency_hz, path.response_delay_s
    )


def sampled_command(sent: FloatArray, path: SignalPath) -> FloatArray:
    """The part of the *sampled* torque that the sent sequence causes directly.

    Exact for a first-order current loop, any delay and both holds. With no delay and a
    zero-order hold it is u[k] = a·u[k-1] + (1-a)·r[k-1], a = exp(-2π·f_c·T).
    """
    period_s = 1.0 / path.sample_rate_hz
    whole, part = divmod(path.command_delay_s, period_s)
    wc = None if path.current_bandwidth_hz is None else 2 * np.pi * path.current_bandwidth_hz

    def after(t: FloatArray) -> FloatArray:
        """Response of the lag to a unit step (zero hold) or unit-slope ramp (linear hold)."""
        late = np.maximum(t, 0.0)
        if path.hold == "zero":
            return np.asarray((t > 0) * 1.0 if wc is None else -np.expm1(-wc * late))
        return np.asarray(late if wc is None else late + np.expm1(-wc * late) / wc)

    t = np.arange(4) * period_s - part
    impulse = after(t) - after(t - period_s)
    if path.hold == "linear":
        impulse = (impulse - after(t - period_s) + after(t - 2 * period_s)) / period_s
    a = 0.0 if wc is None else float(np.exp(-wc * period_s))
    numerator = impulse - a * np.concatenate([[0.0], impulse[:-1]])
    filtered = np.asarray(lfilter(numerator, [1.0, -a], sent)) * path.direct_gain
    return np.concatenate([np.zeros(int(whole)), filtered])[: filtered.size]


def fit_path(
    commands: tuple[FloatArray, ...],
    torques: tuple[FloatArray, ...],
    lines: tuple[npt.NDArray[np.int64], ...],
    path: SignalPath,
    *,
    loop_closed: bool,
    hold_known: bool = False,
) -> SignalPath:
    """Hold and delay from the sent values to the torque, and an unknown current loop's corner.

    ``commands`` and ``torques`` [n] are whole periods that follow the same period (steady state),
    ``lines`` the excited bins.
    """
    judge = _PathJudge(commands, torques, lines, loop_closed)
    holds: tuple[Hold, ...] = (path.hold,) if hold_known else ("linear", "zero")
    tried = [judge.whole_cycles(replace(path, hold=hold)) for hold in holds]
    best = min(tried, key=lambda found: found[1])[0]
    if loop_closed or path.current_bandwidth_hz is None:
        # A corner and a fraction of a cycle are hardly told apart: the mechanics' fit finds it.
        return best
    return judge.refined(best, corner=False, delay=True)[0]


@dataclass(frozen=True)
class _PathJudge:
    """How well a path explains the reported torque, on the upper lines.

    There a closed loop adds about a/s of what is injected, which is fitted along. That leaves no
    more than whole cycles to be told apart in a closed loop, less the `STEP_LEAD_S` of
    interpolation.
    """

    commands: tuple[FloatArray, ...]
    torques: tuple[FloatArray, ...]
    lines: tuple[npt.NDArray[np.int64], ...]
    loop_closed: bool

    def whole_cycles(self, path: SignalPath) -> tuple[SignalPath, float]:
        """The best number of cycles, and corner where unknown, with what is left unexplained.

        Half a cycle and a hold look like none and an interpolation, as far as samples tell.
        """
        period_s = 1.0 / path.sample_rate_hz
        lead_s = STEP_LEAD_S if path.hold == "linear" else 0.0
        known = path.current_bandwidth_hz
        corners = np.geomspace(150.0, 6000.0, 7) if known is None else np.array([known])
        trials = [
            replace(path, command_delay_s=max(c * period_s - lead_s, 0.0),
                    current_bandwidth_hz=float(b))
            for c in range(_MOST_CYCLES + 1) for b in corners
        ]  # fmt: skip
        costs = [float(np.sum(self._rest(trial) ** 2)) for trial in trials]
        start = trials[int(np.argmin(costs))]
        return self.refined(start, corner=known is None, delay=False)

    def refined(self, start: SignalPath, *, corner: bool, delay: bool) -> tuple[SignalPath, float]:
        """Gauss-Newton from a start; microseconds matter here."""
        period_s = 1.0 / start.sample_rate_hz

        def path_of(x: FloatArray) -> SignalPath:
            late = start.command_delay_s
            if delay:
                late = max(late + float(np.clip(x[0], -0.2, 0.2)) * period_s, 0.0)
            bandwidth = start.current_bandwidth_hz
            if corner:
                bandwidth = float(np.exp(np.clip(x[1], 3.0, 10.0)))
            return replace(start, command_delay_s=late, current_bandwidth_hz=bandwidth)

        x0 = np.array([start.command_delay_s / period_s, np.log(start.current_bandwidth_hz or 1.0)])
        if not corner and not delay:
            return start, float(np.sum(self._rest(start) ** 2))

        def rest(x: FloatArray) -> FloatArray:
            return self._rest(path_of(x))

        found = least_squares(rest, x0, x_scale=[0.05, 0.1], max_nfev=25)
        return path_of(found.x), 2.0 * float(found.cost)

    def _rest(self, path: SignalPath) -> FloatArray:
        """What the path leaves unexplained, real and imaginary parts."""
        parts = []
        for sent, torque, bins in zip(self.commands, self.torques, self.lines, strict=True):
            upper = bins[(3 * bins.size) // 4 :]
            twice = np.concatenate([sent, sent])
            u = np.fft.rfft(sampled_command(twice, path)[sent.size :])[upper]
            error = np.fft.rfft(torque)[upper] - u
            if self.loop_closed:
                column = u / (1j * upper)
                share = np.vdot(column, error).real / np.vdot(column, column).real
                error = error - column * share
            parts += [error.real, error.imag]
        return np.concatenate(parts)
