"""Holding torque, windup and slip of traces that are written down by formula."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
import pytest

from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.mechanics.brake.evaluate import Phase, Trial, Trials, evaluate, reevaluate
from backend.tools.mechanics.brake.result import BrakeResult
from backend.tools.mechanics.brake.run import _Catch, _placed, sequence
from backend.tools.mechanics.brake.settings import BrakeSettings
from backend.tools.mechanics.brake.texts import TEXTS, report
from drivers.link import ScopeBlock

RATE, RATED_NM, TEST = 1000.0, 2.0, 100.0
#: One revolution of windup at this many %: 0.005 rev at the test torque.
STIFF = 20_000.0
FACTS = AxisFacts(RATED_NM, True, None, None, None, None, None, True)
ASKED = BrakeSettings(nothing_hangs=True)


def trial(
    direction: Literal[1, -1],
    slips_at: float | None = None,
    creep_rev: float = 0.0,
    speed_rev_s: float = 1.0,
    noise_rev: float = 0.0,
) -> Trial:
    """An elastic hub; beyond ``slips_at`` % it turns until 0.02 rev, and the torque is gone 3 ms
    after that. ``creep_rev`` is gained at the top of the ramp and stays."""
    sent, phase = sequence(TEST, 1.0, 0.3, RATE)
    torque = sent.copy()
    turned = torque / STIFF
    halted = False
    if slips_at is not None:
        first = int(np.argmax(torque > slips_at))
        slid = np.clip((np.arange(torque.size) - first) / RATE * speed_rev_s, 0.0, None)
        turned = turned + slid
        out = int(np.argmax(turned >= 0.02))
        halted = True
        end = out + 60
        sent, torque, turned, phase = sent[:end], torque[:end], turned[:end], phase[:end]
        sent[out + 1 :], torque[out + 3 :] = 0.0, 0.0
        turned[out + 3 :] = turned[out + 2]
    turned = turned + creep_rev * (np.arange(torque.size) >= int(np.argmax(phase == Phase.TOP)))
    turned = turned + noise_rev * np.random.default_rng(5).normal(size=turned.size)
    nm = RATED_NM / 100.0 * direction
    return Trial(
        direction,
        2 * np.pi * direction * turned + 7.0,
        nm * torque,
        nm * sent,
        phase,
        np.ones(torque.size, np.bool_),
        halted,
    )


def trials(*parts: Trial) -> Trials:
    return Trials(parts, RATE, 0.001 * RATED_NM, TEST, "output", "2026-11-23T03:00:00+00:00")


def found_of(*parts: Trial, asked: BrakeSettings = ASKED) -> BrakeResult:
    return evaluate(trials(*parts), asked, FACTS)


@pytest.mark.parametrize("noise_rev", [0.0, 1e-5])
def test_elastic_windup_is_no_slip(noise_rev: float) -> None:
    found = found_of(trial(1, noise_rev=noise_rev), trial(-1, noise_rev=noise_rev))
    assert found.verdict == "held"
    for way in found.ways:
        assert way.torque_percent == pytest.approx(TEST, rel=0.01)
        assert way.windup_rev == pytest.approx(0.9 * TEST / STIFF, rel=0.02)
        assert way.slip_rev == pytest.approx(0.0, abs=3e-5)
        assert way.abort_ms is None


@pytest.mark.parametrize("slips_at", [15.0, 40.0, 75.0, 98.0])
def test_the_torque_where_it_slips(slips_at: float) -> None:
    found = found_of(trial(1, slips_at), trial(-1))
    assert found.verdict == "slipped"
    assert [way.verdict for way in found.ways] == ["slipped", "held"]
    assert found.torque_percent == pytest.approx(slips_at, rel=0.05)
    first = found.ways[0]
    low, high = first.torque_ci95_percent
    assert low < slips_at < high
    assert first.abort_ms == pytest.approx(3.0, abs=1.1)
    assert first.slip_rev > 0.01


def test_a_creep_below_the_limit_is_reported_beside_the_verdict() -> None:
    found = found_of(trial(1, creep_rev=0.005), trial(-1))
    assert found.verdict == "held"
    assert found.ways[0].slip_rev == pytest.approx(0.005, rel=0.02)
    names = [note.name for note in report(found).notes]
    assert names == ["verdict.held", "crept", "by.output", "measured_at"]


def test_a_creep_beyond_a_smaller_limit_is_slip() -> None:
    asked = ASKED.model_copy(update={"slip_limit_rev": 0.004})
    assert found_of(trial(1, creep_rev=0.005), trial(-1), asked=asked).verdict == "slipped"


def test_an_axis_that_turns_under_the_preload_has_no_closed_brake() -> None:
    open_brake = trial(1, 5.0)
    assert int(open_brake.phase[np.flatnonzero(open_brake.sent_nm)[-1]]) < Phase.RAMP
    found = found_of(open_brake)
    assert found.verdict == "not_closed"
    # It turns from 5 % on and is 0.02 rev away after 20 ms of a rise by 10 % in 150 ms.
    assert found.ways[0].torque_ci95_percent[1] == pytest.approx(5.0 + 20 * 10 / 150, abs=0.2)
    words = report(found).notes[0]
    assert (words.name, words.values["value"]) == ("verdict.not_closed", "6.43")


def test_windup_alone_that_reaches_the_limit_is_no_slip() -> None:
    """A limit of 0.003 rev is reached elastically, at 60 %: nothing is known of the brake then."""
    soft = trial(1)
    out = int(np.argmax(soft.position_rad - 7.0 >= 2 * np.pi * 0.003))
    soft.sent_nm[out + 1 :], soft.torque_nm[out + 2 :] = 0.0, 0.0
    soft.position_rad[out + 2 :] = 7.0
    halted = Trial(
        1, soft.position_rad, soft.torque_nm, soft.sent_nm, soft.phase, soft.valid, halted=True
    )
    asked = ASKED.model_copy(update={"slip_limit_rev": 0.003})
    found = found_of(halted, asked=asked)
    assert (found.verdict, found.obstacle) == ("cannot_be_tested", "windup_beyond_limit")


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9])
def test_a_brake_is_not_held_with_less_than_the_test_torque(share: float) -> None:
    """A limit of the drive: of a brake that carries so much, nothing is known beyond that."""
    weak = trial(1)
    limit = share * float(np.max(weak.torque_nm))
    weak.torque_nm[:] = np.minimum(weak.torque_nm, limit)
    found = found_of(weak, trial(-1))
    assert (found.verdict, found.obstacle) == ("cannot_be_tested", None)
    assert [way.verdict for way in found.ways] == ["cannot_be_tested", "held"]
    assert found.torque_percent == pytest.approx(100.0 * share, abs=0.5)
    names = [note.name for note in report(found).notes]
    assert names == ["verdict.cannot_be_tested", "torque_short", "by.output", "measured_at"]


def without(part: Trial, *phases: Phase, keeps: int = 0) -> Trial:
    """The same with the samples of these phases lost, but for the first ``keeps`` of each."""
    for phase in phases:
        lost = np.flatnonzero(part.phase == phase)[keeps:]
        part.valid[lost] = False
        for column in (part.position_rad, part.torque_nm, part.sent_nm):
            column[lost] = 0.0
    return part


@pytest.mark.parametrize("keeps", [0, 5])
@pytest.mark.parametrize(
    "lost", [Phase.LEAD, Phase.PRELOADED, Phase.RAMP, Phase.TOP, Phase.UNLOADED]
)
def test_nothing_is_said_of_a_brake_whose_samples_were_lost(lost: Phase, keeps: int) -> None:
    if keeps and lost is not Phase.RAMP:
        return
    asked = ASKED.model_copy(update={"brake_rated_nm": 3.0})
    found = found_of(without(trial(1), lost, keeps=keeps), trial(-1), asked=asked)
    assert (found.verdict, found.obstacle) == ("cannot_be_tested", "samples_lost")
    assert (found.torque_percent, found.of_brake_percent) == (None, None)
    assert [way.verdict for way in found.ways] == ["held"]
    names = [note.name for note in report(found).notes]
    assert names == [
        "verdict.cannot_be_tested",
        "obstacle.samples_lost",
        "by.output",
        "measured_at",
    ]
    assert set(names) <= TEXTS.keys()


@pytest.mark.parametrize("slips_at", [40.0, 75.0])
def test_a_way_to_the_limit_whose_ramp_was_lost_is_no_open_brake(slips_at: float) -> None:
    found = found_of(without(trial(1, slips_at), Phase.RAMP, keeps=5))
    assert (found.verdict, found.obstacle, found.ways) == ("cannot_be_tested", "samples_lost", ())
    # The other direction slipped: that counts, whatever was lost before.
    found = found_of(without(trial(1), Phase.RAMP), trial(-1, slips_at))
    assert (found.verdict, found.obstacle) == ("slipped", None)
    assert found.torque_percent == pytest.approx(slips_at, rel=0.05)


def test_single_lost_samples_change_no_verdict() -> None:
    parts = trial(1, 75.0), trial(-1)
    for part in parts:
        part.valid[::7] = False
        part.torque_nm[::7] = part.position_rad[::7] = 0.0
    found = found_of(*parts)
    assert [way.verdict for way in found.ways] == ["slipped", "held"]
    assert found.ways[0].torque_percent == pytest.approx(75.0, rel=0.05)


@pytest.mark.parametrize("lost", [0, 1, 200, 1000])
def test_samples_keep_their_phase_where_the_first_of_the_ramp_were_lost(lost: int) -> None:
    """A ramp of 1 s from 10 % on, in steps of 0.1 %, of which the first samples did not arrive."""
    percent, phases = sequence(TEST, 1.0, 0.3, RATE)
    begins = int(np.argmax(phases == Phase.RAMP))
    raw, phases = np.round(10.0 * percent[begins:]).astype(np.int64), phases[begins:]
    before = 30
    sent = np.concatenate([np.full(before, raw[0]), raw]).astype(np.float64)
    rows = np.column_stack([np.arange(sent.size), sent, sent]).astype(np.float64)
    valid = np.ones(sent.size, np.bool_)
    valid[before : before + lost] = False
    rows[~valid] = np.nan
    names = ("position", "torque", "target")
    catch = _Catch(names, [ScopeBlock(0, 0.0, 1 / RATE, names, rows, valid=valid, cycle=4000)])
    units: Any = SimpleNamespace(torque=lambda _raw: 0.1, position=lambda _raw: 1e-4)
    found = _placed(catch, raw, phases, units, FACTS, 1, False)
    assert found.phase.tolist() == phases.tolist()
    assert not found.valid[:lost].any()
    assert found.valid[lost:].all()


def test_of_the_brakes_rating_and_again_from_a_file() -> None:
    data = trials(trial(1, 75.0), trial(-1))
    asked = ASKED.model_copy(update={"brake_rated_nm": 3.0})
    found = evaluate(data, asked, FACTS)
    assert found.of_brake_percent == pytest.approx(100 * 0.75 * RATED_NM / 3.0, rel=0.02)
    facts = {name: getattr(FACTS, name) for name in FACTS.__dataclass_fields__}
    meta: dict[str, Any] = {"settings": asked.model_dump(mode="json"), "facts": facts}
    assert reevaluate(data.arrays(), meta | data.facts()) == found
    with pytest.raises(ValueError, match="brake test"):
        reevaluate({}, meta)


def test_every_note_row_and_chart_has_words() -> None:
    for found in (found_of(trial(1, 40.0), trial(-1)), found_of(trial(1), trial(-1))):
        section = report(found)
        names = {note.name for note in section.notes} | {row.name for row in section.rows}
        for chart in section.charts:
            names |= {chart.name, chart.x_name, chart.y_name, *(line.name for line in chart.lines)}
        assert names <= TEXTS.keys()
