"""Structure of the drive's loop: speed error -> PI -> torque filter -> notches -> current loop and
delay -> mechanics -> speed filter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.loop.notch import Notch
from backend.analysis.response.signal_path.sampling import delay_response, lag_response
from backend.analysis.signals.arrays import ComplexArray, FloatArray

TURN = 2.0 * np.pi
NotchResponse = Callable[[Notch, FloatArray], ComplexArray]


def continuous_notch(notch: Notch, frequency_hz: FloatArray) -> ComplexArray:
    """Notch response for drives that realise it without noticeable rounding."""
    return notch.response(frequency_hz)


@dataclass(frozen=True)
class LoopFilters:
    """Corners of the adjustable first-order filters; None means not present, or unknown."""

    speed_hz: float | None = None
    torque_hz: float | None = None


@dataclass(frozen=True)
class DriveLoops:
    """The fixed parts of the drive's loop; None means not present.

    ``delay_s`` is the total delay of the loop itself: computation, torque hold and speed
    measurement. ``choices`` are other filter settings of the drive, in order of increasing
    bandwidth.
    """

    current_bandwidth_hz: float
    delay_s: float
    speed_filter_hz: float | None = None
    torque_filter_hz: float | None = None
    highest_speed_bandwidth_hz: float | None = None
    choices: tuple[LoopFilters, ...] = ()

    @property
    def filters(self) -> LoopFilters:
        """The present filter setting."""
        return LoopFilters(self.speed_filter_hz, self.torque_filter_hz)

    def with_filters(self, filters: LoopFilters) -> DriveLoops:
        """Return the same loop with other filters."""
        return replace(self, speed_filter_hz=filters.speed_hz, torque_filter_hz=filters.torque_hz)

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """Return the response of all fixed parts in series."""
        return np.asarray(
            lag_response(frequency_hz, self.current_bandwidth_hz)
            * lag_response(frequency_hz, self.torque_filter_hz)
            * lag_response(frequency_hz, self.speed_filter_hz)
            * delay_response(frequency_hz, self.delay_s)
        )


@dataclass(frozen=True)
class Gains:
    """Controller gains: ``speed_nms`` in Nm per rad/s; ``integral_hz`` corner of the PI;
    ``position_1_s`` in 1/s.

    ``speed_bandwidth_hz`` is speed_nms/(2π·J), as drives with a bandwidth convention state it.
    """

    speed_nms: float
    integral_hz: float
    position_1_s: float
    speed_bandwidth_hz: float

    def times(self, share: float) -> Gains:
        """Gains of a loop that is slower by this share."""
        return Gains(
            share * self.speed_nms,
            share * self.integral_hz,
            share * self.position_1_s,
            share * self.speed_bandwidth_hz,
        )


def speed_loop(
    frequency_hz: FloatArray, plant: ComplexArray, fixed: ComplexArray, gains: Gains
) -> ComplexArray:
    """Return the open speed loop; ``fixed`` is all filters, notches, current loop and delay."""
    s = 1j * TURN * frequency_hz
    pi = gains.speed_nms * (1.0 + TURN * gains.integral_hz / s)
    return np.asarray(pi * fixed * plant)


def step_of_closed_loop(
    frequency_hz: FloatArray, closed: ComplexArray, *, duration_s: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """Return the unit step response (time, value) of a closed loop from its frequency response."""
    resolution = 0.5 / duration_s
    top = float(frequency_hz[-1])
    f = np.arange(0.0, top, resolution)
    real = np.interp(f, frequency_hz, closed.real, left=1.0)
    imag = np.interp(f, frequency_hz, closed.imag, left=0.0)
    low = f < frequency_hz[0]
    imag[low] = closed.imag[0] * f[low] / frequency_hz[0]
    # A cosine taper at the upper end avoids ringing from the cut-off.
    taper = 0.5 + 0.5 * np.cos(np.pi * np.clip((f / top - 0.7) / 0.3, 0.0, 1.0))
    impulse = np.fft.irfft((real + 1j * imag) * taper)
    value = np.cumsum(impulse)
    time = (np.arange(value.size) + 0.5) / (2.0 * top)
    half = value.size // 2
    return time[:half], value[:half]
