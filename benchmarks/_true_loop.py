"""The open speed loop of a virtual drive from its own settings, at all frequencies."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from backend.analysis.loop.loop_goals import Worst, worst_of
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import analytic_response

_STEP_S = 50e-6
Response = npt.NDArray[np.complex128]
Lines = npt.NDArray[np.float64]


def true_loop(device: VirtualServo, frequency_hz: Lines) -> Response:
    """Controller, filters and notches in the steps of the firmware, times mechanics and delays."""
    axis = device.axis
    loops, rough = axis.loops, axis.spec.rough_torque
    assert loops is not None
    s = 2j * np.pi * frequency_hz
    z = np.exp(s * _STEP_S)

    def low_pass(a: float) -> Response:
        return np.asarray(a / (1.0 - (1.0 - a) / z))

    def lag(time_s: float) -> float:
        return 1.0 if time_s <= 0 else float(-np.expm1(-_STEP_S / time_s))

    gains = loops.first
    loop = (gains.speed_nms + gains.integral_nm / s) * rough.torque_constant
    loop = loop * low_pass(lag(1.0 / (2 * np.pi * loops.speed_filter_hz)))
    loop = loop * low_pass(lag(loops.torque_filter_s)) * low_pass(lag(rough.torque_filter_s))
    for n in loops.notches:
        loop = loop * (z * z + n.a1 * z + n.a2) / (z * z + n.b1 * z + n.b2)
    # The torque is held for a step and the speed is a difference over one; a longer period adds
    # its own hold and as much again, in whole steps.
    more = rough.loop_period_s / _STEP_S - 1.0
    late_s = _STEP_S * (1.0 + 0.5 * more + int(0.5 * more + 0.5))
    current = 1.0 / (1.0 + 1j * frequency_hz / loops.current_loop_hz)
    return np.asarray(
        loop * current * np.exp(-s * late_s) * analytic_response(axis.spec, frequency_hz)
    )


def true_margins(device: VirtualServo) -> Worst:
    """Phase margin, gain margin, Ms and stability over all frequencies."""
    f = np.geomspace(0.5, 8000.0, 8000)
    return worst_of(true_loop(device, f)[None, :])
