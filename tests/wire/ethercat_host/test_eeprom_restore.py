"""A whole EEPROM read, compared, restored and repaired: our steps on the virtual controller.

Every access goes through its registers, one frame each; time passes with frames and pauses.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

import pytest

from drivers.errors import LinkTimeout, NotAllowed, OutOfRange, ProtocolError
from drivers.ethercat.eeprom.expected import against_profile
from drivers.ethercat.eeprom.image import Image, SlaveIdentity, differences
from drivers.ethercat.eeprom.plan import Plan, plan_identity, plan_restore
from drivers.ethercat.eeprom.transfer import read_image, write_image
from drivers.ethercat.wire.steps import Read
from drivers.ethercat.wire.steps import Write as WriteStep
from drivers.virtual.wires.ethercat.controller.sii import Eeprom
from profiles.bring_up import BringUp, SyncManagerRule
from tests.wire.ethercat_host.by_hand import ByHand
from tests.wire.ethercat_host.servo_device import servo_profile
from tests.wire.ethercat_slave.frames import Wire
from tests.wire.ethercat_slave.test_sii import crc8

SERIAL_WORD, VENDOR_WORD = 14, 8
DRIVE = SlaveIdentity(0xABCD, 0x1234, 0x10002)
"""1018h of the drive."""


class Chip(ByHand):
    """A slave on the wire whose EEPROM takes its time as a real one does."""

    def __init__(self) -> None:
        self.wire = Wire()
        self.wire.number()
        self.frames = 0
        self.deaf = False
        self.eeprom.read_ns, self.eeprom.write_ns = 100_000, 200_000
        self.eeprom.store_ns = 3_000_000

    @property
    def eeprom(self) -> Eeprom:
        return self.wire.slaves[0].controller.eeprom

    @property
    def now(self) -> float:  # type: ignore[override]
        return self.wire.clock.time_ns / 1e9

    @now.setter
    def now(self, value: float) -> None:
        self.wire.clock.time_ns = int(value * 1e9)

    def frame(self, step: Read | WriteStep) -> bytes | None:
        self.wire.clock.time_ns += 20_000
        if isinstance(step, Read):
            return self.wire.read(step.register, step.size).data
        self.wire.write(step.register, step.data)
        return b""

    def power_cycle(self) -> None:
        self.wire.segment.line.power_off(0, self.wire.clock.time_ns, 0.1)
        for _ in range(2):
            self.wire.clock.time_ns += 1_000_000_000
            self.wire.segment.settle()
        self.wire.number()

    def truth(self) -> bytes:
        return bytes(self.eeprom.image)

    def damage(self, word: int, data: bytes) -> None:
        self.eeprom.image[2 * word : 2 * word + len(data)] = data

    def read(self, size: int | None = None) -> Image:
        return Image(self.run(read_image(lambda: self.now, quiet, size)))

    def carry_out(self, plan: Plan) -> None:
        present, target = plan.present.data, plan.target.data
        self.run(write_image(present, target, lambda: self.now, quiet))


def quiet(_share: float, _step: object) -> None:
    pass


@pytest.fixture
def chip(monkeypatch: pytest.MonkeyPatch) -> Chip:
    monkeypatch.setattr("tests.wire.ethercat_host.by_hand._MOST_S", 600.0)
    return Chip()


def test_what_is_read_is_what_is_there(chip: Chip) -> None:
    found = chip.read()
    assert found.data == chip.truth()
    assert found.problem() is None
    assert found.identity == DRIVE


def test_a_changed_word_is_restored_and_nothing_else_is_written(chip: Chip) -> None:
    saved = chip.truth()
    chip.damage(0x50, b"\x12\x34")
    plan = plan_restore(chip.read(), Image(saved), DRIVE)
    assert plan.words == 1
    chip.carry_out(plan)
    assert chip.truth() == saved
    assert chip.eeprom.words_written == 3, "checksum wrong, the word, checksum right"


@pytest.mark.parametrize("after_words", [0, 1, 4, 16])
def test_a_supply_that_fails_inside_a_word_is_noticed_and_repaired(
    chip: Chip, after_words: int
) -> None:
    saved = chip.truth()
    chip.damage(0x50, b"\x12\x34" * 16)
    plan = plan_restore(chip.read(), Image(saved), DRIVE)
    chip.eeprom.cut_after = after_words
    with pytest.raises(LinkTimeout, match="stays busy"):
        chip.carry_out(plan)
    chip.power_cycle()
    assert chip.wire.value(0x0502, 2) & 0x0800, "the controller says so (0502h bit 11)"
    broken = chip.read(len(saved))
    assert not broken.checksum_right
    with pytest.raises(NotAllowed, match="neither the firmware nor the EEPROM"):
        plan_restore(broken, Image(saved), None)
    chip.carry_out(plan_restore(broken, Image(saved), None, unknown_accepted=True))
    assert chip.truth() == saved
    chip.power_cycle()
    assert chip.wire.value(0x0502, 2) & 0x1800 == 0


def test_a_blank_eeprom_is_read_with_a_size_and_restored(chip: Chip) -> None:
    saved = chip.truth()
    chip.damage(0, b"\xff" * len(saved))
    with pytest.raises(ProtocolError, match="blank or damaged"):
        chip.read()
    blank = chip.read(len(saved))
    chip.carry_out(plan_restore(blank, Image(saved), None, unknown_accepted=True))
    assert chip.truth() == saved


def test_the_file_of_another_drive_is_refused(chip: Chip) -> None:
    other = Image(chip.truth()).with_words(10, struct.pack("<I", 0x9999))
    for drive in (DRIVE, None):
        with pytest.raises(NotAllowed, match="the file is of 0x0000abcd 0x00009999"):
            plan_restore(chip.read(), other, drive, unknown_accepted=True)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: data[:-2], "no contents of an EEPROM"),
        (lambda data: data + b"\xff" * 128, "states 2048 bytes and has 2176"),
        (lambda data: b"\x01" + data[1:], "checksum in word 7"),
        (lambda data: data[:16] + b"\xff" * 8 + data[24:], "no vendor and no product"),
        (lambda data: data[:0x80] + b"\x0a\x00\xff\x7f" + data[0x84:], "do not end"),
    ],
)
def test_a_file_that_is_damaged_is_refused(
    chip: Chip, change: Callable[[bytes], bytes], words: str
) -> None:
    with pytest.raises(OutOfRange, match=words):
        plan_restore(chip.read(), Image(change(chip.truth())), DRIVE)


def test_a_file_of_another_size_is_refused(chip: Chip) -> None:
    longer = bytearray(chip.truth() + b"\xff" * 2048)
    struct.pack_into("<H", longer, 2 * 0x3E, 4096 // 128 - 1)
    with pytest.raises(OutOfRange, match="4096 bytes, the EEPROM of the drive has 2048"):
        plan_restore(chip.read(), Image(bytes(longer)), DRIVE)


def test_a_drive_keeps_its_own_serial_number(chip: Chip) -> None:
    chip.damage(SERIAL_WORD, struct.pack("<I", 1234))
    other = bytearray(chip.truth())
    struct.pack_into("<I", other, 2 * SERIAL_WORD, 5678)
    struct.pack_into("<H", other, 8, 7)
    other[14] = crc8(bytes(other[:14]))
    plan = plan_restore(chip.read(), Image(bytes(other)), DRIVE)
    assert plan.keeps_serial
    assert [d.field for d in plan.changes] == ["alias", "checksum"]
    chip.carry_out(plan)
    assert (Image(chip.truth()).serial, Image(chip.truth()).alias) == (1234, 7)


def test_an_identity_that_was_overwritten_is_repaired_from_the_firmware(chip: Chip) -> None:
    saved = chip.truth()
    chip.damage(VENDOR_WORD, struct.pack("<II", 0x1111, 0x2222))
    plan = plan_identity(chip.read(), DRIVE)
    assert [d.field for d in plan.changes] == ["vendor_id", "product_code"]
    chip.carry_out(plan)
    assert chip.truth() == saved
    with pytest.raises(NotAllowed, match="does not report its identity"):
        plan_identity(chip.read(), None)
    chip.damage(0, b"\x55")
    with pytest.raises(NotAllowed, match="checksum of the EEPROM is wrong"):
        plan_identity(chip.read(), DRIVE)


def test_another_change_has_another_digest(chip: Chip) -> None:
    saved = Image(chip.truth())
    chip.damage(0x50, b"\x12\x34")
    first = plan_restore(chip.read(), saved, DRIVE).digest
    chip.damage(0x51, b"\x56\x78")
    assert plan_restore(chip.read(), saved, DRIVE).digest != first


def test_a_chip_that_keeps_its_old_contents_is_noticed(chip: Chip) -> None:
    """Write-protected behind the configuration area, as by a jumper."""
    saved = chip.truth()
    chip.damage(0x50, b"\x12\x34")
    plan = plan_restore(chip.read(), Image(saved), DRIVE)
    store = chip.eeprom._store
    protected = lambda at, word, now: store(at, word if at < 0x80 else b"\x12\x34", now)  # noqa: E731
    chip.eeprom._store = protected  # type: ignore[method-assign]
    with pytest.raises(ProtocolError, match="word 0x0050 reads back as 0x3412"):
        chip.carry_out(plan)
    assert not Image(chip.truth()).checksum_right


def test_an_eeprom_that_the_processor_plays_is_left_alone(chip: Chip) -> None:
    saved = chip.truth()
    chip.damage(0x50, b"\x12\x34")
    plan = plan_restore(chip.read(), Image(saved), DRIVE)
    status = chip.eeprom.status
    chip.eeprom.status = lambda now: status(now) | 0x0020  # type: ignore[method-assign]
    with pytest.raises(NotAllowed, match="emulates the EEPROM"):
        chip.carry_out(plan)
    assert chip.eeprom.words_written == 0


def test_differences_are_named() -> None:
    plain = bytes(0x80) + b"\xff\xff" + bytes(126)
    other = bytearray(plain)
    other[8] = 5
    found = differences(Image(plain), Image(bytes(other)))
    assert [(d.field, d.first, d.second) for d in found] == [("alias", "0000", "0500")]


def test_a_makers_file_is_compared_where_it_says_something(chip: Chip) -> None:
    base = servo_profile()
    rules = BringUp(
        source="file",
        protocols=("coe", "foe"),
        eeprom_bytes=2048,
        sync_managers=(
            SyncManagerRule(
                number=0, kind="mailbox_out", start=0x1000, default_size=128, control=0x26
            ),
            SyncManagerRule(number=2, kind="outputs", start=0x1200, control=0x24),
        ),
    )
    profile = base.model_copy(
        update={
            "bring_up": rules,
            "identity": base.identity.model_copy(update={"revision": 0x20002}),
        }
    )
    found = {d.field: (d.first, d.second) for d in against_profile(chip.read(), profile)}
    assert found == {
        "revision": ("02000100", "02000200"),
        "mailbox_out": ("00100001", "00108000"),
        "protocols": ("0400", "0c00"),
        "sync_manager_2": ("001264", "001224"),
    }
