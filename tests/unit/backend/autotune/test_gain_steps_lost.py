"""A raised gain is shown by a torque that was received, and not by one that was interpolated."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from backend.axes.axis.axis import Envelope
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.recording import Recording, bridged
from backend.tools.moving.step.evaluate import LEAD_S, StepResult, StepSettings, evaluate
from backend.tools.tuning.autotune.verification import gain_steps as raising

SETTINGS = StepSettings(Envelope(4.0, 1500.0, 100.0, 60.0))
RATE = 1000.0
NOTHING: Any = None


def step(swing_percent: float, lost_s: float) -> StepResult:
    """A torque that swings at 90 Hz with a gap of ``lost_s`` at the end of the step."""
    count = round((LEAD_S + 2 * SETTINGS.hold_s) * RATE)
    time = np.arange(count) / RATE
    torque = swing_percent / 100.0 * np.sin(2 * np.pi * 90.0 * time)
    end = LEAD_S + SETTINGS.hold_s
    valid = ~((time >= end - lost_s) & (time < end))
    torque = bridged(np.where(valid, torque, 0.0)[:, None], valid)[:, 0]
    nothing = np.zeros(count)
    recording = Recording(RATE, nothing, nothing, torque, nothing, nothing, valid)
    return evaluate(recording, np.where(time >= LEAD_S, 100.0, 0.0), SETTINGS, 1.0)


async def raised(
    monkeypatch: pytest.MonkeyPatch, present: StepResult, after: StepResult
) -> raising.GainSteps:
    async def again(*_: Any) -> StepResult:
        return after

    @asynccontextmanager
    async def stopping_hard(*_: Any) -> AsyncIterator[None]:
        yield

    @asynccontextmanager
    async def temporary(*_: Any) -> AsyncIterator[None]:
        yield

    async def raw(_key: str) -> int:
        return 100

    tool: Any = SimpleNamespace(
        spec_of=lambda _drive: SimpleNamespace(speed="gain"),
        raised=lambda _drive, _key, now, factor: round(now * factor),
    )
    monkeypatch.setattr(raising, "one_more_step", again)
    monkeypatch.setattr(raising, "stopping_hard", stopping_hard)

    async def home() -> int:
        return 0

    async def go_back(*_: Any) -> None:
        pass

    async def units() -> Any:
        return SimpleNamespace(position=float)

    monkeypatch.setattr(raising, "go_back", go_back)
    monkeypatch.setattr(raising, "temporary", temporary)
    monkeypatch.setattr(raising, "gain_tool", tool)
    parameter = SimpleNamespace(unit="Hz", to_value=float)
    drive = SimpleNamespace(parameter=lambda _key: parameter, raw=raw)
    axis: Any = SimpleNamespace(drive=drive, position_raw=home, units=units)
    silent = Progress(lambda: None)
    return await raising.gain_steps(axis, NOTHING, SETTINGS, present, 6.0, silent, facts=NOTHING)


async def test_an_oscillation_that_was_not_received_shows_no_gain(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    quiet = step(0.1, 0.0)
    whole = await raised(monkeypatch, quiet, step(8.0, 0.0))
    assert (whole.shown_db, whole.steps[0].stable) == (0.0, False)
    lost = await raised(monkeypatch, quiet, step(8.0, 0.12))
    assert lost == raising.GainSteps(0.0, None, ())
    assert await raised(monkeypatch, step(0.1, 0.12), quiet) == lost


async def test_single_samples_are_not_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    found = await raised(monkeypatch, step(0.1, 0.0), step(0.1, 0.003))
    assert found.shown_db == pytest.approx(6.0, abs=0.1)
    assert found.onset_db is None


async def test_steps_lead_away_and_back_in_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is compared with one of its direction; the last way leads home at the usual gain."""
    place, returned, gains, stepped, hard = 0.0, [], [1.0], [], list[bool]()
    ways = {1: 0.4, -1: -0.38}

    @asynccontextmanager
    async def stopping_hard(*_: Any) -> AsyncIterator[None]:
        hard.append(True)
        yield
        hard.pop()

    async def again(_axis: Any, _session: Any, settings: StepSettings, _facts: Any) -> StepResult:
        nonlocal place
        assert hard
        sign = int(np.sign(settings.size))
        stepped.append((sign, round(gains[-1], 2)))
        place += ways[sign]
        return step(0.1, 0.0)

    async def home(*_: Any) -> None:
        nonlocal place
        returned.append((len(stepped), gains[-1]))
        place = 0.0

    @asynccontextmanager
    async def temporary(_axis: Any, values: dict[str, int]) -> AsyncIterator[None]:
        gains.append(values["gain"] / 100)
        yield
        gains.append(1.0)

    async def position_raw() -> int:
        return round(1000 * place)

    async def units() -> Any:
        return SimpleNamespace(position=lambda raw: raw / 1000)

    async def raw(_key: str) -> int:
        return 100

    tool: Any = SimpleNamespace(
        spec_of=lambda _drive: SimpleNamespace(speed="gain"),
        raised=lambda _drive, _key, now, factor: round(now * factor),
    )
    for name, value in (
        ("one_more_step", again), ("go_back", home), ("temporary", temporary),
        ("gain_tool", tool), ("stopping_hard", stopping_hard),
    ):  # fmt: skip
        monkeypatch.setattr(raising, name, value)
    drive = SimpleNamespace(
        parameter=lambda _key: SimpleNamespace(unit="Hz", to_value=float), raw=raw
    )
    axis: Any = SimpleNamespace(drive=drive, position_raw=position_raw, units=units)
    silent = Progress(lambda: None)
    found = await raising.gain_steps(
        axis, NOTHING, SETTINGS, step(0.1, 0.0), 10.0, silent, facts=NOTHING
    )
    assert found.shown_db == pytest.approx(10.0, abs=0.1)
    assert [sign for sign, _gain in stepped] == [1, -1, 1, -1, 1]
    assert stepped[1] == (-1, 1.0)
    assert all(gain > 1.0 for number, (_sign, gain) in enumerate(stepped) if number != 1)
    # Twice 0.02 rev beside the way of 0.42 rev is near enough; what remains is gone at the end.
    assert returned == [(5, 1.0)]
    assert place == 0.0
    # A loop that hardly moves back begins again where it began.
    ways[-1], place = -0.1, 0.0
    stepped.clear()
    returned.clear()
    await raising.gain_steps(axis, NOTHING, SETTINGS, step(0.1, 0.0), 10.0, silent, facts=NOTHING)
    assert [number for number, _gain in returned] == [2, 4, 5]
    # Begun where the step before ended: back first, for comparison, and no way home in between.
    ways[-1], place = -0.4, 0.4
    stepped.clear()
    returned.clear()
    found = await raising.gain_steps(
        axis, NOTHING, SETTINGS, step(0.1, 0.0), 10.0, silent, facts=NOTHING, begun_raw=0
    )
    assert found.shown_db == pytest.approx(10.0, abs=0.1)
    assert stepped[0] == (-1, 1.0)
    assert [sign for sign, _gain in stepped] == [-1, 1, -1, 1, -1]
    assert all(gain > 1.0 for _sign, gain in stepped[1:])
    assert [number for number, _gain in returned] == [5]
    # One raise is compared with the step that there is: no step back.
    place = 0.4
    stepped.clear()
    returned.clear()
    await raising.gain_steps(
        axis, NOTHING, SETTINGS, step(0.1, 0.0), 2.0, silent, facts=NOTHING, begun_raw=0
    )
    assert [sign for sign, _gain in stepped] == [1]
    assert [number for number, _gain in returned] == [0, 1]
    # Too much was lost: nothing is raised, and the axis returns all the same.
    place = 0.4
    stepped.clear()
    returned.clear()
    found = await raising.gain_steps(
        axis, NOTHING, SETTINGS, step(0.1, 0.12), 10.0, silent, facts=NOTHING, begun_raw=0
    )
    assert (found.steps, stepped, place) == ((), [], 0.0)
