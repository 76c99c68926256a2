"""PDOs whose contents cannot be changed, as the profile describes them. Pure.

Source: CiA 301 v4.2.0 clauses 7.5.2.35 to 7.5.2.38: mapping objects may be read-only.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from drivers.canopen.frames import RPDO, TPDO
from drivers.link import Address, CyclicSignal
from drivers.objects.codec import size_of
from profiles.schema import PdoSet, Profile

Direction = Literal["rx", "tx"]

PDOS = 512
"""PDOs of a direction: 1600h to 17FFh and 1A00h to 1BFFh (clauses 7.5.2.36 and 7.5.2.38)."""


@dataclass(frozen=True, slots=True)
class FixedPdo:
    """One PDO of one node: objects in their order (None: unused bytes) with sizes [bytes]."""

    direction: Direction
    number: int
    cob_id: int
    entries: tuple[tuple[Address | None, int], ...]

    @property
    def size(self) -> int:
        """Size in bytes."""
        return sum(size for _, size in self.entries)

    @property
    def words(self) -> tuple[int | None, ...]:
        """Mapping entries as in 16xxh and 1Axxh; None for unused bytes (only the length counts)."""
        return tuple(
            None
            if address is None
            else (address.index or 0) << 16 | address.subindex << 8 | 8 * size
            for address, size in self.entries
        )

    def starts(self) -> Iterator[tuple[Address, int]]:
        """Iterate over the objects with their byte offsets."""
        start = 0
        for address, size in self.entries:
            if address is not None:
                yield address, start
            start += size


def fixed_pdos(profile: Profile, station: int) -> tuple[FixedPdo, ...]:
    """Return the fixed PDOs of a node, for directions in which no PDO can be mapped again."""
    sets = profile.pdo.sets if profile.pdo is not None else ()
    open_ways = {each.direction for each in sets if not each.fixed}
    found = (
        _fixed(each, profile, station)
        for each in sets
        if each.fixed and each.direction not in open_ways
    )
    return tuple(each for each in found if each is not None)


def _fixed(each: PdoSet, profile: Profile, station: int) -> FixedPdo | None:
    """Return None if mapped bits are not whole bytes, if the identifier is unknown, or if the
    index is not that of a PDO of this direction.
    """
    number = each.index - (0x1600 if each.direction == "rx" else 0x1A00)
    if not 0 <= number < PDOS:
        return None
    bases = RPDO if each.direction == "rx" else TPDO
    if each.identifier is not None:
        cob_id = each.identifier.at(station)
    elif number < len(bases):
        cob_id = bases[number] + station
    else:
        return None
    stretches = [(part.key, part.bits) for part in each.layout]
    entries: list[tuple[Address | None, int]] = []
    for key, bits in stretches or [(key, 0) for key in each.entries]:
        parameter = profile.by_key.get(key) if key is not None else None
        size = size_of(parameter.type) if parameter is not None else bits // 8
        if bits % 8 or not size or (bits and bits != 8 * size):
            return None
        address = None
        if parameter is not None and parameter.index is not None:
            address = Address(parameter.index, parameter.subindex or 0, parameter.type)
        entries.append((address, size))
    return FixedPdo(each.direction, number, cob_id, tuple(entries))


def chosen(
    fixed: Sequence[FixedPdo], wanted: Sequence[CyclicSignal]
) -> tuple[list[tuple[FixedPdo, tuple[CyclicSignal, ...]]], list[CyclicSignal]]:
    """Choose the PDOs that contain these signals, each with its own; and the signals left over.

    The other objects of an output PDO become signals as well, as the drive accepts them in every
    cycle.
    """
    left = list(wanted)
    found = []
    for pdo in fixed:
        by_place = {(s.address.index, s.address.subindex): s for s in left}
        places = [(a.index, a.subindex) for a, _ in pdo.starts()]
        if not any(place in by_place for place in places):
            continue
        signals = []
        for address, _ in pdo.starts():
            signal = by_place.get((address.index, address.subindex))
            if signal is None and pdo.direction == "rx":
                signal = _signal_at(wanted[0], address)
            if signal is not None:
                signals.append(signal)
        left = [s for s in left if s not in signals]
        found.append((pdo, tuple(signals)))
    return found, left


def _signal_at(known: CyclicSignal, address: Address) -> CyclicSignal:
    """Return a signal of the same drive, named like the others."""
    drive, slash, _ = known.channel.rpartition("/")
    key = f"{address.index:04X}:{address.subindex:02X}"
    return CyclicSignal(known.station, address, f"{drive}{slash}{key}")
