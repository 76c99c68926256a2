"""Whether a load pulls at the axis is concluded from torques that were read, and from no others."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from backend.axes.drive.readings import Reading
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.mechanics.inertia import probe
from drivers.errors import LinkTimeout
from drivers.texts.message import text

FACTS = AxisFacts(1.27, True, None, None, None, None, None, True)
NOTHING: Any = None


def axis_of(monkeypatch: pytest.MonkeyPatch, every: int) -> Any:
    """A hanging load that takes 30 % to hold; only each ``every``-th torque can be read."""

    @asynccontextmanager
    async def enabled(*_: Any) -> AsyncIterator[int]:
        yield 0

    async def nothing(*_: Any) -> None: ...

    asked = 0

    async def read_many(keys: list[str]) -> dict[str, Reading]:
        nonlocal asked
        asked += 1
        torque = Reading("6077:00", 300, 30.0, 0.0)
        if asked % every:
            torque = Reading("6077:00", None, None, 0.0, text("drive.write-only"))
        return {keys[0]: torque, keys[1]: Reading("606C:00", 0, 0.0, 0.0)}

    async def units() -> Any:
        return SimpleNamespace(torque=lambda x: 0.1 * x, velocity=float, position=lambda x: x / 1e4)

    async def place() -> int:
        return 0

    monkeypatch.setattr(probe, "enabled", enabled)
    monkeypatch.setattr(probe, "require_enabled", nothing)
    monkeypatch.setattr(asyncio, "sleep", nothing)
    drive = SimpleNamespace(name="X", require=lambda role: role, read_many=read_many)
    return SimpleNamespace(units=units, drive=drive, position_raw=place)


async def test_the_torque_that_holds_a_load(monkeypatch: pytest.MonkeyPatch) -> None:
    axis = axis_of(monkeypatch, 1)
    held = await probe.holding_torque(axis, NOTHING, FACTS)
    assert held == pytest.approx(0.3 * 1.27)


async def test_a_torque_that_cannot_be_read_is_no_torque_of_zero(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The loop would be opened, and the load would fall."""
    axis = axis_of(monkeypatch, 10**9)
    with pytest.raises(LinkTimeout, match="6077:00"):
        await probe.holding_torque(axis, NOTHING, FACTS)


async def test_readings_that_were_lost_do_not_make_the_torque_smaller(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    axis = axis_of(monkeypatch, 1)
    whole = axis.drive.read_many
    count = 0

    async def read_many(keys: list[str]) -> dict[str, Reading]:
        nonlocal count
        count += 1
        found: dict[str, Reading] = await whole(keys)
        if count % 4 == 0:
            found[keys[0]] = Reading("6077:00", None, None, 0.0, text("drive.write-only"))
        return found

    axis.drive.read_many = read_many
    held = await probe.holding_torque(axis, NOTHING, FACTS)
    assert held == pytest.approx(0.3 * 1.27)


async def test_ripple_is_told_from_a_torque_that_drifts(monkeypatch: pytest.MonkeyPatch) -> None:
    axis = axis_of(monkeypatch, 1)
    rng = np.random.default_rng(3)
    percent = 30.0 + np.linspace(-8.0, 8.0, 12)

    async def rippled(rms_percent: float) -> probe.Standing:
        readings = iter(percent + rms_percent * rng.standard_normal(percent.size))

        async def read_many(keys: list[str]) -> dict[str, Reading]:
            raw = round(10.0 * next(readings))
            torque = Reading("6077:00", raw, raw / 10.0, 0.0)
            return {keys[0]: torque, keys[1]: Reading("606C:00", 0, 0.0, 0.0)}

        axis.drive.read_many = read_many
        return await probe.standing(axis, NOTHING, FACTS)

    assert (await rippled(0.0)).ripple_percent < 0.1
    found = [(await rippled(6.0)).ripple_percent for _ in range(20)]
    assert float(np.mean(found)) == pytest.approx(6.0, rel=0.2)
