"""Conversion between bytes and raw values: pure, little endian (CiA 301 clause 7.1.4)."""

from __future__ import annotations

import struct

from drivers.errors import OutOfRange, ProtocolError
from drivers.texts.message import text
from profiles.schema import INTEGER_RANGE, DataType, Raw

_FORMAT: dict[str, str] = {
    "BOOL": "<B", "INT8": "<b", "UINT8": "<B", "INT16": "<h", "UINT16": "<H",
    "INT32": "<i", "UINT32": "<I", "INT64": "<q", "UINT64": "<Q", "REAL32": "<f",
}  # fmt: skip


def size_of(data_type: DataType) -> int | None:
    """Return the length in bytes, or None for text and octets, whose length the drive decides."""
    form = _FORMAT.get(data_type)
    return struct.calcsize(form) if form else None


#: The largest REAL32 (IEEE 754 binary32); integers have at most 64 bits.
_LARGEST = 3.4028234663852886e38


def encode(data_type: DataType, raw: Raw) -> bytes:
    """Convert a raw value to bytes.

    Raises:
        OutOfRange: not a number of this type, or outside its range.
    """
    if data_type == "OCTETS":
        return _octets(raw)
    if data_type == "STRING":
        if isinstance(raw, str):
            return raw.encode("utf-8")
        if raw not in range(256):  # NaN and numbers with a fraction neither
            raise OutOfRange("link.not-number", value=raw, data_type=data_type)
        return bytes([int(raw)])
    if isinstance(raw, str) or (isinstance(raw, bool) and data_type != "BOOL"):
        raise OutOfRange("link.not-number", value=raw, data_type=data_type)
    if not abs(raw) <= _LARGEST:  # also true for NaN
        raise OutOfRange("link.no-number", value=raw, data_type=data_type)
    if data_type == "REAL32":
        return struct.pack("<f", float(raw))
    if isinstance(raw, float) and not raw.is_integer():
        raise OutOfRange("link.not-whole-number-needs", value=raw, data_type=data_type)
    low, high = INTEGER_RANGE[data_type]
    if not low <= int(raw) <= high:
        raise OutOfRange(
            "link.not-fit",
            value=raw,
            limit=f"{low}…{high}",
            data_type=data_type,
            low=low,
            high=high,
        )
    return struct.pack(_FORMAT[data_type], int(raw))


def _octets(raw: Raw) -> bytes:
    """Convert the notation of `decode`, "0a ff", to bytes instead of sending it as text."""
    try:
        return bytes.fromhex(raw) if isinstance(raw, str) else bytes([int(raw)])
    except (ValueError, OverflowError) as error:
        raise OutOfRange(
            "link.no-row-bytes-hexadecimal",
            value=raw,
            limit=text("limit.bytes-as", example="0a ff 00"),
        ) from error


def serial_or_none(number: int | None) -> int | None:
    """Return a serial number (1018h:04); None for 0 and FFFFFFFFh, which was never written."""
    return None if number in (None, 0, 0xFFFFFFFF) else number


def text_of(data: bytes) -> str:
    """Decode a drive's text, which ends at the first zero byte or with the data."""
    text = data.split(b"\0", 1)[0]
    try:
        return text.decode("utf-8").strip()
    except UnicodeDecodeError:
        # CiA 301 allows only ASCII, but manufacturers use their own code pages. Latin-1 keeps every
        # byte.
        return text.decode("latin-1").strip()


def decode(data_type: DataType, data: bytes) -> Raw:
    """Convert bytes to a raw value.

    Raises:
        ProtocolError: the length does not fit the type.
    """
    if data_type == "STRING":
        return text_of(data)
    if data_type == "OCTETS":
        return data.hex(" ")
    form = _FORMAT[data_type]
    if len(data) != struct.calcsize(form):
        raise ProtocolError(
            "link.bytes-came-bytes",
            bytes=len(data),
            data_type=data_type,
            calcsize_bytes=struct.calcsize(form),
        )
    value: int | float = struct.unpack(form, data)[0]
    return value
