"""The holding brake of a motor, with the sequence of its family (000:1360, 002:8117).

Enabling: power on, the brake opens, then commands are accepted. Disabling at standstill: the brake
closes and the power stays on for a set time; in motion the axis stops first. A fault closes it at
once, together with switching off the power stage.
"""

from __future__ import annotations

from collections.abc import Callable

from drivers.virtual.firmware.cia402.base import BrakeTimes
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.schedule import Timer

_LOOK_S = 1e-3


class HoldingBrake:
    """See the module docstring."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._axis = core.axis
        self._timer: Timer | None = None
        self._bus: bool | None = None

    def times(self) -> BrakeTimes | None:
        """Return the times, None without a brake on the motor, whatever the parameters state."""
        return self._core.family.brake(self._core.od) if self._axis.spec.motor.brake else None

    def _without_current(self) -> bool:
        """Return whether its coil is never energised: no supply, or no output assigned to it."""
        motor, core = self._axis.spec.motor, self._core
        if not motor.brake or not motor.brake_supplied:
            return motor.brake
        table = core.family.terminals
        if not motor.brake_output or table is None:
            return False
        return all(table.output_use(each, core.od) != "brake" for each in table.outputs)

    @property
    def moving(self) -> bool:
        """Opening or closing, so that commands have to wait."""
        late = self._axis.spec.rough_feedback.brake_opens_s is not None
        return self._timer is not None and not late

    @property
    def released(self) -> bool:
        """Whether the brake output is on."""
        if self._bus is not None:
            return not self._bus
        return self._axis.powered and self._axis.p[k.P_BRAKE_CLOSED] == 0.0

    def follow_bus(self, applied: bool | None) -> None:
        """Apply (True) or release the brake by the bus, or leave it to the drive (None)."""
        if applied == self._bus:
            return
        self.cancel()
        self._bus = applied
        dead = self._without_current()
        self._axis.release_brake(applied is False and not dead)
        self._axis.close_brake(applied is True or dead)

    def grip(self) -> None:
        """Apply the brake after a fault, whatever the bus commands (001:940)."""
        if self._bus is not None:
            self.follow_bus(True)

    def cancel(self) -> None:
        """Cancel the sequence, as the axis gets another command."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def open(self, ready: Callable[[], None]) -> bool:
        """Hold the axis while the brake opens; return False if there is nothing to wait for."""
        if self._bus is not None:
            return False
        if self._without_current():
            # The drive has no data on the brake, and accepts commands against the closed brake.
            self._axis.close_brake(True)
            return False
        late_s = self._axis.spec.rough_feedback.brake_opens_s
        if late_s is not None and self._axis.spec.motor.brake:
            # Commands are accepted at once, against a brake that is still closed.
            self._axis.close_brake(True)
            self._timer = self._core.schedule.after(late_s, self._opened)
            return False
        times = self.times()
        if times is None:
            self._axis.close_brake(False)
            return False
        self._axis.close_brake(True)
        self._axis.hold()
        command_s = times.command_s

        def released() -> None:
            self._axis.close_brake(False)
            self._timer = self._core.schedule.after(command_s, over)

        def over() -> None:
            self._timer = None
            ready()

        self._timer = self._core.schedule.after(times.release_s, released)
        return True

    def _opened(self) -> None:
        self._timer = None
        self._axis.close_brake(False)

    def close(self, enabled_again: Callable[[], bool]) -> bool:
        """Close it and keep the power on for its time; return False without a brake."""
        times = None if self._bus is not None else self.times()
        if times is None or not self._axis.powered:
            return False
        standing = abs(self._axis.speed_rad_s) <= times.speed_rad_s
        hold_s = times.hold_s if standing else times.hold_moving_s

        def off() -> None:
            self._timer = None
            if not enabled_again():
                self._axis.power_off()

        def shut() -> None:
            self._axis.close_brake(True)
            self._timer = self._core.schedule.after(hold_s, off)

        if standing:
            self._axis.hold()
            shut()
        else:
            key = self._core.family.traits.stops.quick_ramp_key
            self._axis.stop_ramp(self._core.deceleration(key))
            self._await_slow(times.speed_rad_s, times.moving_s, shut)
        return True

    def _await_slow(self, speed_rad_s: float, left_s: float, then: Callable[[], None]) -> None:
        def look() -> None:
            if left_s <= _LOOK_S or abs(self._axis.speed_rad_s) <= speed_rad_s:
                then()
            else:
                self._await_slow(speed_rad_s, left_s - _LOOK_S, then)

        self._timer = self._core.schedule.after(_LOOK_S, look)
