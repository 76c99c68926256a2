"""Our host and slaves that are not ours: see `plain_slaves`, which shares no line with our own."""

from __future__ import annotations

import asyncio
import contextlib
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.cia402 import Mode, State
from drivers.errors import DriveError, LinkLost, NotAllowed, Rejected
from drivers.ethercat.exchange.mapping import Entry, Pdo, alone
from drivers.ethercat.exchange.setup import FoundInPart, StationSetup, check_places
from drivers.ethercat.link import EthercatLink
from drivers.ethercat.process.stations.station import Station, identify
from drivers.ethercat.wire.steps import Read, Steps, Write
from drivers.link import Address, CyclicSignal, Envelope, Trajectory
from drivers.objects.dictionary import EntryDescription, ObjectInfo
from drivers.texts.message import prose
from drivers.virtual.wires.netns import Namespace
from profiles.schema import PdoSet, PdoSpec, Profile
from tests.wire.ethercat_host.conftest import Bus, until
from tests.wire.ethercat_host.plain_slaves import LONG, Coupler, Servo, Slave, category
from tests.wire.ethercat_host.servo_device import servo_profile

HERE = Path(__file__).parent
SERVO, BARE, FIXED, PACKED = 3, 4, 5, 6
RECORD = [Address(0x2000, 0, "UINT8"), Address(0x2000, 1, "UINT16"), Address(0x2000, 2, "UINT16")]


@pytest.fixture(scope="module")
def wire(namespace: Namespace) -> Iterator[Namespace]:
    """Coupler, digital outputs, and four servo drives behind them."""
    process = namespace.popen(
        [
            sys.executable,
            str(HERE / "plain_slaves.py"),
            "ec0s",
            "coupler,outputs,servo,bare,fixed,packed",
        ],
        stdout=subprocess.PIPE,
    )
    assert process.stdout is not None
    assert process.stdout.readline().strip() == "ready"
    yield namespace
    process.kill()
    process.wait()
    process.stdout.close()


@pytest.fixture
async def bus(wire: Namespace) -> Bus:
    # Replies are awaited: these slaves repeat no mail, and a busy machine is no trouble of theirs.
    return Bus(EthercatLink("ec0m", launcher=wire.command([]), lockstep=1.0))


def odd_profile() -> Profile:
    """Fixed process data: outputs 1600h on sync manager 3, inputs 1A00h on 2."""
    base = servo_profile(remappable=False, dc=False)
    spec = PdoSpec(
        sets=(
            PdoSet(index=0x1600, direction="rx", source="test", entries=("6040:00", "607A:00")),
            PdoSet(index=0x1A00, direction="tx", source="test", entries=("6041:00", "6064:00")),
        ),
        default_rx=0x1600,
        default_tx=0x1A00,
        max_entries=2,
        remappable=False,
        sync_modes=("SM",),
        source="test",
    )
    fields = {name: getattr(base, name) for name in Profile.model_fields}
    return Profile(**(fields | {"pdo": spec}))


async def test_couplers_and_plain_slaves_share_the_segment_with_a_drive(bus: Bus) -> None:
    await bus.link.open()
    try:
        coupler, outputs, servo, *_ = await bus.link.scan(lambda _s, _t: None)
        assert [f.vendor_id for f in (coupler, outputs, servo)] == [0xBAD] * 3
        for plain in (coupler, outputs):
            assert any(note.code == "ethercat.note-no-mailbox" for note in plain.notes)
            assert plain.serial is None
        assert servo.name == "ODD-1 drive"
        assert servo.serial == 0xC0FFEE
        assert servo.state == prose("PREOP"), "the error it was left with has been acknowledged"
        assert servo.notes[0].params["station"] == 2
        with pytest.raises(NotAllowed, match="has no mailbox"):
            await bus.link.read(1, RECORD[0])
    finally:
        await bus.link.close()


async def test_a_drive_with_a_mailbox_unlike_ours_is_read_and_written(bus: Bus) -> None:
    await bus.link.open()
    try:
        await bus.link.scan(lambda _s, _t: None)
        for _ in range(4):
            answers = await bus.link.read_many(SERVO, [*RECORD, Address(0x7777, 0, "UINT8")])
            assert answers[:3] == [b"\x02", b"\x11\x22", b"\x33\x44"]
            refused = answers[3]
            assert isinstance(refused, Rejected), "an abort as response 84h"
            assert refused.abort_code == 0x06020000
        await bus.link.write(SERVO, RECORD[1], b"\x55\x66")
        assert await bus.link.read(SERVO, RECORD[1]) == b"\x55\x66"
        await bus.link.write(SERVO, RECORD[1], b"\x11\x22")
        with pytest.raises(Rejected, match="can only be read"):
            await bus.link.write(SERVO, Address(0x1C12, 0, "UINT8"), b"\0")
        with pytest.raises(DriveError, match="mailbox"):
            await bus.link.enumerate(SERVO, lambda _s, _t: None)
        assert await bus.link.read(SERVO, RECORD[0]) == b"\x02"
        assert any("emergency 0x8130" in text for text in bus.texts)
    finally:
        await bus.link.close()


@pytest.mark.long
async def test_its_fixed_process_data_on_swapped_sync_managers_move_it(bus: Bus) -> None:
    await bus.link.open()
    cyclic = bus.link.process_data
    try:
        await bus.link.scan(lambda _s, _t: None)
        bus.link.attach(SERVO, odd_profile())
        mapped = await cyclic.configure(
            [CyclicSignal(SERVO, Address(0x6064, 0, "INT32"), "position")],
            [CyclicSignal(SERVO, Address(0x607A, 0, "INT32"), "target")],
            0.004,
        )
        assert {signal.channel for signal in mapped} == {"position", "target"}
        assert cyclic.dc is False
        await cyclic.start()
        positions: list[float] = []
        cyclic.blocks(lambda b: positions.extend(b.samples[:, b.channels.index("position")]))
        await cyclic.drive_to(SERVO, State.OPERATION_ENABLED, Mode.CSP)
        await until(lambda: cyclic.axis_state(SERVO)[0] == "Operation enabled", 30.0)
        values = np.arange(0, 500, 5, dtype=np.int64)
        target = Address(0x607A, 0, "INT32")
        await cyclic.run([Trajectory(SERVO, target, values, Envelope())])
        await asyncio.sleep(0.2)
        assert max(positions) == 495
        assert positions == sorted(positions)
        await cyclic.stop()
    finally:
        await bus.link.close()


@pytest.mark.long
async def test_a_drive_with_a_bare_eeprom_is_read_whole_and_moved_by_nobody(bus: Bus) -> None:
    await bus.link.open()
    try:
        bare = (await bus.link.scan(lambda _s, _t: None))[BARE - 1]
        assert (bare.name, bare.serial, bare.state) == ("ODD-1 drive", 0xC0FFEE, prose("PREOP"))
        assert any(note.code == "ethercat.note-eeprom-checksum" for note in bare.notes)
        described = await bus.link.enumerate(BARE, lambda _s, _t: None)
        objects = {d.index: d for d in described if isinstance(d, ObjectInfo)}
        entries = {(d.index, d.subindex): d for d in described if isinstance(d, EntryDescription)}
        assert [i for i in objects if 0x3000 <= i < 0x4000] == list(range(0x3000, 0x3000 + 300))
        assert objects[0x3123].name == f"3123 {LONG}".strip()
        assert entries[0x1018, 4].name == f"entry 4 {LONG}".strip()
        assert entries[0x1018, 4].bit_length == 32
        assert await bus.link.read(BARE, Address(0x3123, 0, "UINT16")) == b"\x23\x01"
        bus.link.attach(BARE, odd_profile())
        with pytest.raises(NotAllowed, match="EEPROM does not describe its process data"):
            await bus.link.process_data.configure(
                [CyclicSignal(BARE, Address(0x6064, 0, "INT32"), "position")],
                [CyclicSignal(BARE, Address(0x607A, 0, "INT32"), "target")],
                0.004,
            )
    finally:
        await bus.link.close()


@pytest.mark.long
async def test_a_mapping_that_can_only_be_read_is_reported_and_left_assigned(bus: Bus) -> None:
    await bus.link.open()
    try:
        await bus.link.scan(lambda _s, _t: None)
        bus.link.attach(FIXED, servo_profile(remappable=True, dc=False))
        position = CyclicSignal(FIXED, Address(0x6064, 0, "INT32"), "position")
        speed = CyclicSignal(FIXED, Address(0x606C, 0, "INT32"), "speed")
        target = CyclicSignal(FIXED, Address(0x607A, 0, "INT32"), "target")
        with pytest.raises(NotAllowed, match="1A00:00") as refused:
            await bus.link.process_data.configure([position, speed], [target], 0.004)
        assert "ESI" in (refused.value.remedy or "")
        assigned = [Address(0x1C12, 0, "UINT8"), Address(0x1C12, 1, "UINT16")]
        assert await bus.link.read_many(FIXED, assigned) == [b"\x01", b"\x00\x1a"]
        await bus.link.process_data.configure([position], [target], 0.004)  # what it has anyway
    finally:
        await bus.link.close()


@pytest.mark.long
async def test_a_drive_with_another_complete_access_and_no_divider_is_taken_to_op(bus: Bus) -> None:
    """So an independent slave stack is: no complete access of SOEM's kind, 0400h at 0."""
    await bus.link.open()
    cyclic = bus.link.process_data
    try:
        await bus.link.scan(lambda _s, _t: None)
        bus.link.attach(PACKED, odd_profile())
        await cyclic.configure(
            [CyclicSignal(PACKED, Address(0x6064, 0, "INT32"), "position")],
            [CyclicSignal(PACKED, Address(0x607A, 0, "INT32"), "target")],
            0.004,
        )
        await cyclic.start()
        await cyclic.drive_to(PACKED, State.OPERATION_ENABLED, Mode.CSP)
        await until(lambda: cyclic.axis_state(PACKED)[0] == "Operation enabled", 30.0)
        await cyclic.stop()
    finally:
        await bus.link.close()


def answered(steps: Steps[None], slave: Slave) -> None:
    """Run a transaction with this slave."""
    reply: bytes | None = None
    with contextlib.suppress(StopIteration):
        while True:
            step = steps.send(reply)
            if isinstance(step, Read):
                reply = slave.read(step.register, step.size)
            elif isinstance(step, Write):
                reply = b"" if slave.write(step.register, step.data) else None
            else:
                reply = b""


@pytest.mark.parametrize(("slave", "badly"), [(Servo(), True), (Coupler(), False)])
def test_a_mailbox_that_a_search_missed_is_distinguished_from_none_at_all(
    slave: Slave, badly: bool
) -> None:
    """Frames with its EEPROM were lost, so its sync managers were never set up."""
    station = Station(1)
    answered(identify(station, time.monotonic), slave)
    assert station.badly_found is badly
    with pytest.raises(LinkLost if badly else NotAllowed, match="in part" if badly else "mailbox"):
        _ = station.box


@pytest.mark.parametrize(("filling", "says"), [(0, "in part"), (4200, "more than 4096 bytes")])
def test_sync_managers_too_far_back_in_the_eeprom_are_reported_as_such(
    filling: int, says: str
) -> None:
    """SOEM reads 4096 bytes of an EEPROM: to search again would not help."""

    class Wordy(Servo):
        body = category(10, bytes(filling)) + Servo.body

    setup = StationSetup(
        rx=alone(Pdo(0x1600, (Entry(0x6040, 0, 2, "H"),), write=False)),
        tx=alone(Pdo(0x1A00, (Entry(0x6041, 0, 2, "H"),), write=False)),
        cycle_ns=1_000_000,
        dc=False,
        watchdog_ms=50.0,
    )
    steps = check_places(Station(1), setup, time.monotonic)
    with pytest.raises(DriveError, match=says) as reported:
        answered(steps, Wordy())
    assert isinstance(reported.value, FoundInPart) is (filling == 0)
