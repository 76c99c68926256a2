"""Scan, jog, scope at 1 kHz and response with a maker's file alone: no profile written by hand.

The slave insists on every rule of the file, and follows its setpoints without delay: what the
tools must find is known.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

import numpy as np
import pytest

from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.tools.moving.jog.cyclic import jog_cyclic
from backend.tools.moving.jog.hold import Hold
from backend.tools.moving.jog.release import END_OF_JOG
from backend.tools.moving.jog.run import JogSettings
from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.run import sweep
from drivers.link import ScopeBlock
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace
from tests.virtual.tools.rig import silent
from tests.wire.makers_files.samples import ODD, SAMPLES
from tests.wire.makers_files.test_bring_up import brought, namespace, profile_of

__all__ = ["namespace"]

INCREMENTS_PER_REV = 10_000
"""608Fh of the files."""
CYCLE_S = 1e-3
JOG = JogSettings(
    direction=1, speed_rpm=60.0, acceleration_rpm_s=600.0, travel_rev=5.0, torque_percent=100.0
)
ROOM = Envelope(travel_rev=20.0, speed_rpm=1500.0, torque_percent=100.0, time_s=60.0)


@dataclass(frozen=True)
class Way:
    """An axis whose exchange runs, known by its file."""

    axis: Axis
    session: CyclicSession
    segment: VirtualSegment
    blocks: list[ScopeBlock]

    def position(self) -> int:
        truth = bytes.fromhex(self.segment.command("read", slave=0, index=0x6064))
        return int.from_bytes(truth, "little", signed=True)


@asynccontextmanager
async def begun(namespace: Namespace, name: str) -> AsyncIterator[Way]:
    profile = profile_of(name)
    async with brought(namespace, name, haste=1.2) as (link, segment):
        link.attach(1, profile)
        spec = profile.link("ethercat")
        assert spec is not None
        axis = Axis(Drive("x", "X", profile, [Port(link, 1, spec)]))
        session = CyclicSession(link, [axis.drive])
        await session.start(CYCLE_S)
        axis.session = session
        blocks: list[ScopeBlock] = []
        session.cyclic.blocks(blocks.append)
        try:
            yield Way(axis, session, segment, blocks)
        finally:
            await session.stop()


async def jogged(way: Way) -> None:
    """60 rpm are one revolution in a second."""
    before = way.position()
    # The page's time, which a busy computer does not interrupt.
    page_s = [0.0]
    hold = Hold(clock=lambda: page_s[0])

    async def held() -> None:
        for _ in range(20):
            page_s[0] += 0.05
            hold.renew()
            await asyncio.sleep(0.05)
        hold.release(END_OF_JOG["released"])

    holding = asyncio.create_task(held())
    try:
        result = await jog_cyclic(way.axis, way.session, JOG, hold, silent())
    finally:
        holding.cancel()
    moved = way.position() - before
    assert result["reason_message"] == END_OF_JOG["released"].to_wire(), result
    assert result["moved_rev"] == pytest.approx(moved / INCREMENTS_PER_REV, abs=1e-3)
    assert moved > 1000


def recorded(way: Way) -> None:
    """Samples of every cycle, and a position whose slope is the speed that was asked for."""
    names = way.blocks[0].channels
    assert {block.dt_s for block in way.blocks} == {CYCLE_S}
    at = next(place for place, channel in enumerate(names) if "6064" in channel)
    position = np.concatenate([block.samples[:, at] for block in way.blocks])
    speed = np.diff(position) / CYCLE_S
    assert np.percentile(speed, 99) == pytest.approx(INCREMENTS_PER_REV, rel=0.02)


async def responded(way: Way) -> None:
    """An ideal speed loop: 0 dB as far as the response states that it is valid.

    Up to 100 Hz a setpoint held for 1 ms takes 0.14 dB (sin πfT / πfT).
    """
    settings = SweepSettings(
        ROOM,
        kind="speed_loop",
        f_min_hz=20.0,
        f_max_hz=100.0,
        realisations=1,
        rated_torque_nm=1.0,
        inertia_kgm2=1e-4,
    )
    found = await sweep(way.axis, way.session, settings, silent())
    assert found.unit
    inside = found.frf.in_band
    assert np.count_nonzero(inside) > 10
    assert np.abs(found.frf.magnitude_db[inside]).max() < 0.2


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("name", SAMPLES)
async def test_scan_jog_scope_and_response_with_the_file_alone(
    namespace: Namespace,
    name: str,
) -> None:
    async with begun(namespace, name) as way:
        await jogged(way)
        recorded(way)
        await responded(way)


@pytest.mark.long
@pytest.mark.parametrize("name", ODD)
async def test_scan_jog_and_scope_with_an_odd_file(namespace: Namespace, name: str) -> None:
    async with begun(namespace, name) as way:
        await jogged(way)
        recorded(way)
