"""Ten ESI files of our own, each with the structure that some real maker's file has.

No maker's file is copied. What is odd about each is in its comment.
"""

from __future__ import annotations

import re

_TYPES = {8: "SINT", 16: "UINT", 32: "DINT"}


def _scalar(
    index: int, name: str, kind: str, bits: int, access: str, mapping: str = "", default: str = ""
) -> str:
    pdo = f"<PdoMapping>{mapping}</PdoMapping>" if mapping else ""
    info = f"<Info><DefaultData>{default}</DefaultData></Info>" if default else ""
    return (
        f"<Object><Index>#x{index:04X}</Index><Name>{name}</Name><Type>{kind}</Type>"
        f"<BitSize>{bits}</BitSize>{info}<Flags><Access>{access}</Access>{pdo}</Flags></Object>"
    )


RESOLUTION = (
    "<DataType><Name>DT608F</Name><BitSize>80</BitSize>"
    "<SubItem><SubIdx>0</SubIdx><Name>Number</Name><Type>USINT</Type><BitSize>8</BitSize>"
    "<BitOffs>0</BitOffs></SubItem>"
    "<SubItem><SubIdx>1</SubIdx><Name>Increments</Name><Type>UDINT</Type><BitSize>32</BitSize>"
    "<BitOffs>16</BitOffs></SubItem>"
    "<SubItem><SubIdx>2</SubIdx><Name>Revolutions</Name><Type>UDINT</Type><BitSize>32</BitSize>"
    "<BitOffs>48</BitOffs></SubItem></DataType>"
)
OBJECTS = (
    _scalar(0x1000, "Device type", "UDINT", 32, "ro", default="92010200")
    + _scalar(0x2010, "Loop gain", "UINT", 16, "rw")
    + _scalar(0x2011, "Filter", "UINT", 16, "rw")
    + _scalar(0x2200, "Inputs", "USINT", 8, "ro", "T")
    + _scalar(0x603F, "Error code", "UINT", 16, "ro", "T")
    + _scalar(0x6040, "Controlword", "UINT", 16, "rw", "R")
    + _scalar(0x6041, "Statusword", "UINT", 16, "ro", "T")
    + _scalar(0x6060, "Modes of operation", "SINT", 8, "rw", "R", "08")
    + _scalar(0x6061, "Modes of operation display", "SINT", 8, "ro", "T", "08")
    + _scalar(0x6064, "Position actual value", "DINT", 32, "ro", "T")
    + _scalar(0x606C, "Velocity actual value", "DINT", 32, "ro", "T")
    + _scalar(0x6071, "Target torque", "INT", 16, "rw", "R")
    + _scalar(0x6077, "Torque actual value", "INT", 16, "ro", "T")
    + _scalar(0x607A, "Target position", "DINT", 32, "rw", "R")
    + "<Object><Index>#x608F</Index><Name>Encoder resolution</Name><Type>DT608F</Type>"
    "<BitSize>80</BitSize><Info>"
    "<SubItem><Name>Number</Name><Info><DefaultData>02</DefaultData></Info></SubItem>"
    "<SubItem><Name>Increments</Name><Info><DefaultData>10270000</DefaultData></Info></SubItem>"
    "<SubItem><Name>Revolutions</Name><Info><DefaultData>01000000</DefaultData></Info></SubItem>"
    "</Info><Flags><Access>ro</Access></Flags></Object>"
    + _scalar(0x6083, "Profile acceleration", "UDINT", 32, "rw")
    + _scalar(0x60A9, "SI unit velocity", "UDINT", 32, "rw", default="0047B400")
    + _scalar(0x60B1, "Velocity offset", "DINT", 32, "rw", "R")
    + _scalar(0x60C2, "Interpolation", "USINT", 8, "rw")
    + _scalar(0x60FF, "Target velocity", "DINT", 32, "rw", "R")
    + _scalar(0x6502, "Supported drive modes", "UDINT", 32, "ro", default="A0030000")
)
ENTRIES = {0x2200: 8, 0x603F: 16, 0x6040: 16, 0x6041: 16, 0x6060: 8, 0x6061: 8, 0x6064: 32,
           0x606C: 32, 0x6071: 16, 0x6077: 16, 0x607A: 32, 0x60B1: 32, 0x60FF: 32}  # fmt: skip


def pad(bits: int) -> str:
    return f"<Entry><Index>#x0</Index><BitLen>{bits}</BitLen></Entry>"


def pdo(index: int, *entries: int | str, sm: int | None = None, **flags: object) -> str:
    """``exclude`` is a tuple of indices; the other flags are attributes."""
    exclude = flags.pop("exclude", ())
    tag = "RxPdo" if index < 0x1800 else "TxPdo"
    attributes = "".join(f' {name}="{value}"' for name, value in flags.items())
    if sm is not None:
        attributes += f' Sm="{sm}"'
    body = "".join(
        item
        if isinstance(item, str)
        else f"<Entry><Index>#x{item:04X}</Index><SubIndex>0</SubIndex>"
        f"<BitLen>{ENTRIES[item]}</BitLen><Name>e</Name>"
        f"<DataType>{_TYPES[ENTRIES[item]]}</DataType></Entry>"
        for item in entries
    )
    shut = "".join(f"<Exclude>#x{each:04X}</Exclude>" for each in exclude)  # type: ignore[attr-defined]
    return f"<{tag}{attributes}><Index>#x{index:04X}</Index><Name>P</Name>{shut}{body}</{tag}>"


def command(transition: str, index: int, sub: int, data: str, comment: str = "") -> str:
    note = f"<Comment><![CDATA[{comment}]]></Comment>" if comment else ""
    return (
        f"<InitCmd><Transition>{transition}</Transition><Index>#x{index:04X}</Index>"
        f"<SubIndex>{sub}</SubIndex><Data>{data}</Data>{note}</InitCmd>"
    )


def managers(
    out: str = "",
    into: str = "",
    *,
    box: int = 128,
    places: tuple[int, int] = (0x1200, 0x1500),
    control: tuple[int, int] = (0x64, 0x20),
) -> str:
    return (
        f'<Sm MinSize="64" MaxSize="256" DefaultSize="{box}" StartAddress="#x1000"'
        f' ControlByte="#x26" Enable="1">MBoxOut</Sm>'
        f'<Sm DefaultSize="{box}" StartAddress="#x1100" ControlByte="#x22" Enable="1">MBoxIn</Sm>'
        f'<Sm{out} StartAddress="#x{places[0]:04X}" ControlByte="#x{control[0]:02X}"'
        f' Enable="1">Outputs</Sm>'
        f'<Sm{into} StartAddress="#x{places[1]:04X}" ControlByte="#x{control[1]:02X}"'
        f' Enable="1">Inputs</Sm>'
    )


DC = (
    "<Dc><OpMode><Name>DC</Name><AssignActivate>#x300</AssignActivate>"
    '<CycleTimeSync0 Factor="1">0</CycleTimeSync0><ShiftTimeSync0>0</ShiftTimeSync0></OpMode></Dc>'
)
FREE_OUT = pdo(0x1600, 0x6040, 0x6060, 0x607A, 0x60FF, sm=2)
FREE_IN = pdo(0x1A00, 0x603F, 0x6041, 0x6061, 0x6064, 0x606C, sm=3)


def esi(
    pdos: str,
    *,
    coe: str = 'SdoInfo="1" PdoAssign="1" PdoConfig="1" CompleteAccess="1"',
    commands: str = "",
    sms: str = "",
    dc: str = DC,
    info: str = "",
    chip: str = "",
    box: str = "",
    name: str = "<Name>Servo</Name>",
) -> bytes:
    """A file with one device; ``coe`` are the attributes of its CoE mailbox."""
    return (
        '<?xml version="1.0"?><EtherCATInfo><Vendor><Id>#x00000A2B</Id><Name>Example</Name>'
        f'</Vendor><Descriptions><Devices><Device><Type ProductCode="#x190" RevisionNo="#x2">'
        f"ES4</Type>{name}<Info>{info}</Info><Profile><Dictionary><DataTypes>{RESOLUTION}</DataTypes><Objects>{OBJECTS}"
        f"</Objects></Dictionary></Profile>{sms or managers()}{pdos}"
        f'<Mailbox DataLinkLayer="1"><CoE {coe}>{commands}</CoE>{box}</Mailbox>{dc}{chip}'
        "</Device></Devices></Descriptions></EtherCATInfo>"
    ).encode()


SAMPLES: dict[str, bytes] = {
    # One PDO per direction that can be filled, and the mode set on the way up.
    "free": esi(FREE_OUT + FREE_IN, commands=command("PS", 0x6060, 0, "08", "CSP")),
    # Nothing can be written; bytes of padding, single bits, padding that fills them up.
    "fixed_with_padding": esi(
        pdo(0x1600, 0x6040, 0x6060, pad(8), 0x607A, 0x60FF, sm=2, Fixed=1, Mandatory=1)
        + pdo(0x1A00, 0x6041, 0x6061, pad(3), pad(5), 0x6064, 0x606C, pad(16), 0x6077,
              sm=3, Fixed=1),
        coe='SdoInfo="true" PdoAssign="false" PdoConfig="false"',
    ),
    # Two PDOs per direction as delivered, whose contents are fixed.
    "two_each_way": esi(
        pdo(0x1600, 0x6040, 0x6060, sm=2, Fixed=1) + pdo(0x1610, 0x607A, 0x60FF, sm=2, Fixed=1)
        + pdo(0x1620, 0x6071, Fixed=1)
        + pdo(0x1A00, 0x6041, 0x6061, sm=3, Fixed=1) + pdo(0x1A10, 0x6064, 0x606C, 0x6077,
                                                                  sm=3, Fixed=1),
        coe='PdoAssign="1" PdoConfig="0" CompleteAccess="0"',
    ),
    # A mandatory PDO with the control word, next to which a free one is filled.
    "mandatory_and_free": esi(
        pdo(0x1600, 0x6040, 0x6060, sm=2, Fixed=1, Mandatory=1) + pdo(0x1601, 0x607A)
        + pdo(0x1A00, 0x6041, 0x6061, sm=3, Fixed=1, Mandatory=1) + pdo(0x1A01, 0x6064),
        coe='SdoInfo="1" PdoAssign="1" PdoConfig="1" PdoUpload="1"',
        commands=command("IP", 0x2010, 0, "#x2A00") + command("PS", 0x6060, 0, "08"),
    ),
    # Fixed sets for each mode that exclude each other; the one as delivered has too little.
    "exclusive_sets": esi(
        pdo(0x1600, 0x6040, 0x6071, sm=2, Fixed=1, exclude=(0x1601, 0x1602))
        + pdo(0x1601, 0x6040, 0x6060, 0x607A, Fixed=1, exclude=(0x1600, 0x1602))
        + pdo(0x1602, 0x6040, 0x6060, 0x607A, 0x60FF, Fixed=1, exclude=(0x1600, 0x1601))
        + pdo(0x1A00, 0x6041, 0x6077, sm=3, Fixed=1, exclude=(0x1A01,))
        + pdo(0x1A01, 0x6041, 0x6061, 0x6064, 0x606C, 0x603F, 0x6077, Fixed=1,
              exclude=(0x1A00,)),
        coe='SdoInfo="1" PdoAssign="1"',
    ),
    # 0330h: the application switches SYNC1's pin as well; SYNC0 a quarter of a millisecond late.
    "shifted_clock": esi(
        FREE_OUT + FREE_IN,
        dc="<Dc><OpMode><Name>Synchron</Name><AssignActivate>#x0</AssignActivate></OpMode>"
        "<OpMode><Name>DCSync</Name><Desc>DC</Desc><AssignActivate>#x330</AssignActivate>"
        '<CycleTimeSync0 Factor="1">0</CycleTimeSync0><ShiftTimeSync0>250000</ShiftTimeSync0>'
        "</OpMode></Dc>",
    ),
    # SYNC0 runs twice as fast as the process data; SYNC1 every second time, 125 µs behind.
    "two_pulses": esi(
        FREE_OUT + FREE_IN,
        dc="<Dc><OpMode><Name>DC</Name><AssignActivate>#x0700</AssignActivate>"
        '<CycleTimeSync0 Factor="-2">0</CycleTimeSync0><ShiftTimeSync0>0</ShiftTimeSync0>'
        '<CycleTimeSync1 Factor="2">0</CycleTimeSync1><ShiftTimeSync1>125000</ShiftTimeSync1>'
        "</OpMode></Dc>",
    ),
    # Distributed clocks in the chip, no mode that uses them; other watchdog registers, control
    # bytes with interrupts, EoE and FoE.
    "without_clock": esi(
        FREE_OUT + FREE_IN,
        sms=managers(control=(0x24, 0x20), box=192),
        dc="<Dc><OpMode><Name>FreeRun</Name><AssignActivate>0</AssignActivate></OpMode></Dc>",
        chip="<ESC><Reg0400>#x09C0</Reg0400><Reg0410>1000</Reg0410><Reg0420>300</Reg0420></ESC>",
        box="<EoE/><FoE/>",
    ),
    # Thirty commands on three transitions, some in German, and 20 s to leave Pre-Op.
    "many_commands_and_slow": esi(
        FREE_OUT + FREE_IN,
        commands="".join(
            command(("IP", "PS", "SO")[n % 3], (0x2010, 0x2011)[n % 2], 0,
                    (n + 1).to_bytes(2, "little").hex(), f"Verstärkung {n}")
            for n in range(30)
        ),
        info="<StateMachine><Timeout><PreopTimeout>3000</PreopTimeout><SafeopOpTimeout>20000"
        "</SafeopOpTimeout><BackToInitTimeout>5000</BackToInitTimeout><BackToSafeopTimeout>200"
        "</BackToSafeopTimeout></Timeout></StateMachine><Mailbox><Timeout><RequestTimeout>100"
        "</RequestTimeout><ResponseTimeout>2000</ResponseTimeout></Timeout></Mailbox>",
        name='<Name LcId="1031">Antrieb</Name><Name LcId="1033">Servo</Name>',
    ),
    # The operation mode assigns other PDOs than the ones as delivered; tight and high places.
    "pdos_of_the_mode": esi(
        pdo(0x1600, 0x6040, 0x6071, sm=2, Fixed=1)
        + pdo(0x1601, 0x6040, 0x6060, 0x607A, 0x60FF, Fixed=1)
        + pdo(0x1A00, 0x6041, sm=3, Fixed=1)
        + pdo(0x1A01, 0x6041, 0x6061, 0x6064, 0x606C, 0x6077, Fixed=1),
        sms=managers(' MinSize="2" MaxSize="11" DefaultSize="4"', ' MaxSize="13" DefaultSize="2"',
                     places=(0x1800, 0x1C00)),
        coe='SdoInfo="1" PdoAssign="1" PdoConfig="0" CompleteAccess="1"',
        dc="<Dc><OpMode><Name>DC</Name><AssignActivate>#x300</AssignActivate>"
        '<CycleTimeSync0 Factor="1">0</CycleTimeSync0><Sm No="2"><Pdo>#x1601</Pdo></Sm>'
        '<Sm No="3"><Pdo>#x1A01</Pdo></Sm></OpMode></Dc>',
    ),
}  # fmt: skip


def _of_modules(device_pdos: str, module_pdos: str, slots: str, dc: str = DC) -> str:
    """A device that has its objects and PDOs from the module in its slots.

    Objects of CiA 402 lie elsewhere in each slot, the maker's own are there once.
    """
    text = esi(device_pdos, dc=dc).decode()
    described = re.search("<Profile>.*</Profile>", text)
    assert described is not None
    own = text.replace(described[0], "").replace("</Device>", f"{slots}</Device>")
    module = re.sub(
        "<Index>(?=#x[61])(?!#x1000)", '<Index DependOnSlot="1">', f"{module_pdos}{described[0]}"
    )
    return own.replace(
        "</Devices>",
        '</Devices><Modules><Module><Type ModuleIdent="#x10">AX</Type><Name>Axis</Name>'
        f"{module}</Module></Modules>",
    )


def _with_notations(text: str) -> str:
    """Numbers in every notation, remarks within values, a prefix at every tag."""
    for before, after in (
        ("#x6040<", "24640<"), ("#x607A<", "0x607a<"), ("#x6064<", "#x<!-- was 6063 -->6064<"),
        ("#x1600<", "5632<"), ("#x1A00<", "#X1a00<"), ("<BitLen>16<", "<BitLen>#x10<"),
    ):  # fmt: skip
        assert before in text
        text = text.replace(before, after)
    text = re.sub(r"<(/?)(?=[A-Z])", r"<\1esi:", text)
    return text.replace("<esi:EtherCATInfo>", '<esi:EtherCATInfo xmlns:esi="urn:esi">')


#: Further files for the way from scan to jog alone.
ODD: dict[str, bytes] = {
    # Padding of 3, 10 and 14 bytes between the entries; nothing can be written.
    "notations": _with_notations(
        esi(
            pdo(0x1600, 0x6040, 0x6060, pad(24), 0x607A, pad(80), 0x60FF,
                sm=2, Fixed="true", Mandatory="TRUE")
            + pdo(0x1A00, 0x6041, 0x6061, pad(3), pad(5), 0x6064, pad(112), 0x606C, 0x6077,
                  sm=3, Fixed=1),
            coe='SdoInfo="1" PdoAssign="0" PdoConfig="0"',
        ).decode()
    ).encode(),
    # One Slot that stands for two: two axes, whose process data are all assigned as delivered.
    "two_axes": _of_modules(
        "",
        pdo(0x1600, 0x6040, 0x6060, 0x607A, 0x60FF, sm=2, Fixed=1)
        + pdo(0x1A00, 0x6041, 0x6061, 0x6064, 0x606C, 0x6077, sm=3, Fixed=1),
        '<Slots MaxSlotCount="2" SlotPdoIncrement="#x10" SlotIndexIncrement="2048">'
        '<Slot MinInstances="2" MaxInstances="2"><ModuleIdent Default="1">#x10</ModuleIdent>'
        "</Slot></Slots>",
    ).encode(),
    # The module's PDOs in the place of the device's, which have too little; no clock; UTF-16.
    "overwritten": _of_modules(
        pdo(0x1600, 0x6040, sm=2, Fixed=1, OverwrittenByModule=1)
        + pdo(0x1A00, 0x6041, sm=3, Fixed=1, OverwrittenByModule=1),
        pdo(0x1600, 0x6040, 0x6060, 0x607A, 0x60FF, sm=2, Fixed=1)
        + pdo(0x1A00, 0x6041, 0x6061, 0x6064, 0x606C, 0x6077, sm=3, Fixed=1),
        "<Slots><Slot><ModuleIdent>#x10</ModuleIdent></Slot></Slots>",
        dc="<Dc><OpMode><Name>FreeRun</Name><AssignActivate>#x0</AssignActivate></OpMode></Dc>",
    ).replace('version="1.0"', 'version="1.0" encoding="utf-16"').encode("utf-16"),
}  # fmt: skip
