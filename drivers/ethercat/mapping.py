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
from drivers.setpoints import TARGETS
from profiles.schema import DataType, PdoSet, PdoSpec, Profile

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
    if spec is not None and not spec.remappable:
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
                f"station {station}: {address} cannot be in the cyclic data: {reason}",
                parameter=str(address),
                limit=f"{most} objects" + (f", {room} bytes" if room is not None else ""),
                remedy="map fewer signals, or use a mode that needs fewer setpoints",
            )
        else:
            reasons[address.index or 0, address.subindex] = reason
    return Pdo(index, tuple(entries), write=True), reasons


def _limits(spec: PdoSpec | None, direction: str) -> tuple[int, int, int | None]:
    if spec is None:
        return (_GENERIC_RX if direction == "rx" else _GENERIC_TX), _GENERIC_ENTRIES, None
    index = spec.default_rx if direction == "rx" else spec.default_tx
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
    usable = [s for s in sets if must <= set(s.entries)]
    if not usable:
        raise NotAllowed(
            f"station {station}: none of the drive's fixed process data carries"
            f" {', '.join(sorted(must))}",
            limit="fixed process data: " + ", ".join(f"{s.index:04X}h" for s in sets),
            remedy="use a mode whose setpoints one of these sets carries",
        )
    best = max(usable, key=lambda s: (len(want & set(s.entries)), s.index == default))
    return Pdo(best.index, _set_entries(best, profile), write=False)


def _set_entries(chosen: PdoSet, profile: Profile) -> tuple[Entry, ...]:
    entries = []
    for key in chosen.entries:
        parameter = profile.by_key[key]
        kind: DataType = parameter.type
        entries.append(_entry(Address(parameter.index, parameter.subindex or 0, kind)))
    return tuple(entries)


def _unique(addresses: Sequence[Address]) -> list[Address]:
    found: dict[tuple[int | None, int], Address] = {}
    for address in addresses:
        found.setdefault((address.index, address.subindex), address)
    return list(found.values())
