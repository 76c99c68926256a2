"""Distribution of signals over PDOs, and the writes that configure the drive accordingly. Pure.

Source: CiA 301 v4.2.0 clauses 7.5.2.35 to 7.5.2.38 (PDO parameters) and 7.2.2 (PDO services).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from drivers.canopen.exchange.busload import LIMIT, BusLoad, bus_load, require_room
from drivers.canopen.exchange.fixed_pdo import FixedPdo, chosen
from drivers.canopen.frames import RPDO, TPDO
from drivers.link import CyclicSignal
from drivers.objects.codec import size_of
from drivers.texts.message import Text, text

MAX_ENTRIES = 4
"""Entries per PDO that every drive accepts: DS_C has only subindices 1 to 4 (003:432-475)."""

INVALID = 0x80000000
SYNCHRONOUS = 1


@dataclass(frozen=True, slots=True)
class PdoPlan:
    """One PDO of one node: number from 0, direction, and the signals in order."""

    station: int
    direction: Literal["rx", "tx"]
    number: int
    signals: tuple[CyclicSignal, ...]
    fixed: FixedPdo | None = None
    """Contents in the drive, if they cannot be changed."""

    @property
    def cob_id(self) -> int:
        """Identifier in the pre-defined connection set, or that of the drive for a fixed PDO."""
        if self.fixed is not None:
            return self.fixed.cob_id
        return (RPDO if self.direction == "rx" else TPDO)[self.number] + self.station

    @property
    def communication(self) -> int:
        """Index of its communication parameters."""
        return (0x1400 if self.direction == "rx" else 0x1800) + self.number

    @property
    def mapping(self) -> int:
        """Index of its mapping."""
        return (0x1600 if self.direction == "rx" else 0x1A00) + self.number

    @property
    def size(self) -> int:
        """Size in bytes."""
        if self.fixed is not None:
            return self.fixed.size
        return sum(size_of(s.address.type) or 0 for s in self.signals)

    def placed(self) -> Iterator[tuple[CyclicSignal, int]]:
        """Iterate over the signals with their byte offsets."""
        starts = (
            {(a.index, a.subindex): start for a, start in self.fixed.starts()} if self.fixed else {}
        )
        at = 0
        for signal in self.signals:
            place = (signal.address.index, signal.address.subindex)
            yield signal, starts.get(place, at)
            at += size_of(signal.address.type) or 0


@dataclass(frozen=True, slots=True)
class SdoWrite:
    """One write of the set-up."""

    index: int
    subindex: int
    data: bytes


def plan(
    inputs: Sequence[CyclicSignal],
    outputs: Sequence[CyclicSignal],
    fixed: Mapping[int, Sequence[FixedPdo]] = MappingProxyType({}),
) -> tuple[tuple[PdoPlan, ...], tuple[CyclicSignal, ...]]:
    """Distribute signals over four PDOs of 8 bytes per node and direction, in the order given.

    ``fixed`` has the PDOs of stations that cannot be mapped again: these are used unchanged.
    Returns the PDOs and the signals that did not fit (or cannot be mapped at all).
    """
    pdos: list[PdoPlan] = []
    left: list[CyclicSignal] = []
    directions: tuple[tuple[Literal["rx", "tx"], Sequence[CyclicSignal]], ...] = (
        ("tx", inputs),
        ("rx", outputs),
    )
    for direction, signals in directions:
        for station in sorted({s.station for s in signals}):
            own = [s for s in signals if s.station == station]
            given = [each for each in fixed.get(station, ()) if each.direction == direction]
            if given:
                taken, rest = chosen(given, own)
                left += rest
                pdos += [PdoPlan(station, direction, f.number, each, f) for f, each in taken]
                continue
            groups, rest = _pack(own)
            left += rest
            pdos += [PdoPlan(station, direction, n, tuple(g)) for n, g in enumerate(groups)]
    return tuple(pdos), tuple(left)


@dataclass(frozen=True, slots=True)
class LoadedPlan:
    """PDOs within the bus load, the signals left out with the reason, and the load."""

    pdos: tuple[PdoPlan, ...]
    left_over: tuple[tuple[CyclicSignal, Text], ...]
    load: BusLoad | None


_INPUTS_KEPT = 3
_OUTPUTS_KEPT = 5


def plan_within_load(
    inputs: Sequence[CyclicSignal],
    outputs: Sequence[CyclicSignal],
    cycle_s: float,
    bitrate: int,
    fixed: Mapping[int, Sequence[FixedPdo]] = MappingProxyType({}),
) -> LoadedPlan:
    """Plan as `plan`, leaving out the less important signals while the bus load is too high.

    Signals of a station are in order of importance; its first 3 inputs and first 5 outputs are
    never left out.

    Raises:
        NotAllowed: even those need more than 80 % of the bus.
    """
    kept_in, kept_out = list(inputs), list(outputs)
    dropped: list[tuple[CyclicSignal, Text]] = []
    while True:
        pdos, left = plan(kept_in, kept_out, fixed)
        sizes = [p.size for p in pdos]
        if not pdos:
            load = None
        elif bus_load(sizes, cycle_s, bitrate).fraction <= LIMIT:
            load = bus_load(sizes, cycle_s, bitrate)
        else:
            ranked = [(_rank(s, kept_in) - _INPUTS_KEPT, kept_in, s) for s in kept_in]
            ranked += [(_rank(s, kept_out) - _OUTPUTS_KEPT, kept_out, s) for s in kept_out]
            rank, owner, least = max(ranked, key=lambda item: item[0])
            if rank < 0:
                require_room(sizes, cycle_s, bitrate)
            owner.remove(least)
            dropped.append((least, text("canopen.bus-would-be-full", percent=round(LIMIT * 100))))
            continue
        unfit = tuple((s, text("canopen.not-fit-pdos")) for s in left)
        return LoadedPlan(pdos, (*unfit, *dropped), load)


def _rank(signal: CyclicSignal, among: Sequence[CyclicSignal]) -> int:
    return [s for s in among if s.station == signal.station].index(signal)


def _pack(
    signals: Sequence[CyclicSignal],
) -> tuple[list[list[CyclicSignal]], list[CyclicSignal]]:
    groups: list[list[CyclicSignal]] = []
    left: list[CyclicSignal] = []
    for signal in signals:
        size = size_of(signal.address.type)
        if size is None or signal.address.index is None:
            left.append(signal)
            continue
        for group in groups:
            used = sum(size_of(s.address.type) or 0 for s in group)
            if used + size <= 8 and len(group) < MAX_ENTRIES:
                group.append(signal)
                break
        else:
            if len(groups) < 4:
                groups.append([signal])
            else:
                left.append(signal)
    return groups, left


def set_up(pdo: PdoPlan, flags: int = 0) -> list[SdoWrite]:
    """Return the writes that map ``pdo`` and make it synchronous, in the order of CiA 301.

    ``flags`` are bits 29 and 30 of the previous identifier.
    """
    entries = [mapping_entry(s) for s in pdo.signals]
    identifier = pdo.cob_id | flags
    return [
        SdoWrite(pdo.communication, 1, struct.pack("<I", identifier | INVALID)),
        SdoWrite(pdo.communication, 2, bytes([SYNCHRONOUS])),
        SdoWrite(pdo.mapping, 0, b"\0"),
        *(
            SdoWrite(pdo.mapping, n, struct.pack("<I", entry))
            for n, entry in enumerate(entries, start=1)
        ),
        SdoWrite(pdo.mapping, 0, bytes([len(entries)])),
        SdoWrite(pdo.communication, 1, struct.pack("<I", identifier)),
    ]


def mapping_entry(signal: CyclicSignal) -> int:
    """Return index, subindex and length in bits as in a mapping object."""
    address = signal.address
    bits = 8 * (size_of(address.type) or 0)
    return (address.index or 0) << 16 | address.subindex << 8 | bits
