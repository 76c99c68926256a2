"""Bytes and values: what is read can be written back, and nothing else is sent."""

from __future__ import annotations

import math

import pytest

from drivers.errors import OutOfRange
from drivers.objects.codec import decode, encode
from profiles.schema import DataType, Raw


@pytest.mark.parametrize(
    ("data_type", "data", "value"),
    [
        ("OCTETS", b"\x0a\xff\x00", "0a ff 00"),
        ("OCTETS", b"", ""),
        ("STRING", b"motor", "motor"),
        ("STRING", "Säge 锯".encode(), "Säge 锯"),
        ("REAL32", b"\x00\x00\xc0\x3f", 1.5),
        ("INT8", b"\xff", -1),
        ("UINT64", b"\xff" * 8, 2**64 - 1),
    ],
)
def test_there_and_back(data_type: DataType, data: bytes, value: Raw) -> None:
    assert decode(data_type, data) == value
    assert encode(data_type, value) == data


def test_text_in_another_code_page_keeps_its_letters() -> None:
    assert decode("STRING", "Säge".encode("latin-1") + b"\0\0") == "Säge"


@pytest.mark.parametrize(
    ("data_type", "value"),
    [
        ("OCTETS", "speed"),  # letters where bytes are meant: 73 70 65 … must not reach the drive
        ("OCTETS", "0a f"),
        ("OCTETS", 256),
        ("STRING", 256),
        ("STRING", -1),
        ("STRING", 1.5),
        ("STRING", math.nan),
        ("INT16", math.nan),
        ("INT16", math.inf),
        ("INT16", 1.5),
        ("INT16", True),
        ("INT16", "1"),
        ("UINT16", -1),
        ("UINT16", 10**400),
        ("REAL32", math.nan),
        ("REAL32", 1e39),
    ],
)
def test_what_is_no_value_is_refused(data_type: DataType, value: Raw) -> None:
    with pytest.raises(OutOfRange):
        encode(data_type, value)
