"""EEPROM content and its register interface (ETG.2010, ETG.1000.4 clause 6.4)."""

from __future__ import annotations

import struct

import pytest

from drivers.virtual.wires.ethercat.controller import sii

from .frames import Wire

READ, WRITE = 0x0100, 0x0201
BUSY, NO_WRITE_ENABLE = 0x8000, 0x4000


def read_words(wire: Wire, word: int) -> bytes:
    """8 bytes through the registers, as SOEM does: command and address in one write."""
    wire.write(0x0502, struct.pack("<HI", READ, word))
    assert wire.value(0x0502, 2) & BUSY == 0
    return wire.read(0x0508, 8).data


def image(wire: Wire) -> bytes:
    return b"".join(read_words(wire, word) for word in range(0, 0x200, 4))


def categories(raw: bytes) -> dict[int, bytes]:
    found, at = {}, 0x80
    while True:
        kind, words = struct.unpack_from("<HH", raw, at)
        if kind == 0xFFFF:
            return found
        found[kind] = raw[at + 4 : at + 4 + 2 * words]
        at += 4 + 2 * words


@pytest.fixture
def wire() -> Wire:
    made = Wire()
    made.number()
    return made


def test_checksum_of_a_known_configuration() -> None:
    # Words 0-6 of an all-zero area: CRC-8, polynomial 07h, start FFh. The long division of
    # FF 00…00 (14 bytes) by x^8+x^2+x+1, done bit by bit on paper for one byte, gives F3h
    # after the first; the whole is checked by its defining property: appending it leaves 0.
    area = bytes([8, 0x0C, 0x88, 0xEE, 0x0A, 0, 0, 0, 7, 0, 0, 0, 0, 0])
    assert sii.checksum(area + bytes([sii.checksum(area)])) == 0
    assert sii.checksum(b"\x00") == 0xF3


def test_identity_and_mailbox_words(wire: Wire) -> None:
    raw = image(wire)
    assert struct.unpack_from("<IIII", raw, 0x10) == (0xABCD, 0x1234, 0x00010002, 77)
    assert struct.unpack_from("<HHHH", raw, 0x30) == (0x1000, 256, 0x1100, 256)
    assert struct.unpack_from("<H", raw, 0x38)[0] == 0x04  # CoE only
    assert struct.unpack_from("<HHHH", raw, 0x28) == (0, 0, 0, 0)  # no bootstrap
    assert raw[14] == sii.checksum(raw[:14])
    # Size in Kibit less one, version 1.
    assert struct.unpack_from("<HH", raw, 0x7C) == (
        len(wire.slaves[0].controller.eeprom.image) * 8 // 1024 - 1,
        1,
    )


def test_strings_and_general(wire: Wire) -> None:
    found = categories(image(wire))
    strings = found[10]
    assert strings[0] == 4
    assert strings[1:8] == b"\x06DICT-1"
    general = found[30]
    assert len(general) == 32
    assert general[3] == 1  # name is string 1, where SOEM looks for it
    # SDO, information, assignment, configuration, complete access.
    assert general[5] == 0x2F
    assert general[6] == 0  # no FoE


def test_fmmu_and_sync_managers(wire: Wire) -> None:
    found = categories(image(wire))
    assert found[40][:3] == bytes([1, 2, 3])  # outputs, inputs, mailbox status (004:945-947)
    managers = [struct.unpack_from("<HHBBBB", found[41], 8 * n) for n in range(4)]
    assert managers == [
        (0x1000, 256, 0x26, 0, 1, 1),
        (0x1100, 256, 0x22, 0, 1, 2),
        (0x1200, 0, 0x64, 0, 1, 3),
        (0x1500, 0, 0x20, 0, 1, 4),
    ]


def test_default_pdos(wire: Wire) -> None:
    found = categories(image(wire))
    # TxPDO 1A00h comes first and is not assigned (SM FFh), 1A03h belongs to SM3.
    assert struct.unpack_from("<HBB", found[50], 0) == (0x1A00, 4, 0xFF)
    second = 8 + 4 * 8
    assert struct.unpack_from("<HBB", found[50], second) == (0x1A03, 3, 3)
    assert struct.unpack_from("<HBBBB", found[50], second + 8) == (0x603F, 0, 0, 0, 16)
    first_rx = struct.unpack_from("<HBB", found[51], 0)
    assert first_rx == (0x1600, 3, 0xFF)
    assert 60 in found


def test_a_drive_without_dc_has_no_clock_category() -> None:
    wire = Wire(dc=False)
    wire.number()
    assert 60 not in categories(image(wire))
    assert wire.value(0x0008, 2) & 0x0004 == 0


def test_a_drive_with_foe_says_so_and_has_a_boot_mailbox() -> None:
    wire = Wire(foe=True, complete_access=False)
    wire.number()
    raw = image(wire)
    assert struct.unpack_from("<H", raw, 0x38)[0] == 0x0C
    assert struct.unpack_from("<HHHH", raw, 0x28) == (0x1000, 512, 0x1200, 512)
    assert struct.unpack_from("<HHHH", raw, 0x30) == (0x1000, 256, 0x1100, 256)
    general = categories(raw)[30]
    assert (general[5], general[6]) == (0x0F, 1)


def test_busy_for_a_while_and_deaf_meanwhile(wire: Wire) -> None:
    eeprom = wire.slaves[0].controller.eeprom
    eeprom.read_ns = 100_000
    wire.write(0x0502, struct.pack("<HI", READ, 8))
    assert wire.value(0x0502, 2) & BUSY
    wire.write(0x0502, struct.pack("<HI", READ, 0x18))  # ignored
    wire.clock.time_ns += 100_000
    assert wire.value(0x0502, 2) & BUSY == 0
    assert wire.value(0x0508, 4) == 0xABCD


def test_status_tells_that_eight_bytes_are_read_at_once(wire: Wire) -> None:
    assert wire.value(0x0502, 2) & 0x0040


def test_alias_write_takes_effect_at_the_next_power_on(wire: Wire) -> None:
    controller = wire.slaves[0].controller
    controller.eeprom.write_ns = 5_000_000
    wire.write(0x0508, b"\x2a\x00")
    wire.write(0x0502, struct.pack("<HI", WRITE, 4))
    assert wire.value(0x0502, 2) & BUSY
    wire.clock.time_ns += 5_000_000
    assert wire.value(0x0502, 2) & (BUSY | NO_WRITE_ENABLE) == 0
    assert read_words(wire, 4)[:2] == b"\x2a\x00"
    assert wire.value(0x0012, 2) == 0
    # CRC-8 of words 0 to 6 with alias 42 (ETG.2010): without it the controller loads nothing.
    eeprom = controller.eeprom.image
    wire.write(0x0508, bytes([crc8(bytes(eeprom[:14])), 0]))
    wire.write(0x0502, struct.pack("<HI", WRITE, 7))
    wire.clock.time_ns += 5_000_000
    wire.segment.line.power_off(0, wire.clock.time_ns, 0.1)
    wire.clock.time_ns += 1_000_000_000
    wire.segment.settle()
    wire.clock.time_ns += 1_000_000_000
    wire.number()
    assert wire.value(0x0012, 2) == 42


def test_a_wrong_checksum_is_shown_and_nothing_is_loaded(wire: Wire) -> None:
    controller = wire.slaves[0].controller
    controller.eeprom.image[8] = 42
    wire.segment.line.power_off(0, wire.clock.time_ns, 0.1)
    wire.clock.time_ns += 1_000_000_000
    wire.segment.settle()
    wire.clock.time_ns += 1_000_000_000
    wire.number()
    assert wire.value(0x0502, 2) & 0x1800 == 0x1800, "checksum wrong, not loaded (0502h)"
    assert wire.value(0x0012, 2) == 0, "not an alias"
    assert wire.value(0x0140, 1) == 0, "no process data interface"
    wire.write(0x0120, b"\x02\x00")
    wire.clock.time_ns += 1_000_000_000
    assert wire.value(0x0130, 1) == 0x11
    assert wire.value(0x0134, 2) == 0x0051, "EEPROM error (ETG.1020)"


def test_a_chip_that_stores_a_word_does_not_acknowledge(wire: Wire) -> None:
    eeprom = wire.slaves[0].controller.eeprom
    eeprom.write_ns, eeprom.store_ns = 100_000, 5_000_000
    wire.write(0x0508, b"\x2a\x00")
    wire.write(0x0502, struct.pack("<HI", WRITE, 4))
    wire.clock.time_ns += 100_000
    assert wire.value(0x0502, 2) & BUSY == 0
    wire.write(0x0502, struct.pack("<HI", READ, 8))
    assert wire.value(0x0502, 2) & 0x2000, "not acknowledged (0502h bit 13)"
    wire.clock.time_ns += 5_000_000
    wire.write(0x0502, struct.pack("<HI", READ, 8))
    assert wire.value(0x0502, 2) & 0x2000 == 0


def crc8(words: bytes) -> int:
    """x^8 + x^2 + x + 1, start value FFh (ETG.2010 table 2)."""
    rest = 0xFF
    for bit in (byte >> place & 1 for byte in words for place in range(7, -1, -1)):
        rest = (rest << 1 & 0xFF) ^ (0x07 if (rest >> 7) ^ bit else 0)
    return rest


def test_writing_needs_write_enable_in_the_same_frame(wire: Wire) -> None:
    wire.write(0x0508, b"\x2a\x00")
    wire.write(0x0502, struct.pack("<HI", 0x0200, 4))
    assert wire.value(0x0502, 2) & NO_WRITE_ENABLE
    assert read_words(wire, 4)[:2] == b"\0\0"


def test_the_other_side_owns_the_eeprom_when_reported(wire: Wire) -> None:
    wire.write(0x0500, b"\x01")
    wire.write(0x0502, struct.pack("<HI", READ, 8))
    assert wire.value(0x0508, 4) == 0
    wire.write(0x0500, b"\x00")
    assert struct.unpack_from("<I", read_words(wire, 8))[0] == 0xABCD
