"""The station's own tools on a CANopen drive: jog without and with process data."""

from __future__ import annotations

import asyncio
import itertools
import time
from collections.abc import AsyncIterator

import can
import pytest

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.tools.moving.jog.cyclic import jog_cyclic
from backend.tools.moving.jog.release import END_OF_JOG
from backend.tools.moving.jog.run import Hold, JogSettings, jog
from drivers.canopen.link import CanopenLink
from drivers.cia402 import State
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.wires.can_wire import CanWire, PythonCanSide
from drivers.virtual.wires.canopen import CanopenNode
from profiles.loader import drive_names, load_profile

_numbers = itertools.count()
SETTINGS = JogSettings(
    direction=1, speed_rpm=60.0, acceleration_rpm_s=3000.0, travel_rev=20.0, torque_percent=200.0
)


@pytest.fixture
async def axis(request: pytest.FixtureRequest) -> AsyncIterator[Axis]:
    profile = load_profile(getattr(request, "param", "generic402"))
    device = make_device(profile, station=3)
    # Compiles the physics before anybody waits for an answer.
    device.advance(time.monotonic_ns())
    device.advance(time.monotonic_ns() + 10_000_000)
    channel = f"axis-{next(_numbers)}"
    bus = can.Bus(interface="virtual", channel=channel)
    with CanWire(PythonCanSide(bus), [CanopenNode(device, 3, time.monotonic_ns)]):
        link = CanopenLink(f"canopen://virtual/{channel}")
        await link.open()
        link.attach(3, profile)
        drive = Drive("d", "Drive", profile, [Port(link, 3, profile.link("canopen"))])
        yield Axis(drive)
        await link.close()


async def _hold_for(hold: Hold, seconds: float) -> None:
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        hold.renew()
        await asyncio.sleep(0.02)
    hold.release(END_OF_JOG["released"])


@pytest.mark.long
@pytest.mark.parametrize("axis", sorted({"generic402", "ds_c"} & set(drive_names())), indirect=True)
async def test_jog_by_short_moves(axis: Axis) -> None:
    start = await axis.position_raw()
    hold = Hold()
    holding = asyncio.create_task(_hold_for(hold, 0.6))
    result = await jog(axis, SETTINGS, hold, lambda *_: None)
    await holding
    assert result["reason_message"] == END_OF_JOG["released"].to_wire()
    assert await axis.position_raw() > start
    assert await axis.state() is not State.OPERATION_ENABLED


async def test_jog_with_process_data(axis: Axis) -> None:
    session = CyclicSession(axis.drive.ports[0].link, [axis.drive])
    axis.session = session
    await session.start(0.004)
    start = await axis.position_raw()
    hold = Hold()
    holding = asyncio.create_task(_hold_for(hold, 0.6))
    result = await jog_cyclic(axis, session, SETTINGS, hold, lambda *_: None)
    await holding
    assert result["reason_message"] == END_OF_JOG["released"].to_wire()
    assert await axis.position_raw() > start
    assert await axis.state() is not State.OPERATION_ENABLED
    await session.stop()
