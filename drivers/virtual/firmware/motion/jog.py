"""Motions that a drive makes by itself, without the bus: jog by inputs or a parameter, and homing.

M6-L: inputs with functions 17 and 18 at the speed of P06.05 (000:1191-1193); the ramps P06.07 and
P06.08 are assumed up to 1000 rpm, which is not printed. R6L: inputs with functions 39 and 40 at
P04.04, with the servo off, and P04.05 and P04.06 as the times to and from 1000 rpm (002:9774-9807).
Both inputs at once, or neither, mean standstill. Enabling the axis over the bus ends the jog; an
input that is still on when the axis is free again restarts it.

R6L: P12.10 "JOG running" (002:11909) is printed without values: 1 forward, 2 backward and 0 for the
end are assumed. M6-L: P12.00 = 4 or 5 homes at once (000:3618) at the speed P12.05 with the time
P12.08, until the home or limit switch is reached, P12.09 is over, or 0 is written; odd methods of
P12.01 go backward. Only the search for the first switch is simulated. It is not printed whether
both move the axis without enabling over the bus, as the inputs do; this is assumed as the worst
case.
"""

from __future__ import annotations

from collections.abc import Callable

from drivers.virtual.firmware.cia402.base import RPM
from drivers.virtual.firmware.cia402.keys import OwnHomingKeys
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.motion.brake import HoldingBrake
from drivers.virtual.firmware.schedule import Timer

_REFERENCE_RPM = 1000.0
_LOOK_S = 2e-3


class TerminalJog:
    """Moves the axis while one of its two inputs is on; ``free``: the bus does not command it."""

    def __init__(self, core: Core, brake: HoldingBrake, free: Callable[[], bool]) -> None:
        self._core = core
        self._axis = core.axis
        self._brake = brake
        self._free = free
        self._wanted = 0
        self._stopping = False
        self._inputs = self._ordered = 0
        self._homing: OwnHomingKeys | None = None
        self._timer: Timer | None = None

    @property
    def active(self) -> bool:
        """Moving, or still stopping."""
        return self._wanted != 0 or self._stopping

    def update(self, *, forward: bool, backward: bool) -> None:
        """Apply the levels of the two inputs, whenever they may have changed."""
        self._inputs = int(forward) - int(backward)
        self._decide()

    def order(self, direction: int) -> None:
        """Handle a write of the jog parameter: 1 forward, -1 backward, 0 ends it."""
        self._ordered = direction
        self._decide()

    def home(self, keys: OwnHomingKeys, *, begin: bool) -> None:
        """Handle a write of the homing parameter."""
        self._end_homing()
        if begin and self._free() and not self._wanted:
            self._homing = keys
            method = int(self._core.number(keys.method))
            self._ordered = -1 if method % 2 else 1
            self._look(self._value(keys.limit_ms) * 1e-3)
        elif not begin:
            self._ordered = 0
        self._decide()

    def _look(self, left_s: float) -> None:
        """End the search at a switch, or when its time is over."""
        self._timer = None
        pressed = int(self._axis.s[k.S_SIGNALS]) & (k.SIG_HOME | self._limit_ahead())
        if left_s <= 0.0 or pressed:
            self._ordered = 0
            self._decide()
            return
        self._timer = self._core.schedule.after(_LOOK_S, lambda: self._look(left_s - _LOOK_S))

    def _limit_ahead(self) -> int:
        return k.SIG_POSITIVE if self._ordered > 0 else k.SIG_NEGATIVE

    def _end_homing(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _decide(self) -> None:
        wanted = self._inputs or self._ordered
        if wanted == self._wanted or self._core.family.traits.jog is None:
            return
        if wanted and not self._free():
            return
        before, self._wanted = self._wanted, wanted
        if not wanted:
            self._stop()
        elif before or self._stopping or not self._brake.open(self._turn):
            self._turn()

    def cancel(self) -> None:
        """Cancel, as the axis gets another command."""
        self._end_homing()
        self._homing = None
        self._wanted, self._stopping, self._ordered = 0, False, 0

    def stopped(self) -> None:
        """Handle the standstill of the axis."""
        if not self._stopping:
            return
        self._stopping = False
        self._homing = None
        if not self._brake.close(lambda: self.active or not self._free()):
            self._axis.power_off()

    def _turn(self) -> None:
        if not self._wanted:
            return
        self._stopping = False
        speed, rise, fall = self._settings()
        self._axis.run_velocity(self._wanted * speed, rise, fall)

    def _stop(self) -> None:
        self._brake.cancel()
        self._stopping = True
        self._axis.stop_ramp(self._settings()[2])

    def _settings(self) -> tuple[float, float, float]:
        """Return speed [rad/s] and both ramps [rad/s²]."""
        keys, homing = self._core.family.traits.jog, self._homing
        if keys is None:
            return (0.0, 1.0, 1.0)
        names = (keys.speed, keys.rise, keys.fall)
        if homing is not None:
            names = (homing.speed, homing.ramp, homing.ramp)
        speed, rise_ms, fall_ms = (self._value(key) for key in names)
        reference = _REFERENCE_RPM * RPM * 1e3
        return (speed * RPM, reference / max(rise_ms, 1.0), reference / max(fall_ms, 1.0))

    def _value(self, key: str) -> float:
        return float(self._core.profile.by_key[key].to_value(self._core.number(key)))
