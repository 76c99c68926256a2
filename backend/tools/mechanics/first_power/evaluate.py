"""Checklist of the first power from what was observed. Pure: also from stored data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import groupby
from typing import Literal

import numpy as np
import numpy.typing as npt

from backend.tools.mechanics.first_power.result import (
    Check,
    FirstPowerResult,
    Guide,
    Phases,
    Pulse,
    Status,
    Verdict,
    Way,
)
from backend.tools.mechanics.first_power.settings import FirstPowerSettings
from backend.tools.thresholds import first_power_evaluate as threshold
from backend.tools.tool import Arrays, Meta

FloatArray = npt.NDArray[np.float64]
GOAL = threshold.GOAL
STILL_REV = threshold.STILL_REV
_WAYS: tuple[Literal[1, -1], ...] = (1, -1)


@dataclass(frozen=True)
class Seen:
    """What was read and observed by hand; None where it was not checked or is not reported.

    ``turned_rev`` is by the drive's counts. ``switches``: negative and positive, each whether it
    was seen both on and off. ``obstacle``: why the motor was not energised.
    """

    measured_at: str
    supply_v: float | None = None
    faults: int = 0
    counts_per_rev: float | None = None
    certain: bool = True
    turned_rev: float | None = None
    switches: tuple[bool, bool] | None = None
    switch_inputs: bool = True
    obstacle: Phases | None = None
    guide: Guide | None = None


def facts_of(seen: Seen) -> dict[str, object]:
    """The observations for storage, with the arrays."""
    return asdict(seen)


def arrays_of(pulses: Sequence[Pulse]) -> dict[str, npt.NDArray[np.generic]]:
    """The pulses as arrays for storage, [n] each."""
    return {
        "direction": np.array([each.direction for each in pulses], np.int64),
        "pulse_percent": np.array([each.torque_percent for each in pulses], np.float64),
        "from_rev": np.array([each.from_rev for each in pulses], np.float64),
        "to_rev": np.array([each.to_rev for each in pulses], np.float64),
    }


def reevaluate(arrays: Arrays, meta: Meta) -> FirstPowerResult:
    """Evaluate stored raw data again.

    Raises:
        ValueError: not the raw data of a first power.
    """
    given, facts = meta.get("settings"), meta.get("seen")
    if not isinstance(given, dict) or not isinstance(facts, dict) or "pulse_percent" not in arrays:
        raise ValueError("not the raw data of a first power")
    pulses = [
        Pulse(
            direction=1 if way > 0 else -1,
            torque_percent=float(percent),
            from_rev=float(begin),
            to_rev=float(end),
        )
        for way, percent, begin, end in zip(
            arrays["direction"],
            arrays["pulse_percent"],
            arrays["from_rev"],
            arrays["to_rev"],
            strict=True,
        )
    ]
    switches = facts.get("switches")
    pair = None if switches is None else (bool(switches[0]), bool(switches[1]))
    seen = Seen(**(facts | {"switches": pair}))
    return evaluate(seen, pulses, FirstPowerSettings.model_validate(given))


def evaluate(seen: Seen, pulses: Sequence[Pulse], settings: FirstPowerSettings) -> FirstPowerResult:
    """Evaluate the observations: the checklist and its verdict."""
    backwards = None if seen.turned_rev is None else seen.turned_rev < 0
    covers = covered_pole_pairs(settings.travel_limit)
    phases = seen.obstacle or ("not_done" if not pulses else None)
    if phases is None:
        phases = _phases(_way_of(pulses, settings), backwards, settings.pole_pairs, covers)
    moved = any(abs(each.to_rev - each.from_rev) > STILL_REV for each in pulses)
    checks = (
        _supply(seen),
        _resolution(seen),
        *_turned(seen, settings),
        _switches(seen, settings),
        _check("brake", "ok" if moved else "not_seen" if pulses else "not_done"),
        _check("phases", phases),
    )
    places = [abs(place) for each in pulses for place in (each.from_rev, each.to_rev)]
    return FirstPowerResult(
        verdict=_verdict(checks),
        measured_at=seen.measured_at,
        checks=checks,
        pulses=tuple(pulses),
        travel_rev=max(places, default=0.0),
        torque_percent=max((each.torque_percent for each in pulses), default=0.0),
        covers_pole_pairs=covers if pulses else None,
        guide=seen.guide,
    )


def covered_pole_pairs(travel_rev: float) -> int:
    """Smallest number of pole pairs p for which two exchanged phases are certain to be detected.

    With exchanged phases the torque is -cos(2pθ): it keeps its sign over at most a quarter of 1/p
    of a revolution.
    """
    return math.ceil(1.0 / (4.0 * GOAL * travel_rev))


def fits_again(pulse: Pulse, travel_rev: float) -> bool:
    """Whether another motion as by this pulse, from where it ended, stays within the travel."""
    moved = pulse.to_rev - pulse.from_rev
    return abs(moved) <= STILL_REV or abs(pulse.to_rev + moved) <= max(
        travel_rev, abs(pulse.from_rev)
    )


def way_of(pulses: Sequence[Pulse], goal_rev: float, cap_percent: float) -> Way:
    """Motion of the shaft for one sign of the torque; ``cap_percent`` is the highest pulse."""
    if not pulses:
        return "short"
    went = pulses[0].direction * (pulses[-1].to_rev - pulses[0].from_rev)
    if abs(went) >= 0.9 * goal_rev:
        return "with" if went > 0 else "against"
    last = pulses[-1]
    if last.torque_percent < 0.95 * cap_percent or not fits_again(last, goal_rev / GOAL):
        return "short"
    moved = any(abs(each.to_rev - each.from_rev) > threshold.SOME * goal_rev for each in pulses)
    return "locked" if moved else "none"


def ended_for_room(pulses: Sequence[Pulse], settings: FirstPowerSettings) -> bool:
    """Whether the first direction ended before its goal because the travel had no more room."""
    run = _newest_run(pulses, _WAYS[0])
    if not run or fits_again(run[-1], settings.travel_limit):
        return False
    return abs(run[-1].to_rev - run[0].from_rev) < 0.9 * GOAL * settings.travel_limit


def _newest_run(pulses: Sequence[Pulse], way: Literal[1, -1]) -> list[Pulse]:
    """Pulses of a direction that followed one another, of the last time that it was made."""
    runs = [list(run) for sign, run in groupby(pulses, lambda each: each.direction) if sign == way]
    return runs[-1] if runs else []


def _way_of(pulses: Sequence[Pulse], settings: FirstPowerSettings) -> tuple[Way, Way]:
    goal, cap = GOAL * settings.travel_limit, strongest(settings)
    first, second = (way_of(_newest_run(pulses, way), goal, cap) for way in _WAYS)
    return first, second


def strongest(settings: FirstPowerSettings) -> float:
    """Highest torque of a pulse [%]; the rest is reserved for overshoot of the actual torque."""
    return 0.9 * settings.torque_limit


def _phases(
    ways: tuple[Way, Way], backwards: bool | None, pole_pairs: int | None, covers: int
) -> Phases:
    both = set(ways)
    if both == {"with"}:
        return "not_excluded" if pole_pairs is not None and pole_pairs < covers else "right"
    if both == {"against"}:
        if backwards is None:
            return "reversed"
        return "feedback_inverted" if backwards else "phases_reversed"
    if both == {"with", "against"}:
        return "pulled"
    if "short" in both:
        return "short"
    if both & {"with", "against"}:
        return "blocked"
    return "locks" if "locked" in both else "no_motion"


def _check(name: str, finding: str, value: float | None = None) -> Check:
    status: Status = "failed"
    if finding in ("ok", "right"):
        status = "passed"
    elif finding in _OPEN:
        status = "open"
    return Check.model_validate(
        {"name": name, "status": status, "finding": finding, "value": value}
    )


_OPEN = frozenset(
    {
        "not_done", "not_reported", "not_turned", "not_seen", "no_input", "no_torque_mode", "short",
        "not_excluded", "counts_first", "supply_first", "resolution_first", "only_positive",
        "only_negative", "no_motion",
    }
)  # fmt: skip


def supply_sound(seen: Seen) -> bool:
    """Whether nothing about the supply forbids energising the motor."""
    return not seen.faults and (seen.supply_v is None or seen.supply_v >= threshold.LEAST_V)


def _supply(seen: Seen) -> Check:
    if seen.faults:
        return _check("supply", "fault", float(seen.faults))
    if seen.supply_v is None:
        return _check("supply", "not_reported")
    return _check("supply", "ok" if supply_sound(seen) else "low", seen.supply_v)


def _resolution(seen: Seen) -> Check:
    return _check("resolution", "ok" if seen.certain else "uncertain", seen.counts_per_rev)


def counts_sound(seen: Seen, revolutions: int) -> bool | None:
    """Whether the drive counted the revolutions turned by hand; None where nobody turned."""
    if seen.turned_rev is None:
        return None
    return abs(abs(seen.turned_rev) - revolutions) <= threshold.HAND


def _turned(seen: Seen, settings: FirstPowerSettings) -> tuple[Check, Check]:
    sound = counts_sound(seen, settings.hand_revolutions)
    if sound is None:
        finding = "not_turned" if settings.hand_turn else "not_done"
        return _check("counts", finding), _check("direction", finding)
    turned = seen.turned_rev or 0.0
    direction = "backwards" if turned < 0 else "ok"
    return _check("counts", "ok" if sound else "wrong", turned), _check("direction", direction)


def _switches(seen: Seen, settings: FirstPowerSettings) -> Check:
    if not seen.switch_inputs:
        return _check("switches", "no_input")
    if seen.switches is None or not settings.hand_switches:
        return _check("switches", "not_done")
    negative, positive = seen.switches
    names = {(True, True): "ok", (True, False): "only_negative", (False, True): "only_positive"}
    return _check("switches", names.get((negative, positive), "none_seen"))


def _verdict(checks: Sequence[Check]) -> Verdict:
    found = {each.status for each in checks}
    if "failed" in found:
        return "failed"
    return "incomplete" if "open" in found else "passed"
