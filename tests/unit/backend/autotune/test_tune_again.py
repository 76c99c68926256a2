"""A loop that answers otherwise than predicted: what is compared, and what stays in force."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.loop_goals import Goals, goals_for
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.mechanics.mechanical_model import MechanicalModel
from backend.axes.axis.axis import Envelope
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.excite import Room, band_for, loop_reference
from backend.tools.tuning.autotune import again as tune_again
from backend.tools.tuning.autotune import apply as tune_apply
from backend.tools.tuning.autotune.again import Again, Designing, Figures, contradictions
from backend.tools.tuning.autotune.apply import Applied
from backend.tools.tuning.autotune.present import Present, Trials
from backend.tools.tuning.autotune.time_budget import TimeLeft
from backend.tools.tuning.autotune.verification.verify import MOST_PAIRS, Check
from tests.unit.backend.autotune.test_tune_hum import GOALS, design
from tests.unit.backend.autotune.test_tune_verify import loop_swept

FIRST, SECOND = Figures(137.0, 52.0, 11.0), Figures(118.0, 61.0, 11.5)
#: Raw values: of the axis as it was, and of the design.
WAS, NEW = {"2005:03": 700}, {"2005:03": 900}
PLANT = MeasuredPlant(
    np.geomspace(1.0, 6000.0, 50), np.ones(50, dtype=np.complex128), MechanicalModel(1e4, 1.0), 400
)


def test_what_is_off_by_more_than_the_aims_is_named() -> None:
    (width, phase) = contradictions(FIRST, SECOND)
    assert width.words() == "-3 dB point at 118 Hz where 137 Hz was predicted"
    assert phase.words() == "phase margin of 61° where 52° was predicted"
    assert not contradictions(FIRST, Figures(128.0, 57.0, 13.5))
    # What the lines do not show contradicts nothing.
    assert not contradictions(FIRST, Figures(None, None, None))
    (gain,) = contradictions(FIRST, Figures(137.0, 52.0, 7.5))
    assert gain.words() == "gain margin of 7.5 dB where 11.0 dB was predicted"


def test_words_say_what_was_predicted_first_and_what_was_verified_then() -> None:
    verified: Any = SimpleNamespace(predicted_bandwidth_hz=119.0, measured_bandwidth_hz=117.0)
    text = Again(FIRST, SECOND, "same", gain_ratio=1.0).reported(verified).words()
    assert "118 Hz where 137 Hz was predicted" in text
    assert "other realisations: bandwidth 117 Hz measured, 119 Hz predicted from the loop" in text
    text = Again(FIRST, SECOND, "other", gain_ratio=0.87).reported(verified).words()
    assert "with 87% of the speed gain" in text
    for outcome in ("time", "unclear", "none", "not kept"):
        text = Again(FIRST, SECOND, outcome).reported(verified).words()
        assert "118 Hz where 137 Hz was predicted" in text
        assert "realisations" not in text


async def outcome(
    monkeypatch: pytest.MonkeyPatch, *, gain: float, keeps: bool, time_left: TimeLeft,
    read: Figures = SECOND, held: dict[str, int] | None = None, ended_at: str = "",
) -> tuple[Applied | None, Again | None, dict[str, int], list[int]]:  # fmt: skip
    """What stays, what is reported, what the drive holds then, and which pairs were passed over."""
    held = dict(NEW) if held is None else held
    pairs = list[int]()
    first = design(10.0)
    swept = loop_swept(1.0)
    verified: Any = SimpleNamespace(
        seen=swept.frf, every=None, sweep=swept, measured_bandwidth_hz=read.bandwidth_hz
    )

    async def first_kept(_a: Any, _s: Any, check: Any, rows: list[Candidate], *_: Any) -> Any:
        assert held == WAS, "written from what the axis had"
        pairs.append(check.pairs_before)
        if not keeps:
            return None
        held.update(NEW)
        return Applied(rows[0], verified, dict(WAS))

    async def take_back(_axis: Any, before: dict[str, int]) -> None:
        held.update(before)

    async def write_settings(_axis: Any, values: dict[str, int]) -> dict[str, int]:
        before = dict(held)
        held.update(values)
        return before

    for replaced in (first_kept, take_back, write_settings):
        monkeypatch.setattr(tune_again, replaced.__name__, replaced)
    monkeypatch.setattr(tune_again, "expected", lambda *_: FIRST)
    monkeypatch.setattr(tune_again, "_measured", lambda _: read)
    monkeypatch.setattr(tune_apply, "take_back", take_back)

    def designed(*_: Any) -> Candidate:
        if ended_at == "design":
            raise asyncio.CancelledError
        return design(gain)

    monkeypatch.setattr(tune_again, "_designed", designed)
    monkeypatch.setattr(tune_again, "fixed_of", lambda *given: np.ones(given[-1].size, complex))

    async def raw(key: str) -> int:
        if ended_at == "reading":
            raise asyncio.CancelledError
        return held[key]

    axis: Any = SimpleNamespace(drive=SimpleNamespace(name="X", raw=raw))
    nothing: Any = None
    trials = Trials(
        axis, nothing, check_like(), GOALS, Progress(lambda: None), None, had=Present(None),
        time_left=time_left,
    )  # fmt: skip
    how = Designing(PLANT, "medium", "balanced", False, 2000.0)
    applied, reported = await tune_again.again(trials, Applied(first, verified, dict(WAS)), how)
    return applied, reported, held, pairs


def check_like() -> Check:
    facts = AxisFacts(1.27, True, 3000.0, 1000.0, None, None, None, False)
    return Check(Envelope(4.0, 1500.0, 100.0, 60.0), facts, 1e-4, None, None, None)


def soon(seconds: float) -> TimeLeft:
    left = TimeLeft.of(seconds)
    left.longest_s = 9.0
    return left


async def test_a_prediction_that_stands_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    applied, reported, held, pairs = await outcome(
        monkeypatch, gain=10.0, keeps=True, time_left=TimeLeft(), read=FIRST
    )
    assert applied is not None
    assert reported is None
    assert held == NEW
    assert pairs == []


@pytest.mark.parametrize(("gain", "name"), [(10.0, "same"), (8.0, "other")])
async def test_the_second_verification_takes_other_realisations(
    monkeypatch: pytest.MonkeyPatch, gain: float, name: str
) -> None:
    applied, reported, held, pairs = await outcome(
        monkeypatch, gain=gain, keeps=True, time_left=TimeLeft()
    )
    assert applied is not None
    assert applied.candidate.gains.speed_nms == gain
    assert applied.before == WAS
    assert reported is not None
    assert reported.outcome == name
    assert reported.gain_ratio == pytest.approx(gain / 10.0)
    assert (reported.predicted, reported.measured) == (FIRST, SECOND)
    assert reported.closed_db is not None
    assert held == NEW
    assert pairs == [MOST_PAIRS]


async def test_another_design_that_fails_makes_way_for_the_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    applied, reported, held, _pairs = await outcome(
        monkeypatch, gain=8.0, keeps=False, time_left=TimeLeft()
    )
    assert applied is not None
    assert applied.candidate.gains.speed_nms == 10.0
    assert applied.before == WAS
    assert reported is not None
    assert reported.outcome == "not kept"
    assert held == NEW


async def test_the_same_design_that_fails_the_second_time_does_not_stay(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Kept once and failed once is not kept: the luckier of two measurements is no proof."""
    applied, _reported, held, _pairs = await outcome(
        monkeypatch, gain=10.0, keeps=False, time_left=TimeLeft()
    )
    assert applied is None
    assert held == WAS


@pytest.mark.parametrize("where", ["design", "reading"])
async def test_ended_between_two_verifications_nothing_stays(
    monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    held = dict(NEW)
    with pytest.raises(asyncio.CancelledError):
        await outcome(
            monkeypatch, gain=10.0, keeps=True, time_left=TimeLeft(), held=held, ended_at=where
        )
    assert held == WAS


@pytest.mark.parametrize(("seconds", "looks"), [(17.0, 0), (19.0, 1)])
async def test_it_is_seen_again_where_time_allows_a_more_careful_design_as_well(
    monkeypatch: pytest.MonkeyPatch, seconds: float, looks: int
) -> None:
    applied, reported, held, pairs = await outcome(
        monkeypatch, gain=10.0, keeps=True, time_left=soon(seconds)
    )
    assert applied is not None
    assert reported is not None
    assert reported.outcome == ("same" if looks else "time")
    assert len(pairs) == looks
    assert held == NEW


@pytest.mark.parametrize("sound", [True, False])
def test_a_design_that_does_not_hold_within_its_loop_is_made_anew_with_no_more_gain(
    monkeypatch: pytest.MonkeyPatch, sound: bool
) -> None:
    first = replace(design(10.0), marks=("robust",), phase_cost_deg=7.0)
    rows = (replace(design(9.0), marks=("balanced",)), replace(design(8.0), marks=("robust",)))
    goals, limits = list[Goals](), list[float | None]()

    def judged(*given: Any) -> tuple[Candidate, bool]:
        goals.append(given[-1])
        return design(10.0), sound

    def candidates_for(*_: Any, highest_hz: float, filters: bool, notches: bool) -> Any:
        limits.append(highest_hz)
        assert (filters, notches) == (True, True)
        return rows

    monkeypatch.setattr(tune_again, "judged", judged)
    monkeypatch.setattr(tune_again, "candidates_for", candidates_for)
    trials: Any = SimpleNamespace(
        axis=SimpleNamespace(drive=None), check=check_like(), guaranteed=GOALS
    )
    how = Designing(PLANT, "medium", "balanced", False, 2000.0)
    made = tune_again._designed(trials, first, how, PLANT)
    assert made is not None
    # Its own mark counts, which is more careful than the one that was asked for.
    assert goals == [goals_for("medium", "robust").with_reserve()]
    if sound:
        assert (made.gains.speed_nms, made.marks, made.phase_cost_deg) == (10.0, ("robust",), 7.0)
        assert limits == []
    else:
        assert made is rows[1]
        assert limits == [first.gains.speed_bandwidth_hz]


def test_other_realisations_have_other_phases() -> None:
    band = band_for(2000.0, 5.0, None)
    room = Room(1.0, 100.0, 20.0)

    def periods(first: int) -> list[Any]:
        played = loop_reference(
            2000.0, band, room, 0.0, amplitude=2.0, realisations=2, position=False, first=first
        )
        return [each.excitation for each in played]

    assert [e.realisation for e in periods(0)] == [0, 0, 1, 1]
    assert [e.realisation for e in periods(4)] == [4, 4, 5, 5]
    one, other = (np.fft.rfft(periods(first)[0].one_period) for first in (0, 4))
    lines = periods(0)[0].lines
    turned = np.abs(np.angle(one[lines] / other[lines]))
    # Nothing but the sizes is common: phases are spread over the circle.
    assert np.median(turned) > 1.0
    sizes = np.abs(one[lines] / other[lines])
    assert np.allclose(sizes, sizes[0], rtol=0.05)
