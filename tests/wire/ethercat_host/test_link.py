"""The link on a real wire: finding, reading, writing, and trouble without cyclic data."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import subprocess
import sys
import textwrap
import time

import pytest

from drivers.errors import Busy, DriveError, LinkLost, LinkTimeout, NotAllowed, Rejected
from drivers.ethercat.link import EthercatLink
from drivers.ethercat.wire.al_status import AlState
from drivers.link import Address
from drivers.objects.dictionary import EntryDescription
from drivers.texts.message import prose, text
from drivers.virtual.wires.netns import Namespace, child_environment
from tests.support.machine import OwnTime
from tests.wire.ethercat_host.conftest import Rig, repeated, until

STATUS = Address(0x6041, 0, "UINT16")
RECORD = [
    Address(0x2001, 0, "UINT8"),
    Address(0x2001, 1, "UINT16"),
    Address(0x2001, 2, "UINT8"),
    Address(0x2001, 3, "UINT32"),
]
LONG = Address(0x2002, 0, "OCTETS")


def quiet(_share: float, _text: str) -> None:
    pass


@pytest.mark.long
async def test_scan_tells_identity_place_and_state(rig: Rig) -> None:
    async with rig.link(scan=False) as bus:
        steps: list[float] = []
        found = await bus.link.scan(lambda share, _text: steps.append(share))
        assert [f.station for f in found] == [1, 2]
        first, second = found
        assert (first.vendor_id, first.product_code, first.revision) == (0xABCD, 0x1234, 0x10002)
        assert first.serial == 77, "1018:04 goes before the EEPROM"
        assert first.name == "DICT-1 drive"
        assert first.state == prose("PREOP")
        assert first.notes[0] == text("ethercat.note-behind-computer")
        assert second.notes[0] == text("ethercat.note-behind-station", station=1, port=1)
        assert steps == [0.5, 1.0]
        only = await bus.link.scan(quiet, stations=[2])
        assert [f.station for f in only] == [2]


async def test_reading_needs_no_scan_before(rig: Rig) -> None:
    async with rig.link(scan=False) as bus:
        assert await bus.link.read(1, STATUS) == b"\x50\x02"
        with pytest.raises(LinkLost, match="no station 9 on ec0m: 2 were found"):
            await bus.link.read(9, STATUS)


async def test_read_many_mixes_whole_objects_single_ones_and_refusals(rig: Rig) -> None:
    async with rig.link() as bus:
        frames = rig.do("state")["frames"]  # type: ignore[index]
        answers = await bus.link.read_many(
            1, [*RECORD, Address(0x7777, 0, "UINT16"), Address(0x1008, 0, "STRING")]
        )
        assert answers[:4] == [b"\x03", b"\x22\x11", b"\x33", b"\x77\x66\x55\x44"]
        refused = answers[4]
        assert isinstance(refused, Rejected)
        assert refused.abort_code == 0x06020000
        assert refused.parameter == "7777:00"
        assert answers[5] == b"DICT-1 drive"
        assert rig.do("state")["frames"] - frames < 60  # type: ignore[index]


async def test_asking_who_one_station_is_leaves_the_others_alone(rig: Rig) -> None:
    async with rig.link() as bus:
        # Whoever is reset now does not come back.
        rig.do("refuse", slave=0, state="PREOP", code=0x0001)
        (found,) = await bus.link.scan(quiet, stations=[2])
        assert found.station == 2
        assert found.serial == 77
        assert await bus.link.read(1, STATUS) == b"\x50\x02"
        every = await bus.link.scan(quiet)
        assert "INIT" in str(every[0].state), "a whole search resets everybody"


@repeated
async def test_a_search_does_not_end_what_healthy_drives_were_asked_before(rig: Rig) -> None:
    async with rig.link() as bus:
        rig.do("timing", sdo_s=0.01)
        reading = [asyncio.create_task(bus.link.read_many(n, RECORD)) for n in (1, 2, 1, 2)]
        await asyncio.sleep(0.005)
        await bus.link.scan(quiet)
        for answers in await asyncio.gather(*reading):
            assert all(isinstance(answer, bytes) for answer in answers), answers


async def test_write_long_and_short_and_refused(rig: Rig) -> None:
    async with rig.link() as bus:
        await bus.link.write(1, RECORD[1], b"\xcd\xab")
        assert rig.do("read", slave=0, index=0x2001, subindex=1) == "cdab"
        whole = bytes(n % 251 for n in range(1400))
        await bus.link.write(1, LONG, whole)
        assert await bus.link.read(1, LONG) == whole
        with pytest.raises(Rejected, match="can only be read") as caught:
            await bus.link.write(1, STATUS, b"\0\0")
        assert caught.value.parameter == "6041:00"


async def test_the_drive_describes_its_own_dictionary(rig: Rig) -> None:
    async with rig.link() as bus:
        found = await bus.link.enumerate(1, quiet)
        entries = {(e.index, e.subindex): e for e in found if isinstance(e, EntryDescription)}
        assert entries[0x2001, 3].bit_length == 32
        assert entries[0x6041, 0].access & 0x80, "mappable to inputs"


async def test_a_refused_state_comes_with_the_reason(rig: Rig) -> None:
    rig.do("refuse", slave=0, state="SAFEOP", code=0x001D)
    async with rig.link() as bus:
        with pytest.raises(
            NotAllowed, match=r"refuses SAFEOP and is in PREOP \+ error: invalid output config"
        ):
            await bus.link.set_state(1, AlState.SAFEOP)
        await bus.link.set_state(1, AlState.INIT)
        await bus.link.set_state(1, AlState.PREOP)
        assert await bus.link.read(1, STATUS) == b"\x50\x02", "the error was acknowledged"


@pytest.mark.long
async def test_slow_states_and_slow_answers_are_waited_for(rig: Rig) -> None:
    rig.do("timing", al_s=0.4, sdo_s=0.2)
    async with rig.link(scan=False) as bus:
        found = await bus.link.scan(quiet)
        assert [f.state for f in found] == [prose("PREOP")] * 2


@pytest.mark.long
@repeated
async def test_an_answer_that_comes_too_late_is_not_taken_for_another(rig: Rig) -> None:
    async with rig.link() as bus:
        rig.do("timing", slave=0, sdo_s=1.3)
        late = pytest.raises(LinkTimeout, match="did not answer in time")
        with OwnTime(with_children=True) as took, late:
            await bus.link.read(1, RECORD[1])
        assert took.s < 1.5
        rig.do("timing", slave=0, sdo_s=0.0003)
        assert await bus.link.read(1, RECORD[3]) == b"\x77\x66\x55\x44"
        assert await bus.link.read(2, STATUS) == b"\x50\x02"


@pytest.mark.long
async def test_a_mute_mailbox_times_out_and_comes_back(rig: Rig) -> None:
    async with rig.link() as bus:
        rig.do("mute", slave=0)
        with OwnTime(with_children=True) as took:
            answers = await bus.link.read_many(1, [STATUS, *RECORD])
        assert took.s < 3.5, "not one time-out per parameter"
        assert all(isinstance(a, LinkTimeout) for a in answers)
        assert await bus.link.read(2, STATUS) == b"\x50\x02", "the neighbour is served meanwhile"
        rig.do("mute", slave=0, on=False)
        assert await bus.link.read(1, RECORD[3]) == b"\x77\x66\x55\x44"


@pytest.mark.long
@repeated
async def test_dying_in_the_middle_of_a_segmented_upload_does_not_hang(rig: Rig) -> None:
    async with rig.link() as bus:
        await bus.link.write(1, LONG, bytes(1400))
        rig.do("die_in_transfer", slave=0, after_segments=1)
        slowest = 0.0
        with OwnTime(with_children=True) as took:
            reading = asyncio.create_task(bus.link.read(1, LONG))
            while not reading.done():
                with OwnTime(with_children=True) as one:
                    await bus.link.read(2, STATUS)
                slowest = max(slowest, one.s)
            with pytest.raises(LinkTimeout):
                await reading
        assert took.s < 4.0
        assert slowest < 0.8, "not the time-out of the neighbour"
        rig.do("die_in_transfer", slave=0, after_segments=None)
        rig.do("mute", slave=0, on=False)
        assert await bus.link.read(1, STATUS) == b"\x50\x02"
        assert bus.link.quality().details["host_restarts"] == 0


@pytest.mark.long
async def test_a_cut_cable_is_reported_and_heals_by_itself(rig: Rig) -> None:
    async with rig.link() as bus:
        rig.do("cut", cable=1)
        await bus.reported("station 2", "no longer answers")
        with pytest.raises(LinkLost, match="does not answer"):
            await bus.link.read(2, STATUS)
        assert await bus.link.read(1, STATUS) == b"\x50\x02"
        assert not bus.link.quality(2).connected
        rig.do("heal")
        await bus.reported("station 2", "answers again")
        assert await bus.link.read(2, STATUS) == b"\x50\x02"
        survey = await bus.link.survey()
        assert len(survey.stations) == 2
        assert any(
            "cable between station 1 and station 2: the link was lost" in finding.text.words()
            for finding in survey.findings
        )


@pytest.mark.long
async def test_a_power_cycle_is_reported_and_the_drive_is_taken_up_again(rig: Rig) -> None:
    async with rig.link() as bus:
        rig.do("power_cycle", slave=1, off_s=0.4)
        await bus.reported("station 2", "no longer answers")
        await bus.reported("station 2", "was switched on again")
        assert await bus.link.read(2, STATUS) == b"\x50\x02"


@pytest.mark.long
@repeated
async def test_lost_late_and_damaged_frames_cost_time_but_no_value(rig: Rig) -> None:
    async with rig.link() as bus:
        for trouble in (
            {"command": "lose", "chance": 0.05},
            {"command": "lose", "chance": 0.05, "direction": "out"},
            {"command": "late", "by_s": 0.003, "chance": 0.05},
            {"command": "corrupt", "slave": 0, "chance": 0.05, "count": None},
        ):
            rig.do(**trouble)  # type: ignore[arg-type]
            for number in range(8):
                value = number.to_bytes(2, "little")
                await bus.link.write(1, RECORD[1], value)
                assert await bus.link.read(1, RECORD[1]) == value
            rig.do("peace")


@repeated
async def test_a_heap_of_late_frames_is_never_taken_for_answers(rig: Rig) -> None:
    """SOEM's index has four bits: 16 frames too late would answer for ever."""
    async with rig.link() as bus:
        rig.do("late", by_s=0.05, count=40)
        for _ in range(3):
            with contextlib.suppress(DriveError):
                await bus.link.read(1, STATUS)
        rig.do("peace")
        await until(lambda: bus.link.quality(1).state != text("link.no-answer"), 30.0)
        for number in range(1, 20):
            value = number.to_bytes(2, "little")
            await bus.link.write(1, RECORD[1], value)
            assert await bus.link.read(1, RECORD[1]) == value
        await until(lambda: int(bus.link.quality().details["late_frames"]) > 0, 30.0)


@pytest.mark.long
async def test_a_busy_eeprom_ends_in_words(rig: Rig) -> None:
    rig.do("eeprom_busy", slave=0, for_s=1.0)
    async with rig.link(scan=False) as bus:
        started = time.monotonic()
        await bus.link.scan(quiet)
        assert time.monotonic() - started < 30
        await asyncio.sleep(max(0.0, 1.1 - (time.monotonic() - started)))
        found = await bus.link.scan(quiet)
        assert found[0].product_code == 0x1234


async def test_an_emergency_is_reported_once(rig: Rig) -> None:
    async with rig.link() as bus:
        rig.do("inject", slave=0, what="emergency", value=0x8611)
        text = await bus.reported("emergency 0x8611")
        assert text == "station 1: emergency 0x8611, error register 0x01, data 01 02 03 04 05"
        assert await bus.link.read(1, STATUS) == b"\x50\x02"
        assert sum("0x8611" in t for t in bus.texts) == 1


@pytest.mark.long
@repeated
async def test_the_alias_is_written_with_its_checksum(rig: Rig) -> None:
    async with rig.link() as bus:
        await bus.link.set_alias(2, 1234)
        rig.do("power_cycle", slave=1, off_s=0.1)
        await bus.reported("station 2", "was switched on again")
        found = await bus.link.scan(quiet)
        assert [f.alias for f in found] == [0, 1234]
        await bus.link.set_alias(2, 0)
        bus.events.clear()
        rig.do("power_cycle", slave=1, off_s=0.1)
        await bus.reported("station 2", "was switched on again")


@pytest.mark.long
async def test_a_second_master_on_the_same_interface_is_refused(rig: Rig) -> None:
    async with rig.link():
        second = EthercatLink("ec0m", launcher=rig.namespace.command([]))
        with pytest.raises(Busy, match="already uses the interface ec0m"):
            await second.open()
        await second.close()


@pytest.mark.parametrize(
    ("name", "words"),
    [("x" * 16, "1 to 15 characters"), ("nosuch0", "no network interface 'nosuch0'")],
)
async def test_wrong_interfaces_end_in_words(rig: Rig, name: str, words: str) -> None:
    link = EthercatLink(name, launcher=rig.namespace.command([]))
    with pytest.raises(LinkLost, match=words):
        await link.open()
    assert link.quality().connected is False
    await link.close()


async def test_a_hung_host_is_killed_and_replaced(rig: Rig) -> None:
    async with rig.link() as bus:
        first = bus.link._host.pid
        assert first is not None
        os.kill(first, signal.SIGSTOP)
        waiting = asyncio.create_task(bus.link.read(1, STATUS))
        await bus.reported("did not respond while", "was ended")
        with pytest.raises(LinkLost):
            await waiting
        await bus.reported("runs again")
        assert await bus.link.read(1, STATUS) == b"\x50\x02"
        assert bus.link._host.pid != first
        assert bus.link.quality().details["host_restarts"] == 1


@pytest.mark.long
async def test_a_killed_and_restarted_segment_is_found_again(rig: Rig) -> None:
    async with rig.link() as bus:
        rig.segment.kill()
        await bus.reported("station 1", "no longer answers")
        rig.segment.close()
        rig.start()
        await bus.reported("station 1", "was switched on again")
        await bus.reported("station 2", "was switched on again")
        assert await bus.link.read(2, STATUS) == b"\x50\x02"


@pytest.mark.long
async def test_no_descriptor_is_left_behind(rig: Rig) -> None:
    async with rig.link():
        pass
    before = len(os.listdir("/proc/self/fd"))  # noqa: PTH208
    for _ in range(2):
        async with rig.link():
            pass
    await until(lambda: len(os.listdir("/proc/self/fd")) <= before, 30.0)  # noqa: PTH208


def test_hazards_of_pysoem_are_guarded(namespace: Namespace, rig: Rig) -> None:
    """In a process of its own: each of these crashed or corrupted an unguarded one."""
    script = textwrap.dedent(
        """
        import os, socket
        from drivers.errors import DriveError
        from drivers.ethercat.process.segment import IO_MAP_BYTES, Segment

        def refused(call):
            try:
                call()
            except DriveError as error:
                return error.message
            raise SystemExit(f"{call} was not refused")

        descriptors = lambda: sorted(os.listdir("/proc/self/fd"))
        never = Segment("ec0m"); never.close(); never.close()
        os.fstat(0)
        before = descriptors()
        for name in ("x" * 16, "", "nosuch0", "lo0"):
            refused(Segment(name).open)
        segment = Segment("ec0m"); segment.open(); segment.close()
        assert descriptors() == before, "a descriptor leaked"
        stranger = os.open("/dev/null", os.O_RDONLY)
        segment.close(); os.fstat(stranger); os.close(stranger)
        segment = Segment("ec0m"); segment.open()
        assert segment.find() == 2
        print(refused(lambda: segment.set_output(1, b"x" * 6)))
        print(refused(lambda: segment.map(IO_MAP_BYTES + 1)))
        segment.map(64)
        print(refused(lambda: segment.set_output(1, b"x" * 500)))
        segment.close(); os.fstat(0)
        assert descriptors() == before, "a descriptor leaked"
        """
    )
    result = subprocess.run(
        namespace.command([sys.executable, "-c", script]),
        capture_output=True,
        text=True,
        check=False,
        env=child_environment(),
        timeout=30,
    )
    assert result.returncode == 0, result.stderr
    lines = result.stdout.splitlines()
    assert "no process data before they are mapped" in lines[0]
    assert "4096 are possible" in lines[1]
    assert "bytes of outputs, 500 were given" in lines[2]
