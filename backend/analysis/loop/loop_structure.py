"""The drive's loop: speed error -> PI -> torque filter -> notches -> current loop and delay ->
mechanics -> speed filter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.loop.notch import Notch
from backend.analysis.response.sampling import delay_response, lag_response
from backend.analysis.signals.arrays import ComplexArray, FloatArray

TURN = 2.0 * np.pi
NotchResponse = Callable[[Notch, FloatArray], ComplexArray]


def continuous_notch(notch: Notch, frequency_hz: FloatArray) -> ComplexArray:
    """Notch response for drives that realise it without noticeable rounding."""
    return notch.response(frequency_hz)


@dataclass(frozen=True)
class LoopFilters:
    """Corners of the first-order filters that may be set; None means not there, or unknown."""

    speed_hz: float | None = None
    torque_hz: float | None = None


@dataclass(frozen=True)
class DriveLoops:
    """The fixed parts of the drive's loop; None means not there.

    ``delay_s`` is everything that the loop itself adds: computing, holding the torque, measuring
    the speed. ``choices`` are other filters that the drive can be given, wider ones later.
    """

    current_bandwidth_hz: float
    delay_s: float
    speed_filter_hz: float | None = None
    torque_filter_hz: float | None = None
    highest_speed_bandwidth_hz: float | None = None
    choices: tuple[LoopFilters, ...] = ()

    @property
    def filters(self) -> LoopFilters:
        """As they are."""
        return LoopFilters(self.speed_filter_hz, self.torque_filter_hz)

    def with_filters(self, filters: LoopFilters) -> DriveLoops:
        """The same loop with other filters."""
        return replace(self, speed_filter_hz=filters.speed_hz, torque_filter_hz=filters.torque_hz)

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """All fixed parts in series."""
        return np.asarray(
            lag_response(frequency_hz, self.current_bandwidth_hz)
            * lag_response(frequency_hz, self.torque_filter_hz)
            * lag_response(frequency_hz, self.speed_filter_hz)
            * delay_response(frequency_hz, self.delay_s)
        )


@dataclass(frozen=True)
class Gains:
    """``speed_nms`` Nm per rad/s; ``integral_hz`` corner of the PI; ``position_1_s`` 1/s.

    ``speed_bandwidth_hz`` is speed_nms/(2π·J), as drives with a bandwidth convention state it.
    """

    speed_nms: float
    integral_hz: float
    position_1_s: float
    speed_bandwidth_hz: float


def speed_loop(
    frequency_hz: FloatArray, plant: ComplexArray, fixed: ComplexArray, gains: Gains
) -> ComplexArray:
    """Open speed loop; ``fixed`` contains all filters, notches, current loop and delay."""
    s = 1j * TURN * frequency_hz
    pi = gains.speed_nms * (1.0 + TURN * gains.integral_hz / s)
    return np.asarray(pi * fixed * plant)


def step_of_closed_loop(
    frequency_hz: FloatArray, closed: ComplexArray, *, duration_s: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """Unit step response (time, value) of a closed loop known by its frequency response."""
    resolution = 0.5 / duration_s
    top = float(frequency_hz[-1])
    f = np.arange(0.0, top, resolution)
    real = np.interp(f, frequency_hz, closed.real, left=1.0)
    imag = np.interp(f, frequency_hz, closed.imag, left=0.0)
    low = f < frequency_hz[0]
    imag[low] = closed.imag[0] * f[low] / frequency_hz[0]
    # A cosine taper at the top end keeps the cut from ringing.
    taper = 0.5 + 0.5 * np.cos(np.pi * np.clip((f / top - 0.7) / 0.3, 0.0, 1.0))
    impulse = np.fft.irfft((real + 1j * imag) * taper)
    value = np.cumsum(impulse)
    time = (np.arange(value.size) + 0.5) / (2.0 * top)
    half = value.size // 2
    return time[:half], value[:half]
