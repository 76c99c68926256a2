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
from backend.tools.autotune import gain_steps as raising
from backend.tools.measuring.recording import Recording, bridged
from backend.tools.step.evaluate import LEAD_S, StepResult, StepSettings, evaluate

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
    async def temporary(*_: Any) -> AsyncIterator[None]:
        yield

    async def raw(_key: str) -> int:
        return 100

    tool: Any = SimpleNamespace(
        spec_of=lambda _drive: SimpleNamespace(speed="gain"),
        raised=lambda _drive, _key, now, factor: round(now * factor),
    )
    monkeypatch.setattr(raising, "step_response", again)
    monkeypatch.setattr(raising, "temporary", temporary)
    monkeypatch.setattr(raising, "gain_tool", tool)
    parameter = SimpleNamespace(unit="Hz", to_value=float)
    drive = SimpleNamespace(parameter=lambda _key: parameter, raw=raw)
    axis: Any = SimpleNamespace(drive=drive)
    silent = Progress(lambda: None)
    return await raising.gain_steps(axis, NOTHING, SETTINGS, present, 6.0, silent)


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
