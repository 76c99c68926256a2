"""Homing as scripts: each yields what it waits for and is resumed when that has happened.

Methods 1–14, 17–30, 33, 34, 35 and 37 (CiA 402-2 clause "homing", 004:3837-3893), and the family's
own methods against the mechanical limit.

Directions are given by ``d``: +1 for the method as printed towards positive positions, −1 for its
mirror image.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass

from drivers.virtual.firmware.cia402.keys import TorqueHoming
from drivers.virtual.firmware.core import Core
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.schedule import Timer

_FAR = 1e9


@dataclass(frozen=True, slots=True)
class Until:
    """Wait for an event; ``signals`` are the switches whose change counts."""

    event: int
    signals: int = 0


class HomingFailed(Exception):
    """The search failed: it reached a limit switch, or the drive lacks the method."""


Script = Generator[Until, None, float]
"""Yields waits, returns the home angle [rad]."""
_Step = Generator[Until, None, None]


class Homing:
    """Runs one method at a time. ``attained`` and ``failed`` set bits of the status word."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._axis = core.axis
        self._script: Generator[Until, None, None] | None = None
        self._waiting = Until(0)
        self.attained = False
        self.was_attained = False
        self.failed = False
        self.on_failed: Callable[[bool], None] = lambda _timed_out: None
        self._deadline: Timer | None = None

    @property
    def active(self) -> bool:
        """True while searching."""
        return self._script is not None

    def start(self, method: int) -> None:
        """Start a method; an unknown or impossible one fails at once."""
        self.attained = self.failed = False
        core = self._core
        timeout_key, unit_s = core.family.traits.homing_timeout
        timeout_s = core.number(timeout_key) * unit_s
        if timeout_s:
            self._deadline = core.schedule.after(timeout_s, self._give_up)
        self._axis.p[k.P_LIMIT_STOPS] = 0.0
        self._script = self._run(method)
        self._resume()

    def abort(self) -> None:
        """End the search; the caller takes over the axis."""
        if self._script is not None:
            self._script.close()
        self._finish()

    def on_events(self, events: int) -> None:
        """Resume when the awaited event has occurred."""
        if self._script is None:
            if events & k.EV_STOPPED:
                self.guard_limits()
            return
        if events & self._waiting.event:
            self._resume()

    def _give_up(self) -> None:
        self._deadline = None
        if self._script is not None:
            self._script.close()
            self._fail(timed_out=True)

    def _resume(self) -> None:
        script = self._script
        if script is None:
            return
        try:
            self._waiting = next(script)
        except StopIteration:
            self.attained = self.was_attained = self._core.homed = True
            self._finish()
        except HomingFailed:
            self._fail()
        else:
            self._axis.listen(self._waiting.event)
            self._axis.watch_signals(self._waiting.signals)

    def guard_limits(self) -> None:
        """Restore the normal action of limit switches outside a search."""
        self._axis.p[k.P_LIMIT_STOPS] = self._core.limit_mode()

    def _fail(self, *, timed_out: bool = False) -> None:
        self.failed = True
        self._finish()
        # The axis may be at a limit switch: that is a homing error, not a fault.
        self._axis.p[k.P_LIMIT_STOPS] = 0.0
        self._axis.stop_ramp(self._acceleration())
        self.on_failed(timed_out)

    def _finish(self) -> None:
        self._script = None
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None
        self._axis.listen(k.EV_ARRIVED)
        self._axis.watch_signals(0)
        self._axis.watch_stall(0.0, math.inf, 0.0)
        self.guard_limits()
        self._core.torque_cap_nm = math.inf
        self._core.apply_motion()

    # --- building blocks -------------------------------------------------------------------
    def _acceleration(self) -> float:
        raw = self._core.number("609A:00")
        # Zero is a printed default and would not move the axis: the profile ramp is used instead.
        return self._core.units.ramp(raw or self._core.number("6083:00", 3276800))

    def _speed(self, key: str, fallback: int) -> float:
        speed = self._core.speed_at(key) or self._core.speed_of(fallback)
        return min(abs(speed), self._core.max_speed())

    def _signals(self) -> int:
        return int(self._axis.s[k.S_SIGNALS])

    def _drive(self, direction: int, *, slow: bool) -> None:
        speed = self._speed("6099:02", 65536) if slow else self._speed("6099:01", 655360)
        ramp = self._acceleration()
        self._axis.move(math.copysign(_FAR, direction), speed, ramp, ramp)

    def _travel(self, direction: int, signal: int, level: bool, *, slow: bool) -> Script:
        """Move until a switch has this level; return the angle there. A limit switch ends it."""
        blocking = (k.SIG_POSITIVE if direction > 0 else k.SIG_NEGATIVE) & ~signal
        self._drive(direction, slow=slow)
        while bool(self._signals() & signal) != level:
            if self._signals() & blocking:
                raise HomingFailed
            yield Until(k.EV_SIGNAL, signal | blocking)
        return self._axis.angle_rad

    def _search(self, direction: int, signal: int) -> Generator[Until, None, bool]:
        """Search fast for a switch; return False if the limit switch came first."""
        limit = k.SIG_POSITIVE if direction > 0 else k.SIG_NEGATIVE
        self._drive(direction, slow=False)
        while not self._signals() & signal:
            if self._signals() & limit:
                return False
            yield Until(k.EV_SIGNAL, signal | limit)
        return True

    def _index(self, direction: int) -> Script:
        """Search slowly for the next index pulse; return its angle."""
        self._drive(direction, slow=True)
        limit = k.SIG_POSITIVE if direction > 0 else k.SIG_NEGATIVE
        before = float(self._axis.s[k.S_INDEX_COUNT])
        while float(self._axis.s[k.S_INDEX_COUNT]) == before:
            if self._signals() & limit:
                raise HomingFailed
            yield Until(k.EV_INDEX | k.EV_SIGNAL, limit)
        return float(self._axis.s[k.S_INDEX_ANGLE])

    def _index_either_way(self, direction: int) -> Script:
        """Search the index for methods 33 and 34.

        Some families accept an index at the present position (000:2677), reverse at the limit
        switch, pass the index and approach it again in the method's own direction (000:2679).
        """
        turn = float(self._axis.p[k.P_INDEX_RAD])
        nearest = round(self._axis.angle_rad / turn) * turn
        away = abs(self._axis.angle_rad - nearest) * float(self._axis.p[k.P_COUNTS_PER_RAD])
        if self._core.family.traits.index_at_once and away <= 2:
            return nearest
        try:
            return (yield from self._index(direction))
        except HomingFailed:
            if not self._core.family.traits.index_search_reverses:
                raise
        yield from self._index(-direction)
        yield from self._stop()
        return (yield from self._index(direction))

    def _stop(self) -> _Step:
        self._axis.stop_ramp(self._acceleration())
        yield Until(k.EV_STOPPED)

    # --- methods ---------------------------------------------------------------------------
    def _run(self, method: int) -> Generator[Until, None, None]:
        by_torque = self._core.family.traits.torque_homing
        torque_methods = {} if by_torque is None else by_torque.methods
        stays = method in (35, 37) or (method in torque_methods and not torque_methods[method][1])
        if method in (35, 37):
            home = self._axis.angle_rad
        elif by_torque is not None and method in torque_methods:
            direction, back_to_index = torque_methods[method]
            home = yield from self._by_torque(by_torque, direction)
            if back_to_index:
                self._core.torque_cap_nm = math.inf
                self._core.apply_motion()
                home = yield from self._index(-direction)
        elif method in (33, 34):
            home = yield from self._index_either_way(-1 if method == 33 else 1)
        elif 1 <= method <= 14:
            direction = yield from self._edge(method, by_edge=False)
            home = yield from self._index(direction)
        elif 17 <= method <= 30:
            yield from self._edge(method - 16, by_edge=True)
            home = self._axis.angle_rad
        else:
            raise HomingFailed
        if not stays:
            yield from self._stop()
            ramp = self._acceleration()
            self._axis.move(home, self._speed("6099:02", 65536), ramp, ramp)
            yield Until(k.EV_ARRIVED)
        if self._offset_way().startswith("travel"):
            yield from self._travel_offset(home)
            return
        self._take(home)
        if stays:
            self._axis.hold()

    def _take(self, home: float) -> None:
        """Set the zero position the home offset beyond the home position (004:7231-7236).

        Some families use the offset as the position at home instead (001:687-691, 002:4344).
        """
        core = self._core
        offset = core.number("607C:00") / core.units.position_per_rad
        way = self._offset_way()
        if way == "shift":
            core.zero_rad -= offset
        elif way == "zero_beyond":
            core.zero_rad = home + offset
        else:
            core.zero_rad = home - offset

    def _offset_way(self) -> str:
        """Return P12.11 of the M6-L (000:2213-2222).

        0: zero at home, 1: shift the position, 2 and 3: travel the offset.
        """
        traits = self._core.family.traits
        if traits.home_offset != "by_parameter":
            return traits.home_offset
        chosen = int(self._core.number(traits.home_offset_key or ""))
        return {0: "at_home", 1: "shift", 2: "travel_to_zero", 3: "travel"}.get(chosen, "at_home")

    def _travel_offset(self, home: float) -> Generator[Until, None, None]:
        """Travel the offset beyond home; the position there is 0, or the offset."""
        core = self._core
        offset = core.number("607C:00") / core.units.position_per_rad
        ramp = self._acceleration()
        self._axis.move(home + offset, self._speed("6099:02", 65536), ramp, ramp)
        yield Until(k.EV_ARRIVED)
        core.zero_rad = home + offset if self._offset_way() == "travel_to_zero" else home

    def _by_torque(self, keys: TorqueHoming, direction: int) -> Script:
        core = self._core
        torque = core.torque_of(core.number(keys.torque_key, 500))
        core.torque_cap_nm = torque
        core.apply_motion()
        self._axis.watch_stall(
            0.95 * torque,
            core.number(keys.time_key, 500) * 1e-3,
            float(self._axis.p[k.P_STOP_SPEED]),
        )
        # In the speed loop: a position demand would run away from the stalled axis.
        speed, ramp = self._speed("6099:01", 655360), self._acceleration()
        self._axis.run_velocity(math.copysign(speed, direction), ramp, ramp)
        yield Until(k.EV_STALL)
        return self._axis.angle_rad

    def _edge(self, method: int, *, by_edge: bool) -> Generator[Until, None, int]:
        """Find the switch edge of methods 1 to 14; return the direction to the index pulse."""
        if method in (1, 2):
            d = 1 if method == 2 else -1
            limit = k.SIG_POSITIVE if d > 0 else k.SIG_NEGATIVE
            yield from self._travel(d, limit, True, slow=False)
            yield from self._travel(-d, limit, False, slow=True)
            return -d
        if method in (3, 4, 5, 6):
            d = 1 if method in (3, 4) else -1
            inside = method in (4, 6)
            return (yield from self._home_side(d, inside=inside, by_edge=by_edge))
        d = 1 if method <= 10 else -1
        return (yield from self._cam(d, (method - 7) % 4))

    def _home_side(self, d: int, *, inside: bool, by_edge: bool) -> Generator[Until, None, int]:
        """Methods 3 to 6: a home switch that is active beyond its edge in direction ``d``.

        ``by_edge`` (19 to 22): the edge itself is home and is passed at the low speed.
        """
        home = k.SIG_HOME
        active = bool(self._signals() & home)
        if inside:
            if not active:
                found = yield from self._search(d, home)
                if not found:
                    # Started beyond a cam: back across it, and to its edge again (000:2285).
                    if not self._core.family.traits.home_side_reverses:
                        raise HomingFailed
                    yield from self._travel(-d, home, True, slow=False)
                    active = True
            if active or by_edge:
                yield from self._travel(-d, home, False, slow=False)
                yield from self._travel(d, home, True, slow=True)
            return d
        if not active:
            yield from self._travel(d, home, True, slow=False)
        yield from self._travel(-d, home, False, slow=True)
        return -d

    def _cam(self, d: int, which: int) -> Generator[Until, None, int]:
        """Methods 7 to 14: a home cam and a limit switch in direction ``d``.

        ``which``: 0 before the near edge, 1 after it, 2 before the far edge, 3 after it.
        """
        home = k.SIG_HOME
        near = which in (0, 1)
        if not self._signals() & home:
            found = yield from self._search(d, home)
            if not found:
                yield from self._travel(-d, home, True, slow=False)
        # Inside the cam now: leave it across the wanted edge.
        outwards = -d if near else d
        final = which in (0, 3)
        yield from self._travel(outwards, home, False, slow=final)
        if final:
            return outwards
        yield from self._travel(-outwards, home, True, slow=True)
        return -outwards
