"""Trouble in the last moments of a measurement, when its samples are there and nobody looks."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

import pytest

from backend.jobs import Progress
from backend.tools.inertia import inertia
from backend.tools.inertia_evaluation import InertiaSettings
from backend.tools.step_response import StepSettings, step_response
from drivers.cia402 import State
from drivers.errors import NotAllowed
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import WIDE, mechanics, settings_of

ONE = mechanics((1e-4, 60.0, 0.006))
TOOLS: dict[str, tuple[str, Callable[[DirectBench, Progress], Awaitable[object]]]] = {
    "inertia": (
        "moving forth and back",
        lambda b, p: inertia(b.axis, b.session, InertiaSettings(WIDE), p),
    ),
    "step": ("stepping", lambda b, p: step_response(b.axis, b.session, StepSettings(WIDE), p)),
}


@pytest.mark.parametrize(("drive", "tool"), [("mms7", "inertia"), ("r6l", "step")])
async def test_a_fault_after_the_last_sample_is_told(drive: str, tool: str) -> None:
    """It was measured to its end, and the drive tripped before it was disabled."""
    async with direct(ONE, drive=drive) as b:
        before = await settings_of(b.axis.drive)
        step, work = TOOLS[tool]
        progress = Progress(lambda: None)
        disable = b.link.halt
        struck: list[float] = []

        async def strike(station: int | None = None) -> None:
            if progress.step == step and not struck:
                struck.append(progress.fraction)
                b.link.device.inject("over_temperature")
                b.link.pass_s(0.002)
            await disable(station)

        b.link.halt = strike  # type: ignore[method-assign]
        with pytest.raises(NotAllowed, match="temperature"):
            await work(b, progress)
        assert struck
        assert await b.axis.state() is State.FAULT
        assert await settings_of(b.axis.drive) == before
