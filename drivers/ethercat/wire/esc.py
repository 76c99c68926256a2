"""ESC registers as values: ports, error counters, topology, and faulty cables.

Source: ETG.1000.4 clauses 6.1 (0x0110 DL status) and 6.2 (0x0300 error counters).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from drivers.texts.message import Text, text

DL_STATUS = 0x0110
ERROR_COUNTERS = 0x0300
ERROR_COUNTERS_SIZE = 20
TIME_DIFFERENCE = 0x092C
_MOST = 255
"""Maximum of a counter, at which it stops."""

#: Order in which a frame passes the open ports of a slave.
_PORT_ORDER = (0, 3, 1, 2)


@dataclass(frozen=True, slots=True)
class Port:
    """One port of a slave. Counters stop at 255 and count since they were last cleared."""

    link: bool
    communicating: bool
    invalid_frames: int = 0
    rx_errors: int = 0
    forwarded_errors: int = 0
    lost_links: int = 0


@dataclass(frozen=True, slots=True)
class PortCounters:
    """All ports of a slave and its two counters that do not belong to a port."""

    station: int
    ports: tuple[Port, ...]
    processing_errors: int = 0
    pdi_errors: int = 0


@dataclass(frozen=True, slots=True)
class Finding:
    """A fault indicated by a counter; ``port`` is None if it does not concern a cable."""

    station: int
    port: int | None
    text: Text


def decode_time_difference(register: bytes) -> int:
    """Return how far the slave's clock is ahead of the reference clock [ns]; negative: behind.

    Register 0x92C: magnitude in bits 0…30, bit 31 set when the local copy is smaller (ETG.1000.4
    clause 6.5, table 65).
    """
    raw = int.from_bytes(register[:4], "little")
    magnitude = raw & 0x7FFFFFFF
    return -magnitude if raw & 0x80000000 else magnitude


def decode_ports(station: int, dl_status: bytes, counters: bytes | None) -> PortCounters:
    """Decode the ports from register 0x110 (2 bytes) and 0x300 (20 bytes, or None if not read)."""
    status = int.from_bytes(dl_status, "little")
    raw = counters if counters is not None and len(counters) >= 20 else bytes(20)
    ports = tuple(
        Port(
            link=bool(status >> (4 + number) & 1),
            communicating=bool(status >> (9 + 2 * number) & 1),
            invalid_frames=raw[2 * number],
            rx_errors=raw[2 * number + 1],
            forwarded_errors=raw[8 + number],
            lost_links=raw[16 + number],
        )
        for number in range(4)
    )
    return PortCounters(station, ports, raw[12], raw[13])


def parents(stations: Sequence[PortCounters]) -> dict[int, tuple[int, int]]:
    """Return for each station the station before it and the port there; 0 is the computer.

    Follows the frame: each slave forwards it to its open ports in the order 0, 3, 1, 2, and a
    branch is completed before the next port.
    """
    found: dict[int, tuple[int, int]] = {}
    open_ports: list[tuple[int, int]] = []
    for here in stations:
        found[here.station] = open_ports.pop() if open_ports else (0, 0)
        down = [number for number in _PORT_ORDER[1:] if here.ports[number].communicating]
        open_ports.extend((here.station, number) for number in reversed(down))
    return found


def findings(
    stations: Sequence[PortCounters], upstream: Mapping[int, tuple[int, int]]
) -> list[Finding]:
    """Return the faulty cables or connectors that the counters indicate; empty if none.

    ``upstream`` is the result of `parents` while every station answered: while a cable is cut, the
    ports no longer show what is behind them.

    Only ``rx_errors`` and ``invalid_frames`` that were not forwarded arise at the port itself. Port
    0 of a station receives from the one before it, so errors there and at the port of the station
    before belong to the same cable, one direction each.
    """
    before = {(parent, port): station for station, (parent, port) in upstream.items()}
    found = []
    for here in stations:
        for number, port in enumerate(here.ports):
            parent = upstream.get(here.station, (0, 0))[0]
            other = parent if number == 0 else before.get((here.station, number))
            found += _port_findings(here.station, number, port, other)
        for code, count in (
            ("ethercat.frames-not-ethercat", here.processing_errors),
            ("ethercat.errors-inside-drive", here.pdi_errors),
        ):
            if count:
                said = text(code, station=here.station, times=count)
                found.append(Finding(here.station, None, said))
    return found


def _port_findings(station: int, number: int, port: Port, other: int | None) -> list[Finding]:
    cable = _cable(station, number, other)
    own = min(max(port.invalid_frames + port.rx_errors - port.forwarded_errors, 0), _MOST)
    counts = (("ethercat.link-lost", port.lost_links), ("ethercat.frames-damaged", own))
    return [
        Finding(station, number, text(code, cable=cable, times=count))
        for code, count in counts
        if count
    ]


def _cable(station: int, port: int, other: int | None) -> Text:
    if other is None:
        return text("ethercat.port-open", station=station, port=port)
    if port != 0:
        return text("ethercat.cable-between", station=station, other=other)
    if other == 0:
        return text("ethercat.cable-from-computer", station=station)
    return text("ethercat.cable-between", station=other, other=station)
