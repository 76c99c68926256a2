"""What was measured is stored, also where what follows it fails."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from backend.axes.axis.axis import Envelope
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Recording
from backend.tools.mechanics.inertia import run as inertia_run
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.moves import FirstLook
from backend.tools.mechanics.inertia.probe import RoughFit
from backend.tools.moving.step import run as step_run
from backend.tools.moving.step.evaluate import StepSettings
from drivers.errors import LinkLost, NotAllowed, OutOfRange

FACTS = AxisFacts(1.27, True, None, None, None, None, None, True)
WIDE = Envelope(4.0, 1500.0, 100.0, 60.0)
NOTHING: Any = None
TOO_LONG = OutOfRange("inertia.moves-take", value=9.0, limit="5 s")


def recorded(size: int = 400) -> Recording:
    nothing, valid = np.zeros(size), np.ones(size, np.bool_)
    return Recording(1000.0, *([nothing] * 5), valid=valid)


async def place() -> int:
    return 0


async def units() -> Any:
    return SimpleNamespace(
        position=lambda x: x / 1e4,
        position_raw=lambda x: round(1e4 * x),
        velocity_raw=round,
    )


class Kept:
    """Names of what was stored, and how much of each."""

    def __init__(self) -> None:
        self.names: list[str] = []
        self.sizes: list[int] = []

    def __call__(self, name: str, arrays: dict[str, Any], _meta: dict[str, object]) -> None:
        self.names.append(name)
        self.sizes.append(len(arrays["valid"]))


def patched(monkeypatch: pytest.MonkeyPatch, module: Any, **made: Any) -> Any:
    async def facts(*_: Any) -> AxisFacts:
        return FACTS

    made = {"read_facts": facts, "require_signals": lambda *_: None, **made}
    for name, one in made.items():
        monkeypatch.setattr(module, name, one)
    drive = SimpleNamespace(name="X")
    return SimpleNamespace(drive=drive, position_raw=place, require_certain_scales=units)


async def measured(
    monkeypatch: pytest.MonkeyPatch,
    *,
    swings: bool = False,
    back: Exception | None = None,
    wrong: Exception | None = None,
) -> tuple[Any, Kept]:
    """Inertia whose second, gentle move does not fit into the permitted time."""
    moves = 0

    async def look(*_: Any) -> Any:
        return FirstLook(RoughFit(1e-4, 0.0, 0.0), 1.0)

    async def moved(*_: Any) -> Recording:
        nonlocal moves
        moves += 1
        if moves > 1:
            raise TOO_LONG
        return recorded()

    async def go_back(*_: Any) -> None:
        if back is not None:
            raise back

    def evaluated(*_: Any) -> Any:
        if wrong is not None:
            raise wrong
        return SimpleNamespace(inertia_kgm2=SimpleNamespace(value=1e-4))

    axis = patched(
        monkeypatch, inertia_run, first_look=look, identification_moves=moved, go_back=go_back,
        evaluate=evaluated, oscillation_hz=lambda *_: 5.0 if swings else None,
    )  # fmt: skip
    kept = Kept()
    try:
        found: Any = await inertia_run.inertia(
            axis, NOTHING, InertiaSettings(WIDE), Progress(lambda: None), kept
        )
    except (NotAllowed, OutOfRange, LinkLost) as error:
        found = error
    return found, kept


async def test_gentler_moves_that_do_not_fit_leave_the_first_result(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found, kept = await measured(monkeypatch, swings=True)
    assert found.result.inertia_kgm2.value == 1e-4
    assert (kept.names, kept.sizes) == (["inertia"], [400])


async def test_an_inertia_measurement_is_kept_where_the_way_back_or_its_evaluation_fails(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for error in (NotAllowed("the drive has a fault"), LinkLost("the wire is gone")):
        found, kept = await measured(monkeypatch, back=error)
        assert found is error
        assert kept.names == ["inertia"]
    short = NotAllowed("too short to be evaluated")
    found, kept = await measured(monkeypatch, wrong=short)
    assert found is short
    assert kept.names == ["inertia"]


async def test_a_step_is_kept_where_the_way_back_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    @asynccontextmanager
    async def enabled(*_: Any) -> AsyncIterator[int]:
        yield 0

    async def nothing(*_: Any) -> None: ...

    async def play(*_: Any) -> Recording:
        return recorded()

    async def go_back(*_: Any) -> None:
        raise NotAllowed("the drive has a fault")

    axis = patched(
        monkeypatch, step_run, enabled=enabled, stopping_hard=enabled, quiet=nothing, play=play,
        bus_limits=nothing, go_back=go_back, cycle_s=lambda _session: 1e-3,
    )  # fmt: skip
    kept = Kept()
    with pytest.raises(NotAllowed, match="fault"):
        await step_run.step_response(
            axis, NOTHING, StepSettings(WIDE), Progress(lambda: None), kept
        )
    assert kept.names == ["step"]
