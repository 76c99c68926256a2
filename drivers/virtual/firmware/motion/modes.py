"""Use of the setpoints in each mode of operation (004:3641-4530)."""

from __future__ import annotations

from typing import NamedTuple

from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.motion.homing import Homing
from drivers.virtual.firmware.objects.settings import ImpedanceSettings

PP, PV, PT, HM, CSP, CSV, CST = 1, 3, 4, 6, 8, 9, 10
IMPEDANCE = -4
_CYCLIC_LOOP = {
    CSP: k.LOOP_POSITION,
    CSV: k.LOOP_SPEED,
    CST: k.LOOP_TORQUE,
    IMPEDANCE: k.LOOP_IMPEDANCE,
}
_NEW_SET_POINT, _AT_ONCE, _RELATIVE = 1 << 4, 1 << 5, 1 << 6


class _Move(NamedTuple):
    angle_rad: float
    speed: float
    acceleration: float
    deceleration: float


class Modes:
    """Starts modes and supplies their setpoints; independent of the power states."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._axis = core.axis
        self.homing = Homing(core)
        self.mode = 0
        self.running = False
        self.acknowledged = False
        self.limited = False
        self._target_user: float | None = None
        self._move: _Move | None = None
        self._waiting: _Move | None = None
        self._steps = 20
        self._cycle_step = 0
        self._cycle_steps = 0
        self._item = core.axis.s.item
        self._following_ms = core.od.cell("6066:00", 10)
        self._position_ms = core.od.cell("6068:00", 10)
        self._speed_ms = core.od.cell("606E:00", 10)
        self._zero_ms = core.od.cell("6070:00", 10)
        self._targets = tuple(core.od.cell(key) for key in ("607A:00", "60FF:00", "6071:00"))
        self._offsets = tuple(core.od.cell(key) for key in ("60B0:00", "60B1:00", "60B2:00"))

    # --- starting and ending ---------------------------------------------------------------
    def start(self, mode: int) -> None:
        """Start a mode with the power stage on, without a bump."""
        if self.homing.active:
            self.homing.abort()
        self.homing.guard_limits()
        self.mode, self.running = mode, True
        self._move = self._waiting = None
        self._target_user = None
        self._axis.listen(k.EV_ARRIVED)
        self._axis.use_homing_gains(mode == HM)
        if mode in _CYCLIC_LOOP:
            self._axis.run_cyclic(_CYCLIC_LOOP[mode])
            self._interpolation()
            self.on_cyclic()
        elif mode in (PV, PT):
            self.refresh()
        else:
            self._axis.hold()

    def end(self) -> None:
        """End the mode, as the power stage goes off or something else takes over the axis."""
        if self.homing.active:
            self.homing.abort()
        self.running = False
        self._waiting = None

    def resume(self) -> None:
        """Continue the commanded motion after a halt (004:2633-2635)."""
        self.running = True
        if self.mode == PP:
            if self._move is not None:
                self._axis.move(*self._move)
            else:
                self._axis.hold()
        else:
            self.start(self.mode)

    # --- setpoints ------------------------------------------------------------------------
    def refresh(self) -> None:
        """Apply a changed setpoint or parameter of the running mode."""
        if not self.running:
            return
        core = self._core
        if self.mode == PV:
            limit = core.max_profile_speed()
            wanted = core.speed_of(core.number("60FF:00"))
            speed = min(max(wanted, -limit), limit)
            self._axis.run_velocity(
                speed, core.acceleration("6083:00"), core.deceleration("6084:00")
            )
        elif self.mode == PT:
            slope = max(core.torque_of(core.number("6087:00", 3000)), 1e-6)
            self._axis.run_torque(core.torque_of(core.number("6071:00")), slope)
        elif self.mode in _CYCLIC_LOOP:
            self._interpolation()

    def on_control_word(self, now: int, before: int) -> None:
        """Handle bits 4 to 6 in PP, bit 4 in HM; only called in operation enabled."""
        rising = now & ~before
        if self.mode == PP:
            if rising & _NEW_SET_POINT and self.running:
                self._new_set_point(now)
            if not now & _NEW_SET_POINT and self._waiting is None:
                self.acknowledged = False
        elif self.mode == HM and self.running:
            if now & _NEW_SET_POINT and not self.homing.active:
                if rising & _NEW_SET_POINT or not before & 8:
                    self.homing.start(int(self._core.number("6098:00")))
            elif not now & _NEW_SET_POINT and self.homing.active:
                self.homing.abort()
                self._axis.stop_ramp(self.slow_ramp())

    def _new_set_point(self, control_word: int) -> None:
        core = self._core
        raw = float(core.number("607A:00"))
        base = self._target_user
        if base is None:
            base = core.position_of(self._axis.angle_rad)
        raw = raw + base if control_word & _RELATIVE else core.modulo_target(raw, base)
        low, high = core.software_limits()
        target = min(max(raw, low), high)
        self.limited = target != raw
        speed = min(abs(core.speed_of(core.number("6081:00", 655360))), core.max_profile_speed())
        move = _Move(
            core.angle_of(target), speed, core.acceleration("6083:00"), core.deceleration("6084:00")
        )
        self._target_user = target
        self.acknowledged = True
        busy = self._move is not None and self._axis.s[k.S_ARRIVED] == 0.0
        if core.family.traits.buffered_setpoints and busy and not control_word & _AT_ONCE:
            self._waiting = move
        else:
            self._begin(move)

    def _begin(self, move: _Move) -> None:
        self._move, self._waiting = move, None
        self._axis.move(*move)

    def on_events(self, events: int, control_word: int) -> None:
        """Handle the end of trajectories and homing progress."""
        if self.mode == HM:
            self.homing.on_events(events)
        elif events & k.EV_ARRIVED and self.mode == PP and self._waiting is not None:
            self._begin(self._waiting)
            if not control_word & _NEW_SET_POINT:
                self.acknowledged = False

    # --- cyclic modes ----------------------------------------------------------------------
    def _interpolation(self) -> None:
        core = self._core
        period_s = core.number("60C2:01", 1) * 10.0 ** core.number("60C2:02", -3)
        self._steps = max(1, round(period_s / k.STEP_S))
        if self.mode == IMPEDANCE:
            limit = core.number("2080:05") or core.number("2080:06") * core.motor.torque_constant
            largest = 3.0 * core.motor.rated_torque_nm
            self._axis.apply_impedance(
                ImpedanceSettings(
                    core.number("2080:01"),
                    core.number("2080:02"),
                    core.number("2080:03"),
                    core.number("2080:04", 1000) or 1000,
                    min(limit or largest, largest),
                )
            )

    def on_cycle(self) -> None:
        """Handle the arrival of process data of one cycle.

        If the cycles come on an exact grid that is finer than 60C2h can express (it has steps of
        100 µs at best, 004:7628), the drive interpolates over the grid's period.
        """
        now = int(self._item(k.S_STEP))
        spacing, self._cycle_step = now - self._cycle_step, now
        steady, self._cycle_steps = spacing == self._cycle_steps, spacing
        self.on_cyclic(spacing if steady and 0 < spacing < self._steps else None)

    def on_cyclic(self, steps: int | None = None) -> None:
        """Interpolate to new cyclic setpoints over ``steps``, by default 60C2h."""
        if not self.running or self.mode not in _CYCLIC_LOOP:
            return
        core, units = self._core, self._core.units
        position, speed, torque = self._targets
        p_offset, v_offset, t_offset = self._offsets
        wanted = float(position.active) + float(p_offset.active)
        low, high = core.software_limits()
        target = min(max(wanted, low), high)
        self.limited = target != wanted
        angle = target / units.position_per_rad + core.zero_rad
        omega = float(v_offset.active) / units.speed_per_rad_s
        nm = float(t_offset.active) / units.torque_per_nm
        if self.mode in (CSV, IMPEDANCE):
            omega += float(speed.active) / units.speed_per_rad_s
        if self.mode == CSV:
            limit = core.max_speed()
            omega = min(max(omega, -limit), limit)
        if self.mode == CST:
            nm += float(torque.active) / units.torque_per_nm
        self._axis.set_cyclic(angle, omega, nm, steps or self._steps)

    # --- for the status word ---------------------------------------------------------------
    def slow_ramp(self) -> float:
        """Return the deceleration of the present mode's slow-down ramp (004:2463-2467)."""
        core = self._core
        if self.mode == HM and core.number("609A:00"):
            return core.units.ramp(core.number("609A:00"))
        return core.deceleration("6084:00")

    def status_bits(self, halted: bool, enabled: bool) -> int:
        """Return bits 10 to 13 of the status word."""
        item, mode = self._item, self.mode
        limited = self.limited or item(k.S_LIMIT_ACTIVE) > 0 or item(k.S_LIMIT_HELD) > 0
        bits = 1 << 11 if limited else 0
        if enabled and self.reached(halted):
            bits |= 1 << 10
        if mode == PP:
            bits |= self.acknowledged << 12 | (enabled and self._follows_badly()) << 13
        elif mode == PV:
            bits |= (item(k.S_ZERO_T) >= self._zero_ms.active * 1e-3) << 12
        elif mode == HM:
            bits |= self.homing.attained << 12 | self.homing.failed << 13
        elif mode in _CYCLIC_LOOP and enabled:
            bits |= self.running << 12 | (mode == CSP and self._follows_badly()) << 13
        return bits

    def reached(self, halted: bool) -> bool:
        """Return bit 10 of the status word with power on: target reached, or standstill."""
        item, mode = self._item, self.mode
        if halted:
            return item(k.S_ZERO_T) > 0
        if mode == PP:
            return item(k.S_POSITION_T) >= self._position_ms.active * 1e-3
        if mode == PV:
            return item(k.S_SPEED_T) >= self._speed_ms.active * 1e-3
        if mode == PT:
            return item(k.S_ARRIVED) > 0
        return mode == HM and not self.homing.active

    def _follows_badly(self) -> bool:
        return self._item(k.S_FOLLOWING_T) > self._following_ms.active * 1e-3
