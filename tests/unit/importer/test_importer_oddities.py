"""What files of real makers hold, rebuilt small: units, PDOs, limits, names, identity, access."""

from __future__ import annotations

import struct

import pytest

from drivers.ethercat.exchange.mapping import plan_station
from drivers.link import Address, CyclicSignal
from drivers.texts.imports import finding_text
from profiles.check import check
from profiles.importer import ImportFailed, ImportReport, import_file
from profiles.importer.values import fit, unit_of_code
from profiles.schema import Profile

HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<EtherCATInfo><Vendor><Id>#x00000A2B</Id><Name>Example Drives</Name></Vendor>
<Descriptions><Devices>"""
TAIL = "</Devices></Descriptions></EtherCATInfo>"


def scalar(
    index: int,
    name: str,
    kind: str,
    bits: int,
    *,
    access: str = "rw",
    mapping: str = "",
    info: str = "",
) -> str:
    pdo = f"<PdoMapping>{mapping}</PdoMapping>" if mapping else ""
    return (
        f"<Object><Index>#x{index:04X}</Index><Name>{name}</Name><Type>{kind}</Type>"
        f"<BitSize>{bits}</BitSize><Info>{info}</Info>"
        f"<Flags><Access>{access}</Access>{pdo}</Flags></Object>"
    )


CONTROL = scalar(0x6040, "Controlword", "UINT", 16, mapping="R")
STATUS = scalar(0x6041, "Statusword", "UINT", 16, access="ro", mapping="T")
SPEEDS = (
    scalar(0x60FF, "Target velocity", "DINT", 32, mapping="R")
    + scalar(0x606C, "Velocity actual value", "DINT", 32, access="ro", mapping="T")
    + scalar(0x6081, "Profile velocity", "UDINT", 32)
)
POSITIONS = scalar(0x607A, "Target position", "DINT", 32, mapping="R") + scalar(
    0x6064, "Position actual value", "DINT", 32, access="ro", mapping="T"
)


def device(
    objects: str,
    pdos: str = "",
    *,
    name: str = "ES4",
    code: int = 0x190,
    revision: int = 1,
    types: str = "",
) -> str:
    return (
        f'<Device><Type ProductCode="#x{code:08X}" RevisionNo="#x{revision:08X}">{name}</Type>'
        f"<Name>{name}</Name><Profile><Dictionary><DataTypes>{types}</DataTypes>"
        f"<Objects>{objects}</Objects></Dictionary></Profile>{pdos}</Device>"
    )


def esi(*devices: str) -> bytes:
    return (HEAD + "".join(devices) + TAIL).encode()


def imported(objects: str, pdos: str = "", types: str = "") -> Profile:
    profile = import_file(esi(device(objects, pdos, types=types)), "odd.xml").profile
    assert [str(f) for f in check(profile)] == []
    return profile


def unit_object(index: int, code: int) -> str:
    data = struct.pack("<I", code).hex()
    return scalar(index, "SI unit", "UDINT", 32, info=f"<DefaultData>{data}</DefaultData>")


# 1: units of 60A8h to 60AAh ---------------------------------------------------------------------


def test_speed_in_rpm_by_60a9h() -> None:
    profile = imported(CONTROL + STATUS + SPEEDS + unit_object(0x60A9, 0x00B44700))
    assert profile.units.velocity == "rpm"
    assert profile.units.origins["velocity"] == "makers_file"
    target = profile.by_key["60FF:00"]
    assert (target.unit, target.to_raw(60), profile.by_key["6081:00"].unit) == ("rpm", 60, "rpm")


def test_speed_in_tenths_of_rpm_and_position_in_tenths_of_a_degree() -> None:
    profile = imported(
        CONTROL
        + STATUS
        + SPEEDS
        + POSITIONS
        + unit_object(0x60A9, 0xFFB44700)
        + unit_object(0x60A8, 0xFF410000)
    )
    assert (profile.units.velocity, profile.units.position) == ("0.1 rpm", "0.1 °")
    target = profile.by_key["60FF:00"]
    # 60 rpm is 600 tenths; 90 degrees are 900 tenths.
    assert (target.unit, target.to_raw(60), target.to_value(600)) == ("rpm", 600, 60)
    position = profile.by_key["607A:00"]
    assert (position.unit, position.to_raw(90)) == ("°", 900)


def test_a_unit_that_is_not_certain_is_shown_raw_and_kept() -> None:
    profile = imported(CONTROL + STATUS + SPEEDS + unit_object(0x60A9, 0x00AC4700))
    assert profile.by_key["60FF:00"].unit == ""
    assert profile.units.velocity == "60A9h = 00AC4700h"
    # A position where the speed should be says nothing about the speed.
    wrong = imported(CONTROL + STATUS + SPEEDS + unit_object(0x60A9, 0x00410000))
    assert wrong.by_key["60FF:00"].unit == ""
    assert wrong.units.velocity == "60A9h = 00410000h"


def test_nobody_states_a_unit() -> None:
    profile = imported(CONTROL + STATUS + SPEEDS + POSITIONS)
    assert set(profile.units.origins.values()) == {"standard"}
    assert profile.by_key["60FF:00"].unit == ""
    assert profile.by_key["607A:00"].unit == "inc"
    zero = imported(CONTROL + STATUS + SPEEDS + unit_object(0x60A9, 0))
    assert zero.units.origins["velocity"] == "standard"


def test_a_unit_printed_at_the_target_counts() -> None:
    target = scalar(0x60FF, "Target velocity", "DINT", 32, info="<Unit>#x00B44700</Unit>")
    profile = imported(CONTROL + STATUS + target)
    assert (profile.units.velocity, profile.units.origins["velocity"]) == ("rpm", "makers_file")


# 2: unit codes without a mark -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("00470000", "min"), ("FD030000", "ms"), ("00B44700", "rpm"), ("FFB44700", "0.1 rpm"),
        ("#xFF260000", "0.1 V"), ("rpm", ""), ("00FE0000", ""), ("1000000", ""),
    ],
)  # fmt: skip
def test_bare_unit_codes(text: str, unit: str) -> None:
    assert unit_of_code(text) == unit


# 3, 5: process data -----------------------------------------------------------------------------


def entry(index: int, bits: int, subindex: int = 0, kind: str = "UINT") -> str:
    return (
        f"<Entry><Index>#x{index:X}</Index><SubIndex>{subindex}</SubIndex><BitLen>{bits}</BitLen>"
        f"<Name>e</Name><DataType>{kind}</DataType></Entry>"
    )


PAD_8 = "<Entry><Index>#x0</Index><BitLen>8</BitLen></Entry>"
MODE = scalar(0x6060, "Modes of operation", "SINT", 8, mapping="R")
FIXED_OUT = (
    f'<RxPdo Sm="2" Fixed="1" Mandatory="1"><Index>#x1600</Index><Name>Out</Name>'
    f"<Exclude>#x1601</Exclude>{entry(0x6040, 16)}{entry(0x6060, 8, kind='SINT')}{PAD_8}"
    f"{entry(0x60FF, 32, kind='DINT')}</RxPdo>"
)
FIXED_IN = (
    f'<TxPdo Sm="3" Fixed="1"><Index>#x1A00</Index><Name>In</Name>{entry(0x6041, 16)}'
    f"{entry(0x2100, 1, 1, 'BOOL')}{entry(0x2100, 1, 2, 'BOOL')}"
    f"<Entry><Index>#x0</Index><BitLen>6</BitLen></Entry>{PAD_8}"
    f"{entry(0x6064, 32, kind='DINT')}</TxPdo>"
)


def signal(index: int, kind: str) -> CyclicSignal:
    return CyclicSignal(1, Address(index, 0, kind), f"{index:04X}")  # type: ignore[arg-type]


def test_padding_and_bits_keep_their_places() -> None:
    """Eight bytes by ETG.2000 clause 6.10: 2 + 1 + 1 (padding) + 4, and 2 + 2 bits + 6 + 8 + 4."""
    profile = imported(CONTROL + STATUS + MODE + SPEEDS + POSITIONS, FIXED_OUT + FIXED_IN)
    assert profile.pdo is not None
    assert not profile.pdo.remappable
    rx, tx = profile.pdo.sets
    assert (rx.sync_manager, rx.mandatory, rx.exclude) == (2, True, (0x1601,))
    assert sum(part.bits for part in rx.layout) == 64
    assert sum(part.bits for part in tx.layout) == 64
    plan = plan_station(1, [signal(0x6064, "INT32")], [signal(0x60FF, "INT32")], profile)
    assert (plan.rx.size, plan.tx.size) == (8, 8)
    places: dict[int, int] = {}
    start = 0
    for part in plan.tx.entries:
        places[part.index] = start
        start += part.size
    assert places[0x6064] == 4
    assert plan.rx.mapping_words == (0x60400010, 0x60600008, 0x00000008, 0x60FF0020)
    assert plan.tx.mapping_words == (
        0x60410010,
        0x21000101,
        0x21000201,
        0x00000006,
        0x00000008,
        0x60640020,
    )


def test_a_free_pdo_without_contents_is_one_to_be_filled() -> None:
    pdos = (
        FIXED_OUT
        + FIXED_IN
        + "<RxPdo><Index>#x1605</Index><Name>Free</Name></RxPdo>"
        + "<TxPdo><Index>#x1A05</Index><Name>Free</Name></TxPdo>"
    )
    profile = imported(CONTROL + STATUS + MODE + SPEEDS + POSITIONS, pdos)
    assert profile.pdo is not None
    assert profile.pdo.remappable
    assert (profile.pdo.default_rx, profile.pdo.free_set("rx")) == (0x1600, 0x1605)
    plan = plan_station(1, [signal(0x6064, "INT32")], [signal(0x60FF, "INT32")], profile)
    assert (plan.rx.index, plan.rx.write, plan.tx.index) == (0x1605, True, 0x1A05)


def test_one_direction_is_free_and_the_other_fixed() -> None:
    pdos = FIXED_OUT + f'<TxPdo Sm="3"><Index>#x1A00</Index>{entry(0x6041, 16)}</TxPdo>'
    profile = imported(CONTROL + STATUS + MODE + SPEEDS + POSITIONS, pdos)
    plan = plan_station(1, [signal(0x6064, "INT32")], [signal(0x60FF, "INT32")], profile)
    assert (plan.rx.index, plan.rx.write) == (0x1600, False)
    assert (plan.tx.index, plan.tx.write) == (0x1A00, True)


# 4: several devices -----------------------------------------------------------------------------

BOOTLOADER = device(scalar(0x1000, "Device type", "UDINT", 32, access="ro"), name="Boot", code=1)
OLD = device(CONTROL + STATUS, name="Servo", code=0x200, revision=1)
NEW = device(CONTROL + STATUS, name="Servo", code=0x200, revision=0x20000)
OTHER = device(CONTROL + STATUS, name="Other", code=0x300, revision=0x50000)


def test_the_newest_revision_of_a_drive_is_taken_and_the_others_are_offered() -> None:
    taken = import_file(esi(BOOTLOADER, OLD, NEW, OTHER), "series.xml")
    identity = taken.profile.identity
    assert (identity.product_code, identity.revision) == (0x200, 0x20000)
    assert [(d.name, d.product_code, d.has_control_word) for d in taken.others] == [
        ("Boot", 1, False),
        ("Servo", 0x200, True),
        ("Other", 0x300, True),
    ]
    assert any("ProductCode 0x300, RevisionNo 0x50000" in str(f) for f in taken.report.findings)


def test_a_device_can_be_chosen() -> None:
    data = esi(BOOTLOADER, OLD, NEW, OTHER)
    old = import_file(data, "series.xml", product_code=0x200, revision=1).profile.identity
    assert (old.product_code, old.revision) == (0x200, 1)
    missing = import_file(data, "series.xml", product_code=0x200, revision=9)
    assert missing.profile.identity.revision == 0x20000
    assert any("other-revision (revision=9" in str(f) for f in missing.report.findings)
    with pytest.raises(ImportFailed, match=r"no-product .*product=2457"):
        import_file(data, "series.xml", product_code=0x999)
    with pytest.raises(ImportFailed, match=r"no-revision .*revision=2457"):
        import_file(data, "series.xml", revision=0x999)


# 6, 7: limits and signs -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "what", "expected"),
    [
        (2147483648, "MaxValue", 2147483647),
        (4294967295, "HighLimit", 2147483647),
        (2147483648, "MinValue", -2147483648),
        (4294966296, "DefaultValue", -1000),
        (4294966296, "MaxData", -1000),
    ],
)
def test_maximum_above_the_type_is_no_negative_number(value: int, what: str, expected: int) -> None:
    assert fit(value, "INT32", what, "here", ImportReport()) == expected


def test_limits_of_the_whole_type() -> None:
    info = "<MinValue>-2147483648</MinValue><MaxValue>2147483648</MaxValue>"
    profile = imported(CONTROL + STATUS + scalar(0x2000, "Offset", "DINT", 32, info=info))
    found = profile.by_key["2000:00"]
    assert (found.min_raw, found.max_raw) == (-(2**31), 2**31 - 1)


def test_negative_values_of_the_file_keep_its_sign() -> None:
    info = "<DefaultValue>-1000</DefaultValue>"
    profile = imported(CONTROL + STATUS + scalar(0x6072, "Max torque", "INT", 16, info=info))
    found = profile.by_key["6072:00"]
    assert (found.type, found.default_raw) == ("INT16", -1000)


def test_real_numbers_in_hexadecimal_are_their_bits() -> None:
    """DefaultData holds the bytes as they travel: 0000003F is 0.5 (IEEE 754), not 1056964608."""
    data = "<MinData>000020C1</MinData><MaxData>0000C842</MaxData>"
    for default in (
        "<DefaultData>0000003F</DefaultData>",
        "<DefaultValue>#x3F000000</DefaultValue>",
    ):
        gain = scalar(0x2510, "Gain", "REAL", 32, info=default + data)
        result = import_file(esi(device(CONTROL + STATUS + gain)), "real.xml")
        found = result.profile.by_key["2510:00"]
        assert (found.type, found.default_raw) == ("REAL32", 0.5)
        assert (found.min_raw, found.max_raw) == (-10.0, 100.0)
        assert not any(f.code == "description.limits-swapped" for f in result.report.findings)
    nan = scalar(0x2510, "Gain", "REAL", 32, info="<DefaultData>0000C07F</DefaultData>")
    assert imported(CONTROL + STATUS + nan).by_key["2510:00"].default_raw is None


def test_an_io_device_with_modules_has_no_further_axes() -> None:
    module = scalar(0x7040, "Output of module 3", "UINT", 16, mapping="R")
    result = import_file(esi(device(module + STATUS)), "io.xml")
    assert not any(f.code == "description.further-axes" for f in result.report.findings)


# 8: names of array members ----------------------------------------------------------------------

ARRAY = (
    "<DataType><Name>DT2010ARR</Name><BaseType>UINT</BaseType><BitSize>32</BitSize>"
    "<ArrayInfo><LBound>1</LBound><Elements>2</Elements></ArrayInfo></DataType>"
    "<DataType><Name>DT2010</Name><BitSize>48</BitSize>"
    "<SubItem><SubIdx>0</SubIdx><Name>SubIndex 000</Name><Type>USINT</Type></SubItem>"
    "<SubItem><Name>Elements</Name><Type>DT2010ARR</Type>"
    "<Flags><Access>rw</Access></Flags></SubItem></DataType>"
)
MEMBERS = (
    "<SubItem><Name>Controller Kp</Name><Info><DefaultData>0A00</DefaultData></Info></SubItem>"
    "<SubItem><Name>Controller Ki</Name><Info><DefaultData>1400</DefaultData></Info></SubItem>"
)


@pytest.mark.parametrize("first", ["", "<SubItem><Name>SubIndex 000</Name></SubItem>"])
def test_array_members_have_the_names_of_the_object(first: str) -> None:
    gains = (
        "<Object><Index>#x2010</Index><Name>Torque Controller</Name><Type>DT2010</Type>"
        f"<BitSize>48</BitSize><Info>{first}{MEMBERS}</Info>"
        "<Flags><Access>rw</Access></Flags></Object>"
    )
    profile = imported(CONTROL + STATUS + gains, types=ARRAY)
    assert [(p.name, p.default_raw) for k, p in profile.by_key.items() if k[:4] == "2010"] == [
        ("Torque Controller: Controller Kp", 10),
        ("Torque Controller: Controller Ki", 20),
    ]


def test_an_array_beyond_the_subindices_is_said() -> None:
    types = ARRAY.replace("<Elements>2<", "<Elements>512<")
    gains = (
        "<Object><Index>#x2010</Index><Name>Table</Name><Type>DT2010</Type><BitSize>9999</BitSize>"
        "<Flags><Access>rw</Access></Flags></Object>"
    )
    result = import_file(esi(device(CONTROL + STATUS + gains, types=types)), "long.xml")
    assert any("array-too-long (elements=512" in str(f) for f in result.report.findings)
    assert sum(k.startswith("2010") for k in result.profile.by_key) == 255


def test_an_inline_array_with_a_subindex_is_one_octet_string() -> None:
    """ETG.1020: messages of the diagnosis history (10F3h) lie at subindices 6 and following."""
    message = "<Type>ARRAY [0..27] OF BYTE</Type><BitSize>224</BitSize>"
    described = (
        "<DataType><Name>ARRAY [0..27] OF BYTE</Name><BaseType>BYTE</BaseType>"
        "<BitSize>224</BitSize>"
        "<ArrayInfo><LBound>0</LBound><Elements>28</Elements></ArrayInfo></DataType>"
    )
    history = (
        "<DataType><Name>DT10F3</Name><BitSize>512</BitSize>"
        "<SubItem><SubIdx>0</SubIdx><Name>SubIndex 000</Name><Type>USINT</Type></SubItem>"
        "<SubItem><SubIdx>1</SubIdx><Name>Maximum Messages</Name><Type>USINT</Type></SubItem>"
        f"<SubItem><SubIdx>6</SubIdx><Name>Message 001</Name>{message}</SubItem>"
        f"<SubItem><SubIdx>7</SubIdx><Name>Message 002</Name>{message}</SubItem></DataType>"
    )
    diagnosis = (
        "<Object><Index>#x10F3</Index><Name>Diagnosis History</Name><Type>DT10F3</Type>"
        "<BitSize>512</BitSize><Flags><Access>ro</Access></Flags></Object>"
    )
    for types in (history, described + history):
        found = import_file(esi(device(CONTROL + STATUS + diagnosis, types=types)), "d.xml")
        entries = [(k, p.type) for k, p in found.profile.by_key.items() if k[:4] == "10F3"]
        assert entries == [("10F3:01", "UINT8"), ("10F3:06", "OCTETS"), ("10F3:07", "OCTETS")]
        assert not any(
            finding.code == "description.subindex-twice" for finding in found.report.findings
        )


# 9, 10, 12: enumerations, access, remarks -------------------------------------------------------


def test_the_standards_values_stay_inside_the_files_limits() -> None:
    info = "<MinValue>0</MinValue><MaxValue>2</MaxValue>"
    profile = imported(
        CONTROL
        + STATUS
        + scalar(0x605A, "Quick stop option code", "INT", 16, info=info)
        + scalar(0x6086, "Motion profile type", "INT", 16, info="<MaxValue>0</MaxValue>")
    )
    assert sorted(profile.by_key["605A:00"].enum) == [0, 1, 2]
    assert sorted(profile.by_key["6086:00"].enum) == [0]


def test_what_the_standard_only_lets_read_stays_so() -> None:
    profile = imported(
        CONTROL
        + STATUS
        + scalar(0x603F, "Error code", "UINT", 16, access="ro", mapping="R")
        + scalar(0x60FF, "Target velocity", "DINT", 32, access="ro", mapping="R")
    )
    error = profile.by_key["603F:00"]
    assert (error.access, error.pdo, error.motion) == ("ro", "tx", None)
    target = profile.by_key["60FF:00"]
    assert (target.access, target.pdo, target.motion) == ("rw", "rx", "energises")


def remarks(restricted: int, free: int) -> list[str]:
    limited = "".join(
        scalar(0x2000 + n, f"O{n}", "UINT", 16).replace(
            "<Access>", '<Access WriteRestrictions="PreOP">'
        )
        for n in range(restricted)
    )
    others = "".join(scalar(0x3000 + n, f"F{n}", "UINT", 16) for n in range(free))
    result = import_file(esi(device(CONTROL + STATUS + limited + others)), "w.xml")
    found = (finding_text(f).words() for f in result.report.findings)
    return [words for words in found if "PreOP" in words]


def test_a_remark_that_is_always_there_is_none() -> None:
    assert remarks(20, 2) == []
    assert remarks(7, 30) == [
        "may be written in PreOP or SafeOP only: 2000:00, 2001:00, 2002:00, 2003:00, 2004:00 "
        "and 2 more"
    ]


# 11: EDS and DCF --------------------------------------------------------------------------------

EDS = """[DeviceInfo]
VendorName=Maker
ProductName=Drive
VendorNumber=0xFFFFFFFF
BaudRate_125=1
BaudRate_1000=1
BaudRate_500=0
[1018]
ParameterName=Identity
ObjectType=9
SubNumber=4
[1018sub0]
ParameterName=Count
DataType=5
AccessType=ro
[1018sub1]
ParameterName=Vendor
DataType=7
AccessType=ro
DefaultValue=0x1234
[1018sub2]
ParameterName=Product
DataType=7
AccessType=ro
DefaultValue=0x56
[1018sub3]
ParameterName=Revision
DataType=7
AccessType=ro
DefaultValue=0xFFFFFFFF
[6040]
ParameterName=Controlword
DataType=6
AccessType=rww
PDOMapping=1
[6840]
ParameterName=Controlword axis 2
DataType=6
AccessType=rww
[6041]
ParameterName=Statusword
DataType=6
AccessType=ro
[603F]
ParameterName=Error
ObjectType=9
[603Fsub0]
ParameterName=Error code
DataType=6
AccessType=ro
[603Fsub1]
ParameterName=Maker's code
DataType=7
AccessType=ro
[2100]
ParameterName=Rate
DataType=6
AccessType=rw
DefaultValue=7
ParameterValue=
"""


def test_eds_identity_bit_rates_and_empty_values() -> None:
    result = import_file(EDS.encode(), "d.eds")
    profile = result.profile
    assert (profile.identity.vendor_id, profile.identity.product_code) == (0x1234, 0x56)
    assert profile.identity.revision is None
    assert profile.links[0].baudrates == (125_000, 1_000_000)
    assert profile.by_key["2100:00"].default_raw == 7
    assert profile.by_key["603F:00"].type == "UINT16"
    assert profile.by_key["603F:01"].type == "UINT32"
    assert "1018:00" not in profile.by_key
    assert profile.by_key["6840:00"].motion == "energises"
    assert any("further-axes (axes=2)" in str(f) for f in result.report.findings)
    assert [str(f) for f in check(profile)] == []


# Hostile files ----------------------------------------------------------------------------------

BOMB = (
    b'<?xml version="1.0"?><!DOCTYPE l [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;">]>'
    b"<EtherCATInfo>&b;</EtherCATInfo>"
)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (BOMB, "description.dtd"),
        (esi(NEW)[:-40], "description.no-xml"),
        (esi(NEW)[:300], "description.no-xml"),
        (HEAD.encode() + b"<Device>" * 100_000, "description.no-xml"),
        (b"\x00\xff\xfe\x80" * 500, "description.no-eds-objects"),
        (b'<?xml version="1.0" encoding="utf-7"?><a/>', "description.no-esi "),
        (esi(NEW).replace(b"UTF-8", b"UTF-16"), "description.no-xml|description.no-esi "),
        (b"", "description.no-eds-objects"),
    ],
)
def test_hostile_files_get_one_clear_error(data: bytes, words: str) -> None:
    with pytest.raises(ImportFailed, match=words):
        import_file(data, "bad.xml")


def test_a_subindex_0_that_is_no_count_is_a_value() -> None:
    """1004h:00 has the numbers of PDOs in 32 bits; a byte there is the count of members."""

    def record(kind: str, bits: int) -> str:
        return (
            "<DataType><Name>DT1004</Name><BitSize>96</BitSize>"
            f"<SubItem><SubIdx>0</SubIdx><Name>PDOs</Name><Type>{kind}</Type>"
            f"<BitSize>{bits}</BitSize><BitOffs>0</BitOffs></SubItem>"
            "<SubItem><SubIdx>1</SubIdx><Name>Synchronous</Name><Type>UDINT</Type>"
            "<BitSize>32</BitSize><BitOffs>32</BitOffs></SubItem></DataType>"
        )

    item = scalar(0x1004, "Number of PDOs", "DT1004", 96, access="ro")
    values = imported(CONTROL + STATUS + item, types=record("UDINT", 32)).by_key
    assert {key: p.type for key, p in values.items() if key.startswith("1004")} == {
        "1004:00": "UINT32",
        "1004:01": "UINT32",
    }
    counted = imported(CONTROL + STATUS + item, types=record("USINT", 8)).by_key
    assert [key for key in counted if key.startswith("1004")] == ["1004:01"]


def test_an_identity_of_more_than_32_bits_is_none() -> None:
    found = import_file(esi(device(CONTROL, code=0x1_0000_0190, revision=0xFFFFFFFF)), "odd.xml")
    assert found.profile.identity.product_code is None
    assert found.profile.identity.revision == 0xFFFFFFFF
    assert [f.params for f in found.report.findings if f.code == "description.does-not-fit"] == [
        {"name": "ProductCode", "value": 0x1_0000_0190, "type": "UINT32"}
    ]
