"""Detects an axis that turns without permission, from the readings that the monitor polls."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from backend.axes.scales.units import AxisUnits
from drivers.cia402 import State
from drivers.texts.message import Text, text

#: Lower speeds [rpm] are noise, or tremor of a shaft that is held.
TURNS_RPM = 8.0
#: Time for which the axis must turn before it is reported, s.
_FOR_S = 0.35
#: Time after the last permitted motion during which turning is not reported: a ramp may end, s.
_GRACE_S = 0.5
#: Readings older than this, s, do not represent the present speed.
_OLDEST_S = 2.5
_POWERED = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)


class TurnKind(StrEnum):
    """Whether the axis turns without power (disabled), or with power but without a grant."""

    DISABLED = "disabled"
    WITHOUT_GRANT = "without_grant"


@dataclass(frozen=True, slots=True)
class Turning:
    """An axis that turns without permission. ``speed`` in ``unit``, magnitude."""

    kind: TurnKind
    speed: float
    unit: str


class TurnWatch:
    """Detects unpermitted turning of one axis over successive polls."""

    def __init__(self, may_turn: Callable[[], bool]) -> None:
        self._may_turn = may_turn
        self._seen: deque[tuple[float, int]] = deque(maxlen=20)
        self._since_s: float | None = None
        self._reason_s = -_GRACE_S

    def take(
        self, units: AxisUnits, state: State, position: int | None, velocity: int | None
    ) -> Turning | None:
        """Evaluate one more reading; None at standstill, or where the axis may turn."""
        now = time.monotonic()
        by_position = self._by_position(units, now, position)
        by_velocity = None if velocity is None else abs(units.velocity(velocity))
        certain = units.counts_per_rev is not None
        both = [v for v in (by_position, by_velocity if certain else None) if v is not None]
        speed = max(both, default=0.0)
        if self._may_turn():
            self._reason_s, self._since_s = now, None
            return None
        if speed < TURNS_RPM or not certain:
            self._since_s = None
            return None
        if self._since_s is None:
            self._since_s = now
        # A shaft that moved between two samples far apart counts as turning for the whole interval.
        turned_s = now - self._since_s
        if by_position is not None and by_position >= TURNS_RPM and len(self._seen) > 1:
            turned_s = max(turned_s, now - self._seen[-2][0])
        if turned_s < _FOR_S or now - self._reason_s < _GRACE_S:
            return None
        kind = TurnKind.WITHOUT_GRANT if state in _POWERED else TurnKind.DISABLED
        return Turning(kind, speed, units.names["velocity"])

    def _by_position(self, units: AxisUnits, now: float, position: int | None) -> float | None:
        if position is None:
            return None
        earlier = self._newest_before(now)
        self._seen.append((now, position))
        if earlier is None:
            return None
        moved = (position - earlier[1] + 2**31) % 2**32 - 2**31
        return abs(units.position(moved)) / (now - earlier[0]) * 60.0

    def _newest_before(self, now: float) -> tuple[float, int] | None:
        return next(
            (seen for seen in reversed(self._seen) if 0.08 <= now - seen[0] <= _OLDEST_S), None
        )


def turning_message(name: str, turning: Turning) -> Text:
    """Return the message for the log."""
    powered = turning.kind is not TurnKind.DISABLED
    return text(
        "stopping.turns-with-power" if powered else "stopping.turns-without-power",
        drive=name,
        speed=f"{turning.speed:.4g}",
        unit=turning.unit,
    )
