"""EDS files: good ones, odd ones, and a round trip through other people's reader."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import canopen
import pytest
from importer_samples import GOOD_EDS, ODD_EDS, facts, with_object

from profiles.importer import ImportFailed, export_eds, import_file, write_profile
from profiles.importer.eds.eds import MAX_BYTES
from profiles.loader import load_profile, parse_profile


def test_a_good_file_gives_a_profile_merged_over_the_generic_one() -> None:
    imported = import_file(GOOD_EDS.encode(), "good.eds")
    profile = imported.profile
    assert imported.report.findings == []
    assert profile.drive == "servo_400"
    assert profile.identity.vendor_id == 0x1A2
    assert profile.identity.product_code == 0x190
    assert profile.identity.revision == 0x10002
    gain = profile.by_key["2010:00"]
    assert (gain.name, gain.unit, gain.type) == ("Gain", "1/s", "UINT16")
    assert (gain.min_raw, gain.max_raw, gain.default_raw) == (1, 2000, 40)
    assert gain.source.startswith("good.eds:")
    position = profile.by_key["607A:00"]
    assert (position.min_raw, position.max_raw) == (-(2**31), 2**31 - 1)
    assert (position.pdo, position.access, position.unit) == ("rx", "rw", "inc")
    assert profile.by_key["6041:00"].bits["3"] == "fault"  # from the generic profile
    assert profile.by_role["status_word"].key == "6041:00"
    assert "velocity_actual" not in profile.by_role  # the drive has no 606Ch
    assert profile.supported_modes == (1, 8)
    assert profile.pdo is not None
    assert [(s.index, s.entries) for s in profile.pdo.sets] == [
        (0x1600, ("6040:00",)),
        (0x1A00, ("6041:00",)),
    ]
    watchdog = profile.links[0].watchdog
    assert not watchdog.present  # no 1016h in this file


def test_counting_subindices_are_no_parameters() -> None:
    profile = import_file(GOOD_EDS.encode(), "good.eds").profile
    assert "1018:00" not in profile.by_key
    assert profile.by_key["1018:01"].name == "Identity: Vendor ID"


@pytest.mark.parametrize(
    ("oddity", "key", "field", "value", "finding"),
    [
        ("blanks", "2100:00", "type", "UINT16", None),
        ("orphan", "2100:01", "default_raw", 3, "description.no-own-section"),
        ("sub_case", "210A:01", "default_raw", 3, None),
        ("boolean", "2100:00", "default_raw", 1, None),
        ("point", "2100:00", "default_raw", 5, "description.decimal-point"),
        ("deftype", "2100:00", "type", "UINT16", "description.type-of-file"),
        ("zeros", "2100:00", "default_raw", 50, "description.leading-zeros"),
        ("modules", "2100:00", "type", "UINT16", "description.module-sections"),
        ("compact", "2100:03", "default_raw", 9, None),
        ("compact", "2100:02", "name", "Rate: Second", None),
        ("access", "2100:00", "access", "ro", None),
        ("access", "2100:00", "default_raw", None, None),
        ("limits", "2100:00", "default_raw", -2, None),
        ("limits", "2100:00", "min_raw", None, "description.limits-swapped"),
        ("no_limits", "2100:00", "max_raw", None, "description.limits-zero"),
        ("stray", "2100:00", "type", "UINT16", "description.no-section-no-value"),
        ("stray", "2100:00", "default_raw", None, "description.no-number"),
        ("suffix", "2100:00", "default_raw", 16, "description.hexadecimal"),
        ("suffix", "2100:00", "access", "ro", "description.access-unknown (access=rwx)"),
        ("twice", "2100:00", "default_raw", 1, "description.section-twice"),
        (
            "count",
            "2100:01",
            "type",
            "UINT16",
            "description.subindices-differ (announced=9, given=2)",
        ),
        ("count", "2100:01", "type", "UINT16", "description.listed-not-described (index=10649)"),
        (
            "sign",
            "606C:00",
            "type",
            "INT32",
            "description.type-replaced (key=606C:00, type=UINT32, standard=INT32)",
        ),
        ("sign", "606C:00", "max_raw", -1, None),
        ("no_type", "6064:00", "type", "INT32", "description.type-of-standard"),
    ],
)
def test_oddities_are_understood_and_reported(
    oddity: str, key: str, field: str, value: object, finding: str | None
) -> None:
    imported = import_file(with_object(ODD_EDS[oddity]), "odd.eds")
    assert getattr(imported.profile.by_key[key], field) == value
    texts = [str(f) for f in imported.report.findings]
    if finding is not None:
        assert any(finding in text for text in texts), texts
    if oddity in ("blanks", "sub_case", "boolean", "compact"):
        assert texts == []  # allowed, or harmless: not worth a line


def test_an_unknown_type_is_left_out_and_said() -> None:
    imported = import_file(with_object(ODD_EDS["unknown_type"]), "odd.eds")
    assert "2100:00" not in imported.profile.by_key
    assert ("description.type-code-unknown", {"type": 0xFF}) in facts(imported)
    assert {f.outcome for f in imported.report.findings} == {"left out"}


@pytest.mark.parametrize(
    ("encoding", "text"),
    [
        ("cp1252", "Verzögerungszeit für Rampe"),
        ("gb18030", "速度环增益参数设置"),
        ("utf-8-sig", "Verzögerungszeit"),
        ("utf-16", "Verzögerungszeit"),
    ],
)
def test_makers_use_many_encodings(encoding: str, text: str) -> None:
    odd = f"{GOOD_EDS}\n[2100]\nParameterName={text}\nDataType=6\nAccessType=rw\n"
    imported = import_file(odd.encode(encoding), "odd.eds")
    assert imported.profile.by_key["2100:00"].name == text


@pytest.mark.parametrize("data", [b"", b"hello", b"[2000]\nx=y\n", b"\0" * 1000, b"PK\x03\x04"])
def test_what_is_no_eds_file_is_refused_with_a_reason(data: bytes) -> None:
    with pytest.raises(
        ImportFailed, match=r"description\.(no-eds-objects|no-typed-object|archive) \(file=x.eds"
    ):
        import_file(data, "x.eds")


def test_a_file_that_is_too_big_is_not_read() -> None:
    with pytest.raises(ImportFailed, match=r"too-large .*limit_mib=8"):
        import_file(b";" * (MAX_BYTES + 1), "x.eds")


def test_values_of_one_machine_are_no_defaults() -> None:
    odd = "[2100]\nParameterName=Rate\nDataType=6\nAccessType=rw\nDefaultValue=1\nParameterValue=2"
    imported = import_file(with_object(odd), "x.dcf")
    assert imported.profile.by_key["2100:00"].default_raw == 1
    assert ("description.configured-values", {"values": 1}) in facts(imported)


CREATED = datetime(2026, 1, 2, 3, 4, tzinfo=UTC)


def test_export_is_read_by_canopen_and_by_us(tmp_path: Path) -> None:
    profile = load_profile("generic402")
    text = export_eds(profile, CREATED)
    path = tmp_path / "generic402.eds"
    path.write_bytes(text.encode())
    dictionary = canopen.import_od(str(path), node_id=5)
    assert dictionary[0x6040].data_type == canopen.objectdictionary.UNSIGNED16
    assert dictionary[0x6099][1].name == "speed during search for switch"
    assert dictionary[0x1018][4].access_type == "ro"
    again = import_file(text.encode(), "generic402.eds")
    assert again.report.findings == []
    for parameter in profile.parameters:
        other = again.profile.by_key[parameter.key]
        for field in ("type", "access", "pdo", "min_raw", "max_raw", "default_raw", "name"):
            assert getattr(other, field) == getattr(parameter, field), (parameter.key, field)


def test_what_only_modbus_reaches_is_not_exported() -> None:
    imported = import_file(GOOD_EDS.encode(), "good.eds").profile
    parameter = imported.parameters[0].model_copy(update={"key": "PA_38", "modbus_register": 38})
    profile = imported.model_copy(update={"parameters": (*imported.parameters, parameter)})
    assert "PA_38" not in export_eds(profile, CREATED)


def test_an_imported_profile_is_written_and_loaded_like_any_other(tmp_path: Path) -> None:
    profile = import_file(GOOD_EDS.encode(), "good.eds").profile
    target = write_profile(profile, tmp_path)
    assert parse_profile({"profile.yaml": target.read_text("utf-8")}) == profile
    with pytest.raises(ImportFailed, match=r"description.profile-file-exists"):
        write_profile(profile, tmp_path)


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (b"PK\x03\x04\x14\0", "archive"),
        (b"%PDF-1.7", "pdf"),
        (b"\n<!DOCTYPE html><html><body>404</body></html>", "web-page"),
        (
            b'\xef\xbb\xbf<?xml version="1.0"?>\n<ISO15745ProfileContainer xmlns="x"/>',
            "xdd",
        ),
    ],
)
def test_files_that_are_mistaken_for_a_description_are_named(data: bytes, what: str) -> None:
    with pytest.raises(ImportFailed, match=rf"^description\.{what} \(file=drive\)$"):
        import_file(data, "drive")


@pytest.mark.parametrize("remark", ["# a word", "// a word", "; a word", "#"])
def test_a_remark_behind_a_number_is_no_part_of_it(remark: str) -> None:
    odd = (
        f"[2100]\nParameterName=Odd\nObjectType=0x07 {remark}\nDataType=0x0006 {remark}\n"
        f"AccessType=rw {remark}\nDefaultValue=16#1F {remark}\nPDOMapping=0 {remark}\n"
    )
    imported = import_file(with_object(odd), "odd.eds")
    found = imported.profile.by_key["2100:00"]
    assert (found.type, found.access, found.default_raw) == ("UINT16", "rw", 31)
    assert facts(imported) == []


@pytest.mark.parametrize(("count", "last"), [("3", 3), ("254", 254), ("255", 254), ("9" * 30, 254)])
def test_a_compact_array_has_no_more_than_254_members(count: str, last: int) -> None:
    odd = (
        f"[2100]\nParameterName=History\nObjectType=8\nCompactSubObj={count}\n"
        "DataType=7\nAccessType=ro\n"
    )
    keys = import_file(with_object(odd), "odd.eds").profile.by_key
    assert [k for k in keys if k.startswith("2100")] == [
        f"2100:{n:02X}" for n in range(1, last + 1)
    ]


@pytest.mark.parametrize(
    "number", ["1 2", "1\t2", "1 000", "- 1 2", "0x1 2", "1\u00a0000", "1,000"]
)
def test_a_number_that_may_be_another_one_is_left_out(number: str) -> None:
    """ "1 2" became 12, and "1,000" became 1."""
    entry = f"[2100]\nParameterName=Rate\nDataType=0x0006\nAccessType=rw\nDefaultValue={number}\n"
    imported = import_file(with_object(entry), "x.eds")
    assert imported.profile.by_key["2100:00"].default_raw is None
    found = [f for f in imported.report.findings if f.outcome == "left out"]
    assert [f.code for f in found] == [
        "description.two-ways" if "," in number else "description.no-number"
    ]
    assert "DefaultValue" in found[0].place


@pytest.mark.parametrize("number", ["12", " 12 ", "0xC", "+ 12", '" 12 "', "1_2", "12 ; Hz"])
def test_blanks_around_a_number_change_none(number: str) -> None:
    entry = f"[2100]\nParameterName=Rate\nDataType=0x0006\nAccessType=rw\nDefaultValue={number}\n"
    assert import_file(with_object(entry), "x.eds").profile.by_key["2100:00"].default_raw == 12
