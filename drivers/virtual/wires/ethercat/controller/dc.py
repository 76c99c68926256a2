"""Distributed clocks of one slave: local time, system time, receive times, SYNC0 and SYNC1.

ETG.1000.4 clause 6.8. All methods take the segment's time in ns. The local clock starts at zero at
power-on; the master writes the offset to its own time to 920h.
"""

from __future__ import annotations

import struct

from drivers.virtual.wires.ethercat.clock import WireClock
from drivers.virtual.wires.ethercat.controller import registers as reg

HOP_NS = 600
"""Delay of one slave and its cable; order of magnitude of real devices."""

_ACTIVE, _SYNC0, _SYNC1 = 0x01, 0x02, 0x04
_U32, _I64 = struct.Struct("<I"), struct.Struct("<q")


class DistributedClock:
    """Works on the slave's register memory, shared with the controller."""

    def __init__(self, memory: bytearray, clock: WireClock) -> None:
        self._memory = memory
        self._clock = clock
        self._zero_ns = 0
        self.drift_ppm = 0.0
        self._slewed_ns = 0.0
        self.sync0_first_ns: int | None = None
        """Segment time of the first SYNC0; None while SYNC0 is off or cannot occur."""
        self.sync0_cycle_ns = 0
        self.sync1_delay_ns: int | None = None
        """From the first SYNC0 to the first SYNC1 (9A4h); None while SYNC1 is off."""

    def power_on(self, now_ns: int) -> None:
        """Start the local clock from zero."""
        self._zero_ns = now_ns
        self._slewed_ns = 0.0
        self.sync0_first_ns = None
        self.sync0_cycle_ns = 0
        self.sync1_delay_ns = None

    def local(self, now_ns: int) -> int:
        """Return local time since power-on, with ``drift_ppm`` and the master's correction."""
        elapsed = now_ns - self._zero_ns
        if not self.drift_ppm and not self._slewed_ns:
            return elapsed
        return elapsed + int(elapsed * self.drift_ppm * 1e-6 + self._slewed_ns)

    def system(self, now_ns: int) -> int:
        """Return system time, modulo 2^64: local time plus the offset written by the master."""
        offset: int = _I64.unpack_from(self._memory, reg.DC_SYSTEM_OFFSET)[0]
        return (self.local(now_ns) + offset) & 0xFFFF_FFFF_FFFF_FFFF

    def refresh(self, now_ns: int) -> None:
        """Write the present system time to 910h before the master reads it."""
        struct.pack_into("<Q", self._memory, reg.DC_SYSTEM_TIME, self.system(now_ns))
        started = self.sync0_first_ns is not None and now_ns >= self.sync0_first_ns
        pending = bool(self._memory[reg.DC_ACTIVATION] & _SYNC0) and not started
        self._memory[reg.DC_ACTIVATION_STATUS] = int(pending)

    def latch(self, now_ns: int, before: int, behind: int) -> None:
        """Store receive times after a write to 900h (``before``/``behind``: slaves in between)."""
        arrival = self.local(now_ns + before * HOP_NS)
        back = self.local(now_ns + (before + 2 * behind) * HOP_NS) if behind else 0
        struct.pack_into(
            "<IIII",
            self._memory,
            reg.DC_RECEIVE_TIMES,
            arrival & 0xFFFFFFFF,
            back & 0xFFFFFFFF,
            0,
            0,
        )
        struct.pack_into("<Q", self._memory, reg.DC_RECEIVE_TIME_UNIT, arrival)

    def compare(self, received: bytes, now_ns: int) -> None:
        """Process a write to 910h: the master distributes the reference time (low 32 bits)."""
        theirs = int.from_bytes(received[:4], "little")
        delay = _U32.unpack_from(self._memory, reg.DC_SYSTEM_DELAY)[0]
        raw = (self.system(now_ns) - theirs - delay) & 0xFFFFFFFF
        difference = raw - (1 << 32) if raw & 0x80000000 else raw
        magnitude = min(abs(difference), 0x7FFFFFFF)
        # Bit 31 is 0 if the local copy is ahead (ETG.1000.4 table 65).
        value = magnitude | (0x80000000 if difference < 0 else 0)
        _U32.pack_into(self._memory, reg.DC_DIFFERENCE, value)
        if self.drift_ppm and magnitude < 1_000_000:
            self._slewed_ns -= difference / 8.0

    def activate(self, now_ns: int) -> None:
        """Process a write to 981h: start or stop pulses with the present start and cycle."""
        self.sync0_first_ns = self.sync1_delay_ns = None
        if self._memory[reg.DC_ACTIVATION] & (_ACTIVE | _SYNC0) != (_ACTIVE | _SYNC0):
            return
        start = struct.unpack_from("<Q", self._memory, reg.DC_START_TIME)[0]
        self.sync0_cycle_ns, delay = struct.unpack_from("<II", self._memory, reg.DC_SYNC0_CYCLE)
        ahead = (start - self.system(now_ns)) & 0xFFFF_FFFF_FFFF_FFFF
        if self.sync0_cycle_ns == 0 or ahead >= 1 << 63:
            return  # a start time in the past matches only after the counter has wrapped
        if self._memory[reg.DC_ACTIVATION] & _SYNC1:
            self.sync1_delay_ns = delay
        self.sync0_first_ns = self._clock.grid(now_ns + ahead, self.exchange_cycle_ns)

    @property
    def exchange_cycle_ns(self) -> int:
        """Period of the pulse with which outputs and inputs are exchanged.

        SYNC0 may be faster than the process data; SYNC1 then comes every ``9A4h div 9A0h + 1``
        SYNC0 cycles (ETG.1000.4 clause 6.8), once per process-data cycle.
        """
        if self.sync1_delay_ns is None or not self.sync0_cycle_ns:
            return self.sync0_cycle_ns
        return (self.sync1_delay_ns // self.sync0_cycle_ns + 1) * self.sync0_cycle_ns

    @property
    def exchange_first_ns(self) -> int | None:
        """Segment time of the first SYNC1 if it is on, otherwise of the first SYNC0."""
        first = self.sync0_first_ns
        return first if first is None else first + (self.sync1_delay_ns or 0)

    def exchanges_at(self, now_ns: int) -> bool:
        """Whether process data are exchanged at the pulse at ``now_ns``."""
        first = self.exchange_first_ns
        if first is None or now_ns < first:
            return False
        return (now_ns - first) % self.exchange_cycle_ns == 0

    def next_pulse(self, after_ns: int) -> int | None:
        """Return the time of the first SYNC0 or SYNC1 after ``after_ns``; None without them."""
        sync0, first = self.next_sync0(after_ns), self.exchange_first_ns
        if sync0 is None or first is None or self.sync1_delay_ns is None:
            return sync0
        return min(sync0, _next(first, self.exchange_cycle_ns, after_ns))

    @property
    def sync0_requested(self) -> bool:
        """Whether the master has switched SYNC0 on, even if it cannot occur."""
        return bool(self._memory[reg.DC_ACTIVATION] & _SYNC0)

    def next_sync0(self, after_ns: int) -> int | None:
        """Return the time of the first SYNC0 after ``after_ns``; None without SYNC0."""
        first = self.sync0_first_ns
        if first is None:
            return None
        return _next(first, self.sync0_cycle_ns, after_ns)

    def last_sync0(self, until_ns: int) -> int | None:
        """Return the time of the last SYNC0 up to ``until_ns``; None if there was none."""
        first = self.sync0_first_ns
        if first is None or until_ns < first:
            return None
        return first + ((until_ns - first) // self.sync0_cycle_ns) * self.sync0_cycle_ns


def _next(first_ns: int, cycle_ns: int, after_ns: int) -> int:
    """Return the first time on the grid after ``after_ns``."""
    if after_ns < first_ns:
        return first_ns
    return first_ns + ((after_ns - first_ns) // cycle_ns + 1) * cycle_ns
