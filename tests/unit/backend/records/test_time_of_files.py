"""The time to read a file grows with its size, not with the square of it.

A search that holds the interpreter stops everything else of the server meanwhile, STOP too. Each of
these files of some 60 kB took between 2 s and minutes before its reader was changed.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from datetime import UTC, datetime

import pytest

from backend.axes.parameters.csv_list import ParameterList
from backend.axes.parameters.lists import import_list
from backend.axes.parameters.set_file import BadSet, parse
from backend.axes.parameters.toml_keys import deepest_key
from backend.records.handover.read import read_list
from profiles import load_profile
from profiles.importer.eds.sections import Section

SIZE = 60_000
#: Processor time; a reader that takes the square of the size needs at least 2 s.
MOST_S = 1.0
DCF = b"[FileInfo]\n[DeviceInfo]\n"
DOWNLOAD = b"ethercat download -p 0 -t uint16 0x6072 0 1\n"


def start_up_list(data: bytes) -> object:
    return read_list(data, load_profile("mms7"), "list")


def list_of_parameters(data: bytes, family: str = "ds_c") -> ParameterList:
    return import_list(data, load_profile(family), "list", datetime(2026, 1, 2, tzinfo=UTC))[1]


def parameter_set(data: bytes) -> object:
    return parse(data, "list")


@pytest.mark.long(keep=4)
@pytest.mark.parametrize(
    ("read", "data"),
    [
        (start_up_list, b"x\n" + b"\n" * SIZE + b"y"),
        (start_up_list, b"x\n" + b" " * SIZE + b"y"),
        (start_up_list, b"aaaaaaaa\\\n" * (20 * SIZE // 10) + DOWNLOAD),
        (start_up_list, b"ethercat download -p 0 -t uint16 " + b"a" * (20 * SIZE) + b" 0 1\n"),
        (start_up_list, DOWNLOAD * (5 * SIZE // len(DOWNLOAD))),
        (start_up_list, DCF + b"[6072]\nDataType=6" + b" " * SIZE + b"x\nParameterValue=1\n"),
        (list_of_parameters, DCF + b"[6072]\nDataType=6" + b" " * SIZE + b"x\nParameterValue=1\n"),
        (list_of_parameters, DCF + b"[6072]\nParameterValue=1" + b" " * SIZE + b"x\n"),
        (list_of_parameters, b"key,raw\n6072:" + b" " * SIZE + b"00,1\n"),
        (parameter_set, b"a." * (SIZE // 2) + b"a = 1\n"),
        (parameter_set, b"[" + b"a." * (3 * SIZE) + b"a]\n"),
        (parameter_set, b"a = {" + b'"b".' * (3 * SIZE) + b"b = 1}\n"),
        (parameter_set, b"a = {b='\\', " + b"b." * (3 * SIZE) + b"b = 1}\n"),
    ],
    ids=lambda value: getattr(value, "__name__", None) or f"{value[:24]!r}",
)
def test_hostile_files_take_no_square_of_their_size(
    read: Callable[[bytes], object], data: bytes
) -> None:
    for family in ("mms7", "ds_c"):
        load_profile(family)  # is not measured
    before = time.thread_time()
    with contextlib.suppress(BadSet):
        read(data)
    assert time.thread_time() - before < MOST_S


@pytest.mark.long(keep=3)
@pytest.mark.parametrize(
    "data",
    [
        b"sdo: [" + b"1," * 300_000 + b"1]",
        b"<masters>" + b"<a/>" * 700_000 + b"</masters>",
        (25_000).to_bytes(4, "little") + b"\x72\x60\0\1\0\0\0\1" * 25_000,
        DOWNLOAD * 20_001,
        b"key,index,subindex,data\n" + b"a,0x6072,0,00 00\n" * 20_001,
    ],
    ids=["yaml", "xml", "concise dcf", "script", "csv"],
)
def test_lists_with_more_than_a_controller_writes_are_refused(data: bytes) -> None:
    with pytest.raises(BadSet) as refused:
        start_up_list(data)
    assert "more than" in refused.value.message


@pytest.mark.parametrize(
    ("written", "parts"),
    [
        ("a.b.c = 1", 3),
        ('a = "x.y.z.w" # a.b.c', 1),
        ('"a".b."c.d" = 1', 3),
        ("a = '\\'\nb.c.d = 1", 3),
        ("x = {a = '\\', b.b.b.b = 1}", 4),
        ('n = """\n"a.b.c\n..."""\nb.c = 1', 2),
        ("n = '''\n'a.b.c\n...'''\nb.c = 1", 2),
        ('a = "\\".x.x.x"', 1),
        ("[a.b.c]", 3),
    ],
)
def test_parts_of_the_longest_key_are_counted(written: str, parts: int) -> None:
    assert deepest_key(written) == parts


@pytest.mark.parametrize("remark", ["  ; a type", ";", "   // a type", ""])
def test_a_remark_behind_a_word_is_left_out(remark: str) -> None:
    assert Section(1, {"datatype": f"0x0007{remark}"}).word("datatype") == "0x0007"


@pytest.mark.parametrize(
    ("value", "raw"), [("$NODEID+0x200", 0x205), ("0x200 + $ NODE-ID", 0x205), ("NodeId", 5)]
)
def test_a_value_relative_to_the_node_is_the_sum(value: str, raw: int) -> None:
    data = f"{DCF.decode()}[DeviceComissioning]\nNodeID=5\n[607F]\nParameterValue={value}\n"
    found = list_of_parameters(data.encode(), "mms7")
    assert [reading.raw for reading in found.readings] == [raw]
