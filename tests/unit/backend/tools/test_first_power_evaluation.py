"""The checklist of the first power by pulses as they would come from a formula."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Literal

import pytest

from backend.tools.mechanics.first_power.evaluate import (
    Seen,
    arrays_of,
    covered_pole_pairs,
    ended_for_room,
    evaluate,
    facts_of,
    fits_again,
    reevaluate,
)
from backend.tools.mechanics.first_power.result import FirstPowerResult, Pulse
from backend.tools.mechanics.first_power.settings import FirstPowerSettings
from backend.tools.mechanics.first_power.texts import TEXTS, notes

ASKED = FirstPowerSettings(nothing_hangs=True)
SEEN = Seen("2026-01-01T00:00:00+00:00", supply_v=48.0, counts_per_rev=8388608.0)
_STEP, _FRICTION = 0.004, 2.5
_WAYS: tuple[Literal[1, -1], ...] = (1, -1)


def pulses(share: Callable[[float], float], start: float = 0.0) -> list[Pulse]:
    """Each moves by its torque beyond a friction of 2.5 %; ``share`` of the torque by place."""
    found: list[Pulse] = []
    place = start
    for way in _WAYS:
        percent, begin, still = 1.0, place, 0
        while abs(place - begin) < 0.085 and still < 2:
            made = way * percent * share(place)
            beyond = max(abs(made) - _FRICTION, 0.0)
            to = place + math.copysign(min(_STEP * beyond, 0.008), made)
            found.append(Pulse(direction=way, torque_percent=percent, from_rev=place, to_rev=to))
            still = still + 1 if to == place and percent >= 9.0 else 0
            place, percent = to, min(percent * 1.2, 9.0)
            if abs(place - begin) >= 0.085:
                break
    return found


def finding(result: FirstPowerResult, name: str) -> str:
    return next(each.finding for each in result.checks if each.name == name)


def made(
    found: Sequence[Pulse], asked: FirstPowerSettings = ASKED, turned_rev: float | None = None
) -> FirstPowerResult:
    seen = Seen(SEEN.measured_at, 48.0, counts_per_rev=8388608.0, turned_rev=turned_rev)
    return evaluate(seen, found, asked)


def test_right_and_reversed() -> None:
    assert finding(made(pulses(lambda _: 1.0)), "phases") == "right"
    against = pulses(lambda _: -1.0)
    assert finding(made(against), "phases") == "reversed"
    assert finding(made(against, turned_rev=1.0), "phases") == "phases_reversed"
    assert finding(made(against, turned_rev=-1.0), "phases") == "feedback_inverted"


@pytest.mark.parametrize("pairs", [3, 4, 5, 8])
@pytest.mark.parametrize("phase", [0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
def test_exchanged_phases_never_pass(pairs: int, phase: float) -> None:
    found = pulses(lambda rev: -math.cos(2 * pairs * 2 * math.pi * rev + phase))
    result = made(found)
    # Between two places without torque there is a quarter of 1/p: 0.083 rev with three pairs.
    assert finding(result, "phases") in ("locks", "no_motion")
    assert result.verdict != "passed"


def test_few_pole_pairs_are_not_called_right() -> None:
    assert covered_pole_pairs(0.1) == 3
    few = ASKED.model_copy(update={"pole_pairs": 2})
    result = made(pulses(lambda _: 1.0), few)
    assert finding(result, "phases") == "not_excluded"
    assert result.verdict != "passed"


def test_a_pulling_load_a_blocked_side_and_a_closed_brake() -> None:
    assert finding(made(pulses(lambda _: 0.0)), "phases") == "no_motion"
    forwards = [each for each in pulses(lambda _: 1.0) if each.direction > 0]
    same = [each.model_copy(update={"direction": -1}) for each in forwards]
    assert finding(made([*forwards, *same]), "phases") == "pulled"
    stuck = [each for each in pulses(lambda _: 0.0) if each.direction < 0]
    assert finding(made([*forwards, *stuck]), "phases") == "blocked"
    assert finding(made(forwards), "phases") == "short"


def pulse(way: Literal[1, -1], begin: float, end: float, percent: float = 9.0) -> Pulse:
    return Pulse(direction=way, torque_percent=percent, from_rev=begin, to_rev=end)


def test_a_pulse_that_coasts_far_is_repeated_only_where_it_has_room() -> None:
    assert fits_again(pulse(1, 0.0, 0.04), 0.1)
    assert not fits_again(pulse(1, 0.0, 0.06), 0.1)
    assert not fits_again(pulse(1, -0.02, -0.07), 0.1)
    assert fits_again(pulse(-1, 0.15, 0.1), 0.1), "back towards the start"
    assert fits_again(pulse(1, 0.1, 0.1), 0.1), "it did not move"


def test_a_way_that_ended_for_room_is_open_until_it_was_made_again() -> None:
    first = [pulse(1, 0.0, 0.0, 6.7), pulse(1, 0.0, 0.055)]
    back = [pulse(-1, 0.055, 0.0), pulse(-1, 0.0, -0.055)]
    assert ended_for_room(first, ASKED)
    assert ended_for_room([*first, *back], ASKED)
    assert finding(made([*first, *back]), "phases") == "short", "neither locked nor right"
    again = [pulse(1, -0.055, 0.0), pulse(1, 0.0, 0.055)]
    assert not ended_for_room([*first, *back, *again], ASKED)
    assert finding(made([*first, *back, *again]), "phases") == "right"


@pytest.mark.parametrize(
    ("turned", "expected"),
    [(1.04, "ok"), (-0.97, "ok"), (0.5, "wrong"), (2.0, "wrong"), (4.0, "wrong"), (0.9, "wrong")],
)
def test_counts_against_a_marked_turn(turned: float, expected: str) -> None:
    assert finding(made(pulses(lambda _: 1.0), turned_rev=turned), "counts") == expected


@pytest.mark.parametrize(
    ("switches", "expected"),
    [
        ((True, True), "ok"),
        ((True, False), "only_negative"),
        ((False, True), "only_positive"),
        ((False, False), "none_seen"),
        (None, "not_done"),
    ],
)
def test_limit_switches(switches: tuple[bool, bool] | None, expected: str) -> None:
    asked = ASKED.model_copy(update={"hand_switches": True})
    seen = Seen(SEEN.measured_at, switches=switches)
    assert finding(evaluate(seen, [], asked), "switches") == expected


def test_the_whole_checklist_passes_only_when_all_of_it_was_made() -> None:
    asked = ASKED.model_copy(update={"hand_switches": True, "hand_turn": True})
    seen = Seen(
        SEEN.measured_at, 48.0, counts_per_rev=8388608.0, turned_rev=1.01, switches=(True, True)
    )
    found = pulses(lambda _: 1.0)
    assert evaluate(seen, found, asked).verdict == "passed"
    assert evaluate(seen, [], asked).verdict == "incomplete"
    low = Seen(SEEN.measured_at, 3.0, obstacle="supply_first")
    result = evaluate(low, [], asked)
    assert (finding(result, "supply"), result.verdict) == ("low", "failed")


def test_kept_data_give_the_same_result_and_every_finding_has_words() -> None:
    found = pulses(lambda rev: -math.cos(50 * rev))
    asked = ASKED.model_copy(update={"hand_switches": True})
    seen = Seen(SEEN.measured_at, 48.0, switches=(True, False), guide="identification")
    result = evaluate(seen, found, asked)
    meta = {"settings": asked.model_dump(mode="json"), "seen": facts_of(seen)}
    assert reevaluate(arrays_of(found), meta) == result
    for note in notes(result):
        for words in TEXTS[note.name]:
            assert "{" not in words.format(**note.values)
    with pytest.raises(ValueError, match="first power"):
        reevaluate({}, {})
