"""A line of slaves: takes one frame and returns it with all slaves' data and working counters.

Addressing and working counters follow ETG.1000.4 clause 5.4: position and broadcast addresses are
incremented by every slave, a read counts 1, a write 1, in read-write commands a write 2.
"""

from __future__ import annotations

import random
import struct
from collections.abc import Sequence
from typing import NamedTuple

from drivers.virtual.wires.ethercat.clock import WireClock
from drivers.virtual.wires.ethercat.controller.registers import Command
from drivers.virtual.wires.ethercat.line import Line
from drivers.virtual.wires.ethercat.slave import Slave
from drivers.virtual.wires.ethercat.trouble import NO_TROUBLE, Trouble

ETHERTYPE = b"\x88\xa4"
_ETHERNET, _HEADER, _DATAGRAM = 14, 2, 10
_LENGTH_MASK = 0x07FF
# Plain integers: an enumeration look-up costs more time than the use of the value.
_APRD, _APRW, _FPRD, _FPWR = map(int, (Command.APRD, Command.APRW, Command.FPRD, Command.FPWR))
_BRD, _BRW, _ARMW, _FRMW = map(int, (Command.BRD, Command.BRW, Command.ARMW, Command.FRMW))
_LWR, _LRD = int(Command.LWR), int(Command.LRD)
_LOGICAL = frozenset({_LRD, _LWR, int(Command.LRW)})


class _Datagram(NamedTuple):
    """Position of one datagram and its data in the frame."""

    command: int
    at: int
    data: slice


def datagrams(frame: bytes | bytearray) -> list[_Datagram]:
    """Split a frame; a malformed rest is omitted, as a controller ignores it."""
    found: list[_Datagram] = []
    at = _ETHERNET + _HEADER
    while at + _DATAGRAM + 2 <= len(frame):
        word = frame[at + 6] | frame[at + 7] << 8
        length = word & _LENGTH_MASK
        if at + _DATAGRAM + length + 2 > len(frame):
            break
        found.append(_Datagram(frame[at], at, slice(at + _DATAGRAM, at + _DATAGRAM + length)))
        if not word & 0x8000:
            break
        at += _DATAGRAM + length + 2
    return found


class Segment:
    """N slaves in a line. Not thread-safe."""

    def __init__(self, slaves: Sequence[Slave], clock: WireClock, seed: int = 1) -> None:
        self.slaves = list(slaves)
        self.clock = clock
        self.line = Line(self.slaves)
        # Reproducible faults, not a secret.
        self.trouble = Trouble(random.Random(seed))  # noqa: S311
        self.frames = 0
        self.reply_delay_ns = 0
        """Time by which the reply of the last frame must be delayed."""
        self.hold_ns = 0
        """If above 0, the last frame is not processed yet: pass it again as ``held``."""

    def process_frame(self, frame: bytes, age_ns: int = 0, held: bool = False) -> bytes | None:
        """Process one frame from the master; return None if there is no reply.

        ``age_ns`` is the time since it arrived, if the network stack reports it. A frame that the
        caller has delayed by `hold_ns` is passed again as ``held``.
        """
        self.reply_delay_ns = self.hold_ns = 0
        if len(frame) < _ETHERNET + _HEADER or frame[12:14] != ETHERTYPE:
            return None
        parts = datagrams(frame)
        cyclic = any(part.command in _LOGICAL for part in parts)
        fate = NO_TROUBLE if held else self.trouble.frame_fate(cyclic)
        if fate.hold_ns:
            self.hold_ns = fate.hold_ns
            return None
        now = self.clock.arrival(cyclic, self._cycle_ns() if cyclic else 0, age_ns)
        self.frames += 1
        reach = self.line.update(now)
        self.reply_delay_ns = fate.delay_ns
        if fate.lost_outbound or not reach:
            return None
        if fate.corrupt_at is not None:
            self.line.count_crc_error(*fate.corrupt_at)
            reach = reach[: fate.corrupt_at[0]]
        buffer = bytearray(frame)
        for slave in reach:
            slave.run(now)
        for part in parts:
            self._execute(part, buffer, reach, now)
            if part.command in _LOGICAL and fate.counter_offset:
                _count(buffer, part, fate.counter_offset)
        for slave in reach:
            slave.after_frame(now)
        if fate.corrupt_at is not None or fate.lost_inbound:
            return None
        buffer[6] |= 0x02  # a controller marks the source address as locally administered
        return bytes(buffer)

    def next_tick_ns(self) -> int | None:
        """Return the next pulse of the last slave in Op (one common grid); None without one."""
        for slave in reversed(self.slaves):
            if slave.process.operational:
                return slave.process.next_tick_ns
        return None

    def settle(self, until_ns: int | None = None) -> int:
        """Advance all slaves without a frame, at most to ``until_ns``; return the time reached."""
        now = self.clock.now(until_ns)
        self.line.update(now)
        for slave in self.slaves:
            slave.run(now)
        return now

    def _cycle_ns(self) -> int:
        """Return the cycle of the process data; SYNC0 itself may be faster.

        Without any SYNC0 it is the interpolation period that the master has set, 0 if none.
        """
        for slave in self.slaves:
            if slave.dc.sync0_first_ns is not None:
                return slave.dc.exchange_cycle_ns
        return max((slave.process.interpolation_ns for slave in self.slaves), default=0)

    def _execute(
        self, part: _Datagram, buffer: bytearray, reach: Sequence[Slave], now: int
    ) -> None:
        command = part.command
        if command in _LOGICAL:
            self._logical(part, buffer, reach, now)
            return
        if not _APRD <= command <= _FRMW:
            return
        position = struct.unpack_from("<H", buffer, part.at + 2)[0]
        auto = command <= _APRW or command == _ARMW
        broadcast = _BRD <= command <= _BRW
        for slave in reach:
            if broadcast:
                self._physical(slave, part, buffer, command, now)
                position = (position + 1) & 0xFFFF
                continue
            if auto:
                mine = position == 0
                position = (position + 1) & 0xFFFF
            else:
                mine = slave.controller.answers_to(position)
            if command in (_ARMW, _FRMW):
                action = _FPRD if mine else _FPWR
                self._physical(slave, part, buffer, action, now)
            elif mine:
                self._physical(slave, part, buffer, command, now)
        if auto or broadcast:
            struct.pack_into("<H", buffer, part.at + 2, position)

    @staticmethod
    def _physical(slave: Slave, part: _Datagram, buffer: bytearray, command: int, now: int) -> None:
        """Process one datagram in one slave: command kinds are read, write, read-write in turn."""
        offset = buffer[part.at + 4] | buffer[part.at + 5] << 8
        kind = (command - 1) % 3
        incoming = bytes(buffer[part.data])
        counted = 0
        if kind != 1:
            data = slave.controller.read(offset, len(incoming), now)
            if data is not None:
                if _BRD <= command <= _BRW:
                    data = bytes(a | b for a, b in zip(incoming, data, strict=True))
                buffer[part.data] = data
                counted += 1
        if kind != 0 and slave.controller.write(offset, incoming, now):
            counted += 2 if kind == 2 else 1
        if counted:
            _count(buffer, part, counted)

    @staticmethod
    def _logical(part: _Datagram, buffer: bytearray, reach: Sequence[Slave], now: int) -> None:
        address = struct.unpack_from("<I", buffer, part.at + 2)[0]
        reading = part.command != _LWR
        writing = part.command != _LRD
        data = bytearray(buffer[part.data])
        counted = 0
        for slave in reach:
            read, wrote = slave.controller.logical(address, data, reading, writing, now)
            counted += read
            if wrote:
                counted += 2 if reading else 1
        buffer[part.data] = data
        _count(buffer, part, counted)


def _count(buffer: bytearray, part: _Datagram, by: int) -> None:
    at = part.data.stop
    counter = (buffer[at] | buffer[at + 1] << 8) + by & 0xFFFF
    buffer[at], buffer[at + 1] = counter & 0xFF, counter >> 8


def register(slave: Slave, address: int, length: int) -> int:
    """Return the present value of a register, for tests and the control channel."""
    return int.from_bytes(slave.controller.memory[address : address + length], "little")


__all__ = ["ETHERTYPE", "Segment", "datagrams", "register"]
