"""AL states, their conditions and codes (ETG.1000.6 clause 6.4, table 11)."""

from __future__ import annotations

import struct

import pytest

from .frames import BOOT, IN, INIT, MBX_IN, MBX_OUT, MBX_SIZE, OP, OUT, PREOP, SAFEOP, Wire

ERROR, ACK = 0x10, 0x10


@pytest.fixture
def wire() -> Wire:
    made = Wire()
    made.number()
    return made


def test_up_and_down_through_all_states() -> None:
    wire = Wire()
    wire.to_op()
    for state in (SAFEOP, PREOP, INIT):
        assert wire.request(state) == (state, 0)


@pytest.mark.parametrize(
    ("target", "code"), [(SAFEOP, 0x0011), (OP, 0x0011), (BOOT, 0x0013), (5, 0x0012)]
)
def test_steps_that_do_not_exist_from_init(wire: Wire, target: int, code: int) -> None:
    assert wire.request(target) == (INIT | ERROR, code)


def test_pre_op_to_op_is_not_a_step(wire: Wire) -> None:
    wire.to_preop()
    assert wire.request(OP) == (PREOP | ERROR, 0x0011)


@pytest.mark.parametrize(
    "managers",
    [
        bytes(16),
        struct.pack("<HHBBBBHHBBBB", 0x1000, 128, 0x26, 0, 1, 0, 0x1100, 256, 0x22, 0, 1, 0),
        struct.pack("<HHBBBBHHBBBB", 0x1000, 256, 0x26, 0, 1, 0, 0x1200, 256, 0x22, 0, 1, 0),
        struct.pack("<HHBBBBHHBBBB", 0x1000, 256, 0x22, 0, 1, 0, 0x1100, 256, 0x22, 0, 1, 0),
        struct.pack("<HHBBBBHHBBBB", 0x1000, 256, 0x26, 0, 0, 0, 0x1100, 256, 0x22, 0, 1, 0),
    ],
)
def test_pre_op_needs_the_mailbox_of_the_eeprom(wire: Wire, managers: bytes) -> None:
    wire.write(0x0800, managers)
    assert wire.request(PREOP) == (INIT | ERROR, 0x0016)


def test_an_error_must_be_acknowledged_before_the_state_rises(wire: Wire) -> None:
    wire.request(PREOP)
    assert wire.state() == (INIT | ERROR, 0x0016)
    wire.set_mailbox()
    assert wire.request(PREOP) == (INIT | ERROR, 0x0016)
    assert wire.request(PREOP | ACK) == (PREOP, 0)


def test_a_lower_state_needs_no_acknowledgement(wire: Wire) -> None:
    wire.to_preop()
    assert wire.request(OP) == (PREOP | ERROR, 0x0011)
    assert wire.request(INIT) == (INIT, 0)


def test_asking_for_the_present_state_with_acknowledgement_clears_the_error(wire: Wire) -> None:
    wire.request(OP)
    assert wire.request(INIT | ACK) == (INIT, 0)


@pytest.mark.parametrize(
    ("sizes", "code"), [((5, 8), 0x001D), ((0, 8), 0x001D), ((6, 7), 0x001E), ((6, 0), 0x001E)]
)
def test_safe_op_needs_sync_managers_as_long_as_the_mapping(
    wire: Wire, sizes: tuple[int, int], code: int
) -> None:
    wire.to_preop()
    wire.set_process_data(out_size=sizes[0], in_size=sizes[1])
    assert wire.request(SAFEOP) == (PREOP | ERROR, code)


def test_safe_op_needs_sync_managers_the_right_way_round(wire: Wire) -> None:
    wire.to_preop()
    wire.set_process_data()
    wire.write(0x0818, struct.pack("<HHBBBB", IN, 8, 0x24, 0, 1, 0))
    assert wire.request(SAFEOP) == (PREOP | ERROR, 0x001E)


def test_a_mapping_that_the_drive_no_longer_accepts(wire: Wire) -> None:
    wire.to_preop()
    wire.download(0x1C12, 0, b"\x00")
    wire.download(0x1600, 0, b"\x00")
    wire.download(0x1600, 1, struct.pack("<I", 0x60400010))
    wire.download(0x1600, 0, b"\x01")
    wire.download(0x1C12, 1, b"\x00\x16")
    wire.download(0x1C12, 0, b"\x01")
    wire.set_process_data(out_size=2)
    profile = wire.device.profile
    wire.device.profile = profile.model_copy(
        update={"parameters": tuple(p for p in profile.parameters if p.key != "6040:00")}
    )
    assert wire.request(SAFEOP) == (PREOP | ERROR, 0x0025)


def test_op_waits_for_the_first_outputs(wire: Wire) -> None:
    wire.to_safeop()
    assert wire.request(OP) == (SAFEOP, 0)
    wire.clock.time_ns += 8_000_000_000
    assert wire.state() == (SAFEOP, 0)
    wire.write(OUT, wire.outputs())
    assert wire.state() == (OP, 0)


def test_op_waits_for_the_first_sync0(wire: Wire) -> None:
    wire.to_preop()
    wire.set_process_data()
    wire.write(0x0990, struct.pack("<Q", 100_000_000))
    wire.write(0x09A0, struct.pack("<I", 1_000_000))
    wire.write(0x0981, b"\x03")
    wire.request(SAFEOP)
    wire.request(OP)
    wire.write(OUT, wire.outputs())
    wire.clock.time_ns = 99_999_999
    assert wire.state() == (SAFEOP, 0)
    wire.clock.time_ns = 100_000_000
    wire.write(OUT, wire.outputs())
    assert wire.state() == (OP, 0)


def test_op_gives_up_when_no_outputs_come(wire: Wire) -> None:
    wire.to_safeop()
    wire.request(OP)
    wire.clock.time_ns += 9_000_000_001
    assert wire.state() == (SAFEOP | ERROR, 0x001B)


def test_transitions_take_their_time(wire: Wire) -> None:
    wire.set_mailbox()
    wire.slaves[0].al.delay_ns = 50_000_000
    assert wire.request(PREOP) == (INIT, 0)
    wire.clock.time_ns += 49_999_999
    assert wire.state() == (INIT, 0)
    wire.clock.time_ns += 1
    assert wire.state() == (PREOP, 0)


def test_a_refused_state_gives_the_code_asked_for(wire: Wire) -> None:
    wire.to_preop()
    wire.set_process_data()
    wire.slaves[0].al.refusals[4] = 0x0017  # type: ignore[index]
    assert wire.request(SAFEOP) == (PREOP | ERROR, 0x0017)


def test_taking_the_mailbox_away_forces_init(wire: Wire) -> None:
    wire.to_preop()
    wire.write(0x0806, b"\x00")
    assert wire.state() == (INIT | ERROR, 0x0016)


def test_taking_process_data_away_in_op_stops_the_drive() -> None:
    wire = Wire()
    wire.to_op()
    wire.write(0x0816, b"\x00")
    assert wire.state() == (PREOP | ERROR, 0x001D)
    assert len(wire.device.lost) == 1


def test_leaving_op_tells_the_drive_and_coming_back_does_not() -> None:
    wire = Wire()
    wire.to_op()
    assert wire.device.lost == []
    wire.request(SAFEOP)
    assert wire.device.lost == ["state SAFEOP"]
    wire.write(OUT, wire.outputs())
    wire.request(OP)
    assert wire.state() == (OP, 0)
    assert wire.device.lost == ["state SAFEOP"]


def boot() -> Wire:
    """A drive in BOOT with the mailboxes that its EEPROM names for it."""
    wire = Wire(foe=True)
    wire.number()
    wire.set_mailbox()
    assert wire.request(BOOT) == (INIT | ERROR, 0x0015), "not with the usual mailboxes"
    wire.boxes = (0x1000, 0x1200, 512)
    wire.set_mailbox()
    assert wire.request(BOOT | ACK) == (BOOT, 0)
    return wire


def test_boot_knows_only_files_and_one_way_out() -> None:
    wire = boot()
    wire.post(struct.pack("<HBHB4x", 0x2000, 0x40, 0x1000, 0))
    assert wire.fetch_raw()[5] & 0x0F == 0, "CoE is answered by a mailbox error"
    assert wire.request(PREOP) == (BOOT | ERROR, 0x0011)
    assert wire.request(INIT | ACK) == (INIT, 0)
    wire.boxes = (MBX_OUT, MBX_IN, MBX_SIZE)
    wire.set_mailbox()
    assert wire.request(PREOP) == (PREOP, 0)


def test_a_download_that_breaks_off_in_boot_leaves_a_drive_without_firmware() -> None:
    wire = boot()
    wire.post(struct.pack("<BBI", 2, 0, 0) + b"drive.bin", kind=4)
    assert wire.fetch_raw()[6:12] == struct.pack("<BBI", 4, 0, 0)
    assert wire.request(INIT) == (INIT, 0)
    wire.boxes = (MBX_OUT, MBX_IN, MBX_SIZE)
    wire.set_mailbox()
    assert wire.request(PREOP) == (INIT | ERROR, 0x0014)


def test_boot_and_firmware_transfer() -> None:
    wire = boot()
    content = bytes(range(256)) * 4 + b"end"  # a mailbox of 512 holds 500: 500 + 500 + 27
    wire.post(struct.pack("<BBI", 2, 0, 0) + b"drive.bin", kind=4)
    assert wire.fetch_raw()[6:12] == struct.pack("<BBI", 4, 0, 0)
    for number, start in enumerate((0, 500, 1000), 1):
        part = content[start : start + 500]
        wire.post(struct.pack("<BBI", 3, 0, number) + part, kind=4)
        assert wire.fetch_raw()[6:12] == struct.pack("<BBI", 4, 0, number)
    files = wire.slaves[0].files
    assert files is not None
    assert files.files == {"drive.bin": content}

    wire.post(struct.pack("<BBI", 1, 0, 0) + b"drive.bin", kind=4)
    got = b""
    for number in (1, 2, 3):
        raw = wire.fetch_raw()
        length = struct.unpack_from("<H", raw)[0]
        assert raw[6:12] == struct.pack("<BBI", 3, 0, number)
        got += raw[12 : 6 + length]
        wire.post(struct.pack("<BBI", 4, 0, number), kind=4)
    assert got == content
    wire.post(struct.pack("<BBI", 1, 0, 0) + b"other.bin", kind=4)
    assert wire.fetch_raw()[6:12] == struct.pack("<BBI", 5, 0, 0x8001)
    assert wire.request(INIT) == (INIT, 0)
