"""A slave that insists on every rule of an ESI file.

It reads the file by itself (ETG.2000) and has no data of our importer: where both understand
the file differently, the slave refuses. Refusals have codes of its own, named in `RULES`.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from drivers.virtual.device import ABORT_NOT_MAPPABLE, SdoAbort
from drivers.virtual.mechanics.spec import MechanicsSpec
from drivers.virtual.wires.ethercat.clock import WireClock
from drivers.virtual.wires.ethercat.controller import registers as reg
from drivers.virtual.wires.ethercat.controller import sii
from drivers.virtual.wires.ethercat.controller.registers import AlState
from drivers.virtual.wires.ethercat.mailbox.dictionary import CoeDictionary
from drivers.virtual.wires.ethercat.slave import Slave, SlaveIdentity
from profiles.schema import Parameter, PdoPart, PdoSet, PdoSpec, Profile
from tests.wire.ethercat_host.servo_device import ServoDevice, servo_profile
from tests.wire.ethercat_slave.dictionary_device import _parameter
from tests.wire.makers_files.samples import ODD, SAMPLES

RULES = {
    0x8001: "a command of Init to Pre-Op or Pre-Op to Safe-Op was not written",
    0x8002: "a command of Safe-Op to Op was not written",
    0x8003: "a mandatory PDO is not assigned",
    0x8004: "PDOs are assigned together that exclude each other",
    0x8005: "process data are outside the sizes of their sync manager",
    0x8006: "start address or control byte of a sync manager differ from the file",
    0x8007: "0400h differs from the file",
    0x8008: "0420h is longer than the file's, or off",
    0x8009: "0980h is not the AssignActivate of any mode",
    0x800A: "cycle of SYNC0 or SYNC1 differs from the file",
    0x800B: "SYNC0 starts with another shift",
    0x800C: "PDOs are assigned that are not those of the operation mode",
}
_BASE = {"SINT": "INT8", "USINT": "UINT8", "INT": "INT16", "UINT": "UINT16", "DINT": "INT32",
         "UDINT": "UINT32"}  # fmt: skip
_MEAN_NS = 20_000_000
_SLOW = 0.6
"""Of the time that the file allows."""


def number(text: str | None) -> int:
    bare = (text or "0").strip().lower()
    return int(bare[2:], 16) if bare.startswith(("#x", "0x")) else int(bare)


def flag(element: Element | None, name: str) -> bool:
    return element is not None and element.get(name, "0") in ("1", "true")


@dataclass
class FilePdo:
    index: int
    words: list[int]
    fixed: bool
    mandatory: bool
    exclude: set[int]
    sm: int | None


@dataclass
class FileManager:
    start: int
    control: int
    size: int
    low: int
    high: int


@dataclass
class Mode:
    activate: int
    cycle: tuple[int, int]
    shift: int
    cycle1: tuple[int, int] | None
    shift1: int
    pdos: dict[int, list[int]]


@dataclass
class File:
    """What the slave needs of one file."""

    device: Element
    pdos: list[FilePdo] = field(default_factory=list)
    managers: list[FileManager] = field(default_factory=list)
    modes: list[Mode] = field(default_factory=list)
    commands: list[tuple[str, int, int, bytes]] = field(default_factory=list)

    def __post_init__(self) -> None:
        for item in self.device:
            if item.tag in ("RxPdo", "TxPdo"):
                self.pdos.append(_pdo(item))
            elif item.tag == "Sm":
                self.managers.append(_manager(item))
        self.modes = [_mode(item) for item in self.device.iterfind("Dc/OpMode")]
        for item in self.device.iterfind("Mailbox/CoE/InitCmd"):
            data = (item.findtext("Data") or "").removeprefix("#x")
            place = number(item.findtext("Index")), number(item.findtext("SubIndex"))
            transition = item.findtext("Transition") or ""
            self.commands.append((transition, *place, bytes.fromhex(data)))

    @property
    def coe(self) -> Element | None:
        return self.device.find("Mailbox/CoE")

    def sets(self, direction: str) -> list[FilePdo]:
        return [p for p in self.pdos if (p.index < 0x1800) is (direction == "rx")]

    def default(self, direction: str) -> list[int]:
        return [p.index for p in self.sets(direction) if p.sm is not None]

    def register(self, name: str) -> int | None:
        text = self.device.findtext(f"ESC/{name}")
        return None if text is None else number(text)

    def slow_s(self, target: AlState) -> float:
        text = self.device.findtext("Info/StateMachine/Timeout/SafeopOpTimeout")
        return _SLOW * int(text) / 1000 if text and target == AlState.SAFEOP else 0.002


def _pdo(item: Element) -> FilePdo:
    words = [
        number(e.findtext("Index")) << 16
        | number(e.findtext("SubIndex")) << 8
        | number(e.findtext("BitLen"))
        for e in item.iterfind("Entry")
    ]
    return FilePdo(
        number(item.findtext("Index")),
        words,
        flag(item, "Fixed"),
        flag(item, "Mandatory"),
        {number(e.text) for e in item.iterfind("Exclude")},
        number(item.get("Sm")) if item.get("Sm") else None,
    )


def _manager(item: Element) -> FileManager:
    return FileManager(
        number(item.get("StartAddress")),
        number(item.get("ControlByte")),
        number(item.get("DefaultSize")),
        number(item.get("MinSize")),
        number(item.get("MaxSize")) or 0xFFFF,
    )


def _mode(item: Element) -> Mode:
    def cycle(which: str) -> tuple[int, int] | None:
        found = item.find(f"CycleTimeSync{which}")
        return None if found is None else (number(found.text), int(found.get("Factor", "1")))

    return Mode(
        number(item.findtext("AssignActivate")),
        cycle("0") or (0, 1),
        number(item.findtext("ShiftTimeSync0")),
        cycle("1"),
        number(item.findtext("ShiftTimeSync1")),
        {
            number(s.get("No")): [number(p.text) for p in s.iterfind("Pdo")]
            for s in item.iterfind("Sm")
        },
    )


class _Image:
    """Process data bit by bit; padding is zero."""

    def __init__(self, device: FileDevice, words: Sequence[int]) -> None:
        self._device = device
        self._words = list(words)
        self.size = (sum(word & 0xFF for word in words) + 7) // 8

    def pack(self) -> bytes:
        bits, value = 0, 0
        for word in self._words:
            if word >> 16:
                held = self._device.values[word >> 16, word >> 8 & 0xFF]
                value |= (int.from_bytes(held, "little") & ((1 << (word & 0xFF)) - 1)) << bits
            bits += word & 0xFF
        return value.to_bytes(self.size, "little")

    def unpack(self, data: bytes) -> None:
        value = int.from_bytes(data, "little")
        for word in self._words:
            bits = word & 0xFF
            if word >> 16:
                part = value & ((1 << bits) - 1)
                key = word >> 16, word >> 8 & 0xFF
                self._device.values[key] = part.to_bytes(len(self._device.values[key]), "little")
            value >>= bits


class FileDevice(ServoDevice):
    """The ideal servo with the objects of the file and no others."""

    def __init__(self, file: File) -> None:
        self.file = file
        self._passed: deque[tuple[int, float]] = deque()
        super().__init__(_profile(file))

    def advance(self, t_ns: int) -> None:
        """While positions are followed the speed is a mean: SYNC0 may be faster than they come."""
        super().advance(t_ns)
        if super()._get(0x6060) != 8:
            self._passed.clear()
            return
        self._passed.append((self.time_ns, self.position))
        while len(self._passed) > 2 and t_ns - self._passed[0][0] > _MEAN_NS:
            self._passed.popleft()
        (first_ns, first), (last_ns, last) = self._passed[0], self._passed[-1]
        if last_ns > first_ns:
            self._put(0x606C, (last - first) / (last_ns - first_ns) * 1e9)

    def _put(self, index: int, value: float) -> None:
        """Speeds in rpm (60A9h of the files), 10000 increments per revolution (608Fh)."""
        super()._put(index, value * 60 / 10_000 if index == 0x606C else value)

    def _get(self, index: int) -> int:
        value = super()._get(index)
        return value * 10_000 // 60 if index == 0x60FF else value

    def map_process_data(self, entries: Sequence[int], direction: str) -> _Image:  # type: ignore[override]
        for word in entries:
            if word >> 16 == 0:
                continue
            known = self._find(word >> 16, word >> 8 & 0xFF)
            if known.pdo not in (direction, "rxtx"):
                raise SdoAbort(ABORT_NOT_MAPPABLE)
        return _Image(self, entries)


def _record(file: File, item: Element) -> list[Parameter]:
    """The entries of a record, by its data type."""
    name = item.findtext("Type")
    types = file.device.iterfind("Profile/Dictionary/DataTypes/DataType")
    members = next(t for t in types if t.findtext("Name") == name).findall("SubItem")
    values = [i.findtext("Info/DefaultData") or "" for i in item.iterfind("Info/SubItem")]
    return [
        _parameter(
            f"{number(item.findtext('Index')):04X}:{number(member.findtext('SubIdx')):02X}",
            _BASE[member.findtext("Type") or ""],  # type: ignore[arg-type]
            item.findtext("Flags/Access") or "ro",
            default=int.from_bytes(bytes.fromhex(value), "little"),
        )
        for member, value in zip(members, values, strict=True)
    ]


def _profile(file: File) -> Profile:
    """A record for the virtual wire, made of the file's own words."""
    base = servo_profile()
    identity = {p.key: p for p in base.parameters if p.index in (0x1008, 0x1018)}
    kind = file.device.find("Type")
    assert kind is not None
    own = {
        "1018:01": 0xA2B,
        "1018:02": number(kind.get("ProductCode")),
        "1018:03": number(kind.get("RevisionNo")),
    }
    parameters = [
        p.model_copy(update={"default_raw": own.get(key, p.default_raw)})
        for key, p in identity.items()
    ]
    seen: set[int] = set()
    for item in file.device.iterfind("Profile/Dictionary/Objects/Object"):
        if number(item.findtext("Index")) in seen:
            continue  # of all slots together
        seen.add(number(item.findtext("Index")))
        if (item.findtext("Type") or "").startswith("DT"):
            parameters += _record(file, item)
            continue
        mapping = (item.findtext("Flags/PdoMapping") or "").replace("R", "rx").replace("T", "tx")
        data = bytes.fromhex(item.findtext("Info/DefaultData") or "")
        parameters.append(
            _parameter(
                f"{number(item.findtext('Index')):04X}:00",
                _BASE[item.findtext("Type") or ""],  # type: ignore[arg-type]
                item.findtext("Flags/Access") or "ro",
                mapping or "none",  # type: ignore[arg-type]
                int.from_bytes(data, "little"),
            )
        )
    sets = tuple(
        PdoSet(
            index=p.index,
            direction="rx" if p.index < 0x1800 else "tx",
            fixed=p.fixed,
            entries=tuple(f"{w >> 16:04X}:{w >> 8 & 0xFF:02X}" for w in p.words if w >> 16),
            layout=tuple(
                PdoPart(
                    key=f"{w >> 16:04X}:{w >> 8 & 0xFF:02X}" if w >> 16 else None, bits=w & 0xFF
                )
                for w in p.words
            ),
            source="file",
        )
        for p in file.pdos
    )
    configurable = flag(file.coe, "PdoConfig")
    spec = PdoSpec(
        sets=sets,
        default_rx=file.default("rx")[0],
        default_tx=file.default("tx")[0],
        max_entries=12,
        remappable=configurable,
        source="file",
        sync_modes=("SM",) if file.device.find("Dc") is None else ("DC",),
    )
    link = base.links[0].model_copy(
        update={
            "complete_access": flag(file.coe, "CompleteAccess"),
            "foe": file.device.find("Mailbox/FoE") is not None,
        }
    )
    fields = {name: getattr(base, name) for name in Profile.model_fields}
    changed = {"parameters": tuple(parameters), "pdo": spec, "links": (link,), "signals": ()}
    return Profile(**(fields | changed))


class StrictDictionary(CoeDictionary):
    """Assignment as the file says, and a note of everything that is written."""

    file: File
    written: list[tuple[AlState, int, int, bytes]]

    def reset(self) -> None:
        super().reset()
        file: File = self._device.file  # type: ignore[attr-defined]
        self.file, self.written = file, []
        for index, direction in ((0x1C12, "rx"), (0x1C13, "tx")):
            chosen = file.default(direction)
            found = self._objects[index]
            for place in range(1, found.slots + 1):
                found.put(place, chosen[place - 1] if place <= len(chosen) else 0)
            found.put(0, len(chosen))
        if not flag(file.coe, "PdoAssign"):
            self._fixed |= {0x1C12, 0x1C13}

    def write(self, index: int, subindex: int, data: bytes) -> None:
        super().write(index, subindex, data)
        self.written.append((self._state(), index, subindex, bytes(data)))


class StrictSlave(Slave):
    """See the module."""

    dictionary_type = StrictDictionary

    def __init__(
        self,
        device: FileDevice,
        clock: WireClock,
        identity: SlaveIdentity | None = None,
        mailboxes: tuple[int, int] = (128, 128),
    ) -> None:
        self.file = device.file
        super().__init__(device, clock, identity, mailboxes)

    def sii_layout(self, _mailboxes: tuple[int, int]) -> tuple[sii.SmLayout, ...]:
        return tuple(
            sii.SmLayout(m.start, m.size if kind < 3 else 0, m.control, 1, kind)
            for kind, m in enumerate(self.file.managers, start=1)
        )

    def state_requested(self, control: int, now_ns: int) -> None:
        target = control & 0x0F
        known = target in (1, 2, 3, 4, 8)
        slow_s = self.file.slow_s(AlState(target)) if known else 0.002
        self.al.delay_ns = int(slow_s * 1e9)
        super().state_requested(control, now_ns)

    def check(self, target: AlState) -> int:
        code = super().check(target)
        if code or target not in (AlState.SAFEOP, AlState.OP):
            return code
        if target == AlState.SAFEOP and self.al.state == AlState.PREOP:
            code = (
                self._commands(("IP", "PS"), AlState.PREOP, 0x8001)
                or self._assignment()
                or self._managers()
                or self._watchdog()
                or self._clock()
            )
        elif target == AlState.OP:
            code = self._commands(("SO",), AlState.SAFEOP, 0x8002)
        return code

    def _commands(self, transitions: tuple[str, ...], state: AlState, code: int) -> int:
        """Every command in the file's order within its transition, in the right state."""
        written = [w[1:] for w in self.dictionary.written if w[0] == state]  # type: ignore[attr-defined]
        for transition in transitions:
            expected = [c[1:] for c in self.file.commands if c[0] == transition]
            left = iter(written)
            if not all(command in left for command in expected):
                return code
        return 0

    def _assignment(self) -> int:
        mode = self._mode()
        for direction, manager in (("rx", 2), ("tx", 3)):
            chosen = self.dictionary.assigned_pdos(direction)
            sets = {p.index: p for p in self.file.sets(direction)}
            if any(p.mandatory and p.index not in chosen for p in sets.values()):
                return 0x8003
            if any(other in sets[one].exclude for one in chosen for other in chosen):
                return 0x8004
            size = self.controller.sms[manager].length
            limits = self.file.managers[manager]
            if not limits.low <= size <= limits.high:
                return 0x8005
            if mode is not None and mode.pdos.get(manager, list(chosen)) != list(chosen):
                return 0x800C
        return 0

    def _managers(self) -> int:
        for manager, wanted in zip(self.controller.sms, self.file.managers, strict=False):
            if manager.start != wanted.start:
                return 0x8006
            if (manager.control ^ wanted.control) & ~0x40:
                return 0x8006
        return 0

    def _watchdog(self) -> int:
        memory = self.controller.memory
        divider = struct.unpack_from("<H", memory, reg.WATCHDOG_DIVIDER)[0]
        ticks = struct.unpack_from("<H", memory, reg.WATCHDOG_PROCESS_DATA)[0]
        wanted = self.file.register("Reg0400")
        if wanted is not None and divider != wanted:
            return 0x8007
        longest = self.file.register("Reg0420")
        return 0x8008 if longest is not None and not 0 < ticks <= longest else 0

    def _mode(self) -> Mode | None:
        value = struct.unpack_from("<H", self.controller.memory, reg.DC_CYCLIC_CONTROL)[0]
        return next((m for m in self.file.modes if m.activate == value), None)

    def _clock(self) -> int:
        mode = self._mode()
        if mode is None:
            return 0x8009
        if not mode.activate:
            return 0
        memory = self.controller.memory
        start = struct.unpack_from("<Q", memory, reg.DC_START_TIME)[0]
        cycle0, cycle1 = struct.unpack_from("<II", memory, reg.DC_SYNC0_CYCLE)
        base = 1_000_000
        expected0 = _period(mode.cycle, base)
        if cycle0 != expected0:
            return 0x800A
        if mode.cycle1 is not None:
            # ETG.1000.4 clause 6.8: SYNC1 comes every (9A4h div 9A0h) + 1 SYNC0 pulses.
            slower = _period(mode.cycle1, expected0) // expected0
            if cycle1 // cycle0 + 1 != slower or cycle1 % cycle0 != mode.shift1:
                return 0x800A
        return 0 if (start - mode.shift) % base == 0 else 0x800B


def _period(cycle: tuple[int, int], base: int) -> int:
    length, factor = cycle
    if length:
        return length
    return base // -factor if factor < 0 else base * factor


def read(name: str) -> File:
    root = ElementTree.fromstring((SAMPLES | ODD)[name])
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    device = root.find("Descriptions/Devices/Device")
    assert device is not None
    _put_modules(root, device)
    return File(device)


def _put_modules(root: Element, device: Element) -> None:
    """Make the device whole: each slot has the only module of the file."""
    slots, module = device.find("Slots"), root.find("Descriptions/Modules/Module")
    if slots is None or module is None:
        return
    count = sum(number(slot.get("MinInstances", "1")) for slot in slots.iterfind("Slot"))
    for place in range(count):
        copied = deepcopy(module)
        for tag in ("RxPdo", "TxPdo"):
            for pdo in copied.findall(tag):
                _shift(pdo, place * number(slots.get("SlotPdoIncrement")))
                own = [p for p in device.findall(tag) if _index(p) == _index(pdo)]
                for old in own:
                    device.remove(old)
                device.append(pdo)
                for entry in pdo.iterfind("Entry"):
                    _shift(entry, place * number(slots.get("SlotIndexIncrement")))
        for item in copied.iterfind("Profile/Dictionary/Objects/Object"):
            _shift(item, place * number(slots.get("SlotIndexIncrement")))
        described = copied.find("Profile")
        if described is not None:
            device.append(described)


def _index(item: Element) -> int:
    return number(item.findtext("Index"))


def _shift(item: Element, by: int) -> None:
    index = item.find("Index")
    if index is not None and flag(index, "DependOnSlot"):
        index.text = str(number(index.text) + by)


def make_device(
    drive: str, mechanics: MechanicsSpec, nvm: Path | None = None, station: int = 1
) -> FileDevice:
    """Factory for the command line of a segment: ``drive`` is the name of a sample."""
    del mechanics, nvm, station
    return FileDevice(read(drive))
