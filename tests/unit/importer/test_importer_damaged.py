"""Files that break the rules of XML or CiA 306, as makers' tools write them; and modules."""

from __future__ import annotations

from datetime import datetime

import pytest

from profiles.check import check
from profiles.importer import ImportFailed, export_eds, import_file
from profiles.importer.build import ImportedProfile
from profiles.schema import PdoIdentifier
from tests.unit.importer.test_importer_oddities import (
    CONTROL,
    POSITIONS,
    STATUS,
    device,
    entry,
    esi,
    scalar,
)

PDOS = (
    f'<RxPdo Sm="2"><Index>#x1600</Index>{entry(0x6040, 16)}{entry(0x607A, 32, kind="DINT")}'
    f'</RxPdo><TxPdo Sm="3"><Index>#x1A00</Index>{entry(0x6041, 16)}'
    f"{entry(0x6064, 32, kind='DINT')}</TxPdo>"
)
WHOLE = esi(device(CONTROL + STATUS + POSITIONS, PDOS)).decode()


def taken(data: bytes, name: str) -> ImportedProfile:
    imported = import_file(data, name)
    assert [str(f) for f in check(imported.profile)] == []
    return imported


def findings(imported: ImportedProfile) -> str:
    return "\n".join(str(f) for f in imported.report.findings)


# XML ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "<!-- written by a tool -->\n" + WHOLE,
        WHOLE + "\0\0\x1a",
        WHOLE + "\nnothing of XML <",
        WHOLE.replace("Example Drives", "Drives & Motors &deg;"),
        WHOLE.replace("Example Drives", "Drives\x01&#x1F;"),
        WHOLE.replace("<EtherCATInfo>", '<EtherCATInfo xsi:schema="EtherCATInfo.xsd">'),
    ],
)
def test_what_no_parser_takes_is_taken_out_and_reported(text: str) -> None:
    imported = taken(text.encode(), "odd.xml")
    assert "description.xml-repaired" in findings(imported)
    assert imported.profile.pdo is not None
    assert imported.profile.identity.product_code == 0x190


@pytest.mark.parametrize("cut", [0.3, 0.7, 0.98])
def test_what_is_cut_off_is_refused(cut: float) -> None:
    with pytest.raises(ImportFailed, match=r"description.no-xml"):
        import_file(WHOLE[: int(cut * len(WHOLE))].encode(), "cut.xml")


def test_a_dtd_is_refused_however_damaged_the_file_is() -> None:
    bomb = '<!DOCTYPE a [<!ENTITY b "bbb">]>' + WHOLE.split("?>", 1)[1].replace("4<", "4 & &b;<")
    with pytest.raises(ImportFailed, match=r"description.dtd"):
        import_file(bomb.encode(), "bomb.xml")


@pytest.mark.parametrize(
    ("declared", "encoding", "name"),
    [
        ("Shift-JIS", "shift_jis", "サーボ"),
        ("EUC-KR", "euc_kr", "서보"),
        ("Windows-1252", "cp1252", "Größe"),
        ("UTF-16", "utf-16-be", "伺服"),
    ],
)
def test_encodings_by_any_of_their_names(declared: str, encoding: str, name: str) -> None:
    text = WHOLE.replace("UTF-8", declared).replace("<Name>ES4</Name>", f"<Name>{name}</Name>")
    assert taken(text.encode(encoding), "x.xml").profile.identity.model == name


def test_numbers_as_some_makers_write_them() -> None:
    text = WHOLE.replace('ProductCode="#x00000190"', 'ProductCode="1A2B"')
    modes = "<Dc><OpMode><Name>DC</Name><AssignActivate>0300</AssignActivate></OpMode></Dc>"
    imported = taken(text.replace("</Device>", f"{modes}</Device>").encode(), "x.xml")
    assert imported.profile.identity.product_code == 0x1A2B
    rules = imported.profile.bring_up
    assert rules is not None
    assert rules.clock_modes[0].assign_activate == 0x300
    # A tool that writes 32 bits of a negative number of 16.
    limited = scalar(0x2001, "Limit", "INT", 16, info="<DefaultValue>#xFFFFFFFB</DefaultValue>")
    profile = taken(esi(device(CONTROL + STATUS + limited)), "x.xml").profile
    assert profile.by_key["2001:00"].default_raw == -5


def test_init_commands_as_tools_of_masters_write_them() -> None:
    commands = (
        "<Mailbox><CoE><InitCmds><InitCmd><Transition>&lt;PS&gt;</Transition><Index>#x6060</Index>"
        "<SubIndex>0</SubIndex><Data>08</Data></InitCmd></InitCmds></CoE></Mailbox>"
    )
    rules = taken(WHOLE.replace("</Device>", f"{commands}</Device>").encode(), "x.xml").profile
    assert rules.bring_up is not None
    (command,) = rules.bring_up.init_commands
    assert (command.transition, command.index, command.data) == ("PS", 0x6060, "08")


def test_objects_that_lie_in_another_file() -> None:
    text = WHOLE.replace("<Dictionary>", "<DictionaryFile>axis.xml</DictionaryFile><Other>")
    imported = taken(text.replace("</Dictionary>", "</Other>").encode(), "x.xml")
    assert "objects-elsewhere (files=axis.xml" in findings(imported)
    assert set(imported.profile.by_key) == {"6040:00", "6041:00", "6064:00", "607A:00"}
    with pytest.raises(ImportFailed, match=r"description.part-of-esi"):
        import_file(b"<EtherCATDict/>", "axis.xml")


# Modules --------------------------------------------------------------------------------------


def modular(slots: str) -> bytes:
    axis = (CONTROL + STATUS + POSITIONS).replace("<Index>", '<Index DependOnSlot="1">')
    shifted = PDOS.replace("<Index>#x1", '<Index DependOnSlot="1">#x1').replace(
        "<Entry><Index>", '<Entry><Index DependOnSlot="true">'
    )
    modules = (
        '<Modules><Module><Type ModuleIdent="#x20">Other</Type><Name>Other</Name><Profile>'
        f"<Dictionary><Objects>{scalar(0x2000, 'Own', 'UINT', 16)}</Objects></Dictionary></Profile>"
        '</Module><Module><Type ModuleIdent="#x10">Axis</Type><Name>Axis</Name><Profile>'
        f"<Dictionary><Objects>{axis}</Objects>"
        f"</Dictionary></Profile>{shifted}</Module></Modules>"
    )
    whole = device(scalar(0x1000, "Device type", "UDINT", 32, access="ro"), slots)
    return esi(whole).replace(b"</Devices>", b"</Devices>" + modules.encode())


SLOT = (
    "<Slot><Name>Axis</Name><ModuleIdent>#x20</ModuleIdent>"
    '<ModuleIdent Default="1">#x10</ModuleIdent></Slot>'
)


def test_a_module_in_its_slot_completes_the_device() -> None:
    profile = taken(modular(f"<Slots>{SLOT}</Slots>"), "modular.xml").profile
    assert {"1000:00", "6040:00", "607A:00"} <= set(profile.by_key)
    assert "2000:00" not in profile.by_key
    assert profile.pdo is not None
    assert (profile.pdo.default_rx, profile.pdo.default_tx) == (0x1600, 0x1A00)


def test_the_second_slot_lies_behind_the_first_and_the_list_of_modules_is_written() -> None:
    slots = (
        '<Slots DownloadModuleIdentList="1" SlotIndexIncrement="#x800" SlotPdoIncrement="#x10">'
        f"{SLOT}{SLOT}</Slots>"
    )
    imported = taken(modular(slots), "modular.xml")
    assert "6840:00" in imported.profile.by_key
    assert "further-axes (axes=2)" in findings(imported)
    assert imported.profile.pdo is not None
    second = next(s for s in imported.profile.pdo.sets if s.index == 0x1610)
    assert second.entries == ("6840:00", "687A:00")
    rules = imported.profile.bring_up
    assert rules is not None
    written = rules.init_commands[0]
    # ETG.5001: two modules, the number of each on 32 bits.
    assert (written.transition, written.index, written.complete_access) == ("PS", 0xF030, True)
    assert written.data == "0200" + "10000000" * 2


# EDS ------------------------------------------------------------------------------------------


def sub(index: int, number: int, kind: str, default: str, access: str = "rw") -> str:
    return (
        f"[{index:04X}sub{number}]\nParameterName=x\nObjectType=0x7\nDataType={kind}\n"
        f"AccessType={access}\nDefaultValue={default}\n"
    )


def pdo_of(number: int, entries: list[int], cob: str, count: int, access: str = "rw") -> str:
    communication, mapping = 0x1400 + number, 0x1600 + number
    return (
        f"[{communication:04X}]\nParameterName=c\nSubNumber=3\n"
        + sub(communication, 0, "5", "2")
        + sub(communication, 1, "7", cob, access)
        + f"[{mapping:04X}]\nParameterName=m\nSubNumber=9\n"
        + sub(mapping, 0, "5", f"{count}")
        + "".join(sub(mapping, n, "7", f"0x{e:08X}") for n, e in enumerate(entries, 1))
    )


OBJECTS = "".join(
    f"[{index:04X}]\nParameterName=x\nObjectType=0x7\nDataType={kind}\nAccessType={access}\n"
    "PDOMapping=1\n"
    for index, kind, access in (
        (0x6040, "0x0006 ; UNSIGNED16", "rw ; by the master"),
        (0x6041, "UNSIGNED16", "ro // c"),
        (0x607A, "0x0004", "rw"),
    )
)


def eds(*parts: str) -> bytes:
    return (
        "[FileInfo]\nFileName=a.eds\n[DeviceInfo]\nVendorNumber=0x2B\n" + "".join(parts)
    ).encode()


def test_remarks_behind_values_change_none() -> None:
    profile = taken(eds(OBJECTS), "a.eds").profile
    control, status = profile.by_key["6040:00"], profile.by_key["6041:00"]
    assert (control.type, control.access, control.pdo) == ("UINT16", "rw", "rxtx")
    assert (status.type, status.access, status.pdo) == ("UINT16", "ro", "tx")


def test_line_ends_within_a_name_and_headings_with_h() -> None:
    text = OBJECTS.replace("=x\n", "=x\x0by\u2028z\n", 1).replace("[6040]", "[6040h]")
    profile = taken(eds(text).replace(b"\n", b"\r\r\n"), "a.eds").profile
    assert profile.by_key["6040:00"].name.startswith("x")
    assert "6041:00" in profile.by_key


def test_a_pdo_holds_as_many_entries_as_its_count_says() -> None:
    imported = taken(
        eds(
            OBJECTS, pdo_of(0, [0x60400010, 0x00050008, 0x607A0020, 0x60400010], "$NODEID+0x200", 3)
        ),
        "a.eds",
    )
    assert imported.profile.pdo is None  # there is no other direction
    with_inputs = eds(
        OBJECTS,
        pdo_of(0, [0x60400010, 0x00050008, 0x607A0020, 0x60400010], "$NODEID+0x200", 3),
        pdo_of(0x400, [0x60410010], "0x181", 1, "const"),
    )
    pdo = taken(with_inputs, "a.eds").profile.pdo
    assert pdo is not None
    rx, tx = pdo.sets
    assert [(part.key, part.bits) for part in rx.layout] == [
        ("6040:00", 16),
        (None, 8),
        ("607A:00", 32),
    ]
    assert rx.identifier == PdoIdentifier(cob_id=0x200, of_node=True)
    assert rx.identifier.at(5) == 0x205
    assert tx.identifier == PdoIdentifier(cob_id=0x181, of_node=False, fixed=True)


def test_pdos_are_exported_as_they_were_imported() -> None:
    text = eds(
        OBJECTS,
        pdo_of(0, [0x60400010, 0x607A0020, 0x60400010], "$NODEID+0x220", 2),
        pdo_of(0x400, [0x60410010], "0x181", 1, "const"),
    )
    before = taken(text, "a.eds").profile
    again = taken(export_eds(before, datetime(2020, 1, 2), "a.eds").encode(), "a.eds").profile
    assert again.pdo == before.pdo
    assert again.pdo is not None
    assert [each.entries for each in again.pdo.sets] == [("6040:00", "607A:00"), ("6041:00",)]
