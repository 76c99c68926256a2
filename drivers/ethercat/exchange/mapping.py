"""Which signals go into the process data of a drive: pure, no I/O.

A drive that can be remapped gets exactly the wanted objects in its default PDO; one that cannot
gets that of its fixed sets which carries most of them. What is left over is polled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drivers.codec import size_of
from drivers.errors import NotAllowed
from drivers.link import Address, CyclicSignal
from drivers.motion.setpoints import TARGETS
from profiles.schema import Parameter, PdoPart, PdoSet, PdoSpec, Profile

CONTROL_WORD = Address(0x6040, 0, "UINT16")
STATUS_WORD = Address(0x6041, 0, "UINT16")
POSITION_ACTUAL = Address(0x6064, 0, "INT32")

#: For a drive without a profile: what every CiA 402 drive known to us can take.
_GENERIC_ENTRIES, _GENERIC_RX, _GENERIC_TX = 8, 0x1600, 0x1A00

_CODE = {
    "BOOL": "B", "INT8": "b", "UINT8": "B", "INT16": "h", "UINT16": "H", "INT32": "i",
    "UINT32": "I", "INT64": "q", "UINT64": "Q", "REAL32": "f",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Entry:
    """One object in a PDO. ``code`` is its `struct` letter, ``x`` for bytes of no interest."""

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
    """One PDO with its entries; ``write`` when the mapping object has to be written."""

    index: int
    entries: tuple[Entry, ...]
    write: bool
    words: tuple[int, ...] = ()
    """Mapping entries of a fixed PDO with padding or single bits, where ``entries`` has bytes."""

    @property
    def mapping_words(self) -> tuple[int, ...]:
        """What its mapping object holds (ETG.1000.6 clause 5.6.7.4.7)."""
        return self.words or tuple(entry.word for entry in self.entries)

    @property
    def size(self) -> int:
        """Bytes."""
        return sum(entry.size for entry in self.entries)


@dataclass(frozen=True, slots=True)
class StationPlan:
    """Process data of one station, and what of the wish is in them."""

    station: int
    rx: Pdo
    tx: Pdo
    mapped: tuple[CyclicSignal, ...]
    left_over: tuple[tuple[CyclicSignal, str], ...]
    """Signals for polling, each with the reason in words."""


def plan_station(
    station: int,
    inputs: Sequence[CyclicSignal],
    outputs: Sequence[CyclicSignal],
    profile: Profile | None,
) -> StationPlan:
    """Choose the process data of one station.

    Outputs are all needed, and with a target its control word, status word and actual position,
    so that the loop can stop the axis by itself. Inputs fill the rest in their order.

    Raises:
        NotAllowed: an output cannot be mapped, or all of them do not fit.
    """
    needed_out = [signal.address for signal in outputs]
    needed_in: list[Address] = []
    if any(address.index in TARGETS for address in needed_out):
        needed_out.insert(0, CONTROL_WORD)
        needed_in = [STATUS_WORD, POSITION_ACTUAL]
    elif CONTROL_WORD.index in {address.index for address in needed_out}:
        needed_in = [STATUS_WORD]
    wish_in = _unique([*needed_in, *(signal.address for signal in inputs)])
    wish_out = _unique(needed_out)
    rx = _direction(station, "rx", wish_out, len(wish_out), profile)
    tx = _direction(station, "tx", wish_in, len(_unique(needed_in)), profile)
    return _with_signals(station, inputs, outputs, rx, tx)


def _with_signals(
    station: int,
    inputs: Sequence[CyclicSignal],
    outputs: Sequence[CyclicSignal],
    rx: tuple[Pdo, dict[tuple[int, int], str]],
    tx: tuple[Pdo, dict[tuple[int, int], str]],
) -> StationPlan:
    mapped: list[CyclicSignal] = []
    left: list[tuple[CyclicSignal, str]] = []
    for signals, (pdo, reasons) in ((inputs, tx), (outputs, rx)):
        present = {(entry.index, entry.subindex) for entry in pdo.entries if entry.code != "x"}
        for signal in signals:
            place = (signal.address.index or 0, signal.address.subindex)
            if place in present:
                mapped.append(signal)
            else:
                left.append((signal, reasons.get(place, "not in the drive's fixed process data")))
    return StationPlan(station, rx[0], tx[0], tuple(mapped), tuple(left))


def _direction(
    station: int, direction: str, wish: Sequence[Address], needed: int, profile: Profile | None
) -> tuple[Pdo, dict[tuple[int, int], str]]:
    spec = profile.pdo if profile is not None else None
    if spec is not None and spec.free_set("rx" if direction == "rx" else "tx") is None:
        return _fixed(station, direction, wish[:needed], wish, profile), {}
    index, most, room = _limits(spec, direction)
    entries: list[Entry] = []
    reasons: dict[tuple[int, int], str] = {}
    for number, address in enumerate(wish):
        reason = _unmappable(address, direction, profile)
        entry = _entry(address)
        if not reason and len(entries) >= most:
            reason = f"the drive maps {most} objects in one direction and they are used up"
        if not reason and room is not None and sum(e.size for e in entries) + entry.size > room:
            reason = f"the drive takes {room} bytes in one direction and they are used up"
        if not reason:
            entries.append(entry)
        elif number < needed:
            raise NotAllowed(
                "ethercat.station-cannot-cyclic-data",
                parameter=str(address),
                limit=f"{most} objects" + (f", {room} bytes" if room is not None else ""),
                station=station,
                address=str(address),
                reason=reason,
            )
        else:
            reasons[address.index or 0, address.subindex] = reason
    return Pdo(index, tuple(entries), write=True), reasons


def _limits(spec: PdoSpec | None, direction: str) -> tuple[int, int, int | None]:
    if spec is None:
        return (_GENERIC_RX if direction == "rx" else _GENERIC_TX), _GENERIC_ENTRIES, None
    index = spec.free_set("rx" if direction == "rx" else "tx")
    assert index is not None, "a direction without a free set is fixed"
    return index, spec.max_entries, spec.max_bytes


def _unmappable(address: Address, direction: str, profile: Profile | None) -> str:
    if address.index is None or size_of(address.type) is None:
        return "only objects of fixed length can be mapped"
    if profile is None:
        return ""
    parameter = profile.by_key.get(str(address))
    if parameter is None:
        return (
            ""
            if address in (CONTROL_WORD, STATUS_WORD, POSITION_ACTUAL)
            else ("the profile does not know it")
        )
    if direction not in parameter.pdo:
        return "the drive does not map it in this direction"
    return ""


def _entry(address: Address) -> Entry:
    return Entry(
        address.index or 0,
        address.subindex,
        size_of(address.type) or 0,
        _CODE.get(address.type, "x"),
    )


def _fixed(
    station: int,
    direction: str,
    needed: Sequence[Address],
    wish: Sequence[Address],
    profile: Profile | None,
) -> Pdo:
    """The fixed set that has all that is needed and most of what is wished."""
    assert profile is not None
    assert profile.pdo is not None
    default = profile.pdo.default_rx if direction == "rx" else profile.pdo.default_tx
    must = {str(address) for address in needed}
    want = {str(address) for address in wish}
    sets = [s for s in profile.pdo.sets if s.direction == direction]
    reached = {s.index: _reached(_set_entries(s, profile)) for s in sets}
    usable = [s for s in sets if must <= reached[s.index]]
    if not usable:
        raise NotAllowed(
            "ethercat.station-none-drive-fixed",
            limit="fixed process data: " + ", ".join(f"{s.index:04X}h" for s in sets),
            station=station,
            must=", ".join(sorted(must)),
        )
    best = max(usable, key=lambda s: (len(want & reached[s.index]), s.index == default))
    words = tuple(_word(part) for part in best.layout)
    return Pdo(best.index, _set_entries(best, profile), write=False, words=words)


def _reached(entries: Sequence[Entry]) -> set[str]:
    """Keys of the objects that lie in whole bytes of a PDO."""
    return {f"{e.index:04X}:{e.subindex:02X}" for e in entries if e.code != "x"}


def _word(part: PdoPart) -> int:
    """The mapping entry of a stretch; padding has index 0."""
    if part.key is None:
        return part.bits
    return int(part.key[:4], 16) << 16 | int(part.key[5:], 16) << 8 | part.bits


def _set_entries(chosen: PdoSet, profile: Profile) -> tuple[Entry, ...]:
    """Its contents byte by byte; padding and single bits become bytes of no interest."""
    if not chosen.layout:
        return tuple(_entry_of(profile.by_key[key]) for key in chosen.entries)
    entries: list[Entry] = []
    loose = 0  # bits since the last object that begins at a byte
    for part in chosen.layout:
        known = profile.by_key.get(part.key) if part.key is not None else None
        entry = None if known is None else _entry_of(known)
        if entry is None or loose % 8 or entry.size * 8 != part.bits or entry.code == "x":
            loose += part.bits
            continue
        if loose:
            entries.append(Entry(0, 0, loose // 8, "x"))
            loose = 0
        entries.append(entry)
    if loose:
        entries.append(Entry(0, 0, (loose + 7) // 8, "x"))
    return tuple(entries)


def _entry_of(parameter: Parameter) -> Entry:
    return _entry(Address(parameter.index, parameter.subindex or 0, parameter.type))


def _unique(addresses: Sequence[Address]) -> list[Address]:
    found: dict[tuple[int | None, int], Address] = {}
    for address in addresses:
        found.setdefault((address.index, address.subindex), address)
    return list(found.values())
