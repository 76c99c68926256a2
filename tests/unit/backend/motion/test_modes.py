"""Which modes a drive has: a profile that stands for many drives does not know."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest

from backend.api.app import make_app
from backend.station.bench import Bench
from drivers.cia402 import Mode
from drivers.errors import NotAllowed
from tests.support.servo import URL, Servo

MODES = (0x6502, 0)
PP, PV, PT, HM, CSP, CSV, CST = 1, 3, 4, 6, 8, 9, 10
CAN = URL.replace("mlink", "canopen")


@pytest.fixture
async def stranger(tmp_path: Path) -> AsyncIterator[tuple[Servo, Bench]]:
    """A drive of the generic profile that has profile position, velocity and homing."""
    servo = Servo("generic402")
    servo.kind = "canopen"
    servo.set(MODES, 0b100101)
    bench = Bench(tmp_path, {CAN: lambda: servo})
    connected = await bench.connect(CAN, 1, "generic402", "X")
    await connected.monitor.close()
    yield servo, bench
    await bench.close()


async def test_a_mode_that_the_drive_does_not_tell_is_not_offered(
    stranger: tuple[Servo, Bench],
) -> None:
    _, bench = stranger
    (connected,) = bench.connected_drives.values()
    await connected.monitor.refresh()
    assert connected.drive.modes == (PP, PV, HM)
    transport = httpx.ASGITransport(make_app(bench, hosts=frozenset({"test"})))
    async with httpx.AsyncClient(transport=transport, base_url="http://test/api/v1") as http:
        state = (await http.get(f"/drives/{connected.drive.id}/state")).json()
    assert state["modes"] == [PP, PV, HM]
    with pytest.raises(NotAllowed, match="Cyclic"):
        await connected.axis.set_mode(Mode.CST)


@pytest.mark.parametrize("reported", [0, None])
async def test_a_drive_that_tells_nothing_keeps_what_the_profile_says(
    stranger: tuple[Servo, Bench], reported: int | None
) -> None:
    servo, bench = stranger
    (connected,) = bench.connected_drives.values()
    connected.drive.forget()
    if reported is None:
        del servo.objects[MODES]
    else:
        servo.set(MODES, reported)
    asked: list[object] = []
    await connected.monitor.refresh()
    servo.on_read = asked.append
    await connected.monitor.refresh()
    assert connected.drive.modes == (PP, PV, PT, HM, CSP, CSV, CST)
    assert MODES not in asked, "asked once"
