"""Slave information interface: the EEPROM image (ETG.2010) and its register interface.

The image is built from the profile; the register interface is ETG.1000.4 clause 6.4: a command sets
the busy bit for a time, and writing requires the write-enable bit in the same frame.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

ALIAS_WORD = 0x04
SIZE_BYTES = 2048

_STRINGS, _GENERAL, _FMMU, _SYNC_MANAGERS, _TX_PDO, _RX_PDO, _CLOCKS = 10, 30, 40, 41, 50, 51, 60
_END = 0xFFFF

COE_SDO = 0x01
COE_INFO = 0x02
COE_ASSIGN = 0x04
COE_CONFIGURE = 0x08
COE_COMPLETE_ACCESS = 0x20

PROTOCOL_COE = 0x04
PROTOCOL_FOE = 0x08


@dataclass(frozen=True, slots=True)
class SmLayout:
    """Start address, length and control byte of one sync manager, as in the EEPROM."""

    start: int
    length: int
    control: int
    enable: int
    kind: int
    """1 mailbox out, 2 mailbox in, 3 outputs, 4 inputs (seen from the master)."""


@dataclass(frozen=True, slots=True)
class SiiPdo:
    """A PDO of the EEPROM: ``entries`` are 32-bit mapping words; ``sm`` is 0xFF if unassigned."""

    index: int
    sm: int
    entries: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class SiiContent:
    """Contents of the image."""

    vendor_id: int
    product_code: int
    revision: int
    serial: int
    alias: int
    name: str
    group: str
    coe_details: int
    foe: bool
    sync_managers: tuple[SmLayout, ...]
    boot: tuple[SmLayout, SmLayout] | None = None
    """Mailboxes in BOOT, for a slave with this state."""
    rx_pdos: tuple[SiiPdo, ...] = ()
    tx_pdos: tuple[SiiPdo, ...] = ()
    clocks: bool = True


def checksum(first_14_bytes: bytes) -> int:
    """Return the CRC-8 of words 0 to 6: polynomial x^8+x^2+x+1, start FFh (ETG.2010 table 2)."""
    crc = 0xFF
    for byte in first_14_bytes:
        crc ^= byte
        for _ in range(8):
            crc = ((crc << 1) ^ 0x07) & 0xFF if crc & 0x80 else crc << 1
    return crc


def build(content: SiiContent) -> bytes:
    """Return the complete image, padded with FFh to `SIZE_BYTES`."""
    mailbox_out, mailbox_in = content.sync_managers[0], content.sync_managers[1]
    image = bytearray(0x80)
    struct.pack_into("<HHHHH", image, 0, 0x0C08, 0xEE88, 0x000A, 0, content.alias)
    image[14] = checksum(bytes(image[:14]))
    struct.pack_into(
        "<IIII",
        image,
        16,
        content.vendor_id,
        content.product_code,
        content.revision,
        content.serial,
    )
    layout = (mailbox_out.start, mailbox_out.length, mailbox_in.start, mailbox_in.length)
    if content.boot is not None:
        out, back = content.boot
        boot = (out.start, out.length, back.start, back.length)
        struct.pack_into("<HHHH", image, 0x28, *boot)
    struct.pack_into("<HHHH", image, 0x30, *layout)
    protocols = PROTOCOL_COE | (PROTOCOL_FOE if content.foe else 0)
    struct.pack_into("<H", image, 0x38, protocols)
    struct.pack_into("<HH", image, 0x7C, SIZE_BYTES * 8 // 1024 - 1, 1)
    names = _Strings()
    body = [
        (_GENERAL, _general(content, names)),
        (_FMMU, bytes([1, 2, 3, 0])),
        (_SYNC_MANAGERS, b"".join(map(_sync_manager, content.sync_managers))),
    ]
    if content.tx_pdos:
        body.append((_TX_PDO, _pdos(content.tx_pdos)))
    if content.rx_pdos:
        body.append((_RX_PDO, _pdos(content.rx_pdos)))
    if content.clocks:
        body.append((_CLOCKS, _clocks(names)))
    image += _category(_STRINGS, names.pack())
    for kind, data in body:
        image += _category(kind, data)
    image += struct.pack("<H", _END)
    if len(image) > SIZE_BYTES:
        raise ValueError(f"SII of {content.name} needs {len(image)} bytes, {SIZE_BYTES} are there")
    return bytes(image).ljust(SIZE_BYTES, b"\xff")


class _Strings:
    """The string category; others refer to its entries by number, counted from 1."""

    def __init__(self) -> None:
        self._texts: list[bytes] = []

    def number(self, text: str) -> int:
        encoded = text.encode("ascii", "replace")[:255]
        if encoded not in self._texts:
            self._texts.append(encoded)
        return self._texts.index(encoded) + 1

    def pack(self) -> bytes:
        packed = b"".join(bytes([len(text)]) + text for text in self._texts)
        return bytes([len(self._texts)]) + packed


def _category(kind: int, data: bytes) -> bytes:
    padded = data + b"\0" * (len(data) % 2)
    return struct.pack("<HH", kind, len(padded) // 2) + padded


def _general(content: SiiContent, names: _Strings) -> bytes:
    # SOEM always takes string 1 as the name, so the name is first.
    name = names.number(content.name)
    group = names.number(content.group)
    data = bytearray(32)
    data[0], data[2], data[3] = group, name, name
    data[5] = content.coe_details
    data[6] = 1 if content.foe else 0
    data[9] = 1  # one DS402 channel
    data[14] = group
    struct.pack_into("<H", data, 16, 0x0011)  # ports 0 and 1: MII
    return bytes(data)


def _sync_manager(layout: SmLayout) -> bytes:
    return struct.pack(
        "<HHBBBB", layout.start, layout.length, layout.control, 0, layout.enable, layout.kind
    )


def _pdos(pdos: Sequence[SiiPdo]) -> bytes:
    packed = bytearray()
    for pdo in pdos:
        packed += struct.pack("<HBBBBH", pdo.index, len(pdo.entries), pdo.sm, 0, 0, 0)
        for entry in pdo.entries:
            packed += struct.pack(
                "<HBBBBH", entry >> 16, (entry >> 8) & 0xFF, 0, 0, entry & 0xFF, 0
            )
    return bytes(packed)


def _clocks(names: _Strings) -> bytes:
    """Return two modes as in ESI files: SYNC0 (assign-activate 300h) and without DC (0)."""
    modes = ((0x0300, names.number("DC")), (0x0000, names.number("SM")))
    return b"".join(
        struct.pack("<IIIhHhBBI", 0, 0, 0, 0, activate, 1 if activate else 0, name, 0, 0)
        for activate, name in modes
    )


_BUSY = 0x8000
_NOT_LOADED, _CHECKSUM_ERROR = 0x1000, 0x0800
_WRITE_ENABLE_ERROR = 0x4000
_COMMAND_ERROR = 0x2000
_COMMAND_MASK = 0x0700
_READ, _WRITE, _RELOAD = 0x0100, 0x0200, 0x0400
_EIGHT_BYTES = 0x0040
_TWO_ADDRESS_BYTES = 0x0080
_FOREVER_NS = 1 << 62


class Eeprom:
    """The EEPROM at registers 500h to 50Fh. The content is kept over power cycles.

    A word is transferred to the chip while the interface is busy (``write_ns``); the chip then
    stores it for ``store_ns`` and does not acknowledge other commands meanwhile (bit 13).
    """

    def __init__(self, image: bytes) -> None:
        self.image = bytearray(image)
        self.read_ns = 0
        self.write_ns = 0
        self.store_ns = 0
        self.busy_until_ns = 0
        self.cut_after: int | None = None
        """Number of words still written before the supply of the chip fails within a word."""
        self.words_written = 0
        self._storing_until_ns = 0
        self._power_on()

    @property
    def loaded(self) -> bool:
        """Whether the checksum was correct when the controller loaded the configuration."""
        return not self._load_status

    def power_on(self) -> None:
        """Load the configuration as at power-on; a failed chip supply is restored."""
        self.busy_until_ns = self._storing_until_ns = 0
        self.cut_after = None
        self._power_on()

    def _power_on(self) -> None:
        right = self.image[14] == checksum(bytes(self.image[:14]))
        self._load_status = 0 if right else _CHECKSUM_ERROR | _NOT_LOADED
        self._set()

    def _set(self, bits: int = 0) -> None:
        self._status = _EIGHT_BYTES | _TWO_ADDRESS_BYTES | self._load_status | bits

    @property
    def alias(self) -> int:
        """Configured station alias."""
        return int(struct.unpack_from("<H", self.image, ALIAS_WORD * 2)[0])

    def status(self, now_ns: int) -> int:
        """Return the value of register 502h."""
        return self._status | (_BUSY if now_ns < self.busy_until_ns else 0)

    def command(self, control: int, address: int, data: bytes, now_ns: int) -> bytes | None:
        """Execute a command written to 502h; return the new value of 508h after a read."""
        if now_ns < self.busy_until_ns:
            return None  # the controller ignores commands while it is busy
        code = control & _COMMAND_MASK
        self._set(code)
        if code and now_ns < self._storing_until_ns:
            self._status |= _COMMAND_ERROR
            return None
        if code == _READ:
            self.busy_until_ns = now_ns + self.read_ns
            start = address * 2
            return bytes(self.image[start : start + 8]).ljust(8, b"\xff")
        if code == _WRITE:
            if not control & 1:
                self._status |= _WRITE_ENABLE_ERROR
            elif address * 2 + 2 <= len(self.image):
                self._store(address * 2, data[:2], now_ns)
            else:
                self._status |= _COMMAND_ERROR
        elif code == _RELOAD:
            self.busy_until_ns = now_ns + self.read_ns
        elif code:
            self._status |= _COMMAND_ERROR
        else:
            self._status &= ~_COMMAND_MASK
        return None

    def _store(self, at: int, word: bytes, now_ns: int) -> None:
        if self.cut_after == 0:
            # Half of the word is stored; the interface stays busy without an answer of the chip.
            self.image[at : at + 1] = word[:1]
            self.busy_until_ns = _FOREVER_NS
            return
        if self.cut_after is not None:
            self.cut_after -= 1
        self.busy_until_ns = now_ns + self.write_ns
        self._storing_until_ns = self.busy_until_ns + self.store_ns
        self.image[at : at + 2] = word
        self.words_written += 1
