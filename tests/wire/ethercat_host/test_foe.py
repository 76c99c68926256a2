"""FoE bytes against ETG.1000.6 clause 5.8, and loading firmware through BOOT on a real wire."""

from __future__ import annotations

import asyncio
import hashlib
import struct

import pytest

from drivers.errors import Busy, DriveError, LinkTimeout, NotAllowed, Rejected
from drivers.ethercat.wire.foe import write_file
from drivers.link import Address
from tests.wire.ethercat_host.conftest import Bus, Rig, until
from tests.wire.ethercat_host.scripted import ScriptedSlave

FILE = bytes(n % 253 for n in range(4000))
STATUS = Address(0x6041, 0, "UINT16")
CONTROL = Address(0x6040, 0, "UINT16")


@pytest.mark.parametrize("length", [0, 10, 116, 117, 232])
def test_a_file_arrives_whole_and_a_short_packet_ends_it(length: int) -> None:
    data = bytes(n % 251 for n in range(length))
    busy = {"once": True}

    def react(request: bytes) -> list[bytes]:
        if request[0] == 2:
            return [struct.pack("<BxI", 4, 0)]
        number = struct.unpack_from("<I", request, 2)[0]
        if number == 1 and busy.pop("once", False):
            return [struct.pack("<BxHH", 6, 1, 2)]
        return [struct.pack("<BxI", 4, number)]

    slave = ScriptedSlave(react)
    progress: list[int] = []
    slave.run(write_file(slave.box(), "fw.bin", data, password=0x1234, on_progress=progress.append))
    assert slave.requests[0] == struct.pack("<BxI", 2, 0x1234) + b"fw.bin"
    packets = {struct.unpack_from("<I", r, 2)[0]: r[6:] for r in slave.requests[1:]}
    assert b"".join(packets[n] for n in sorted(packets)) == data
    assert len(packets[max(packets)]) < 128 - 12, "the last packet is short"
    assert progress[-1] == length


def test_a_refusal_comes_in_words() -> None:
    slave = ScriptedSlave(lambda _: [struct.pack("<BxI", 5, 0x8008) + b"use BOOT"])
    with pytest.raises(Rejected, match=r"only possible in the BOOT state: use BOOT \(FoE 0x8008\)"):
        slave.run(write_file(slave.box(), "fw.bin", b"x", password=0, on_progress=lambda _: None))


def test_a_drive_that_falls_silent_ends_the_download_in_its_time() -> None:
    def react(request: bytes) -> list[bytes]:
        return [struct.pack("<BxI", 4, 0)] if request[0] == 2 else []

    slave = ScriptedSlave(react)
    with pytest.raises(LinkTimeout):
        slave.run(write_file(slave.box(), "f", FILE, password=0, on_progress=lambda _: None))
    assert 10 < slave.now < 10.5


def test_a_drive_that_is_busy_for_ever_does_not_hang_us() -> None:
    def react(request: bytes) -> list[bytes]:
        return [struct.pack("<BxI", 4, 0) if request[0] == 2 else struct.pack("<BxHH", 6, 1, 2)]

    slave = ScriptedSlave(react)
    with pytest.raises(DriveError, match="busy for 10 s with packet 1"):
        slave.run(write_file(slave.box(), "f", FILE, password=0, on_progress=lambda _: None))


class Loading:
    """Loads `FILE` into the first drive and keeps what was reported meanwhile."""

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.reported: list[tuple[float, str]] = []

    async def load(self, **options: str) -> str:
        return await self.bus.link.load_firmware(
            1,
            "app.efw",
            FILE,
            lambda share, text: self.reported.append((share, str(text))),
            **options,  # type: ignore[arg-type]
        )

    async def works(self) -> None:
        """The drive is in PREOP and its mailboxes are those of PREOP again."""
        assert await self.bus.link.read(1, STATUS) == b"\x50\x02"
        await until(lambda: "PREOP" in str(self.bus.link.quality(1).state), 30.0)


@pytest.fixture
def calm(rig: Rig) -> Rig:
    rig.do("firmware", slave=0)
    return rig


@pytest.mark.long
async def test_the_file_is_loaded_in_boot_and_the_drive_comes_back(calm: Rig) -> None:
    async with calm.link() as bus:
        loading = Loading(bus)
        assert await loading.load() == "BOOT"
        assert calm.do("files", slave=0) == {"app.efw": hashlib.sha256(FILE).hexdigest()}
        assert loading.reported[0] == (0.0, "going to BOOT")
        shares = [share for share, _ in loading.reported]
        assert shares == sorted(shares)
        assert any("of 4000 bytes: do not switch off" in text for _, text in loading.reported)
        await loading.works()


@pytest.mark.long
async def test_nothing_else_is_asked_of_a_drive_that_is_being_loaded(calm: Rig) -> None:
    calm.do("timing", slave=0, sdo_s=0.05)
    async with calm.link() as bus:
        loading = Loading(bus)
        task = asyncio.create_task(loading.load())
        await until(lambda: any("bytes" in text for _, text in loading.reported), 30.0)
        with pytest.raises(Busy, match="being loaded with firmware"):
            await bus.link.read(1, STATUS)
        with pytest.raises(Busy, match="cannot move"):
            await bus.link.write(1, CONTROL, b"\x02\0")
        assert await bus.link.read(2, STATUS) == b"\x50\x02", "the neighbour is served"
        assert await task == "BOOT"
        calm.do("timing", slave=0, sdo_s=0.0003)
        await loading.works()


@pytest.mark.long
async def test_a_drive_without_boot_takes_the_file_in_preop(calm: Rig) -> None:
    calm.do("refuse", slave=0, state="BOOT", code=0x0013)
    try:
        async with calm.link() as bus:
            loading = Loading(bus)
            assert await loading.load() == "PREOP"
            await loading.works()
            with pytest.raises(NotAllowed, match=r"refuses BOOT.*no bootstrap state"):
                await loading.load(where="BOOT")
            await loading.works()
    finally:
        calm.do("refuse", slave=0, state="BOOT", code=None)


async def test_a_file_that_is_only_taken_in_boot_is_refused_in_preop(calm: Rig) -> None:
    calm.do("firmware", slave=0, boot_only=True)
    async with calm.link() as bus:
        loading = Loading(bus)
        with pytest.raises(Rejected, match="only possible in the BOOT state") as caught:
            await loading.load(where="PREOP")
        assert "after 0 of 4000 bytes" in caught.value.message
        await loading.works()
        assert await loading.load() == "BOOT"


async def test_a_file_that_is_refused_leaves_the_drive_as_it_was(calm: Rig) -> None:
    calm.do("firmware", slave=0, refuse=0x8012, text="for 400 W only")
    async with calm.link() as bus:
        loading = Loading(bus)
        with pytest.raises(Rejected, match="not compatible: for 400 W only") as caught:
            await loading.load()
        assert caught.value.message.endswith("the drive is back in PREOP")
        await loading.works()


@pytest.mark.long
async def test_a_failure_in_the_middle_says_that_there_is_no_firmware_now(calm: Rig) -> None:
    calm.do("firmware", slave=0, fail_at=1999)
    async with calm.link() as bus:
        loading = Loading(bus)
        with pytest.raises(Rejected) as caught:
            await loading.load()
        assert "flash memory error" in caught.value.message
        # 1500 bytes are three packets of the 500 that a BOOT mailbox of 512 holds.
        assert "after 1500 of 4000 bytes" in caught.value.message
        assert "no valid firmware" in caught.value.message
        assert "load it again before you switch anything off" in caught.value.message
        calm.do("firmware", slave=0, busy=1)
        assert await loading.load() == "BOOT", "once more, and it is well again"
        await loading.works()
