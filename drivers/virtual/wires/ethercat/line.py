"""The cable: which slaves a frame reaches, port states, link counters, power."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from drivers.virtual.wires.ethercat import registers as reg
from drivers.virtual.wires.ethercat.slave import Slave

LINK_UP_NS = 300_000_000
"""From power-on to a working link; auto-negotiation of a 100 Mbit/s port takes about this."""


class Line:
    """Slave k is connected to slave k+1 by cable k+1; cable 0 is the master's."""

    def __init__(self, slaves: Sequence[Slave]) -> None:
        self._slaves = list(slaves)
        self._cut: set[int] = set()
        self._off_until: dict[int, int | None] = {}
        self._links: list[bool] = [True] * len(slaves)
        self._reach: list[Slave] = []
        self._dirty = True
        self._next_ns = 0
        for slave, up, down in zip(
            self._slaves, self._links, [*self._links[1:], False], strict=True
        ):
            _show_ports(slave, up, down)

    def cut(self, cable: int) -> None:
        """Pull cable ``cable`` (0: between master and first slave)."""
        self._check(cable)
        self._cut.add(cable)
        self._dirty = True

    def heal(self, cable: int | None = None) -> None:
        """Plug one cable in again, or all."""
        if cable is None:
            self._cut.clear()
        else:
            self._check(cable)
            self._cut.discard(cable)
        self._dirty = True

    def power_off(self, position: int, now_ns: int, until_ns: int | None) -> None:
        """Switch one slave off, until a time or for good."""
        self._check(position)
        slave = self._slaves[position]
        slave.run(now_ns)
        slave.power_off(now_ns)
        self._off_until[position] = until_ns
        self._dirty = True

    def power_on(self, position: int, now_ns: int) -> None:
        """Switch it on again; its link comes up after `LINK_UP_NS`."""
        self._check(position)
        if position in self._off_until:
            self._start(position, now_ns)

    def is_cut(self, cable: int) -> bool:
        """Cable is pulled."""
        return cable in self._cut

    def update(self, now_ns: int) -> list[Slave]:
        """Follow what time has brought; returns the slaves that a frame reaches now."""
        if not self._dirty and now_ns < self._next_ns:
            return self._reach
        for position, until in list(self._off_until.items()):
            if until is not None and until <= now_ns:
                self._start(position, until)
        self._relink(now_ns)
        return self._reach

    def count_crc_error(self, position: int, port: int) -> None:
        """A frame arrived damaged at a port: counted there, and as forwarded further on."""
        memory = self._slaves[position].memory
        for address in (reg.RX_ERRORS + 2 * port, reg.RX_ERRORS + 2 * port + 1):
            memory[address] = min(255, memory[address] + 1)
        for slave in self._reach[position + 1 :]:
            at = reg.FORWARDED_ERRORS
            slave.memory[at] = min(255, slave.memory[at] + 1)

    def _check(self, position: int) -> None:
        if not 0 <= position < len(self._slaves):
            raise IndexError(f"there is no slave {position}; there are {len(self._slaves)}")

    def _start(self, position: int, now_ns: int) -> None:
        del self._off_until[position]
        slave = self._slaves[position]
        slave.power_on(now_ns)
        slave.link_from_ns = now_ns + LINK_UP_NS
        self._dirty = True

    def _up(self, position: int, now_ns: int) -> bool:
        return position not in self._off_until and now_ns >= self._slaves[position].link_from_ns

    def _relink(self, now_ns: int) -> None:
        count = len(self._slaves)
        links = []
        for cable in range(count):
            before = cable == 0 or self._up(cable - 1, now_ns)
            links.append(before and self._up(cable, now_ns) and cable not in self._cut)
        for cable in range(count):
            if self._links[cable] and not links[cable]:
                self._count_lost(cable, 0)
                if cable:
                    self._count_lost(cable - 1, 1)
        self._links = links
        reach = 0
        while reach < count and links[reach]:
            reach += 1
        self._reach = self._slaves[:reach]
        for position, slave in enumerate(self._slaves):
            following = position + 1 < count and links[position + 1]
            _show_ports(slave, links[position], following)
            slave.neighbours = (position, reach - position - 1 if position < reach else 0)
        waiting = [t for t in self._off_until.values() if t is not None and t > now_ns]
        waiting += [s.link_from_ns for s in self._slaves if s.link_from_ns > now_ns]
        self._next_ns = min(waiting, default=1 << 62)
        self._dirty = False

    def _count_lost(self, position: int, port: int) -> None:
        if position not in self._off_until:
            memory, at = self._slaves[position].memory, reg.LOST_LINK + port
            memory[at] = min(255, memory[at] + 1)


def _show_ports(slave: Slave, up: bool, down: bool) -> None:
    """DL status (ETG.1000.4 table 14): link bits 4 and 5, loop and communication from bit 8."""
    status = 0x0001
    for port, linked in enumerate((up, down, False, False)):
        status |= (0x0010 << port) if linked else 0
        status |= (0x0200 if linked else 0x0100) << 2 * port
    struct.pack_into("<H", slave.memory, reg.DL_STATUS, status)
