"""Choice of the signals in the process data of a drive: pure, no I/O.

A drive that can be remapped gets exactly the requested objects in its default PDO; a drive that
cannot gets the fixed PDOs that carry most of them. The remaining signals are polled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drivers.errors import NotAllowed
from drivers.ethercat.exchange.assignment import (
    AssignmentRules,
    Direction,
    assignment_rules,
    choose_fixed,
)
from drivers.link import Address, CyclicSignal
from drivers.motion.setpoints import TARGETS
from drivers.objects.codec import size_of
from drivers.texts import limits
from drivers.texts.message import Text, joined, text
from profiles.schema import Parameter, PdoPart, PdoSet, Profile

CONTROL_WORD = Address(0x6040, 0, "UINT16")
STATUS_WORD = Address(0x6041, 0, "UINT16")
POSITION_ACTUAL = Address(0x6064, 0, "INT32")

#: For a drive without a profile: what every CiA 402 drive known to us accepts.
_GENERIC_ENTRIES, _GENERIC_RX, _GENERIC_TX = 8, 0x1600, 0x1A00

_CODE = {
    "BOOL": "B", "INT8": "b", "UINT8": "B", "INT16": "h", "UINT16": "H", "INT32": "i",
    "UINT32": "I", "INT64": "q", "UINT64": "Q", "REAL32": "f",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Entry:
    """One object in a PDO. ``code`` is its `struct` letter, ``x`` for unused bytes."""

    index: int
    subindex: int
    size: int
    code: str

    @property
    def word(self) -> int:
        """The mapping entry: index, subindex and bits (ETG.1000.6 clause 5.6.7.4.7)."""
        return self.index << 16 | self.subindex << 8 | self.size * 8


@dataclass(frozen=True, slots=True)
class Pdo:
    """One PDO with its entries; ``write``: the mapping object has to be written."""

    index: int
    entries: tuple[Entry, ...]
    write: bool
    words: tuple[int, ...] = ()
    """Mapping entries of a fixed PDO with padding or single bits, where ``entries`` has bytes."""

    @property
    def mapping_words(self) -> tuple[int, ...]:
        """Contents of its mapping object (ETG.1000.6 clause 5.6.7.4.7)."""
        return self.words or tuple(entry.word for entry in self.entries)

    @property
    def ragged(self) -> bool:
        """Whether it does not end on a byte boundary."""
        return sum(word & 0xFF for word in self.mapping_words) % 8 != 0

    @property
    def size(self) -> int:
        """Size in bytes."""
        return sum(entry.size for entry in self.entries)


@dataclass(frozen=True, slots=True)
class Assigned:
    """All PDOs of one direction in their order, and their contents byte by byte.

    ``assign`` is False if the drive's assignment cannot be written: these are its own.
    """

    pdos: tuple[Pdo, ...]
    entries: tuple[Entry, ...]
    assign: bool = True

    @property
    def index(self) -> int:
        """Index of the PDO that is written, else of the first one."""
        written = (pdo.index for pdo in self.pdos if pdo.write)
        return next(written, self.pdos[0].index)

    @property
    def write(self) -> bool:
        """Whether a mapping object is written."""
        return any(pdo.write for pdo in self.pdos)

    @property
    def mapping_words(self) -> tuple[int, ...]:
        """Contents of the mapping objects, one after the other."""
        return tuple(word for pdo in self.pdos for word in pdo.mapping_words)

    @property
    def size(self) -> int:
        """Size in bytes."""
        return sum(entry.size for entry in self.entries)


def alone(pdo: Pdo) -> Assigned:
    """Return a direction with a single PDO."""
    return Assigned((pdo,), pdo.entries)


@dataclass(frozen=True, slots=True)
class StationPlan:
    """Process data of one station, and which of the requested signals they contain."""

    station: int
    rx: Assigned
    tx: Assigned
    mapped: tuple[CyclicSignal, ...]
    left_over: tuple[tuple[CyclicSignal, Text], ...]
    """Signals to poll, each with the reason."""


def plan_station(
    station: int,
    inputs: Sequence[CyclicSignal],
    outputs: Sequence[CyclicSignal],
    profile: Profile | None,
) -> StationPlan:
    """Choose the process data of one station.

    All outputs except the optional ones are required; with a setpoint among them, control word,
    status word and actual position are required too, so that the loop can stop the axis by itself.
    Optional outputs and inputs fill the remaining room in their order.

    Raises:
        NotAllowed: a required output cannot be mapped, or the required ones do not all fit.
    """
    needed_out = [signal.address for signal in outputs if not signal.optional]
    optional = [signal.address for signal in outputs if signal.optional]
    needed_in: list[Address] = []
    if any(address.index in TARGETS for address in (*needed_out, *optional)):
        needed_out.insert(0, CONTROL_WORD)
        needed_in = [STATUS_WORD, POSITION_ACTUAL]
    elif CONTROL_WORD.index in {address.index for address in needed_out}:
        needed_in = [STATUS_WORD]
    wish_in = _unique([*needed_in, *(signal.address for signal in inputs)])
    wish_out = _unique([*needed_out, *optional])
    rx = _direction(station, "rx", wish_out, len(_unique(needed_out)), profile)
    tx = _direction(station, "tx", wish_in, len(_unique(needed_in)), profile)
    return _with_signals(station, inputs, outputs, rx, tx)


def _with_signals(
    station: int,
    inputs: Sequence[CyclicSignal],
    outputs: Sequence[CyclicSignal],
    rx: tuple[Assigned, dict[tuple[int, int], Text]],
    tx: tuple[Assigned, dict[tuple[int, int], Text]],
) -> StationPlan:
    mapped: list[CyclicSignal] = []
    left: list[tuple[CyclicSignal, Text]] = []
    for signals, (taken, reasons) in ((inputs, tx), (outputs, rx)):
        present = {(entry.index, entry.subindex) for entry in taken.entries if entry.code != "x"}
        for signal in signals:
            place = (signal.address.index or 0, signal.address.subindex)
            if place in present:
                mapped.append(signal)
            else:
                left.append((signal, reasons.get(place, text("ethercat.not-in-fixed-data"))))
    return StationPlan(station, rx[0], tx[0], tuple(mapped), tuple(left))


def _direction(
    station: int,
    direction: Direction,
    wish: Sequence[Address],
    needed: int,
    profile: Profile | None,
) -> tuple[Assigned, dict[tuple[int, int], Text]]:
    if profile is None or profile.pdo is None:
        index = _GENERIC_RX if direction == "rx" else _GENERIC_TX
        return _filled(station, direction, wish, needed, profile, _Room(index, _GENERIC_ENTRIES))
    rules = assignment_rules(profile, profile.pdo, direction)
    if rules.free is None:
        return _fixed(station, wish[:needed], wish, profile, rules), {}
    kept = _set_entries(rules.kept, profile)
    room = _Room(
        rules.free.index,
        profile.pdo.max_entries,
        rules.room_bytes,
        rules.kept,
        kept,
        rules.assignable,
        profile,
    )
    return _filled(station, direction, wish, needed, profile, room)


@dataclass(frozen=True, slots=True)
class _Room:
    """The PDO to fill, its capacity, and the PDOs assigned next to it."""

    index: int
    most: int
    bytes: int | None = None
    kept: tuple[PdoSet, ...] = ()
    kept_entries: tuple[Entry, ...] = ()
    assignable: bool = True
    profile: Profile | None = None

    def assigned(self, entries: Sequence[Entry]) -> Assigned:
        """Return the assignment with these entries in the free PDO, together with the kept PDOs."""
        filled = Pdo(self.index, tuple(entries), write=True)
        if not self.kept or self.profile is None:
            return Assigned((filled,), filled.entries, self.assignable)
        kept = tuple(_fixed_pdo(each, self.profile) for each in self.kept)
        # A PDO that does not end on a byte boundary is placed last, as it would shift what follows.
        pdos = sorted((*kept, filled), key=lambda pdo: (pdo.ragged, pdo.index))
        loose = tuple(e for pdo in pdos for e in pdo.entries)
        return Assigned(tuple(pdos), loose, self.assignable)


def _filled(
    station: int,
    direction: Direction,
    wish: Sequence[Address],
    needed: int,
    profile: Profile | None,
    room: _Room,
) -> tuple[Assigned, dict[tuple[int, int], Text]]:
    entries: list[Entry] = []
    reasons: dict[tuple[int, int], Text] = {}
    carried = _reached(room.kept_entries)
    used = sum(entry.size for entry in room.kept_entries)
    for number, address in enumerate(wish):
        if str(address) in carried:
            continue
        reason = _unmappable(address, direction, profile)
        entry = _entry(address)
        if reason is None and len(entries) >= room.most:
            reason = text("ethercat.objects-used-up", count=room.most)
        if reason is None and room.bytes is not None and used + entry.size > room.bytes:
            reason = text("ethercat.bytes-used-up", bytes=room.bytes)
        if reason is None:
            entries.append(entry)
            used += entry.size
        elif number < needed:
            raise NotAllowed(
                "ethercat.station-cannot-cyclic-data",
                parameter=str(address),
                limit=joined(
                    [text("limit.objects", count=room.most)]
                    + ([] if room.bytes is None else [limits.size(room.bytes)]),
                    ", ",
                ),
                station=station,
                address=str(address),
                reason=reason,
            )
        else:
            reasons[address.index or 0, address.subindex] = reason
    return room.assigned(entries), reasons


def _unmappable(address: Address, direction: str, profile: Profile | None) -> Text | None:
    if address.index is None or size_of(address.type) is None:
        return text("ethercat.fixed-length-only")
    if profile is None:
        return None
    parameter = profile.by_key.get(str(address))
    if parameter is None:
        known = address in (CONTROL_WORD, STATUS_WORD, POSITION_ACTUAL)
        return None if known else text("ethercat.not-in-profile")
    if direction not in parameter.pdo:
        return text("ethercat.not-in-this-direction")
    return None


def _entry(address: Address) -> Entry:
    return Entry(
        address.index or 0,
        address.subindex,
        size_of(address.type) or 0,
        _CODE.get(address.type, "x"),
    )


def _fixed(
    station: int,
    needed: Sequence[Address],
    wish: Sequence[Address],
    profile: Profile,
    rules: AssignmentRules,
) -> Assigned:
    """Choose the fixed PDOs with all required objects and most of the requested ones."""
    must = {str(address) for address in needed}
    want = {str(address) for address in wish}

    def keys_of(sets: Sequence[PdoSet]) -> set[str]:
        return _reached(_set_entries(sets, profile))

    best = choose_fixed(rules, must, want, keys_of)
    if best is None:
        own = ", ".join(f"{s.index:04X}h" for s in rules.sets)
        raise NotAllowed(
            "ethercat.station-none-drive-fixed",
            limit=text("limit.fixed-process-data", own=own),
            station=station,
            must=", ".join(sorted(must)),
        )
    pdos = tuple(_fixed_pdo(each, profile) for each in best)
    return Assigned(pdos, _set_entries(best, profile), rules.assignable)


def _fixed_pdo(each: PdoSet, profile: Profile) -> Pdo:
    words = tuple(_word(part) for part in each.layout)
    return Pdo(each.index, _set_entries((each,), profile), write=False, words=words)


def _reached(entries: Sequence[Entry]) -> set[str]:
    """Return the keys of the objects that occupy whole bytes of a PDO."""
    return {f"{e.index:04X}:{e.subindex:02X}" for e in entries if e.code != "x"}


def _word(part: PdoPart) -> int:
    """Return the mapping entry of a part of a PDO; padding has index 0."""
    if part.key is None:
        return part.bits
    return int(part.key[:4], 16) << 16 | int(part.key[5:], 16) << 8 | part.bits


def _set_entries(chosen: Sequence[PdoSet], profile: Profile) -> tuple[Entry, ...]:
    """Return the contents byte by byte; padding and single bits become unused bytes.

    PDOs of one direction follow each other without a gap, bit by bit (ETG.1000.4 clause 6.6).
    """
    entries: list[Entry] = []
    seen: set[tuple[int, int]] = set()
    loose = 0  # bits since the last object that begins on a byte boundary
    for part in (part for each in chosen for part in _parts(each, profile)):
        known = profile.by_key.get(part.key) if part.key is not None else None
        entry = None if known is None else _entry_of(known)
        if entry is None or loose % 8 or entry.size * 8 != part.bits or entry.code == "x":
            loose += part.bits
            continue
        if (entry.index, entry.subindex) in seen:
            # Mapped twice: the first place is used.
            loose += part.bits
            continue
        seen.add((entry.index, entry.subindex))
        if loose:
            entries.append(Entry(0, 0, loose // 8, "x"))
            loose = 0
        entries.append(entry)
    if loose:
        entries.append(Entry(0, 0, (loose + 7) // 8, "x"))
    return tuple(entries)


def _parts(each: PdoSet, profile: Profile) -> tuple[PdoPart, ...]:
    if each.layout:
        return each.layout
    sizes = ((key, _entry_of(profile.by_key[key]).size) for key in each.entries)
    return tuple(PdoPart(key=key, bits=8 * size) for key, size in sizes if size)


def _entry_of(parameter: Parameter) -> Entry:
    return _entry(Address(parameter.index, parameter.subindex or 0, parameter.type))


def _unique(addresses: Sequence[Address]) -> list[Address]:
    found: dict[tuple[int | None, int], Address] = {}
    for address in addresses:
        found.setdefault((address.index, address.subindex), address)
    return list(found.values())
