"""Faults of the cable: lost, delayed and damaged frames, wrong working counters.

Faults inside a slave (slow, mute, refusing) are part of the module concerned.
"""

from __future__ import annotations

import random
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Fate:
    """Effects of the faults on one frame."""

    lost_outbound: bool = False
    lost_inbound: bool = False
    corrupt_at: tuple[int, int] | None = None
    """Slave and port where it arrives damaged."""
    delay_ns: int = 0
    """The reply is delayed."""
    hold_ns: int = 0
    """The frame reaches the slaves late, and so its reply is late as well."""
    counter_offset: int = 0


NO_TROUBLE = Fate()


@dataclass(slots=True)
class _Rule:
    """Applies to the next ``count`` frames (None: no limit), each with probability ``chance``."""

    count: int | None
    chance: float
    cyclic_only: bool
    fate: Fate


class Trouble:
    """Active rules; several may apply to the same frame."""

    def __init__(self, source: random.Random) -> None:
        self._random = source
        self._rules: list[_Rule] = []
        self.counted = {"lost": 0, "late": 0, "corrupt": 0, "counter": 0}

    def clear(self) -> None:
        """Remove all rules."""
        self._rules.clear()

    def add(
        self, fate: Fate, count: int | None = None, chance: float = 1.0, cyclic_only: bool = False
    ) -> None:
        """Add a rule."""
        if not 0.0 < chance <= 1.0:
            raise ValueError(f"chance {chance} must lie above 0 and not above 1")
        if count is not None and count < 1:
            raise ValueError(f"count {count} must be at least 1")
        self._rules.append(_Rule(count, chance, cyclic_only, fate))

    def frame_fate(self, cyclic: bool) -> Fate:
        """Return the effects on the present frame; counts the rules down."""
        if not self._rules:
            return NO_TROUBLE
        outbound = inbound = False
        corrupt: tuple[int, int] | None = None
        delay = hold = offset = 0
        for rule in list(self._rules):
            if (rule.cyclic_only and not cyclic) or self._random.random() >= rule.chance:
                continue
            if rule.count is not None:
                rule.count -= 1
                if not rule.count:
                    self._rules.remove(rule)
            outbound |= rule.fate.lost_outbound
            inbound |= rule.fate.lost_inbound
            corrupt = rule.fate.corrupt_at or corrupt
            delay = max(delay, rule.fate.delay_ns)
            hold = max(hold, rule.fate.hold_ns)
            offset += rule.fate.counter_offset
        self.counted["lost"] += outbound or inbound
        self.counted["corrupt"] += corrupt is not None
        self.counted["late"] += delay > 0 or hold > 0
        self.counted["counter"] += offset != 0
        return Fate(outbound, inbound, corrupt, delay, hold, offset)
