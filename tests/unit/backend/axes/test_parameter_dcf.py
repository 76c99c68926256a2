"""DCF: what is exported is a file of CiA 306 that others read, and theirs is read here."""

from __future__ import annotations

import io
from contextlib import suppress
from datetime import datetime
from pathlib import Path

import canopen
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from backend.axes.parameters.csv_list import LeftOut
from backend.axes.parameters.dcf import read_dcf, write_dcf
from backend.axes.parameters.lists import import_list
from backend.axes.parameters.set_file import BadSet, Row, parse
from backend.commands.drive.params import app
from drivers.texts.message import Text
from profiles import load_profile
from profiles.importer import export_eds
from profiles.schema import Profile

DS_C = load_profile("ds_c")
WHEN = datetime(2026, 1, 2, 3, 4)
ROWS = [Row("6083:00", 250), Row("607C:00", -1200)]

#: As CiA 306 clause 5.3 lays a DCF out, with notations that makers use.
THEIRS = b"""[FileInfo]\r
FileName=theirs.dcf\r
[DeviceInfo]\r
VendorName=somebody\r
[DeviceComissioning]\r
NodeID=3\r
[6083]\r
ParameterName=Profile acceleration\r
ObjectType=0x7\r
DataType=0x0007\r
AccessType=rw\r
DefaultValue=100\r
ParameterValue=0xFA\r
[607C]\r
ParameterName=Home offset\r
DataType=0x0004\r
AccessType=rw\r
ParameterValue=0xFFFFFB50\r
[6084]\r
DataType=0x0007\r
DefaultValue=100\r
[5FFF]\r
DataType=0x0007\r
ParameterValue=1\r
"""


def dcf(rows: list[Row]) -> tuple[str, tuple[LeftOut, ...]]:
    return write_dcf(DS_C, rows, file_name="x.dcf", node_name="Z axis", created=WHEN)


def test_another_library_reads_the_values() -> None:
    text, left_out = dcf(ROWS)
    assert left_out == ()
    file = io.StringIO(text)
    file.name = "x.dcf"
    objects = canopen.import_od(file)
    assert objects[0x6083].value == 250
    assert objects[0x607C].value == -1200
    assert objects[0x6084].value is None


def test_what_is_written_is_read() -> None:
    text, _ = dcf(ROWS)
    assert {r.key: r.raw for r in read_dcf(text.encode(), DS_C).readings} == {
        "6083:00": 250,
        "607C:00": -1200,
    }


def test_another_makers_file() -> None:
    found = read_dcf(THEIRS, DS_C, "theirs.dcf")
    # FFFFFB50h as a 32-bit two's complement is -1200; a default is no value to be set.
    assert {r.key: r.raw for r in found.readings} == {"6083:00": 250, "607C:00": -1200}
    assert any("5FFF:00" in problem.words() for problem in found.problems)


def test_arrays_in_compact_storage() -> None:
    """CiA 306-1 clause 7.5.3: their values stand in a section of their own."""
    compact = b"[607D]\nObjectType=8\nCompactSubObj=2\n[607DValue]\nNrOfEntries=2\n1=-9\n2=0x8\n"
    found = read_dcf(compact, load_profile("generic402"))
    assert {r.key: r.raw for r in found.readings} == {"607D:01": -9, "607D:02": 8}


def test_a_file_for_another_makers_drive_is_refused() -> None:
    identity = DS_C.identity.model_copy(update={"vendor_id": 0x31, "product_code": 5})
    known = DS_C.model_copy(update={"identity": identity})

    def read(numbers: bytes, profile: Profile = known) -> tuple[Text, ...]:
        return read_dcf(THEIRS.replace(b"VendorName=somebody", numbers), profile).problems

    for numbers in (b"VendorNumber=0x31\r\nProductNumber=5", b"VendorNumber=0", b"VendorNumber="):
        assert not any("product" in problem.words() for problem in read(numbers))
    assert "for product 00000006h, this family is 00000005h" in read(b"ProductNumber=6")[0].words()
    with pytest.raises(BadSet, match="is for a drive of vendor 00000099h"):
        read(b"VendorNumber=0x99")
    read(b"VendorNumber=0x99", DS_C)  # whose manual prints no vendor number


def test_the_set_of_a_dcf_says_for_which_drive_it_is() -> None:
    numbered = THEIRS.replace(b"VendorName=somebody", b"VendorNumber=0x31\r\nProductNumber=5")
    for data, identity in ((numbered, (0x31, 5, None)), (THEIRS, (None, None, None))):
        content = parse(import_list(data, DS_C, "theirs.dcf", WHEN)[0])
        assert (content.vendor_id, content.product_code, content.serial) == identity


def test_each_row_that_the_format_cannot_hold_is_named_with_its_reason() -> None:
    only_modbus = next(p.key for p in DS_C.parameters if p.index is None and p.access == "rw")
    text, left_out = dcf(
        [
            *ROWS,
            Row(only_modbus, 1),
            Row("6083:00", 7),
            Row("5FFF:00", 1),
            Row("6084:00", None),
            Row("607A:00", "many"),
            Row("60FF:00", 2**40),
        ]
    )
    assert [(each.key, each.why.code) for each in left_out] == [
        (only_modbus, "sets.left-out-no-object"),
        ("6083:00", "sets.row-twice"),
        ("5FFF:00", "sets.row-no-parameter"),
        ("6084:00", "sets.left-out-no-value"),
        ("607A:00", "sets.left-out-type"),
        ("60FF:00", "sets.left-out-type"),
    ]
    values = {r.key: r.raw for r in read_dcf(text.encode(), DS_C).readings}
    assert values == {"6083:00": 250, "607C:00": -1200}


def test_the_command_line_says_which_rows_are_missing_in_the_dcf(tmp_path: Path) -> None:
    only_modbus = next(p for p in DS_C.parameters if p.index is None and p.access == "rw")
    listed = f"key,raw\n6083:00,250\n{only_modbus.key},{only_modbus.min_raw or 0}\n"
    data, _ = import_list(listed.encode(), DS_C, "a.csv", WHEN)
    (tmp_path / "a.sdset").write_bytes(data)

    def export(name: str) -> str:
        done = CliRunner().invoke(app, ["export", f"{tmp_path}/a.sdset", f"{tmp_path}/{name}"])
        assert done.exit_code == 0, done.output
        return done.output

    said = export("b.dcf")
    assert f"left out: {only_modbus.key}: only Modbus reaches it" in said
    assert "b.dcf: 1 parameters" in said
    assert "b.dcf lacks 1 row of the set: keep the set itself" in said
    assert "left out" not in export("b.csv")


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        (export_eds(DS_C, WHEN).encode(), "sets no values"),
        (b"[FileInfo]\n[2FFF]\nParameterValue=1\n", "no value of a"),
        (b"", "sets no values"),
    ],
)
def test_unusable_files_are_refused_in_words(data: bytes, complaint: str) -> None:
    with pytest.raises(BadSet, match=complaint):
        read_dcf(data, DS_C)


@settings(max_examples=80, deadline=None)
@given(st.binary(max_size=300), st.integers(0, len(THEIRS)))
def test_no_bytes_make_the_reader_crash(noise: bytes, at: int) -> None:
    with suppress(BadSet):
        read_dcf(THEIRS[:at] + noise + THEIRS[at:], DS_C)


def test_from_a_set_to_a_dcf_and_back_on_the_command_line(tmp_path: Path) -> None:
    def run(*words: str) -> tuple[int, str]:
        done = CliRunner().invoke(app, [*(w.replace("@", f"{tmp_path}/") for w in words)])
        return done.exit_code, done.output

    (tmp_path / "theirs.dcf").write_bytes(THEIRS)
    code, text = run("import", "@theirs.dcf", "@a.sdset", "--profile", "ds_c")
    assert code == 0, text
    assert "2 parameters, 1 lines not used" in text
    for name in ("@b.dcf", "@b.csv"):
        code, text = run("export", "@a.sdset", name)
        assert code == 0, text
    for name in ("b.dcf", "b.csv"):
        code, text = run("import", f"@{name}", "@c.sdset", "--profile", "ds_c")
        assert code == 0, text
        back = parse((tmp_path / "c.sdset").read_bytes(), "c").rows
        first = parse((tmp_path / "a.sdset").read_bytes(), "a").rows
        assert {r.key: r.raw for r in back} == {r.key: r.raw for r in first}
    code, text = run("export", "@a.sdset", "@b.xls")
    assert (code, "neither CSV nor DCF" in text) == (1, True)
    assert run("export", "@none.sdset", "@b.csv")[0] == 1


def test_utf_16_without_a_mark_is_a_dcf() -> None:
    for encoding in ("utf-16-le", "utf-16-be"):
        data = THEIRS.decode().encode(encoding)
        _, found = import_list(data, DS_C, "theirs.txt", WHEN)
        assert {r.key: r.raw for r in found.readings} == {"6083:00": 250, "607C:00": -1200}


def test_a_text_is_written_as_it_is_or_not_at_all() -> None:
    """Two blanks became one, and what was behind 241 characters was lost."""
    texts = DS_C.by_key["6083:00"].model_copy(update={"type": "STRING", "min_raw": None})
    family = DS_C.model_copy(update={"parameters": (texts,), "by_key": {texts.key: texts}})

    def written(value: str) -> tuple[dict[str, object], int]:
        text, left_out = write_dcf(
            family, [Row("6083:00", value)], file_name="x.dcf", node_name="Z", created=WHEN
        )
        with suppress(BadSet):
            read = read_dcf(text.encode(), family)
            return {r.key: r.raw for r in read.readings}, len(left_out)
        return {}, len(left_out)

    for value in ("A  B", "A;B // C", "x" * 300):
        assert written(value) == ({"6083:00": value}, 0)
    for value in ("A\nB", " A", "A\t", ""):
        assert written(value) == ({}, 1)
