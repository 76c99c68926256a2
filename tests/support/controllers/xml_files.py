"""TwinCAT's start-up list, ENI and lcec's configuration, as their readers take them."""

from __future__ import annotations

from collections.abc import Callable
from xml.etree.ElementTree import Element

from defusedxml.ElementTree import fromstring

from tests.support.controllers.consumed import Consumed, Refused, need, unsigned

#: Children of an InitCmd in their order, as in the files that TwinCAT writes:
#: linuxcnc-ethercat, examples/initcmds/AM8121-xFx0-000x_MDP.xml (a start-up list of CoE) and
#: Cassie_FlatGround_Controller, Cassie/Core/EtherCAT/cassie-v3-eni.xml (the same within an ENI).
_FIELDS = ["Transition", "Comment", "Timeout", "Ccs", "Index", "SubIndex", "Data"]


def init_command(command: Element) -> tuple[int, int, bytes, str]:
    """One CoE command, field by field."""
    fields = [child.tag for child in command]
    need(fields == _FIELDS, f"InitCmd with {fields}")
    transition = command.findtext("Transition") or ""
    need(transition in ("IP", "PS", "SO"), f"Transition {transition!r}")
    need(command.findtext("Ccs") == "1", "Ccs of a download is 1")
    unsigned(command.findtext("Timeout"), 32, "Timeout")
    text = command.findtext("Data") or ""
    need(text == text.strip() and text, "Data is empty or has blanks")
    try:
        data = bytes.fromhex(text)
    except ValueError as error:
        raise Refused(f"Data {text!r}") from error
    return (
        unsigned(command.findtext("Index"), 16, "Index"),
        unsigned(command.findtext("SubIndex"), 8, "SubIndex"),
        data,
        transition,
    )


def _children(element: Element, tags: list[str]) -> None:
    found = [child.tag for child in element]
    need(found == tags, f"{element.tag} with {found}, {tags} is what there may be")


def twincat(data: bytes) -> Consumed:
    """A start-up list: nothing but CoE commands."""
    root = fromstring(data)
    need(root.tag == "EtherCATMailbox", root.tag)
    _children(root, ["CoE"])
    _children(root[0], ["InitCmds"])
    need({child.tag for child in root[0][0]} == {"InitCmd"}, "InitCmds")
    return Consumed([init_command(command) for command in root[0][0]])


def eni(data: bytes) -> Consumed:
    """The first slave of an ENI; commands of the mapping itself are marked Fixed."""
    root = fromstring(data)
    need(root.tag == "EtherCATConfig", root.tag)
    slave = root.find("Config/Slave")
    assert slave is not None
    commands = slave.findall("Mailbox/CoE/InitCmds/InitCmd")
    pdos = {}
    for pdo in (*slave.iterfind("ProcessData/TxPdo"), *slave.iterfind("ProcessData/RxPdo")):
        number = unsigned((pdo.findtext("Index") or "").removeprefix("#x"), 16, "Pdo", 16)
        pdos[number] = [
            (
                unsigned((entry.findtext("Index") or "").removeprefix("#x"), 16, "Entry", 16),
                unsigned(entry.findtext("SubIndex") or "0", 8, "SubIndex"),
                unsigned(entry.findtext("BitLen"), 8, "BitLen"),
            )
            for entry in pdo.iterfind("Entry")
        ]
    return Consumed(
        [init_command(command) for command in commands if command.get("Fixed") != "1"],
        pdos,
        (
            unsigned(slave.findtext("Info/VendorId"), 32, "VendorId"),
            unsigned(slave.findtext("Info/ProductCode"), 32, "ProductCode"),
        ),
        unsigned(root.findtext("Config/Cyclic/CycleTime"), 32, "CycleTime"),
    )


# --- lcec -------------------------------------------------------------------------------


def _hexadecimal(low: int, high: int) -> Callable[[str], bool]:
    return lambda text: low <= int(text, 16) <= high


def _decimal(low: int, high: int) -> Callable[[str], bool]:
    return lambda text: low <= int(text) <= high


def _one_of(*words: str) -> Callable[[str], bool]:
    return lambda text: text in words


def _any(text: str) -> bool:
    return True


def _cycle(text: str) -> bool:
    return int(text.removeprefix("*")) > 0


def _octets(text: str) -> bool:
    return len(bytes.fromhex(text)) > 0


def _pin(text: str) -> bool:
    # HAL names have at most 47 characters (HAL_NAME_LEN), of which `lcec.0.NAME.` takes a part.
    return 0 < len(text) <= 32 and all(c.isalnum() or c in "-._" for c in text)


#: linuxcnc-ethercat, documentation/configuration-reference.md: elements with what they may
#: contain, and their attributes with whether they are needed and what they may be. What the
#: reference leaves open (dcConf, sdoConfig, sdoDataRaw, the largest numbers) is as its files in
#: examples/ and its parser have it. Attributes that we never write are not listed: they fail.
_GRAMMAR: dict[str, tuple[set[str], dict[str, tuple[bool, Callable[[str], bool]]]]] = {
    "masters": ({"master"}, {}),
    "master": (
        {"slave"},
        {
            "idx": (False, _decimal(0, 255)),
            "appTimePeriod": (False, _decimal(1, 4_294_967_295)),
            "refClockSyncCycles": (True, _decimal(-1, 2**31 - 1)),
        },
    ),
    "slave": (
        {"dcConf", "sdoConfig", "syncManager"},
        {
            "idx": (True, _decimal(0, 65535)),
            "type": (True, _one_of("generic")),
            "name": (False, _pin),
            "vid": (True, _hexadecimal(0, 2**32 - 1)),
            "pid": (True, _hexadecimal(0, 2**32 - 1)),
            "configPdos": (False, _one_of("true", "false")),
        },
    ),
    "dcConf": (
        set(),
        {
            "assignActivate": (True, _hexadecimal(1, 0xFFFF)),
            "sync0Cycle": (True, _cycle),
            "sync0Shift": (True, _decimal(-(2**31), 2**31 - 1)),
        },
    ),
    "sdoConfig": (
        {"sdoDataRaw"},
        {"idx": (True, _hexadecimal(0, 0xFFFE)), "subIdx": (True, _hexadecimal(0, 0xFE))},
    ),
    "sdoDataRaw": (set(), {"data": (True, _octets)}),
    "syncManager": ({"pdo"}, {"idx": (True, _decimal(0, 15)), "dir": (True, _one_of("in", "out"))}),
    "pdo": ({"pdoEntry"}, {"idx": (True, _hexadecimal(0, 0xFFFE))}),
    "pdoEntry": (
        set(),
        {
            "idx": (True, _hexadecimal(0, 0xFFFE)),
            "subIdx": (True, _hexadecimal(0, 0xFE)),
            "bitLen": (True, _decimal(1, 255)),
            "halPin": (False, _pin),
            "halType": (False, _one_of("bit", "s32", "u32", "float-ieee")),
        },
    ),
}


def _check(element: Element) -> None:
    need(element.tag in _GRAMMAR, f"element {element.tag}")
    children, attributes = _GRAMMAR[element.tag]
    for name, text in element.attrib.items():
        need(name in attributes, f"attribute {name} of {element.tag}")
        try:
            need(attributes[name][1](text), f"{element.tag} {name}={text!r}")
        except ValueError as error:
            raise Refused(f"{element.tag} {name}={text!r}") from error
    for name, (needed, _) in attributes.items():
        need(not needed or name in element.attrib, f"{element.tag} has no {name}")
    # What a type allows is decided while attributes are read: it stands in front of them.
    if element.tag == "slave":
        names = list(element.attrib)
        need(names.index("type") < names.index("configPdos"), "type stands before configPdos")
    for child in element:
        need(child.tag in children, f"{child.tag} in {element.tag}")
        _check(child)


def lcec(data: bytes, slave: int = 0) -> Consumed:
    """One slave of lcec's configuration. SDOs are written on the way to Safe-Operational."""
    root = fromstring(data)
    need(root.tag == "masters", root.tag)
    _check(root)
    master = root[0]
    of = master.findall("slave")[slave]
    pins = [entry.get("halPin") for entry in of.iter("pdoEntry") if entry.get("halPin")]
    need(len(pins) == len(set(pins)), "two pins have one name")
    clock = of.find("dcConf")
    return Consumed(
        [
            (
                int(config.get("idx", ""), 16),
                int(config.get("subIdx", ""), 16),
                b"".join(bytes.fromhex(raw.get("data", "")) for raw in config),
                "PS",
            )
            for config in of.iterfind("sdoConfig")
        ],
        {
            int(pdo.get("idx", ""), 16): [
                (
                    int(entry.get("idx", ""), 16),
                    int(entry.get("subIdx", ""), 16),
                    int(entry.get("bitLen", "")),
                )
                for entry in pdo
            ]
            for pdo in of.iterfind("syncManager/pdo")
        },
        (int(of.get("vid", ""), 16), int(of.get("pid", ""), 16)),
        int(master.get("appTimePeriod", "1000000")) // 1000,
        None if clock is None else int(clock.get("assignActivate", ""), 16),
    )
