"""The SDO information service: the drive's own object dictionary.

Generators over `Mailbox`; no I/O. Source: ETG.1000.6 clause 5.6.3.
"""

from __future__ import annotations

import struct

from drivers.errors import ProtocolError
from drivers.ethercat.wire.coe import MAX_BYTES, OVERTAKEN_READS, settle
from drivers.ethercat.wire.mailbox import COE, Mail, Mailbox, Overtaken
from drivers.ethercat.wire.registers import GONE_S
from drivers.ethercat.wire.steps import Steps
from drivers.objects.dictionary import EntryDescription, ObjectInfo
from drivers.objects.sdo_abort import rejected

_INFO = 8


def list_objects(box: Mailbox) -> Steps[list[int]]:
    """Read all object indices of the drive's own dictionary (list type 1)."""
    parts = yield from _info(box, 0x01, struct.pack("<H", 1), 0x02)
    raw = b"".join(part[2:] if number == 0 else part for number, part in enumerate(parts))
    return sorted(set(struct.unpack(f"<{len(raw) // 2}H", raw[: len(raw) // 2 * 2])))


def describe_object(box: Mailbox, index: int) -> Steps[ObjectInfo]:
    """Read name, type and number of entries of one object."""
    parts = yield from _info(box, 0x03, struct.pack("<H", index), 0x04)
    data = b"".join(parts)
    if len(data) < 6:
        raise ProtocolError("ethercat.description-bytes", index=index, bytes=len(data))
    reported, data_type, max_subindex, code = struct.unpack("<HHBB", data[:6])
    return ObjectInfo(reported, _text(data[6:]), data_type, code & 0x0F, max_subindex)


def describe_entry(box: Mailbox, index: int, subindex: int) -> Steps[EntryDescription]:
    """Read type, length, access and name of one entry; unit, default and limits if reported."""
    wanted = 0x08 | 0x10 | 0x20 | 0x40
    parts = yield from _info(box, 0x05, struct.pack("<HBB", index, subindex, wanted), 0x06)
    data = b"".join(parts)
    if len(data) < 10:
        raise ProtocolError("ethercat.description-too-short", index=index, subindex=subindex)
    reported, sub, info, data_type, bits, access = struct.unpack("<HBBHHH", data[:10])
    rest = data[10:]
    size = (bits + 7) // 8
    unit: int | None = None
    values: list[bytes | None] = [None, None, None]
    if info & 0x08 and len(rest) >= 4:
        unit, rest = int.from_bytes(rest[:4], "little"), rest[4:]
    for place, bit in enumerate((0x10, 0x20, 0x40)):
        if info & bit and len(rest) >= size:
            values[place], rest = rest[:size], rest[size:]
    return EntryDescription(reported, sub, data_type, bits, access, _text(rest), unit, *values)


def _info(box: Mailbox, opcode: int, data: bytes, answer_code: int) -> Steps[list[bytes]]:
    """Send one information request; the answer comes in as many mails as it needs."""
    for _ in range(OVERTAKEN_READS):
        try:
            return (yield from _info_once(box, opcode, data, answer_code))
        except Overtaken:
            continue
    return (yield from _info_once(box, opcode, data, answer_code))


def _info_once(box: Mailbox, opcode: int, data: bytes, answer_code: int) -> Steps[list[bytes]]:
    yield from settle(box)

    def matches(mail: Mail) -> bool:
        if mail.protocol != COE or len(mail.payload) < 6:
            return False
        service = int.from_bytes(mail.payload[:2], "little") >> 12
        return service == _INFO and mail.payload[2] & 0x7F in (answer_code, 0x07)

    request = struct.pack("<HBBH", _INFO << 12, opcode, 0, 0) + data
    # Hundreds of requests in a row: a stalled computer must not end them.
    answer = yield from box.request(COE, request, matches, gone_s=GONE_S)
    parts: list[bytes] = []
    while True:
        if answer[2] & 0x7F == 0x07:
            index = int.from_bytes(data[:2], "little")
            raise rejected(
                int.from_bytes(answer[6:10], "little"), parameter=f"description of {index:04X}"
            )
        parts.append(answer[6:])
        left = int.from_bytes(answer[4:6], "little")
        if left == 0:
            return parts
        if sum(map(len, parts)) > MAX_BYTES:
            raise ProtocolError("ethercat.drive-description-not-end")
        answer = yield from box.receive(matches, box.timeout_s)
        if answer[2] & 0x7F != 0x07 and int.from_bytes(answer[4:6], "little") != left - 1:
            box.unsettled = True
            raise ProtocolError("ethercat.part-drive-description-itself")


def _text(data: bytes) -> str:
    return data.split(b"\0", 1)[0].decode("utf-8", "replace").strip()
