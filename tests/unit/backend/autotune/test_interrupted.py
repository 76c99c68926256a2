"""What others ended is over: nothing in progress lets the axis move once more by itself.

A person presses the emergency stop while an axis is tuned, looks, and releases it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import pytest

from backend.analysis.loop.design import Candidate
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.interrupted import Interrupted, raise_if_ended
from backend.tools.tuning.autotune import apply as tune_apply
from backend.tools.tuning.autotune import present as tune_present
from backend.tools.tuning.autotune.design import notches as tune_notches
from drivers.cia402 import State
from drivers.errors import DriveError, LinkLost, MotionHalted, NotAllowed, motion_halted
from drivers.halt import HaltCause, Halted, LoopState
from tests.unit.backend.autotune.test_tune_hum import GOALS, design

STOPPED = Interrupted("station 1: the drive left Operation enabled: Quick stop active")
LOST = LinkLost("only 12 of 800 samples were received from the bus")
TOO_FAR = motion_halted("station 1", Halted.beyond("position", 9000, 8000))
HELD, MEANT = {"2005:03": 700}, {"2005:03": 200}


class Axis:
    """Holds one gain; disabled, without a fault, whenever it is asked."""

    known_units = None

    def __init__(self) -> None:
        self.held = dict(HELD)
        self.drive = SimpleNamespace(
            name="X", pending_restores=self, raw=self.raw, profile=SimpleNamespace(notch=None)
        )

    async def raw(self, key: str) -> int:
        return self.held[key]

    @contextmanager
    def temporary(self, _values: dict[str, int]) -> Iterator[None]:
        yield

    async def state(self) -> State:
        return State.SWITCH_ON_DISABLED

    async def position_raw(self) -> int:
        return 4711


async def tried_on(
    monkeypatch: pytest.MonkeyPatch, end: DriveError
) -> tuple[list[float], dict[str, int], DriveError | None]:
    """Gains verified with this end each time, what the drive holds then, and the error."""
    axis: Any = Axis()
    seen: list[float] = []

    async def plan(_axis: Any, *_: Any) -> dict[str, int]:
        return dict(MEANT)

    async def write(_axis: Any, values: dict[str, int]) -> dict[str, int]:
        before = dict(axis.held)
        axis.held.update(values)
        return before

    async def verify(_axis: Any, _session: Any, _check: Any, candidate: Candidate, *_: Any) -> Any:
        seen.append(candidate.gains.speed_nms)
        raise end

    monkeypatch.setattr(tune_apply, "plan", plan)
    monkeypatch.setattr(tune_apply, "write_settings", write)
    monkeypatch.setattr(tune_apply, "put_back_in_time", write)
    monkeypatch.setattr(tune_apply, "verify", verify)
    check: Any = SimpleNamespace(inertia_kgm2=1e-4, motor_inertia_kgm2=None)
    session: Any = None
    try:
        await tune_apply.first_kept(
            axis, session, check, [design(8.0), design(2.0)], GOALS, [], Progress(lambda: None),
            None,
        )  # fmt: skip
    except DriveError as error:
        return seen, axis.held, error
    return seen, axis.held, None


@pytest.mark.parametrize("end", [STOPPED, LOST])
async def test_no_other_design_is_tried_on_an_axis_that_others_stopped(
    monkeypatch: pytest.MonkeyPatch, end: DriveError
) -> None:
    assert await tried_on(monkeypatch, end) == ([8.0], HELD, end)


async def test_a_design_that_leaves_the_envelope_is_followed_by_the_next(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert await tried_on(monkeypatch, TOO_FAR) == ([8.0, 2.0], HELD, None)


@pytest.mark.parametrize("end", [STOPPED, TOO_FAR])
async def test_what_it_had_is_no_way_on_either(
    monkeypatch: pytest.MonkeyPatch, end: NotAllowed
) -> None:
    async def verify(*_: Any) -> None:
        raise end

    monkeypatch.setattr(tune_present, "verify", verify)
    axis: Any = Axis()
    nothing: Any = None
    trials = tune_present.Trials(axis, nothing, nothing, GOALS, Progress(lambda: None), None)
    trials.had = tune_present.Present(7.0, design(7.0))
    if end is TOO_FAR:
        assert await trials._as_it_was() is None
        return
    with pytest.raises(Interrupted):
        await trials._as_it_was()


@pytest.mark.parametrize("end", [STOPPED, TOO_FAR])
async def test_tuning_goes_on_without_notches_only_where_the_axis_kept_them_back(
    monkeypatch: pytest.MonkeyPatch, end: NotAllowed
) -> None:
    async def learn(*_: Any) -> None:
        raise end

    gone: list[int] = []

    async def stands(_axis: Any) -> None: ...

    async def go_back(_axis: Any, _session: Any, goal: int, *_: Any) -> None:
        gone.append(goal)

    monkeypatch.setattr(tune_notches, "quiet", stands)
    monkeypatch.setattr(tune_notches, "go_back", go_back)
    monkeypatch.setattr(tune_notches, "_learn_free", learn)
    monkeypatch.setattr(tune_notches, "meaning_of", lambda _drive: None)
    monkeypatch.setattr("backend.tools.tuning.notch.effect.unknown", lambda _drive: True)
    monkeypatch.setattr("backend.tools.tuning.notch.trials.least_s", lambda _drive: 11.6)
    axis: Any = Axis()
    resonant: Any = SimpleNamespace(
        resonances=[SimpleNamespace(kind="resonance")], model=object(), loop="none"
    )
    found: Any = SimpleNamespace(result=SimpleNamespace(gravity_nm=SimpleNamespace(value=0.0)))
    how: Any = SimpleNamespace(loop="auto", envelope=None, scheme="free")
    facts: Any = SimpleNamespace(rated_torque_nm=1.27)
    nothing: Any = None
    learned = tune_notches.learn_notches(
        axis, nothing, how, facts, found, resonant, Progress(lambda: None)
    )
    if end is TOO_FAR:
        assert "beyond the limit" in str(await learned)
        assert gone == [4711], "travel counts from there"
        return
    with pytest.raises(Interrupted):
        await learned
    assert not gone


CAUSES = [
    (HaltCause.POSITION, False),
    (HaltCause.SPEED, False),
    (HaltCause.TORQUE, False),
    (HaltCause.FOLLOWING, False),
    (HaltCause.SKEW, False),
    (HaltCause.PARTNER, True),
    (HaltCause.EXPIRED, False),
    (HaltCause.LEFT_ENABLED, True),
    (HaltCause.COMMANDED, True),
    (HaltCause.LOST, True),
    (HaltCause.UNFIT, True),
    (HaltCause.CONTRADICTION, True),
]


@pytest.mark.parametrize(("cause", "by_others"), CAUSES)
def test_only_what_was_asked_of_the_axis_may_be_asked_in_another_way(
    cause: HaltCause, by_others: bool
) -> None:
    # Its note holds the words of another cause: nothing may read them.
    halt = Halted(cause, note="torque 310 is beyond the limit of 300")
    power = SimpleNamespace(axis_state=lambda _station: LoopState("", "idle", halt))
    session: Any = SimpleNamespace(power=lambda: power, running=True, station=lambda _drive: 1)
    axis: Any = Axis()
    with pytest.raises(NotAllowed) as reported:
        raise_if_ended(axis, session)
    assert isinstance(reported.value, Interrupted) is by_others
    assert isinstance(reported.value, Interrupted | MotionHalted)
    assert reported.value.halt is halt


def test_every_cause_is_judged() -> None:
    judged = {cause for cause, _ in CAUSES}
    assert judged == set(HaltCause)
