"""The cable: slaves reached by a frame, port states, link counters, power."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from drivers.virtual.wires.ethercat.controller import registers as reg
from drivers.virtual.wires.ethercat.slave import Slave

LINK_UP_NS = 300_000_000
"""From power-on to an established link; typical auto-negotiation time of a 100 Mbit/s port."""

_FOREVER = 1 << 62
_FOR_GOOD_S = 1e6
_AT_ONCE_S = 1e-9


class Line:
    """Cable k leads to slave k; cable 0 is the master's."""

    def __init__(self, slaves: Sequence[Slave]) -> None:
        self._slaves = list(slaves)
        count = len(self._slaves)
        self._cut: set[int] = set()
        self._off: set[int] = set()
        self._up_from = [0] * count
        self._links = [True] * count
        self._reach: list[Slave] = []
        self._next_ns = 0

    def cut(self, cable: int) -> None:
        """Disconnect cable ``cable``."""
        self._check(cable)
        self._cut.add(cable)
        self._next_ns = 0

    def heal(self, cable: int | None = None) -> None:
        """Connect one cable again, or all."""
        if cable is None:
            self._cut.clear()
        else:
            self._check(cable)
            self._cut.discard(cable)
        self._next_ns = 0

    def is_cut(self, cable: int) -> bool:
        """Whether the cable is disconnected."""
        return cable in self._cut

    def power_off(self, position: int, now_ns: int, for_s: float | None = None) -> None:
        """Switch one slave off, for a time or until `power_on`. The drive coasts."""
        self._check(position)
        device = self._slaves[position].device
        device.advance(now_ns)
        device.power_cycle(_FOR_GOOD_S if for_s is None else for_s)
        if not device.powered and position not in self._off:
            self._power_changed(position, now_ns)

    def power_on(self, position: int) -> None:
        """Switch a slave on again; its link is established after `LINK_UP_NS`."""
        self._check(position)
        device = self._slaves[position].device
        if not device.powered:
            device.power_cycle(_AT_ONCE_S)

    def update(self, now_ns: int) -> list[Slave]:
        """Update links and power to the present time; return the slaves that a frame reaches.

        A drive may also switch off and on by itself, for example after its own reset.
        """
        for position, slave in enumerate(self._slaves):
            if position in self._off:
                slave.device.advance(now_ns)
            if slave.device.powered == (position in self._off):
                self._power_changed(position, now_ns)
        if now_ns >= self._next_ns:
            self._relink(now_ns)
        return self._reach

    def _power_changed(self, position: int, now_ns: int) -> None:
        slave = self._slaves[position]
        if slave.device.powered:
            self._off.discard(position)
            self._up_from[position] = now_ns + LINK_UP_NS
            slave.power_on(now_ns)
        else:
            self._off.add(position)
            slave.restart(now_ns)
        self._next_ns = 0

    def count_crc_error(self, position: int, port: int) -> None:
        """Count a damaged frame at a port, and as a forwarded error at the following slaves."""
        controller = self._slaves[position].controller
        controller.count(reg.RX_ERRORS + 2 * port)
        controller.count(reg.RX_ERRORS + 2 * port + 1)
        for slave in self._reach[position + 1 :]:
            slave.controller.count(reg.FORWARDED_ERRORS)

    def _check(self, position: int) -> None:
        if not 0 <= position < len(self._slaves):
            raise IndexError(f"there is no slave {position}; there are {len(self._slaves)}")

    def _alive(self, position: int, now_ns: int) -> bool:
        return position not in self._off and now_ns >= self._up_from[position]

    def _relink(self, now_ns: int) -> None:
        count = len(self._slaves)
        links = []
        for cable in range(count):
            before = cable == 0 or self._alive(cable - 1, now_ns)
            links.append(before and self._alive(cable, now_ns) and cable not in self._cut)
        for cable in range(count):
            if self._links[cable] and not links[cable]:
                self._lose(cable, 0)
                if cable:
                    self._lose(cable - 1, 1)
        self._links = links
        reach = links.index(False) if False in links else count
        self._reach = self._slaves[:reach]
        for position, slave in enumerate(self._slaves):
            following = position + 1 < count and links[position + 1]
            _show_ports(slave, links[position], following)
            behind = reach - position - 1 if position < reach else 0
            slave.controller.neighbours = (position, behind)
        waiting = [t for t in self._up_from if t > now_ns]
        self._next_ns = min(waiting, default=_FOREVER)

    def _lose(self, position: int, port: int) -> None:
        self._slaves[position].controller.count(reg.LOST_LINK + port)


def _show_ports(slave: Slave, up: bool, down: bool) -> None:
    """Set DL status (ETG.1000.4 table 14): link bits 4 and 5, loop and communication from bit 8."""
    status = 0x0001
    for port, linked in enumerate((up, down, False, False)):
        status |= (0x0010 << port) if linked else 0
        status |= (0x0200 if linked else 0x0100) << 2 * port
    struct.pack_into("<H", slave.controller.memory, reg.DL_STATUS, status)
