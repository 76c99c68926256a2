"""The EtherCAT host as on Windows and macOS, over virtual segments in a private network.

Nothing is used that Linux alone has: registers by SOEM's own calls, messages by the standard input
and output of the process, samples through a file, no recorder of frames. Trouble on the wire, STOP
and firmware are tested by the same tests as on Linux.
"""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest

from drivers.computer.timing.lateness import EDGES_US
from drivers.errors import DriveError, NotAllowed
from drivers.ethercat.exchange import segmentcyclic
from drivers.ethercat.link import EthercatLink
from drivers.ethercat.process import punctuality
from drivers.ethercat.process.punctuality import Kept, Punctuality
from drivers.link import Address, CyclicSignal
from drivers.virtual.wires.ethercat.launch import VirtualSegment
from drivers.virtual.wires.netns import Namespace
from tests.wire.ethercat_host import test_foe, test_link, test_real_time, test_stop
from tests.wire.ethercat_host.conftest import Rig, until

RAW_FRAMES = False
"""Of the rig, see `conftest`."""
CONTROL, STATUS = Address(0x6040, 0, "UINT16"), Address(0x6041, 0, "UINT16")
MODE, TARGET = Address(0x6060, 0, "INT8"), Address(0x607A, 0, "INT32")
ACTUAL, PROFILE_SPEED = Address(0x6064, 0, "INT32"), Address(0x6081, 0, "UINT32")
PROFILE_POSITION = 1
SHUTDOWN, SWITCH_ON, ENABLE, NEW_SETPOINT, QUICK_STOP = 0x06, 0x07, 0x0F, 0x1F, 0x02
"""CiA 402-2, control word."""
PUNCTUAL = Punctuality((10_000, *[0] * len(EDGES_US)))
"""Every cycle over within 1 µs."""

calm = test_foe.calm
test_scan = test_link.test_scan_tells_identity_place_and_state
test_bad_frames = test_link.test_lost_late_and_damaged_frames_cost_time_but_no_value
test_alarm = test_link.test_an_emergency_is_reported_once
test_cut_cable = test_link.test_a_cut_cable_is_reported_and_heals_by_itself
test_power_cycle = test_link.test_a_power_cycle_is_reported_and_the_drive_is_taken_up_again
test_descriptors = test_link.test_no_descriptor_is_left_behind
test_firmware = test_foe.test_the_file_is_loaded_in_boot_and_the_drive_comes_back
test_stop_behind_reads = test_stop.test_on_a_real_wire_a_stop_does_not_wait_behind_reads
test_stop_of_set_up = test_stop.test_a_stop_does_not_wait_for_the_set_up_of_an_exchange
test_halt = test_real_time.test_halt_stops_every_axis
test_cut_in_motion = test_real_time.test_a_cable_cut_in_motion_stops_the_axis_and_heals
test_killed_host = (
    test_real_time.test_killing_the_host_in_motion_stops_the_axis_and_recovers_disabled
)


@pytest.fixture(autouse=True)
def _punctual(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(punctuality, "_folder", lambda: tmp_path)
    Kept("ec0m").write(PUNCTUAL)


async def number(link: EthercatLink, address: Address) -> int:
    return int.from_bytes(await link.read(1, address), "little", signed=True)


async def put(link: EthercatLink, address: Address, value: int) -> None:
    size = int(address.type.removeprefix("U").removeprefix("INT")) // 8
    await link.write(1, address, value.to_bytes(size, "little", signed=value < 0))


def is_state(wanted: int, status: int) -> bool:
    """Whether the status word shows this state (CiA 402-2, mask 6Fh)."""
    return status & 0x6F == wanted


async def reaches(link: EthercatLink, address: Address, wanted: Callable[[int], bool]) -> None:
    """Read it until it is as wanted; each read takes milliseconds."""
    for _ in range(5000):
        if wanted(await number(link, address)):
            return
    raise AssertionError(f"{address} does not get there")


@pytest.fixture
def mms7(namespace: Namespace, rig: Rig) -> Iterator[Rig]:
    """Another drive in the place of the rig's; its time follows the frames."""
    rig.segment.close()
    arguments = ["--drive", "mms7", "--sdo-ms", "0.3", "--lockstep"]
    with VirtualSegment.start("ec0s", arguments, namespace):
        yield rig
    rig.start()


@pytest.mark.long
async def test_jog_in_profile_position_and_stop_without_process_data(mms7: Rig) -> None:
    async with mms7.link() as bus:
        link = bus.link
        assert link.frames is None, "nothing of a recorder is offered"
        await put(link, PROFILE_SPEED, 200_000)
        assert await number(link, PROFILE_SPEED) == 200_000
        await put(link, MODE, PROFILE_POSITION)
        start = await number(link, ACTUAL)
        await put(link, TARGET, start + 20_000_000)
        for word, wanted in ((SHUTDOWN, 0x21), (SWITCH_ON, 0x23), (ENABLE, 0x27)):
            await put(link, CONTROL, word)
            await reaches(link, STATUS, partial(is_state, wanted))
        await put(link, CONTROL, NEW_SETPOINT)
        await reaches(link, ACTUAL, lambda now: now >= start + 1000)
        await put(link, CONTROL, QUICK_STOP)
        await reaches(link, STATUS, lambda now: now & 0x4F == 0x40)
        here = await number(link, ACTUAL)
        assert start + 1000 <= here < start + 20_000_000
        assert await number(link, ACTUAL) == pytest.approx(here, abs=50), "it stands"


@pytest.mark.long
async def test_a_heap_of_late_answers_is_noticed_and_none_of_them_is_used(rig: Rig) -> None:
    """SOEM's index has four bits: 16 answers too late would answer for ever."""
    async with rig.link() as bus:
        os.kill(rig.segment.pid, signal.SIGSTOP)
        for _ in range(3):
            with contextlib.suppress(DriveError):
                await bus.link.read(1, STATUS)
        os.kill(rig.segment.pid, signal.SIGCONT)
        await bus.reported("came too late to be assigned", "opened again")
        await bus.reported("ec0m is back")
        await bus.link.scan(lambda _share, _text: None)
        for value in range(1, 20):
            await bus.link.write(1, test_link.RECORD[1], value.to_bytes(2, "little"))
            assert await number(bus.link, test_link.RECORD[1]) == value


@pytest.mark.long
async def test_process_data_need_a_check_that_allows_the_cycle(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    # So few cycles cannot show 0.1 %: at best 3 of 200, 1.5 %, by the rule of three.
    monkeypatch.setattr(segmentcyclic, "CHECK_S", 0.2)
    signals = [CyclicSignal(1, STATUS, "status"), CyclicSignal(1, ACTUAL, "position")]
    target = [CyclicSignal(1, TARGET, "target")]
    kept = Kept("ec0m")
    kept.write(Punctuality((0, *[0] * len(EDGES_US))))
    async with rig.link() as bus:
        cyclic = bus.link.process_data
        with pytest.raises(NotAllowed) as refused:
            await cyclic.configure(signals, target, 0.004)
        assert refused.value.text.code == "ethercat.process-data-too-late"
        measured = kept.read()
        assert measured is not None
        assert measured.cycles == 200
        kept.write(PUNCTUAL)
        await cyclic.configure(signals, target, 0.004)
        await cyclic.start()
        await until(lambda: bool(cyclic.newest(["status"], 1e9)), 30.0)
        await cyclic.stop()
