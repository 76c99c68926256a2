"""Bus load of a SYNC cycle. Pure.

The load is the worst case (most stuff bits), so that an accepted cycle also works with the worst
data. Above `LIMIT` no room is left for SDO, heartbeats and repeated frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drivers.canopen.frames import worst_case_bits
from drivers.errors import NotAllowed

LIMIT = 0.80


@dataclass(frozen=True, slots=True)
class BusLoad:
    """``fraction`` is the share of the bit rate used by the frames of one cycle."""

    fraction: float
    bits_per_cycle: int
    shortest_cycle_s: float
    """Shortest cycle with which these frames stay within the limit."""


def bus_load(pdo_bytes: Sequence[int], cycle_s: float, bitrate: int) -> BusLoad:
    """Return the load of a SYNC (without counter) and PDOs of these lengths, every ``cycle_s``."""
    bits = worst_case_bits(0) + sum(worst_case_bits(length) for length in pdo_bytes)
    return BusLoad(bits / (cycle_s * bitrate), bits, bits / (LIMIT * bitrate))


def require_room(pdo_bytes: Sequence[int], cycle_s: float, bitrate: int) -> BusLoad:
    """Return the load if the bus can carry it.

    Raises:
        NotAllowed: above 80 %; the message states the shortest possible cycle.
    """
    load = bus_load(pdo_bytes, cycle_s, bitrate)
    if load.fraction > LIMIT:
        raise NotAllowed(
            "canopen.pdos-every-ms-load",
            value=round(load.fraction, 3),
            limit=f"{LIMIT:.0%}",
            pdo_bytes=len(pdo_bytes),
            cycle_ms=cycle_s * 1e3,
            bitrate_kbits=bitrate / 1e3,
            fraction=load.fraction,
            shortest_cycle_ms=load.shortest_cycle_s * 1e3,
        )
    return load
