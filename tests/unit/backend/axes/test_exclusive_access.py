"""A drive that stores is left alone from the write on; STOP is not kept away (001:1209-1212)."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

import pytest

from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.axes.drive.exclusive import ExclusiveAccessHeld
from backend.axes.drive.ports import Port
from backend.tools.moving.moves.procedures import run_procedure
from drivers.errors import DriveError
from drivers.link import Address
from profiles.schema import Procedure, Profile, WaitStep, WriteStep
from tests.support.memory_link import MemoryLink
from tests.unit.backend.conftest import SPEC

SAVE = (0x200D, 1)
GAIN = (0x2005, 3)


class SlowLink(MemoryLink):
    """Answers reads when ``answers`` is set; notes what was asked, in order."""

    def __init__(self, objects: dict[tuple[int, int], bytes]) -> None:
        super().__init__(objects)
        self.answers = asyncio.Event()
        self.answers.set()
        self.asked: list[tuple[int, int]] = []

    async def read(self, station: int, address: Address) -> bytes:
        self.asked.append((address.index or 0, address.subindex))
        await self.answers.wait()
        return await super().read(station, address)

    async def read_many(
        self, station: int, addresses: Sequence[Address]
    ) -> list[bytes | DriveError]:
        return [await self.read(station, address) for address in addresses]

    async def write(self, station: int, address: Address, data: bytes) -> None:
        self.asked.append((address.index or 0, address.subindex))
        await super().write(station, address, data)


def procedure(wait_s: float) -> Procedure:
    steps = (
        WriteStep(do="write", key="200D:01", raw=0x65766173),
        WaitStep(do="wait", seconds=wait_s),
    )
    return Procedure(
        name="save", title="Save", help="", source="t", requires_stop=False, steps=steps
    )


@pytest.fixture
def slow(link: MemoryLink) -> SlowLink:
    return SlowLink(link.objects)


@pytest.fixture
def quiet(profile: Profile, slow: SlowLink) -> Drive:
    return Drive("x", "X axis", profile, [Port(slow, 1, SPEC)])


def begin(drive: Drive, wait_s: float) -> asyncio.Task[object]:
    return asyncio.create_task(
        run_procedure(Axis(drive), procedure(wait_s), True, lambda _share, _step: None)
    )


async def turns(count: int = 10) -> None:
    for _ in range(count):
        await asyncio.sleep(0)


async def test_a_question_under_way_ends_before_the_write_and_none_follows_it(
    quiet: Drive, slow: SlowLink
) -> None:
    slow.answers.clear()
    reading = asyncio.create_task(quiet.read("2005:03"))
    await turns()
    saving = begin(quiet, 10.0)
    await turns()
    assert slow.asked == [GAIN], "the write must not overtake the question"
    slow.answers.set()
    assert (await reading).raw == 400
    await turns()
    assert slow.asked == [GAIN, SAVE]
    assert quiet.exclusive.held
    with pytest.raises(
        ExclusiveAccessHeld, match=r"X axis must not be accessed for another 10 s.*is storing"
    ):
        await quiet.read("2005:03")
    with pytest.raises(ExclusiveAccessHeld):
        await quiet.write("2005:03", 300)
    many = await quiet.read_many(["2005:03", "2005:10"])
    assert all("must not be accessed" in reading.error for reading in many.values())
    assert slow.asked == [GAIN, SAVE]
    saving.cancel()
    await asyncio.wait([saving])
    assert (await quiet.read("2005:03")).raw == 400


async def test_a_long_reading_lets_the_storing_in_between(quiet: Drive, slow: SlowLink) -> None:
    """Its next part is refused, entry by entry, and reported."""
    slow.answers.clear()
    reading = asyncio.create_task(quiet.read_many(["2005:03", "2005:10"] * 20))
    await turns()
    saving = begin(quiet, 10.0)
    await turns()
    slow.answers.set()
    many = await reading
    assert any("must not be accessed" in reading.error for reading in many.values())
    assert quiet.exclusive.held
    assert slow.asked[-1] == SAVE
    saving.cancel()
    await asyncio.wait([saving])


async def test_a_short_rest_is_waited_for(quiet: Drive, slow: SlowLink) -> None:
    saving = begin(quiet, 0.05)
    await turns()
    assert quiet.exclusive.held
    assert (await quiet.read("2005:03")).raw == 400
    assert saving.done() or not quiet.exclusive.held
    await saving


async def test_stop_goes_through_and_ends_the_rest(quiet: Drive, slow: SlowLink) -> None:
    saving = begin(quiet, 10.0)
    await turns()
    await Axis(quiet).quick_stop()
    assert slow.asked == [SAVE, (0x6040, 0)]
    assert not quiet.exclusive.held
    assert (await quiet.read("2005:03")).raw == 400
    saving.cancel()
    await asyncio.wait([saving])


async def test_two_cannot_have_it_alone(quiet: Drive) -> None:
    saving = begin(quiet, 10.0)
    await turns()
    with pytest.raises(ExclusiveAccessHeld):
        await begin(quiet, 10.0)
    assert quiet.exclusive.held
    saving.cancel()
    await asyncio.wait([saving])
    assert not quiet.exclusive.held
