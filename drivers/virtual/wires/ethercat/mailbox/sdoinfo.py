"""SDO information service: list and description of objects (ETG.1000.6 clause 5.6.3)."""

from __future__ import annotations

import struct

from drivers.errors import OutOfRange
from drivers.objects.codec import encode
from drivers.virtual.device import ABORT_UNSUPPORTED, EntryInfo, SdoAbort
from drivers.virtual.wires.ethercat.mailbox.dictionary import CoeDictionary
from profiles.schema import DataType, Parameter

_LIST_REQUEST, _LIST_ANSWER = 1, 2
_OBJECT_REQUEST, _OBJECT_ANSWER = 3, 4
_ENTRY_REQUEST, _ENTRY_ANSWER = 5, 6
_ERROR = 7
_INCOMPLETE = 0x80
_HEADER = 4

_VAR, _ARRAY, _RECORD = 7, 8, 9

#: Data type codes (ETG.1000.6 table 64).
TYPE_CODE: dict[DataType, int] = {
    "BOOL": 0x01, "INT8": 0x02, "INT16": 0x03, "INT32": 0x04, "UINT8": 0x05, "UINT16": 0x06,
    "UINT32": 0x07, "REAL32": 0x08, "STRING": 0x09, "OCTETS": 0x0A, "INT64": 0x15, "UINT64": 0x1B,
}  # fmt: skip

_READ_ALL, _WRITE_ALL, _WRITE_PREOP = 0x0007, 0x0038, 0x0008
_MAP_RX, _MAP_TX = 0x0040, 0x0080

_WITH_DEFAULT, _WITH_MINIMUM, _WITH_MAXIMUM = 0x10, 0x20, 0x40


def answer(dictionary: CoeDictionary, body: bytes, capacity: int) -> list[bytes]:
    """Return the fragments of one answer; ``capacity`` is bytes per fragment with header."""
    if len(body) < _HEADER:
        return [_error(ABORT_UNSUPPORTED)]
    try:
        opcode, data = _look_up(dictionary, body[0] & 0x7F, body[_HEADER:].ljust(4, b"\0"))
    except SdoAbort as abort:
        return [_error(abort.code)]
    return _fragments(opcode, data, capacity)


def _look_up(dictionary: CoeDictionary, opcode: int, request: bytes) -> tuple[int, bytes]:
    word, subindex, wanted = struct.unpack_from("<HBB", request)
    if opcode == _LIST_REQUEST:
        return _LIST_ANSWER, _object_list(dictionary, word)
    if opcode == _OBJECT_REQUEST:
        return _OBJECT_ANSWER, _describe_object(dictionary, word)
    if opcode == _ENTRY_REQUEST:
        return _ENTRY_ANSWER, _describe_entry(dictionary, word, subindex, wanted)
    raise SdoAbort(ABORT_UNSUPPORTED)


def _error(code: int) -> bytes:
    return struct.pack("<BBHI", _ERROR, 0, 0, code)


def _fragments(opcode: int, data: bytes, capacity: int) -> list[bytes]:
    room = capacity - _HEADER
    parts = [data[i : i + room] for i in range(0, len(data), room)] or [b""]
    left = range(len(parts) - 1, -1, -1)
    return [
        struct.pack("<BBH", opcode | (_INCOMPLETE if n else 0), 0, n) + part
        for n, part in zip(left, parts, strict=True)
    ]


def _object_list(dictionary: CoeDictionary, kind: int) -> bytes:
    """Return list type 1 (all), 2 (RxPDO-mappable) or 3 (TxPDO-mappable); 0: five lengths."""
    lists = {1: dictionary.indices()}
    if kind in (0, 2, 3):
        lists[2] = [i for i in lists[1] if _mappable(dictionary, i, receive=True)]
        lists[3] = [i for i in lists[1] if _mappable(dictionary, i, receive=False)]
    if kind == 0:
        counts = [len(lists.get(n, [])) for n in (1, 2, 3, 4, 5)]
        return struct.pack("<H5H", 0, *counts)
    if kind not in (1, 2, 3, 4, 5):
        raise SdoAbort(ABORT_UNSUPPORTED)
    chosen = lists.get(kind, [])
    return struct.pack(f"<H{len(chosen)}H", kind, *chosen)


def _mappable(dictionary: CoeDictionary, index: int, receive: bool) -> bool:
    for subindex in dictionary.subindices(index):
        info = dictionary.entry(index, subindex)
        if info.pdo_rx if receive else info.pdo_tx:
            return True
    return False


def _describe_object(dictionary: CoeDictionary, index: int) -> bytes:
    subindices = dictionary.subindices(index)
    name = dictionary.object_name(index).encode("ascii", "replace")
    if subindices == [0]:
        kind = TYPE_CODE[dictionary.entry(index, 0).type]
        return struct.pack("<HHBB", index, kind, 0, _VAR) + name
    kinds = {dictionary.entry(index, s).type for s in subindices if s}
    is_array = len(kinds) == 1
    kind = TYPE_CODE[kinds.pop()] if is_array else 0
    code = _ARRAY if is_array else _RECORD
    return struct.pack("<HHBB", index, kind, subindices[-1], code) + name


def _describe_entry(dictionary: CoeDictionary, index: int, subindex: int, wanted: int) -> bytes:
    info = dictionary.entry(index, subindex)
    access = _READ_ALL if info.readable else 0
    if info.writable:
        access |= _WRITE_PREOP if dictionary.is_list(index) else _WRITE_ALL
    access |= (_MAP_RX if info.pdo_rx else 0) | (_MAP_TX if info.pdo_tx else 0)
    parameter = dictionary.parameter(index, subindex)
    given = wanted & 0x07
    limits = b""
    for bit, raw in _printed(parameter):
        if wanted & bit and (value := _encoded(info, raw)) is not None:
            given |= bit
            limits += value
    head = struct.pack(
        "<HBBHHH", index, subindex, given, TYPE_CODE[info.type], info.bit_length, access
    )
    return head + limits + info.name.encode("ascii", "replace")


def _printed(parameter: Parameter | None) -> list[tuple[int, int | float | str]]:
    """Return the manual's default, minimum and maximum, in the order of the service."""
    if parameter is None:
        return []
    found = (
        (_WITH_DEFAULT, parameter.default_raw),
        (_WITH_MINIMUM, parameter.min_raw),
        (_WITH_MAXIMUM, parameter.max_raw),
    )
    return [(bit, raw) for bit, raw in found if raw is not None]


def _encoded(info: EntryInfo, raw: int | float | str) -> bytes | None:
    if info.type in ("STRING", "OCTETS"):
        return None
    try:
        return encode(info.type, raw)
    except OutOfRange:
        return None  # a listed value that does not fit its type is omitted
