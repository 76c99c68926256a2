"""Measures the wake-up delay of a real-time thread and the round trip of a frame.

Runs as a process of its own under the conditions of the EtherCAT process, so that the server's own
scheduling has no influence:
``python -m drivers.computer.timing.lateness PERIOD_US SECONDS [INTERFACE]`` prints one line of
JSON. With an interface each cycle sends one EtherCAT frame that reads register 0000h of all slaves
(BRD: nothing is written) and waits for its return until the cycle ends.
"""

from __future__ import annotations

import json
import math
import select
import socket
import struct
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass

from drivers.computer.network.sockets import AF_PACKET
from drivers.computer.timing import realtime

#: Upper edges of the histogram bins [µs]: six per decade from 1 µs to 1 s.
EDGES_US = tuple(round(10 ** (step / 6), 2) for step in range(37))
_ETH_P_ECAT = 0x88A4
_UNANSWERED = 50
"""Consecutive frames without an answer after which no more are sent."""


@dataclass(slots=True)
class Histogram:
    """Counts by `EDGES_US` (one more bin above the last), with the largest value in µs."""

    counts: list[int]
    most_us: float = 0.0

    @classmethod
    def empty(cls) -> Histogram:
        """Return a histogram without values."""
        return cls([0] * (len(EDGES_US) + 1))

    def add(self, value_us: float) -> None:
        """Count one value."""
        step = 0 if value_us <= 1 else math.ceil(6 * math.log10(value_us) - 1e-3)
        self.counts[min(step, len(EDGES_US))] += 1
        self.most_us = max(self.most_us, value_us)

    def below_us(self, share: float) -> float:
        """Return the edge of the bin below which this share of the values lies [µs]."""
        wanted, seen = share * sum(self.counts), 0
        for count, edge in zip(self.counts, EDGES_US, strict=False):
            seen += count
            if seen >= wanted:
                return min(edge, self.most_us)
        return self.most_us


@dataclass(slots=True)
class Measured:
    """One run. A cycle is ``missed`` if it ended before thread and frame were done."""

    period_us: int
    cycles: int
    missed: int
    fifo: bool
    memory_locked: bool
    lateness: Histogram
    round_trip: Histogram | None
    """None if no interface was given or nothing answered."""
    unanswered: int = 0


def missed_bound(missed: int, cycles: int) -> float:
    """Return the one-sided 95 % upper bound of the share of missed cycles.

    Wilson's score with continuity correction; with none missed, the rule of three, 3 / cycles
    (Hanley and Lippman-Hand 1983).
    """
    if cycles <= 0:
        return 1.0
    if missed == 0:
        return min(1.0, 3.0 / cycles)
    z = 1.645
    share = min(1.0, (missed + 0.5) / cycles)
    centre = share + z * z / (2 * cycles)
    half = z * math.sqrt(share * (1 - share) / cycles + z * z / (4 * cycles * cycles))
    return min(1.0, (centre + half) / (1 + z * z / cycles))


def from_json(text: str) -> Measured:
    """Parse the output of the process."""
    found = json.loads(text)
    found["lateness"] = Histogram(**found["lateness"])
    found["round_trip"] = Histogram(**found["round_trip"]) if found["round_trip"] else None
    return Measured(**found)


def broadcast_read(index: int) -> bytes:
    """Return an Ethernet frame with one BRD of 2 bytes at 0000h (ETG.1000.4, clause 5.4.1)."""
    datagram = struct.pack("<BBHHHH", 7, index & 0xFF, 0, 0, 2, 0) + bytes(2) + bytes(2)
    header = struct.pack("<H", len(datagram) | 1 << 12)
    frame = b"\xff" * 6 + b"\x02\x00\x00\x00\x00\x01" + struct.pack(">H", _ETH_P_ECAT)
    return (frame + header + datagram).ljust(60, b"\0")


class Wire:
    """Sends one frame and waits for it to come back."""

    def __init__(self, interface: str) -> None:
        self._socket = socket.socket(AF_PACKET, socket.SOCK_RAW, socket.htons(_ETH_P_ECAT))
        self._socket.bind((interface, _ETH_P_ECAT))
        self._socket.setblocking(False)
        self._index = 0

    def round_trip_us(self, until: float) -> float | None:
        """Return the time until the frame of this call is back; None if it is not by ``until``."""
        self._index = (self._index + 1) & 0xFF
        sent = time.monotonic()
        self._socket.send(broadcast_read(self._index))
        while (left := until - time.monotonic()) > 0:
            if not select.select((self._socket,), (), (), left)[0]:
                return None
            frame, address = self._socket.recvfrom(1600)
            # Outgoing frames are received as well (PACKET_OUTGOING, packet(7)).
            if address[2] != 4 and len(frame) > 17 and frame[17] == self._index:
                return (time.monotonic() - sent) * 1e6
        return None


def measure(period_us: int, seconds: float, interface: str = "") -> Measured:
    """Wake up once per period and record the delay.

    Raises:
        OSError: the interface cannot be used: it does not exist, or is not permitted.
    """
    granted = realtime.claim()
    wire = Wire(interface) if interface else None
    measured = Measured(
        period_us,
        0,
        0,
        granted.fifo_priority > 0,
        granted.memory_locked,
        Histogram.empty(),
        Histogram.empty() if wire else None,
    )
    period, in_a_row = period_us / 1e6, 0
    due = time.monotonic() + 0.05
    for _ in range(round(seconds / period)):
        due += period
        time.sleep(max(0.0, due - time.monotonic()))
        late_us = (time.monotonic() - due) * 1e6
        measured.lateness.add(late_us)
        used_us = late_us
        if wire is not None and measured.round_trip is not None:
            trip = wire.round_trip_us(max(due + period, time.monotonic() + 0.2 * period))
            if trip is None:
                measured.unanswered, in_a_row = measured.unanswered + 1, in_a_row + 1
                used_us = math.inf
                if in_a_row == _UNANSWERED and measured.unanswered == measured.cycles + 1:
                    return _without_wire(measured, period_us, seconds)
            else:
                measured.round_trip.add(trip)
                used_us, in_a_row = late_us + trip, 0
        measured.cycles += 1
        measured.missed += used_us > period_us
        # A missed cycle is not made up for: the next one is on the grid again.
        due += max(0.0, math.floor((time.monotonic() - due) / period) * period)
    return measured


def _without_wire(tried: Measured, period_us: int, seconds: float) -> Measured:
    """Measure the lateness alone, as nothing answers on the wire."""
    measured = measure(period_us, seconds)
    measured.unanswered = tried.unanswered
    return measured


def main(arguments: Sequence[str]) -> int:
    """Entry point of the process."""
    period_us, seconds = int(arguments[0]), float(arguments[1])
    try:
        measured = measure(period_us, seconds, *arguments[2:3])
    except OSError as error:
        sys.stderr.write(f"{error.strerror or error}\n")
        return 1
    sys.stdout.write(json.dumps(asdict(measured)) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
