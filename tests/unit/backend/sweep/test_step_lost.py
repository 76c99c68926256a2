"""Figures of a step whose samples were lost on the bus: what depends on them is not known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from backend.axes.axis.axis import Envelope
from backend.tools.measuring.recording import Recording, bridged
from backend.tools.moving.step.evaluate import LEAD_S, StepResult, StepSettings, answer_of, evaluate
from backend.tools.moving.step.texts import TEXTS, report
from backend.tools.tuning.autotune.verification.verify import restless
from backend.tools.watching.health import run as health
from backend.tools.watching.health.settings import HealthSettings

RATE = 1000.0
SETTINGS = StepSettings(Envelope(4.0, 1500.0, 100.0, 60.0))
HZ, DAMPING = 40.0, 0.3


def stepped(*lost_s: tuple[float, float]) -> StepResult:
    """A speed of second order after 100 rpm, without the samples of these times after the step."""
    lead, hold = round(LEAD_S * RATE), round(SETTINGS.hold_s * RATE)
    t = (np.arange(lead + 2 * hold) - lead) / RATE
    w, wd = 2 * np.pi * HZ, 2 * np.pi * HZ * np.sqrt(1 - DAMPING**2)

    def unit(at: np.ndarray) -> np.ndarray:
        at = np.maximum(at, 0.0)
        swing = np.cos(wd * at) + DAMPING * w / wd * np.sin(wd * at)
        return np.asarray(1.0 - np.exp(-DAMPING * w * at) * swing)

    speed = 100.0 * (unit(t) - unit(t - SETTINGS.hold_s)) * 2 * np.pi / 60.0
    valid = np.ones(t.size, np.bool_)
    for first, end in lost_s:
        valid &= ~((t >= first - 1e-9) & (t < end - 1e-9))
    table = bridged(np.where(valid, speed, 0.0)[:, None], valid)
    nothing = np.zeros(t.size)
    recording = Recording(
        RATE, np.cumsum(speed) / RATE, table[:, 0], nothing, nothing, nothing, valid
    )
    return evaluate(recording, np.where(t >= 0.0, 100.0, 0.0), SETTINGS, 1.0)


def test_all_samples_received_say_everything() -> None:
    found = answer_of(stepped())
    assert found.step is not None
    assert found.step.overshoot_percent == pytest.approx(37.2, abs=1.0)
    assert (found.lost_percent, found.unknown) == (0.0, ())
    assert [note.name for note in report(found).notes] == ["settled"]


def test_a_peak_that_was_lost_is_no_small_overshoot() -> None:
    """The peak is at 13 ms; interpolated, the step had 20 % less."""
    result = stepped((0.009, 0.018))
    found = answer_of(result)
    assert found.step is not None
    assert (found.step.overshoot_percent, found.step.peak_time_s) == (None, None)
    # It rose before and settled afterwards, as was received.
    assert found.step.rise_s == pytest.approx(answer_of(stepped()).step.rise_s)  # type: ignore[union-attr]
    assert found.step.settling_s == answer_of(stepped()).step.settling_s  # type: ignore[union-attr]
    assert found.unknown == ("overshoot_percent", "peak_time_s")
    assert found.lost_percent == pytest.approx(100 * 9 / 550)
    notes = {note.name: note for note in report(found).notes}
    assert list(notes) == ["settled", "samples_lost"]
    assert notes["samples_lost"].values["value"] == "1.6"
    why = restless(result)
    assert why is not None
    assert why.code == "autotune.few-lines-lost"


def test_a_rise_that_was_lost_has_no_time() -> None:
    for gap in ((0.002, 0.005), (0.004, 0.005)):
        found = answer_of(stepped(gap))
        assert found.step is not None
        assert found.step.rise_s is None
        # A gap of 3 ms hides neither peak nor settling.
        assert found.unknown == ("rise_s",)


def test_an_end_that_was_lost_may_not_have_settled() -> None:
    found = answer_of(stepped((0.03, 0.25)))
    assert found.step is not None
    assert found.step.settling_s is None
    section = report(found)
    assert [note.name for note in section.notes] == ["settling_unknown", "samples_lost"]
    assert {note.name for note in section.notes} <= TEXTS.keys()


def test_single_lost_samples_are_stated_and_hide_nothing() -> None:
    found, whole = answer_of(stepped((0.1, 0.101), (0.2, 0.203))), answer_of(stepped())
    assert found.step == whole.step
    assert found.unknown == ()
    assert found.lost_percent == pytest.approx(100 * 4 / 550)
    assert [note.name for note in report(found).notes] == ["settled", "samples_lost"]


def test_one_that_did_not_settle_stays_so_whatever_was_lost_before() -> None:
    settings = StepSettings(SETTINGS.envelope, window=0.01)
    result = stepped((0.02, 0.03))
    recording = Recording(
        RATE, result.actual, result.actual + 1.0, result.actual, result.demand, result.demand,
        result.valid,  # type: ignore[arg-type]
    )  # fmt: skip
    found = answer_of(evaluate(recording, result.demand, settings, 1.0))
    assert report(found).notes[0].name == "not_settled"


@pytest.mark.parametrize("gap", [None, (0.35, 0.40), (0.45, 0.48)])
def test_a_move_whose_end_was_lost_has_no_settling_time(gap: tuple[float, float] | None) -> None:
    """It is commanded from 0.05 s to 0.25 s, and follows with 20 ms; settled at about 0.33 s."""
    time = np.arange(500) / RATE
    demand = np.clip((time - 0.05) / 0.2, 0.0, 1.0)
    late = np.zeros(time.size)
    for i in range(1, time.size):
        late[i] = late[i - 1] + (demand[i] - late[i - 1]) / 20.0
    valid = np.ones(time.size, np.bool_)
    if gap is not None:
        # Everything around the settling is lost, or something long after it.
        first = 0.26 if gap[0] < 0.4 else gap[0]
        valid = (time < first) | (time >= gap[1])
    turned = bridged(np.where(valid, late, 0.0)[:, None], valid)[:, 0] * 2 * np.pi
    nothing = np.zeros(time.size)
    recording = Recording(RATE, turned, nothing, nothing, nothing, nothing, valid)
    settings = StepSettings(SETTINGS.envelope, kind="move", size=1.0)
    found = answer_of(evaluate(recording, demand, settings, 1.0))
    assert found.move is not None
    assert found.move.following_peak == pytest.approx(0.1, abs=0.01)
    assert (found.move.settling_s is None) is (gap is not None)
    assert found.unknown == (() if gap is None else ("overshoot", "settling_s"))


async def test_a_health_check_has_no_figure_of_lost_samples(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def step_response(*_: Any) -> StepResult:
        return stepped((0.002, 0.018))

    monkeypatch.setattr(health, "step_response", step_response)
    settings = HealthSettings(travel_limit=1.0, speed_limit=600.0, torque_limit=60.0)
    run: Any = type("R", (), {"axis": None, "session": None, "keep": None})()
    found = await health._step(run, settings, run)
    assert found == {"step_rise": None, "step_overshoot": None}
