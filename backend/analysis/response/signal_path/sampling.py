"""The signal path between an injected sequence and the drive's continuous signals.

The bus sends one value per cycle of length T; the drive holds it (zero-order), or interpolates
towards it when 60C2h is in use (linear, one cycle later), passes it through the current loop
(first order here) and a delay. All of that is known and can be divided out; the images that
sampling folds back are not, see :mod:`backend.analysis.response.signal_path.sampled_model`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy

from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import sampling as threshold

Hold = Literal["zero", "linear"]

DIRECT_SHARE = threshold.DIRECT_SHARE
MODEL_SHARE = threshold.MODEL_SHARE

STEP_LEAD_S = threshold.STEP_LEAD_S

USUAL_CURRENT_HZ = threshold.USUAL_CURRENT_HZ


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


def lead_s(hold: Hold) -> float:
    """Return the time [s] by which a hold's torque leads whole cycles."""
    return STEP_LEAD_S if hold == "linear" else 0.0


def command_delay_s(cycles: float, hold: Hold, sample_rate_hz: float) -> float:
    """Return the delay [s] of a path whose setpoints take effect after so many cycles, at least 0.

    Negative by the lead where a drive begins its interpolation in the cycle of the setpoint.
    """
    return max(cycles, 0.0) / sample_rate_hz - lead_s(hold)


def cycles_of(path: SignalPath) -> float:
    """Return the cycles after which setpoints take effect: the inverse of `command_delay_s`."""
    return (path.command_delay_s + lead_s(path.hold)) * path.sample_rate_hz


def hold_response(frequency_hz: FloatArray, sample_rate_hz: float, hold: Hold) -> ComplexArray:
    """Return the frequency response of the hold, unit gain at 0 Hz."""
    x = np.asarray(frequency_hz, dtype=np.float64) / sample_rate_hz
    zero = np.sinc(x) * np.exp(-1j * np.pi * x)
    # Linear interpolation reaches a value one cycle after it was sent: the square of the hold.
    return np.asarray(zero if hold == "zero" else zero**2, dtype=np.complex128)


def lag_response(frequency_hz: FloatArray, bandwidth_hz: float | None) -> ComplexArray:
    """Return the response of a first-order lag with this corner; None is no lag."""
    f = np.asarray(frequency_hz, dtype=np.float64)
    if bandwidth_hz is None:
        return np.ones(f.shape, dtype=np.complex128)
    return np.asarray(1.0 / (1.0 + 1j * f / bandwidth_hz), dtype=np.complex128)


def delay_response(frequency_hz: FloatArray, delay_s: float) -> ComplexArray:
    """Return the response of a pure delay."""
    f = np.asarray(frequency_hz, dtype=np.float64)
    return np.asarray(np.exp(-2j * np.pi * f * delay_s), dtype=np.complex128)


def command_response(frequency_hz: FloatArray, path: SignalPath) -> ComplexArray:
    """Return the response from the sent sequence to the continuous torque it causes directly."""
    return (
        path.direct_gain
        * hold_response(frequency_hz, path.sample_rate_hz, path.hold)
        * lag_response(frequency_hz, path.current_bandwidth_hz)
        * delay_response(frequency_hz, path.command_delay_s)
    )


def reported_response(frequency_hz: FloatArray, path: SignalPath) -> ComplexArray:
    """Return the response from the true to the reported quantity: speed filter and delay."""
    return lag_response(frequency_hz, path.response_bandwidth_hz) * delay_response(
        frequency_hz, path.response_delay_s
    )


def sampled_command(sent: FloatArray, path: SignalPath) -> FloatArray:
    """Return the part of the *sampled* torque that the sent sequence causes directly.

    Exact for a first-order current loop, any delay and both holds. With no delay and a
    zero-order hold it is u[k] = a·u[k-1] + (1-a)·r[k-1], a = exp(-2π·f_c·T).
    """
    numerator, a, whole = _difference_equation(path)
    filtered = np.asarray(scipy.signal.lfilter(numerator, [1.0, -a], sent)) * path.direct_gain
    return np.concatenate([np.zeros(whole), filtered])[: filtered.size]


def sampled_command_response(frequency_hz: FloatArray, path: SignalPath) -> ComplexArray:
    """Return the response of `sampled_command`, from the sent spectrum to that of the samples."""
    numerator, a, whole = _difference_equation(path)
    z = np.exp(-2j * np.pi * np.asarray(frequency_hz) / path.sample_rate_hz)
    top = np.polyval(numerator[::-1], z) * z**whole
    return np.asarray(path.direct_gain * top / (1.0 - a * z), dtype=np.complex128)


def rising_command(sent: FloatArray, path: SignalPath) -> FloatArray:
    """Return the *sampled* torque of a sequence's integral (s) in excess of its mean per cycle.

    A speed loop integrates the reference that it holds, so that the integral rises within each
    cycle: a sawtooth around the mean that `sampled_command` covers. Exact for a first-order current
    loop and any delay; zero with interpolation, where the samples are near the mean.
    """
    if path.hold == "linear":
        return np.zeros_like(sent)
    numerator, a, whole = _sawtooth(path)
    filtered = np.asarray(scipy.signal.lfilter(numerator, [1.0, -a], sent)) * path.direct_gain
    return np.concatenate([np.zeros(whole), filtered])[: filtered.size]


def sampled_integral_response(frequency_hz: FloatArray, path: SignalPath) -> ComplexArray:
    """Return the response [s] from the sent sequence to its sampled integral, as a torque."""
    f = np.asarray(frequency_hz, dtype=np.float64)
    mean = -0.5j / path.sample_rate_hz / np.tan(np.pi * f / path.sample_rate_hz)
    rises = np.zeros_like(mean)
    if path.hold == "zero":
        numerator, a, whole = _sawtooth(path)
        z = np.exp(-2j * np.pi * f / path.sample_rate_hz)
        rises = path.direct_gain * np.polyval(numerator[::-1], z) * z**whole / (1.0 - a * z)
    return np.asarray(mean * sampled_command_response(f, path) + rises)


def _sawtooth(path: SignalPath) -> tuple[FloatArray, float, int]:
    """Difference equation as `_difference_equation`, for the sawtooth within a hold period."""
    period_s = 1.0 / path.sample_rate_hz
    whole, part = divmod(path.command_delay_s, period_s)
    corner = path.current_bandwidth_hz
    lag_s = 0.0 if corner is None else 1.0 / (2 * np.pi * corner)

    def faded(t: float) -> float:
        return 0.0 if not lag_s else float(np.exp(-t / lag_s))

    def within(t: float) -> float:
        return t - (0.5 * period_s + lag_s) * (1.0 - faded(t))

    a, first = faded(period_s), within(period_s - part)
    after = within(period_s) * faded(period_s - part)
    return np.array([first, after - a * first]), a, int(whole) + 1


def _difference_equation(path: SignalPath) -> tuple[FloatArray, float, int]:
    """Numerator, the single pole, and whole cycles of delay before them."""
    period_s = 1.0 / path.sample_rate_hz
    whole, part = divmod(path.command_delay_s, period_s)
    wc = None if path.current_bandwidth_hz is None else 2 * np.pi * path.current_bandwidth_hz

    def after(t: FloatArray) -> FloatArray:
        """Response to a step: immediate (zero hold), or reached within one cycle."""
        if path.hold == "zero":
            return np.asarray((t > 0) * 1.0 if wc is None else -np.expm1(-wc * np.maximum(t, 0.0)))
        if wc is None:
            return np.asarray(np.clip(t / period_s, 0.0, 1.0))
        # The drive interpolates in small steps, which the sampled torque shows where cycles are
        # short.
        steps = max(round(period_s / (2 * STEP_LEAD_S)), 1)
        begun = t[:, None] - STEP_LEAD_S - np.arange(steps) * (period_s / steps)
        return np.asarray(np.mean(-np.expm1(-wc * np.maximum(begun, 0.0)), axis=1))

    t = np.arange(4) * period_s - part
    impulse = after(t) - after(t - period_s)
    a = 0.0 if wc is None else float(np.exp(-wc * period_s))
    numerator = impulse - a * np.concatenate([[0.0], impulse[:-1]])
    if whole < 0.0:
        # An interpolation that begins before its setpoint's cycle has not reached its value there.
        return numerator[1:], a, int(whole) + 1
    return numerator, a, int(whole)
