"""ESI files: good ones, odd ones and hostile ones; and the drive's own dictionary."""

from __future__ import annotations

import pytest
from importer_samples import GOOD_ESI, facts

from profiles.importer import ImportFailed, ImportReport, build_profile, import_file
from profiles.importer.dictionary import DictionaryEntry, describe_dictionary
from profiles.importer.esi.esi import MAX_BYTES, esi_devices, open_esi
from profiles.importer.values import unit_of_code


def test_a_good_file() -> None:
    imported = import_file(GOOD_ESI.encode(), "good.xml", product_code=0x190)
    profile = imported.profile
    assert profile.identity.maker == "Example Drives"
    assert profile.identity.model == "Drive ES4"  # English before German
    assert (profile.identity.vendor_id, profile.identity.product_code) == (0xA2B, 0x190)
    switch = profile.by_key["2000:00"]
    assert (switch.type, switch.default_raw) == ("UINT16", 1)
    assert switch.enum == {0: "Off", 1: "On"}
    ramp = profile.by_key["2001:00"]
    assert (ramp.min_raw, ramp.default_raw, ramp.max_raw, ramp.unit) == (-10, -5, 10, "ms")
    assert [k for k in profile.by_key if k.startswith("2020")] == ["2020:01", "2020:02", "2020:03"]
    speed = profile.by_key["6099:01"]
    assert (speed.name, speed.default_raw, speed.pdo) == (
        "Homing speeds: Speed for switch",
        1000,
        "rx",
    )
    assert profile.by_key["6099:02"].default_raw is None
    assert profile.links[0].complete_access
    assert profile.links[0].foe
    assert profile.pdo is not None
    assert [(s.entries, s.fixed) for s in profile.pdo.sets] == [
        (("6040:00", "607A:00"), False),
        (("6041:00",), True),
    ]
    # Only the PDO names 607Ah, as unsigned: the standard's sign counts, and it is said.
    assert profile.by_key["607A:00"].type == "INT32"
    assert [f.outcome for f in imported.report.findings] == ["repaired"]


def test_the_devices_of_a_series_can_be_chosen() -> None:
    devices = esi_devices(open_esi(GOOD_ESI.encode(), "good.xml", ImportReport()))
    assert [(d.name, d.product_code, d.revision) for d in devices] == [
        ("Drive ES4", 0x190, 2),
        ("Drive ES5", 0x191, 1),
    ]
    second = import_file(GOOD_ESI.encode(), "good.xml", product_code=0x191)
    assert second.profile.identity.model == "Drive ES5"
    assert ("description.no-dictionary", {}) in facts(second)
    newer = import_file(GOOD_ESI.encode(), "good.xml", product_code=0x190, revision=9)
    assert "description.other-revision" in [code for code, _ in facts(newer)]
    with pytest.raises(ImportFailed, match=r"no-product .*product=2457"):
        import_file(GOOD_ESI.encode(), "good.xml", product_code=0x999)


@pytest.mark.parametrize(
    "data",
    [
        b"\xef\xbb\xbf" + GOOD_ESI.encode(),  # Omron: byte order mark
        b"\r\n\r\n" + GOOD_ESI.encode(),  # blank lines before the declaration
        GOOD_ESI.replace("UTF-8", "gb2312").encode("gb2312"),  # Chinese makers
        GOOD_ESI.replace("UTF-8", "ISO-8859-1").encode("latin-1"),
        GOOD_ESI.replace("UTF-8", "utf-16").encode("utf-16"),
        GOOD_ESI.replace("<EtherCATInfo ", '<EtherCATInfo xmlns="urn:x" ').encode(),
        # the list that a master prints (IgH, SOEM tools)
        ("<EtherCATInfoList>" + GOOD_ESI.partition("?>")[2] + "</EtherCATInfoList>").encode(),
    ],
)
def test_wrappings_of_the_same_contents(data: bytes) -> None:
    profile = import_file(data, "odd.xml", product_code=0x190).profile
    assert profile.by_key["6099:01"].default_raw == 1000


def _changed(before: str, after: str) -> str:
    assert before in GOOD_ESI
    return GOOD_ESI.replace(before, after)


@pytest.mark.parametrize(
    ("text", "key", "field", "value", "finding"),
    [
        # decimal instead of #x numbers (Festo)
        (_changed("#x2001", "8193"), "2001:00", "default_raw", -5, None),
        # signed objects as unsigned (Lichuan- and StepperOnline-like)
        (
            _changed("<Index>#x2001</Index><Name>Ramp</Name><Type>INT</Type><BitSize>16",
                     "<Index>#x606C</Index><Name>Ramp</Name><Type>UDINT</Type><BitSize>32"),
            "606C:00", "type", "INT32",
            "description.type-replaced (key=606C:00, type=UINT32, standard=INT32)",
        ),
        # read-only although it is an output (SSC-generated)
        (
            _changed("<Access>rw</Access><PdoMapping>R</PdoMapping></Flags></Object>",
                     "<Access>ro</Access><PdoMapping>R</PdoMapping></Flags></Object>"),
            "6040:00", "access", "rw", "description.output-marked-read-only (key=6040:00)",
        ),
        # a record whose type is missing (hand-made files)
        (
            _changed("<DataType><Name>DT6099</Name>", "<DataType><Name>DT6098</Name>"),
            "6099:01", "default_raw", None, "description.type-not-described (type=DT6099)",
        ),
        # default as number with #x in DefaultData
        (_changed("0100</DefaultData>", "#x0001</DefaultData>"), "2000:00", "default_raw", 1, None),
        # a type that refers to itself
        (
            _changed("<Name>DT0800EN16</Name><BaseType>UINT<",
                     "<Name>DT0800EN16</Name><BaseType>DT0800EN16<"),
            "2000:00", "type", "UINT16", None,
        ),
        # array written out in the type's name
        (_changed("<Type>DT2020ARR</Type>", "<Type>ARRAY [1..3] OF UINT</Type>"),
         "2020:03", "type", "UINT16", None),
    ],
)  # fmt: skip
def test_oddities_are_understood_and_reported(
    text: str, key: str, field: str, value: object, finding: str | None
) -> None:
    imported = import_file(text.encode(), "odd.xml", product_code=0x190)
    if field == "default_raw" and value is None:
        assert key not in imported.profile.by_key or (
            imported.profile.by_key[key].default_raw is value
        )
    else:
        assert getattr(imported.profile.by_key[key], field) == value
    if finding is not None:
        assert any(finding in str(f) for f in imported.report.findings)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"<EtherCATConfig/>", "description.network-configuration"),
        (b"<html/>", "description.web-page"),
        (b"<EtherCATInfo><Vendor/></EtherCATInfo>", "description.no-devices"),
        (b"<EtherCATInfo>", "description.no-xml"),
        (b"<", "description.no-xml"),
        (
            b'<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><EtherCATInfo>&b;'
            b"</EtherCATInfo>",
            "description.dtd",
        ),
        (
            b'<!DOCTYPE x SYSTEM "file:///etc/passwd"><EtherCATInfo/>',
            "description.dtd",
        ),
    ],
)
def test_hostile_and_foreign_files_are_refused(data: bytes, says: str) -> None:
    with pytest.raises(ImportFailed, match=says):
        import_file(data, "x.xml")


def test_a_file_that_is_too_big_is_not_read() -> None:
    with pytest.raises(ImportFailed, match=r"too-large .*limit_mib=32"):
        import_file(b"<" + b" " * MAX_BYTES, "x.xml")


def test_deep_nesting_is_survived() -> None:
    deep = b"<EtherCATInfo>" + b"<a>" * 50_000 + b"</a>" * 50_000 + b"</EtherCATInfo>"
    with pytest.raises(ImportFailed):
        import_file(deep, "x.xml")


def test_units_by_number() -> None:
    # CiA 303-2: revolutions B4h per minute 47h; milli FDh ampere 04h; increments B5h per s² 57h.
    assert unit_of_code("#x00B44700") == "rpm"
    assert unit_of_code("#xFD040000") == "mA"
    assert unit_of_code("0x00B55700") == "inc/s²"
    assert unit_of_code("rpm") == ""


def _entry(index: int, subindex: int, type_code: int, access: int, **more: object) -> object:
    values: dict[str, object] = {"name": f"n{subindex}", "bit_length": 16, **more}
    return DictionaryEntry(index, subindex, type_code=type_code, access=access, **values)  # type: ignore[arg-type]


def test_the_drives_own_dictionary() -> None:
    # Flags: 07h read in all states, 38h write, 40h RxPDO, 80h TxPDO (ETG.1000.6 clause 5.6.3).
    entries = [
        _entry(0x0005, 0, 5, 7),
        _entry(0x6040, 0, 0x06, 0x7F, name="Controlword"),
        _entry(0x6041, 0, 0x06, 0x87, name="Statusword"),
        _entry(0x6041, 0, 0x06, 0x87, name="Statusword"),
        _entry(0x2000, 0, 0x05, 0x07, members=2, object_name="Gains"),
        _entry(
            0x2000,
            1,
            0x06,
            0x3F,
            members=2,
            object_name="Gains",
            name="Speed loop (Hz)",
            default=b"\x28\0",
            minimum=b"\x01\0",
            maximum=b"\xe8\x03",
            unit=0x00200000,
        ),
        _entry(0x2001, 0, 0x0999, 0x38, name="Odd", bit_length=32),
        _entry(0x2002, 0, 0x0999, 0x38, name="Nothing", bit_length=0),
    ]
    report = ImportReport()
    described = describe_dictionary(entries, name="ES4", report=report, vendor_id=7)  # type: ignore[arg-type]
    profile = build_profile(described, report).profile
    assert list(profile.by_key) == ["6040:00", "6041:00", "2000:01", "2001:00"]
    assert (profile.by_key["6040:00"].access, profile.by_key["6040:00"].pdo) == ("rw", "rx")
    assert (profile.by_key["6041:00"].access, profile.by_key["6041:00"].pdo) == ("ro", "tx")
    gain = profile.by_key["2000:01"]
    assert (gain.name, gain.unit) == ("Gains: Speed loop", "Hz")
    assert (gain.default_raw, gain.min_raw, gain.max_raw) == (40, 1, 1000)
    assert (profile.by_key["2001:00"].type, profile.by_key["2001:00"].access) == ("UINT32", "wo")
    assert [f.outcome for f in report.findings] == ["noted", "repaired", "left out"]
    with pytest.raises(ImportFailed, match=r"description.no-objects-listed"):
        describe_dictionary([], name="x", report=ImportReport())
