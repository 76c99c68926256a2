"""Magnetic pole identification of a motor whose encoder does not report its rotor's angle.

M6-L (000:1163-1181, P01.20, P24.00 to P24.10): a direct drive motor with an incremental or sin/cos
encoder and without a Hall sensor needs it once after every power-on. In the manual mode (P24.01 =
0) enabling without it raises Er.059; P24.01 = 2 identifies at the first enabling. Pre-positioning
pulls the rotor to the nearest pole by a constant current; micro-motion moves it by P24.09. Either
fails with Er.058 if the rotor does not follow; so does the reserved method 0.

The durations of the parts are not printed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass

from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.schedule import Timer

_CREEP_RAD_S = 0.5
_RAMP_RAD_S2 = 20.0
_SETTLE_S = 0.2
_FAILED, _MISSING = "Er.058", "Er.059"
_DIRECT_DRIVE, _WITHOUT_ANGLE = (1, 2), (0, 3, 4)
PRE_POSITIONING, MICRO_MOTION = 1, 2
WHEN_ENABLED = 2


@dataclass(frozen=True, slots=True)
class PoleKeys:
    """Parameters: motor and encoder type, Hall sensor, method, mode and its details."""

    motor: str = "2001:1D"
    encoder: str = "2001:13"
    hall: str = "2001:22"
    method: str = "2018:01"
    mode: str = "2018:02"
    withdraw: str = "2018:04"
    nudge: str = "2018:0A"
    pole_pitch: str = "2001:1E"


class PoleIdentification:
    """Knowledge of the rotor's angle since power-on, and its identification."""

    def __init__(self, core: Core, report: Callable[[str], None], free: Callable[[], bool]) -> None:
        self._core = core
        self._axis = core.axis
        self._keys = PoleKeys()
        self._applies = core.family.traits.identifies_poles
        self._report = report
        self._free = free
        self._script: Generator[float, None, bool] | None = None
        self._timer: Timer | None = None
        self._then: Callable[[], None] | None = None
        self.known = False

    @property
    def active(self) -> bool:
        """True while identifying."""
        return self._script is not None

    @property
    def needed(self) -> bool:
        """Whether the axis cannot be enabled without identification."""
        keys, number = self._keys, self._core.number
        return (
            self._applies
            and not self.known
            and int(number(keys.motor)) in _DIRECT_DRIVE
            and int(number(keys.hall)) == 0
            and int(number(keys.encoder, 1)) in _WITHOUT_ANGLE
        )

    @property
    def refusal(self) -> str | None:
        """Fault with which enabling is refused, None if it is permitted."""
        by_itself = int(self._core.number(self._keys.mode)) == WHEN_ENABLED
        return _MISSING if self.needed and not by_itself else None

    def start(self, then: Callable[[], None] | None = None) -> bool:
        """Start; call ``then`` when the angle is known. Return False if the axis is busy."""
        if self.active or (then is None and not self._free()):
            return False
        self._then = then
        self._script = self._run()
        self._resume()
        return True

    def cancel(self) -> None:
        """Cancel, as the axis gets another command."""
        if self._script is not None:
            self._script.close()
            self._script = None
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _resume(self) -> None:
        if self._script is None:
            return
        try:
            wait_s = next(self._script)
        except StopIteration as ended:
            self._script = self._timer = None
            self._conclude(bool(ended.value))
        else:
            self._timer = self._core.schedule.after(wait_s, self._resume)

    def _conclude(self, found: bool) -> None:
        then, self._then = self._then, None
        self.known = found
        if then is None or not found:
            self._axis.power_off()
        if not found:
            self._report(_FAILED)
        elif then is not None:
            then()

    def _run(self) -> Generator[float, None, bool]:
        method = int(self._core.number(self._keys.method))
        start = self._axis.angle_rad
        if method == PRE_POSITIONING:
            pole = 2 * math.pi / self._axis.motor.pole_pairs
            found = yield from self._go(round(start / pole) * pole)
            if found and int(self._core.number(self._keys.withdraw)):
                yield from self._go(start)
            return found
        if method == MICRO_MOTION:
            nudge = self._nudge_rad()
            there = yield from self._go(start + nudge)
            back = yield from self._go(start)
            return there and back
        return False

    def _go(self, target_rad: float) -> Generator[float, None, bool]:
        """Pull the rotor to an angle; return whether it followed."""
        self._axis.move(target_rad, _CREEP_RAD_S, _RAMP_RAD_S2, _RAMP_RAD_S2)
        way = abs(target_rad - self._axis.angle_rad)
        yield way / _CREEP_RAD_S + _SETTLE_S
        return abs(self._axis.angle_rad - target_rad) < 0.1 * way + 1e-3

    def _nudge_rad(self) -> float:
        """Return P24.09 in mm of a linear motor, in turns of its pole pitch P01.29."""
        keys, by_key = self._keys, self._core.profile.by_key
        nudge, pitch = (
            float(by_key[key].to_value(self._core.number(key)))
            for key in (keys.nudge, keys.pole_pitch)
        )
        return 2 * math.pi * nudge / max(pitch, 1e-3)
