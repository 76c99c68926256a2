"""The slave controller: register memory, sync managers, FMMUs and their access rules.

It has no clock and no drive; the effects of a write are reported to `ControllerEvents`.
"""

from __future__ import annotations

import struct
from typing import NamedTuple, Protocol

from drivers.virtual.wires.ethercat.controller import registers as reg
from drivers.virtual.wires.ethercat.controller.dc import DistributedClock
from drivers.virtual.wires.ethercat.controller.sii import Eeprom
from drivers.virtual.wires.ethercat.controller.syncmanager import Fmmu, SyncManager, parse_fmmu

_FMMUS, _SYNC_MANAGERS = 4, 4
_FMMU_END = reg.FMMU + 16 * _FMMUS
_SM_END = reg.SYNC_MANAGER + 8 * _SYNC_MANAGERS
_REACHES = 64
_DC_SUPPORTED = 0x000C  # bit 2: distributed clocks, bit 3: 64 bits wide


def _writable_mask() -> bytes:
    mask = bytearray(reg.RAM)
    for start, length in reg.WRITABLE:
        mask[start : start + length] = b"\x01" * length
    return bytes(mask)


_WRITABLE = _writable_mask()


class _Reach(NamedTuple):
    """What a logical datagram reaches in one slave: bytes to write, bytes to read, single bits.

    Byte pairs are (position in the datagram, physical address).
    """

    writes: tuple[tuple[slice, int], ...]
    reads: tuple[tuple[slice, int], ...]
    bit_writes: tuple[Fmmu, ...]
    bit_reads: tuple[Fmmu, ...]


class ControllerEvents(Protocol):
    """Events of the controller to which the slave must react."""

    def state_requested(self, control: int, now_ns: int) -> None:
        """The master has written AL control."""

    def configuration_changed(self) -> None:
        """The master has written sync manager registers or switched SYNC0."""

    def mailbox_repeat_requested(self) -> None:
        """The activation byte of sync manager 1 was written."""


class Controller:
    """See the module docstring."""

    def __init__(
        self, events: ControllerEvents, eeprom: Eeprom, dc: DistributedClock, memory: bytearray
    ) -> None:
        self.memory = memory
        self.sms = [SyncManager(n) for n in range(_SYNC_MANAGERS)]
        self.eeprom = eeprom
        self.watchdog_ns = 0
        """Process-data watchdog time, 0 while it is switched off."""
        self.watchdog_expired = False
        self.neighbours = (0, 0)
        """Number of slaves before and after this one on the working part of the line."""
        self._events = events
        self._dc = dc
        self._fmmus: list[Fmmu] = []
        self._reaches: dict[tuple[int, int], _Reach] = {}
        self._active: list[SyncManager] = []

    def power_on(self, has_dc: bool) -> None:
        """Set the registers to power-on values (defaults of ETG.1000.4 and common controllers)."""
        memory = self.memory
        memory[:] = bytes(len(memory))
        self.eeprom.power_on()
        memory[reg.TYPE : reg.TYPE + 10] = struct.pack(
            "<BBHBBBBH", 0x11, 0, 2, _FMMUS, _SYNC_MANAGERS, 8, 0x0F,
            _DC_SUPPORTED if has_dc else 0,
        )  # fmt: skip
        memory[reg.DL_CONTROL] = 0x01
        if self.eeprom.loaded:
            struct.pack_into("<H", memory, reg.STATION_ALIAS, self.eeprom.alias)
            memory[reg.PDI_CONTROL] = 0x08
        struct.pack_into("<H", memory, reg.WATCHDOG_DIVIDER, 0x09C2)
        struct.pack_into("<H", memory, reg.WATCHDOG_PDI, 1000)
        struct.pack_into("<H", memory, reg.WATCHDOG_PROCESS_DATA, 1000)
        self._set_watchdog()
        self.watchdog_expired = False
        for sm in self.sms:
            sm.configure(bytes(8))
            sm.locked = True
        self.show_sync_managers()
        self._fmmus, self._active = [], []
        self._reaches.clear()
        self._has_dc = has_dc

    # -- registers set by the slave -------------------------------------------------------------

    def show_state(self, status: int, code: int) -> None:
        """Set AL status and AL status code."""
        self.memory[reg.AL_STATUS] = status
        struct.pack_into("<H", self.memory, reg.AL_STATUS_CODE, code)

    def show_sync_managers(self) -> None:
        """Set the status bytes of all sync managers."""
        for sm in self.sms:
            self._show(sm)

    def show_mailbox(self) -> None:
        """Set the status bytes of the two mailbox channels."""
        self._show(self.sms[0])
        self._show(self.sms[1])

    def count(self, register: int) -> None:
        """Increment an 8-bit error counter, which stops at 255."""
        self.memory[register] = min(255, self.memory[register] + 1)

    def _show(self, sm: SyncManager) -> None:
        base = reg.SYNC_MANAGER + 8 * sm.number
        self.memory[base : base + 8] = sm.registers()

    # -- physical access ------------------------------------------------------------------------

    @property
    def station(self) -> int:
        """Configured station address."""
        return self.memory[0x10] | self.memory[0x11] << 8

    def answers_to(self, address: int) -> bool:
        """Whether ``address`` is the station address, or the alias if the master has enabled it."""
        if self.station == address:
            return True
        if not self.memory[reg.DL_ALIAS_ENABLE] & 1:
            return False
        return address == int(struct.unpack_from("<H", self.memory, reg.STATION_ALIAS)[0])

    def read(self, address: int, length: int, now_ns: int) -> bytes | None:
        """Read physical memory; None leaves datagram and working counter unchanged."""
        end = address + length
        if address < reg.RAM:
            self._refresh(address, end, now_ns)
        else:
            for sm in self._active:
                if address < sm.end and end > sm.start:
                    data = sm.read(address, length)
                    if data is not None and sm.mailbox:
                        self._show(sm)
                    return data
        return bytes(self.memory[address:end]).ljust(length, b"\0")

    def _refresh(self, address: int, end: int, now_ns: int) -> None:
        """Update registers with changing values before they are read."""
        if address < reg.EEPROM_ADDRESS and end > reg.EEPROM_CONTROL:
            status = self.eeprom.status(now_ns)
            struct.pack_into("<H", self.memory, reg.EEPROM_CONTROL, status)
        if address <= reg.WATCHDOG_STATUS < end:
            self.memory[reg.WATCHDOG_STATUS] = 0 if self.watchdog_expired else 1
        if self._has_dc and address < reg.DC_START_TIME and end > reg.DC_SYSTEM_TIME:
            self._dc.refresh(now_ns)

    def write(self, address: int, data: bytes, now_ns: int) -> bool:
        """Write physical memory; False leaves the working counter unchanged."""
        if address < reg.RAM:
            self._write_registers(address, data, now_ns)
            return True
        end = address + len(data)
        for sm in self._active:
            if address < sm.end and end > sm.start:
                done = sm.write(address, data)
                if done and sm.mailbox:
                    self.show_mailbox()
                return done
        self.memory[address:end] = data[: len(self.memory) - address]
        return True

    def _write_registers(self, address: int, data: bytes, now_ns: int) -> None:
        end = address + len(data)
        if _WRITABLE.find(1, address, end) >= 0:
            for at, value in enumerate(data, address):
                if at < reg.RAM and _WRITABLE[at]:
                    self.memory[at] = value
        if end > reg.DC_RECEIVE_TIMES:
            self._clock_written(address, data, now_ns)
        if address >= reg.DC_RECEIVE_TIMES:
            return
        if address <= reg.AL_CONTROL < end:
            self._events.state_requested(self.memory[reg.AL_CONTROL], now_ns)
        if address < _SM_END and end > reg.SYNC_MANAGER:
            self._configure_sync_managers(address, data)
        if address < _FMMU_END and end > reg.FMMU:
            self._configure_fmmus(address, data)
        if address < reg.FMMU and end > reg.EEPROM_CONTROL:
            self._eeprom_written(address, data, now_ns)
        if address < reg.EEPROM_CONFIG and end > reg.RX_ERRORS:
            self._diagnosis_written(address, end)

    def _diagnosis_written(self, address: int, end: int) -> None:
        """A write to any error counter of a group clears the group."""
        for start, stop in (
            (reg.RX_ERRORS, reg.PROCESSING_ERRORS),
            (reg.PROCESSING_ERRORS, reg.PROCESSING_ERRORS + 1),
            (reg.LOST_LINK, reg.LOST_LINK + 4),
            (reg.WATCHDOG_COUNTER, reg.WATCHDOG_COUNTER + 2),
        ):
            if address < stop and end > start:
                self.memory[start:stop] = bytes(stop - start)
        if address < reg.WATCHDOG_STATUS and end > reg.WATCHDOG_DIVIDER:
            self._set_watchdog()

    def _set_watchdog(self) -> None:
        """The divider counts 40 ns steps and adds two (ETG.1000.4 table 35)."""
        divider, count = (
            struct.unpack_from("<H", self.memory, at)[0]
            for at in (reg.WATCHDOG_DIVIDER, reg.WATCHDOG_PROCESS_DATA)
        )
        self.watchdog_ns = int((divider + 2) * 40 * count)

    def _eeprom_written(self, address: int, data: bytes, now_ns: int) -> None:
        """Only the side selected by 500h bit 0 may use the interface."""
        if self.memory[reg.EEPROM_CONFIG] & 1:
            return
        end = address + len(data)
        keep = slice(max(address, reg.EEPROM_CONTROL), min(end, reg.EEPROM_DATA + 8))
        self.memory[keep] = data[keep.start - address : keep.stop - address]
        if address <= reg.EEPROM_CONTROL < end:
            control, word = struct.unpack_from("<HI", self.memory, reg.EEPROM_CONTROL)
            low = bytes(self.memory[reg.EEPROM_DATA : reg.EEPROM_DATA + 2])
            found = self.eeprom.command(control, word, low, now_ns)
            if found is not None:
                self.memory[reg.EEPROM_DATA : reg.EEPROM_DATA + 8] = found

    def _clock_written(self, address: int, data: bytes, now_ns: int) -> None:
        if not self._has_dc:
            return
        end = address + len(data)
        if address < reg.DC_RECEIVE_TIMES + 4:
            self._dc.latch(now_ns, *self.neighbours)
        if address <= reg.DC_SYSTEM_TIME < end:
            self._dc.compare(data[reg.DC_SYSTEM_TIME - address :], now_ns)
        if address <= reg.DC_ACTIVATION < end:
            self._dc.activate(now_ns)
            self._events.configuration_changed()

    def _configure_sync_managers(self, address: int, data: bytes) -> None:
        for sm in self.sms:
            base = reg.SYNC_MANAGER + 8 * sm.number
            if address >= base + 8 or address + len(data) <= base:
                continue
            raw = bytearray(sm.registers())
            for at, value in enumerate(data, address - base):
                if 0 <= at < 8 and at not in (5, 7):
                    raw[at] = value
            sm.configure(bytes(raw))
            if sm.number == 1 and sm.enabled:
                self._events.mailbox_repeat_requested()
            self._show(sm)
        self._active = [sm for sm in self.sms if sm.enabled]
        self._events.configuration_changed()

    def _configure_fmmus(self, address: int, data: bytes) -> None:
        for at, value in enumerate(data, address):
            if reg.FMMU <= at < _FMMU_END:
                self.memory[at] = value
        raws = (bytes(self.memory[at : at + 16]) for at in range(reg.FMMU, _FMMU_END, 16))
        self._fmmus = [f for f in map(parse_fmmu, raws) if f]
        self._reaches.clear()

    # -- logical access -------------------------------------------------------------------------

    def logical(
        self, address: int, data: bytearray, reading: bool, writing: bool, now_ns: int
    ) -> tuple[bool, bool]:
        """Process one logical datagram; return whether something was read and written.

        Writes take the received bytes; inputs are put into ``data`` after that.
        """
        reach = self._reaches.get((address, len(data)))
        if reach is None:
            reach = self._reach(address, len(data))
        wrote = read = False
        if writing:
            for place, physical in reach.writes:
                wrote |= self.write(physical, bytes(data[place]), now_ns)
            for fmmu in reach.bit_writes:
                wrote |= self._write_bits(fmmu, address, data, now_ns)
        if reading:
            for place, physical in reach.reads:
                part = self.read(physical, place.stop - place.start, now_ns)
                if part is not None:
                    data[place] = part
                    read = True
            for fmmu in reach.bit_reads:
                read |= self._read_bits(fmmu, address, data, now_ns)
        return read, wrote

    def _reach(self, address: int, length: int) -> _Reach:
        """Return what a logical datagram reaches here, calculated once for all cycles."""
        end = address + length
        meant = [f for f in self._fmmus if f.start < end and f.end > address]

        def place(fmmu: Fmmu) -> tuple[slice, int]:
            low, high = max(address, fmmu.start), min(end, fmmu.end)
            return slice(low - address, high - address), fmmu.physical + low - fmmu.start

        whole = [f for f in meant if f.bytewise]
        bits = [f for f in meant if not f.bytewise]
        reach = _Reach(
            tuple(place(f) for f in whole if f.writes),
            tuple(place(f) for f in whole if f.reads),
            tuple(f for f in bits if f.writes),
            tuple(f for f in bits if f.reads),
        )
        if len(self._reaches) >= _REACHES:
            self._reaches.clear()
        self._reaches[address, length] = reach
        return reach

    def _write_bits(self, fmmu: Fmmu, address: int, data: bytearray, now_ns: int) -> bool:
        done = False
        for bit, place in fmmu.bits(address, len(data)):
            mask = 1 << place % 8
            old = self._stored(place // 8)
            new = old | mask if data[bit // 8] >> bit % 8 & 1 else old & ~mask
            done |= self.write(place // 8, bytes([new]), now_ns)
        return done

    def _stored(self, address: int) -> int:
        """Return a stored byte, without the rules for reading."""
        for sm in self._active:
            if sm.start <= address < sm.end:
                return sm.data[address - sm.start]
        return self.memory[address]

    def _read_bits(self, fmmu: Fmmu, address: int, data: bytearray, now_ns: int) -> bool:
        done = False
        for bit, place in fmmu.bits(address, len(data)):
            if (byte := self.read(place // 8, 1, now_ns)) is not None:
                at, mask = bit // 8, 1 << bit % 8
                data[at] = data[at] | mask if byte[0] >> place % 8 & 1 else data[at] & ~mask
                done = True
        return done
