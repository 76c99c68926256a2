"""A trial on the bench: undone whatever happens, kept only after it reached Operational."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.doctor.diagnosis import Cause
from drivers.doctor.examined import Examination
from drivers.errors import Busy, DriveError, LinkTimeout, NotAllowed
from drivers.link import Address
from profiles.schema import Profile
from tests.support.memory_link import MemoryLink

URL = "ethercat://virtual0"
CLOCK = "bring_up.clock_modes"
WRONG, RIGHT = "0330h", "0700h"
ENABLED, DISABLED = (0x0637).to_bytes(2, "little"), (0x0650).to_bytes(2, "little")


class Bus(MemoryLink):
    """A bus whose drive reaches Operational with AssignActivate 0700h alone."""

    def __init__(self) -> None:
        super().__init__({(0x6041, 0): DISABLED})
        self.kind = "ethercat"
        self.url = URL
        self.cyclic = self.doctor = self  # type: ignore[assignment]
        self.attached: Profile | None = None
        self.running = False
        self.starts = 0
        self.silent: set[int] = set()
        self.entered, self.gate = asyncio.Event(), asyncio.Event()
        self.gate.set()

    def attach(self, station: int, profile: Profile) -> None:
        del station
        assert not self.running, "a profile changes under a running exchange"
        self.attached = profile

    async def read(self, station: int, address: Address) -> bytes:
        if station in self.silent:
            raise LinkTimeout("ethercat.drive-not-answer-time")
        return await super().read(station, address)

    async def configure(self, _inputs: object, _outputs: object, _cycle_s: float) -> None:
        self.starts += 1

    async def start(self) -> None:
        self.running = True
        self.entered.set()
        await self.gate.wait()
        assert self.attached is not None
        rules = self.attached.bring_up
        if rules is None or rules.clock_mode is None or rules.clock_mode.assign_activate != 0x700:
            raise LinkTimeout("ethercat.drive-not-answer-time")

    async def stop(self) -> None:
        self.running = False

    async def stations_known(self) -> list[int]:
        return [1]

    async def examination(self, station: int, refusal: DriveError | None = None) -> Examination:
        reached = self.running and refusal is None
        return Examination(station, reached, () if reached else (Cause("clock_needed", 3, ()),))


@pytest.fixture
async def bus() -> Bus:
    return Bus()


@pytest.fixture
async def bench(tmp_path: Path, bus: Bus) -> AsyncIterator[Bench]:
    bench = Bench(tmp_path, {URL: lambda: bus})
    await bench.connect(URL, 1, "mms7", "X")
    yield bench
    await bench.close()


def x(bench: Bench) -> ConnectedDrive:
    (only,) = bench.connected_drives.values()
    return only


async def offer(bench: Bench) -> list[tuple[str, str]]:
    _, offered = await bench.doctor.examination(URL, 1)
    return [(each.setting, each.after) for each in offered]


async def test_try_keep_and_undo(bench: Bench, bus: Bus) -> None:
    profile = x(bench).drive.profile
    assert {(CLOCK, WRONG), (CLOCK, RIGHT)} <= set(await offer(bench))
    failed = await bench.doctor.run(URL, 1, CLOCK, WRONG)
    assert not failed.reached
    assert failed.refusal is not None
    assert bus.attached is x(bench).drive.profile is profile
    assert not bus.running, "a start that timed out may still come to its end"
    with pytest.raises(NotAllowed, match="did not reach"):
        bench.doctor.keep(URL, 1, CLOCK, WRONG)

    assert (await bench.doctor.run(URL, 1, CLOCK, RIGHT)).reached
    assert bus.attached is x(bench).drive.profile is profile
    assert not bus.running
    with pytest.raises(NotAllowed, match="did not reach"):
        bench.doctor.keep(URL, 1, CLOCK, WRONG)
    bench.doctor.keep(URL, 1, CLOCK, RIGHT)
    kept = x(bench).drive.profile
    assert kept is bus.attached
    assert kept.bring_up is not None
    assert kept.bring_up.clock_mode is not None
    assert kept.bring_up.clock_mode.assign_activate == 0x700
    assert bench.doctor.kept(URL, 1) is not None
    assert await offer(bench) == [], "one at a time"

    bench.doctor.undo(URL, 1)
    assert bus.attached is x(bench).drive.profile is profile
    assert bench.doctor.kept(URL, 1) is None
    with pytest.raises(NotAllowed, match="no setting is kept"):
        bench.doctor.undo(URL, 1)
    assert bus.written == [], "nothing is written to the drive"
    lines = [entry.text for entry in bench.journal.entries(x(bench).drive.id)]
    assert any(f"{CLOCK} is {RIGHT} instead of 0300h" in line for line in lines)
    assert any("again as in the profile" in line for line in lines)


async def test_what_was_not_offered_is_not_tried(bench: Bench, bus: Bus) -> None:
    with pytest.raises(NotAllowed, match="does not offer"):
        await bench.doctor.run(URL, 1, CLOCK, RIGHT)
    await offer(bench)
    with pytest.raises(NotAllowed, match="does not offer"):
        await bench.doctor.run(URL, 1, CLOCK, "1234h")
    with pytest.raises(NotAllowed, match="no drive is connected"):
        await bench.doctor.run(URL, 2, CLOCK, RIGHT)
    assert bus.starts == 0


async def test_no_trial_beside_an_enabled_axis(bench: Bench, bus: Bus) -> None:
    """The start of an exchange resets every drive of the bus."""
    await offer(bench)
    bus.objects[0x6041, 0] = ENABLED
    with pytest.raises(NotAllowed, match="is enabled"):
        await bench.doctor.run(URL, 1, CLOCK, RIGHT)
    assert bus.starts == 0


async def test_a_drive_that_does_not_answer_may_be_enabled(bench: Bench, bus: Bus) -> None:
    await bench.connect(URL, 2, "mms7", "Y")
    await offer(bench)
    bus.silent = {2}
    with pytest.raises(DriveError):
        await bench.doctor.run(URL, 1, CLOCK, RIGHT)
    assert bus.starts == 0
    # The drive on trial itself may be silent: that is what is being looked into.
    bus.silent = {1}
    assert (await bench.doctor.run(URL, 1, CLOCK, RIGHT)).reached


async def test_a_cancelled_trial_is_undone_and_nothing_moves_meanwhile(
    bench: Bench, bus: Bus
) -> None:
    await offer(bench)
    profile = x(bench).drive.profile
    bus.gate.clear()
    trial = asyncio.create_task(bench.doctor.run(URL, 1, CLOCK, RIGHT))
    await bus.entered.wait()
    assert bus.attached is not profile
    with pytest.raises(Busy):
        bench.exchanges.require_calm("X", [URL])
    with pytest.raises(Busy):
        await bench.start_cyclic(URL, 0.001)
    with pytest.raises(Busy):
        await bench.doctor.run(URL, 1, CLOCK, WRONG)
    trial.cancel()
    await asyncio.wait([trial])
    assert trial.cancelled()
    assert not bus.running
    assert bus.attached is x(bench).drive.profile is profile
    bench.exchanges.require_calm("X", [URL])


async def test_the_cycle_is_no_setting_to_keep(bench: Bench, bus: Bus) -> None:
    async def unsteady(station: int, refusal: DriveError | None = None) -> Examination:
        causes = (Cause("sync0_unsteady", 3, ()),)
        return Examination(station, refusal is None and bus.running, causes)

    async def start() -> None:
        bus.running = True

    bus.examination, bus.start = unsteady, start  # type: ignore[method-assign]
    assert ("cycle", "2") in await offer(bench)
    assert (await bench.doctor.run(URL, 1, "cycle", "2")).reached
    with pytest.raises(NotAllowed, match="is not a setting"):
        bench.doctor.keep(URL, 1, "cycle", "2")
