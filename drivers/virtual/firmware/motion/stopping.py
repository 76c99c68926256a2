"""Stopping an axis: ramps, torques, coasting and dynamic braking of each family.

``begin``, ``servo_off`` and ``react`` return whether to wait for EV_STOPPED.
"""

from __future__ import annotations

from collections.abc import Sequence

from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.firmware.cia402.base import FaultInfo, OffStop
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.motion.modes import CST, PT, Modes

_COAST: OffStop = ("coast", "free")


class Stopping:
    """See the module docstring."""

    def __init__(self, core: Core, modes: Modes) -> None:
        self._core = core
        self._axis = core.axis
        self._modes = modes
        self._traits = core.family.traits.stops
        self._then = "free"

    def begin(self, option: int) -> bool:
        """Start options 0 to 4 of 605Ah–605Eh (004:2451-2551, 001:880-935)."""
        axis, core, traits = self._axis, self._core, self._traits
        self._then = "free"
        ramp = traits.ramps.get(option)
        if option in (1, 2) and traits.slope_in_torque and self._modes.mode in (PT, CST):
            axis.stop_by_torque_slope(max(core.torque_of(core.number("6087:00", 3000)), 1e-6))
        elif ramp is not None:
            axis.stop_ramp(core.deceleration(ramp))
        elif option == 1:
            axis.stop_ramp(self._modes.slow_ramp())
        elif option == 2:
            axis.stop_ramp(core.deceleration(traits.quick_ramp_key))
        elif option == 3:
            axis.stop_by_torque(self._brake_torque())
        elif option == 4:
            axis.stop_by_torque(float(axis.p[k.P_T_MAX]))
        elif traits.off is not None:
            axis.power_off()
            return False
        elif traits.waits:
            return self.coast()
        else:
            return False
        return True

    def coast(self) -> bool:
        """Switch power off now; the state changes when the axis is at standstill (001:882)."""
        self._axis.power_off()
        if abs(self._axis.speed_rad_s) <= self._axis.p[k.P_STOP_SPEED]:
            return False
        self._axis.await_standstill()
        return True

    def servo_off(self, choice: tuple[str, dict[int, OffStop]]) -> bool:
        """Stop as a parameter selects: (while moving, afterwards)."""
        key, ways = choice
        moving, self._then = ways.get(int(self._core.number(key, -1)), _COAST)
        if moving == "ramp":
            self._axis.stop_ramp(self._core.deceleration(self._traits.quick_ramp_key))
            return True
        self._axis.power_off(dynamic_brake=moving == "dynamic")
        if (moving, self._then) in (("coast", "free"), ("dynamic", "dynamic")):
            return False
        self._axis.await_standstill()
        return True

    def react(self, faults: Sequence[FaultInfo], option: int) -> bool:
        """Start the fault reaction: 605Eh, off at once, or the parameter for the kind of fault."""
        traits = self._traits
        self._then = "free"
        if traits.reaction == "off":
            return False
        if traits.first is not None and traits.second is not None:
            first = any(self._is_first_kind(item.fault) for item in faults)
            return self.servo_off(traits.first if first else traits.second)
        if any(item.fixed for item in faults):
            return False
        return self.begin(option)

    def _is_first_kind(self, code: str) -> bool:
        entry = next((f for f in self._core.profile.faults if f.code == code), None)
        return entry is None or entry.severity.startswith("first")

    def after_rest(self, axis: VirtualAxis) -> None:
        """Apply the final state after the stop."""
        if self._then == "hold":
            axis.hold()
        elif axis.powered or axis.p[k.P_STOPPING] > 0:
            axis.power_off(dynamic_brake=self._then == "dynamic")
        elif self._then == "dynamic":
            axis.power_off(dynamic_brake=True)
        self._then = "free"

    def _brake_torque(self) -> float:
        rated = self._core.motor.rated_torque_nm
        key = self._traits.torque_key
        return rated if key is None else self._core.number(key, 1000) / 1000 * rated
