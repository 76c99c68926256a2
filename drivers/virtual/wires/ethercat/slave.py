"""One slave: controller memory and registers, with the drive behind them.

Order of events is by the wire's time: everything that was due before a frame arrived (answers,
state changes, SYNC0, watchdog) happens before the frame is processed.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from drivers.virtual.device import Device, SdoAbort
from drivers.virtual.wires.ethercat import registers as reg
from drivers.virtual.wires.ethercat import sii
from drivers.virtual.wires.ethercat.al import AlStateMachine
from drivers.virtual.wires.ethercat.clock import WireClock
from drivers.virtual.wires.ethercat.coe import CoeServer
from drivers.virtual.wires.ethercat.dc import DistributedClock
from drivers.virtual.wires.ethercat.dictionary import CoeDictionary, SyncReport
from drivers.virtual.wires.ethercat.foe import FirmwareStore
from drivers.virtual.wires.ethercat.mailbox import HEADER, Mailbox
from drivers.virtual.wires.ethercat.process import ProcessData
from drivers.virtual.wires.ethercat.registers import AlCode, AlState
from drivers.virtual.wires.ethercat.syncmanager import Fmmu, SyncManager, parse_fmmu

_FMMUS, _SYNC_MANAGERS = 4, 4
_HOUSEKEEPING_NS = 1_000_000
_NEVER = 1 << 62

MAILBOX_BYTES = 256
_LAYOUT = (
    sii.SmLayout(0x1000, MAILBOX_BYTES, 0x26, 1, 1),
    sii.SmLayout(0x1100, MAILBOX_BYTES, 0x22, 1, 2),
    sii.SmLayout(0x1200, 0, 0x64, 1, 3),
    sii.SmLayout(0x1500, 0, 0x20, 1, 4),
)


@dataclass(frozen=True, slots=True)
class SlaveIdentity:
    """What tells two drives of one family apart."""

    serial: int = 0
    alias: int = 0


def _writable_mask() -> bytes:
    mask = bytearray(reg.RAM)
    for start, length in reg.WRITABLE:
        mask[start : start + length] = b"\x01" * length
    return bytes(mask)


_WRITABLE = _writable_mask()


class Slave:
    """See the module docstring. Not thread-safe: the segment's thread calls it."""

    def __init__(
        self, device: Device, clock: WireClock, identity: SlaveIdentity | None = None
    ) -> None:
        self.device = device
        self._clock = clock
        self._identity = identity or SlaveIdentity()
        link = device.profile.link("ethercat")
        self._has_dc = _supports_dc(device)
        self.report = SyncReport()
        self.dictionary = CoeDictionary(device, lambda: self.al.state, self.report, self._has_dc)
        self.coe = CoeServer(
            self.dictionary, bool(link and link.complete_access), MAILBOX_BYTES - HEADER
        )
        self.files = FirmwareStore(MAILBOX_BYTES - HEADER) if link and link.foe else None
        self.eeprom = sii.Eeprom(sii.build(self._sii_content()))
        self.memory = bytearray(0x10000)
        self.sms = [SyncManager(n) for n in range(_SYNC_MANAGERS)]
        self.al = AlStateMachine(self)
        self.dc = DistributedClock(self.memory, clock)
        self.mailbox = Mailbox(self.sms[0], self.sms[1], self.coe, self.files)
        self.process = ProcessData(
            device, self.dictionary, self.report, self.dc, self.sms[2], self.sms[3]
        )
        self._fmmus: list[Fmmu] = []
        self._active: list[SyncManager] = []
        self._housekeeping_ns = 0
        self._now_ns = 0
        self._wd_time_ns = 0
        self._wd_expired = False
        self.link_from_ns = 0
        """When the link of the ports is up after power-on."""
        self.neighbours = (0, 0)
        """How many slaves lie before and behind this one on the working part of the line."""
        self.power_on(0)

    # -- power ----------------------------------------------------------------------------------

    def power_on(self, now_ns: int) -> None:
        """Registers as after power-on; the EEPROM keeps its content, the drive its NVM."""
        memory = self.memory
        memory[:] = bytes(len(memory))
        memory[reg.TYPE : reg.TYPE + 10] = struct.pack(
            "<BBHBBBBH", 0x11, 0, 2, _FMMUS, _SYNC_MANAGERS, 8, 0x0F,
            0x000C if self._has_dc else 0,
        )  # fmt: skip
        struct.pack_into("<H", memory, reg.STATION_ALIAS, self.eeprom.alias)
        memory[reg.DL_CONTROL] = 0x01
        memory[reg.PDI_CONTROL] = 0x08
        struct.pack_into("<H", memory, reg.WATCHDOG_DIVIDER, 0x09C2)
        struct.pack_into("<H", memory, reg.WATCHDOG_PDI, 1000)
        struct.pack_into("<H", memory, reg.WATCHDOG_PROCESS_DATA, 1000)
        for sm in self.sms:
            sm.configure(bytes(8))
            sm.locked = True
            self._show_sm(sm)
        self._fmmus, self._active = [], []
        self.al.power_on()
        self.mailbox.stop()
        self.process.stop()
        self.dictionary.reset()
        self.dc.power_on(now_ns)
        self._housekeeping_ns = self._now_ns = now_ns
        self._wd_time_ns = self._watchdog_ns()
        self._wd_expired = False
        self._show_al()

    def power_off(self, now_ns: int) -> None:
        """The drive loses its supply: it coasts, and its volatile values are gone."""
        self.device.advance(now_ns)
        self.mailbox.stop()
        self.process.stop()
        self.al.power_on()
        self.device.powered = False

    def _sii_content(self) -> sii.SiiContent:
        profile = self.device.profile
        link = profile.link("ethercat")
        vendor, product, revision, serial = (self._identity_word(n) for n in (1, 2, 3, 4))
        details = sii.COE_SDO | sii.COE_INFO
        if profile.pdo is not None:
            details |= sii.COE_ASSIGN | (sii.COE_CONFIGURE if profile.pdo.remappable else 0)
        if link and link.complete_access:
            details |= sii.COE_COMPLETE_ACCESS
        return sii.SiiContent(
            vendor_id=vendor,
            product_code=product,
            revision=revision,
            serial=serial or self._identity.serial,
            alias=self._identity.alias,
            name=profile.identity.model,
            group=profile.identity.maker,
            coe_details=details,
            foe=bool(link and link.foe),
            sync_managers=_LAYOUT,
            rx_pdos=self._sii_pdos("rx", 2),
            tx_pdos=self._sii_pdos("tx", 3),
            clocks=self._has_dc,
        )

    def _identity_word(self, subindex: int) -> int:
        """From the drive's 1018h, so that EEPROM and dictionary agree; else from the profile."""
        try:
            return int.from_bytes(self.device.read(0x1018, subindex)[:4], "little")
        except SdoAbort:
            identity = self.device.profile.identity
            known = (identity.vendor_id, identity.product_code, identity.revision, None)
            return known[subindex - 1] or 0

    def _sii_pdos(self, direction: str, sm: int) -> tuple[sii.SiiPdo, ...]:
        pdo = self.device.profile.pdo
        chosen = self.dictionary.assigned_pdos(direction)
        return tuple(
            sii.SiiPdo(s.index, sm if s.index in chosen else 0xFF, self.dictionary.mapping(s.index))
            for s in (pdo.sets if pdo else ())
            if s.direction == direction
        )

    # -- time -----------------------------------------------------------------------------------

    def run(self, now_ns: int) -> None:
        """Let everything happen that is due up to ``now_ns``, in the order of time."""
        self.process.skip_to(now_ns)
        while True:
            tick = self.process.next_tick_ns
            mailbox = self.mailbox.due_ns
            state = self.al.due_ns
            dog = self._watchdog_due()
            due = min(
                _NEVER if tick is None else tick,
                _NEVER if mailbox is None else mailbox,
                _NEVER if state is None else state,
                dog,
                self._housekeeping_ns,
            )
            if due > now_ns:
                break
            self._now_ns = max(self._now_ns, due)
            if due == self._housekeeping_ns:
                self._keep_house(now_ns)
            elif due == tick:
                self.process.tick(due)
                self._forward_emergencies()
            elif due == mailbox:
                self.device.advance(due)
                self.mailbox.run(due)
                self._show_sm(self.sms[0])
                self._show_sm(self.sms[1])
            elif due == dog:
                self._watchdog_fired(due)
            else:
                self.al.run(due)
                self._show_al()
                self.process.skip_to(now_ns)
        self._now_ns = now_ns
        self.mailbox.at(now_ns)
        self.process.at(now_ns)

    def after_frame(self, now_ns: int) -> None:
        """Called once a frame has left."""
        self.process.after_frame(now_ns)
        if self.al.due_ns is not None and self.al.due_ns <= now_ns + 1:
            self.al.run(now_ns + 1)
            self._show_al()

    def _keep_house(self, now_ns: int) -> None:
        """Keep the drive alive where no SYNC0 does, once a millisecond at most."""
        self._housekeeping_ns = now_ns + _HOUSEKEEPING_NS
        if self.process.next_tick_ns is None:
            self.device.advance(now_ns)
        self._forward_emergencies()

    def _forward_emergencies(self) -> None:
        for code, register, data in self.device.take_emergencies():
            self.mailbox.emergency(code, register, data)
            self._show_sm(self.sms[1])

    def _watchdog_ns(self) -> int:
        divider, count = (
            struct.unpack_from("<H", self.memory, at)[0]
            for at in (reg.WATCHDOG_DIVIDER, reg.WATCHDOG_PROCESS_DATA)
        )
        return int((divider + 2) * 40 * count)

    def _watchdog_due(self) -> int:
        if self.al.state != AlState.OP or not self.sms[2].watches:
            return _NEVER
        written = self.process.written_ns
        if written is None or self._wd_time_ns == 0:
            return _NEVER
        return written + self._wd_time_ns

    def _watchdog_fired(self, now_ns: int) -> None:
        self._wd_expired = True
        counter = self.memory[reg.WATCHDOG_COUNTER]
        self.memory[reg.WATCHDOG_COUNTER] = min(255, counter + 1)
        self.device.advance(now_ns)
        self.al.fall(AlState.SAFEOP, AlCode.WATCHDOG)
        self._show_al()

    # -- state machine --------------------------------------------------------------------------

    def check(self, target: AlState) -> int:
        """Forbid states for which the master's configuration is wrong."""
        if target == AlState.BOOT:
            if self.files is None:
                return AlCode.BOOT_UNSUPPORTED
            return 0 if self._mailbox_set() else AlCode.INVALID_MAILBOX_BOOT
        if target == AlState.PREOP and self.al.state == AlState.INIT:
            return 0 if self._mailbox_set() else AlCode.INVALID_MAILBOX_PREOP
        if target == AlState.SAFEOP and self.al.state == AlState.PREOP:
            return self.process.check()
        if target == AlState.OP and self.dc.sync0_requested and self.dc.sync0_first_ns is None:
            return AlCode.NO_SYNC
        return 0

    def _mailbox_set(self) -> bool:
        return all(
            sm.enabled
            and sm.mailbox
            and sm.writable == (sm.number == 0)
            and (sm.start, sm.length) == (_LAYOUT[sm.number].start, _LAYOUT[sm.number].length)
            for sm in self.sms[:2]
        )

    def ready(self, target: AlState) -> bool:
        """Op begins with the first outputs (004:970-972)."""
        return target != AlState.OP or self.process.received or not self.process.has_outputs

    def entered(self, old: AlState, new: AlState, code: int) -> None:
        """Start and stop mailbox, process data and the drive's reaction."""
        now = self._now_ns
        if new == AlState.INIT:
            self.mailbox.stop()
        elif old == AlState.INIT:
            self.mailbox.start()
        if old >= AlState.SAFEOP > new:
            self.process.stop()
        if old < AlState.SAFEOP <= new:
            self.process.start(now)
        self.process.operate(new == AlState.OP)
        if new == AlState.OP:
            self._wd_expired = False
        elif old == AlState.OP:
            self.device.communication_lost(_reason(new, code))
        for sm in self.sms:
            self._show_sm(sm)

    def _show_al(self) -> None:
        self.memory[reg.AL_STATUS] = self.al.status
        struct.pack_into("<H", self.memory, reg.AL_STATUS_CODE, self.al.code)

    # -- memory ---------------------------------------------------------------------------------

    @property
    def station(self) -> int:
        """Configured station address."""
        return self.memory[0x10] | self.memory[0x11] << 8

    def answers_to(self, address: int) -> bool:
        """Station address, or alias where the master has switched that on."""
        if self.station == address:
            return True
        if not self.memory[reg.DL_ALIAS_ENABLE] & 1:
            return False
        return address == int(struct.unpack_from("<H", self.memory, reg.STATION_ALIAS)[0])

    def read(self, address: int, length: int, now_ns: int) -> bytes | None:
        """Physical read; None leaves datagram and working counter alone."""
        end = address + length
        if address >= reg.RAM:
            for sm in self._active:
                if address < sm.end and end > sm.start:
                    data = sm.read(address, length)
                    if data is not None and sm.mailbox:
                        self._show_sm(sm)
                    return data
            return bytes(self.memory[address:end]).ljust(length, b"\0")
        if address < 0x918 and end > 0x910:
            self.dc.refresh(now_ns)
        elif address < reg.DC_ACTIVATION_STATUS + 1 and end > reg.DC_ACTIVATION_STATUS:
            self.dc.refresh(now_ns)
        elif address < reg.EEPROM_ADDRESS and end > reg.EEPROM_CONTROL:
            status = self.eeprom.status(now_ns)
            struct.pack_into("<H", self.memory, reg.EEPROM_CONTROL, status)
        elif address <= reg.WATCHDOG_STATUS < end:
            self.memory[reg.WATCHDOG_STATUS] = 0 if self._wd_expired else 1
        return bytes(self.memory[address:end])

    def write(self, address: int, data: bytes, now_ns: int) -> bool:
        """Physical write; False leaves the working counter alone."""
        end = address + len(data)
        if address >= reg.RAM:
            for sm in self._active:
                if address < sm.end and end > sm.start:
                    done = sm.write(address, data)
                    if done and sm.mailbox:
                        self._show_sm(self.sms[0])
                        self._show_sm(self.sms[1])
                    return done
            self.memory[address:end] = data[: len(self.memory) - address]
            return True
        self._write_registers(address, data, now_ns)
        return True

    def _write_registers(self, address: int, data: bytes, now_ns: int) -> None:
        end = address + len(data)
        for at, value in enumerate(data, address):
            if at < reg.RAM and _WRITABLE[at]:
                self.memory[at] = value

        def touched(start: int, length: int = 1) -> bool:
            return address < start + length and end > start

        if touched(reg.AL_CONTROL):
            self.al.request(self.memory[reg.AL_CONTROL], now_ns)
            self._show_al()
        if touched(reg.SYNC_MANAGER, 8 * _SYNC_MANAGERS):
            self._configure_sms(address, data)
        if touched(reg.FMMU, 16 * _FMMUS):
            self._configure_fmmus(address, data)
        if touched(reg.WATCHDOG_DIVIDER, 0x22):
            self._wd_time_ns = self._watchdog_ns()
        if touched(reg.RX_ERRORS, 8) or touched(reg.FORWARDED_ERRORS, 4):
            self.memory[reg.RX_ERRORS : reg.PROCESSING_ERRORS] = bytes(12)
        if touched(reg.PROCESSING_ERRORS):
            self.memory[reg.PROCESSING_ERRORS] = 0
        if touched(reg.LOST_LINK, 4):
            self.memory[reg.LOST_LINK : reg.LOST_LINK + 4] = bytes(4)
        if touched(reg.WATCHDOG_COUNTER, 2):
            self.memory[reg.WATCHDOG_COUNTER : reg.WATCHDOG_COUNTER + 2] = bytes(2)
        if touched(reg.EEPROM_CONTROL, 14):
            self._eeprom_access(address, data, now_ns)
        if not self._has_dc:
            return
        if touched(reg.DC_RECEIVE_TIMES, 4):
            self.dc.latch(now_ns, *self.neighbours)
        if touched(reg.DC_SYSTEM_TIME):
            self.dc.compare(data[reg.DC_SYSTEM_TIME - address :], now_ns)
        if touched(reg.DC_ACTIVATION):
            self.dc.activate(now_ns)

    def _eeprom_access(self, address: int, data: bytes, now_ns: int) -> None:
        """Only the side that 500h bit 0 names may use the interface."""
        if self.memory[reg.EEPROM_CONFIG] & 1:
            return
        keep = slice(max(address, reg.EEPROM_CONTROL), min(address + len(data), reg.FMMU))
        self.memory[keep] = data[keep.start - address : keep.stop - address]
        if address <= reg.EEPROM_CONTROL < address + len(data):
            control, word = struct.unpack_from("<HI", self.memory, reg.EEPROM_CONTROL)
            low = self.memory[reg.EEPROM_DATA : reg.EEPROM_DATA + 2]
            found = self.eeprom.command(control, word, bytes(low), now_ns)
            if found is not None:
                self.memory[reg.EEPROM_DATA : reg.EEPROM_DATA + 8] = found

    def _configure_sms(self, address: int, data: bytes) -> None:
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
                self.mailbox.repeat_toggled()
            self._show_sm(sm)
        self._active = [sm for sm in self.sms if sm.enabled]
        self._configuration_lost()

    def _configuration_lost(self) -> None:
        """A master that switches off what the present state needs forces an error state."""
        heading = min(self.al.state, self.al.target)
        if heading >= AlState.PREOP and not all(sm.enabled for sm in self.sms[:2]):
            self.al.fall(AlState.INIT, AlCode.INVALID_MAILBOX_PREOP)
        elif heading >= AlState.SAFEOP and (code := self.process.check()):
            self.al.fall(AlState.PREOP, code)
        self._show_al()

    def _show_sm(self, sm: SyncManager) -> None:
        base = reg.SYNC_MANAGER + 8 * sm.number
        self.memory[base : base + 8] = sm.registers()

    def _configure_fmmus(self, address: int, data: bytes) -> None:
        for at, value in enumerate(data, address):
            if reg.FMMU <= at < reg.FMMU + 16 * _FMMUS:
                self.memory[at] = value
        raws = [self.memory[reg.FMMU + 16 * n : reg.FMMU + 16 * n + 16] for n in range(_FMMUS)]
        self._fmmus = [f for f in map(parse_fmmu, map(bytes, raws)) if f]

    # -- logical access -------------------------------------------------------------------------

    def logical(
        self, address: int, data: bytearray, reading: bool, writing: bool, now_ns: int
    ) -> tuple[bool, bool]:
        """One logical datagram; returns whether something was read and written.

        Writes take the bytes as they came in; only then are inputs put into ``data``.
        """
        end = address + len(data)
        wrote = read = False
        for fmmu in self._fmmus if writing else ():
            if fmmu.writes and fmmu.start < end and fmmu.end > address:
                wrote |= self._logical_write(fmmu, address, data, now_ns)
        for fmmu in self._fmmus if reading else ():
            if fmmu.reads and fmmu.start < end and fmmu.end > address:
                read |= self._logical_read(fmmu, address, data, now_ns)
        return read, wrote

    def _logical_write(self, fmmu: Fmmu, address: int, data: bytearray, now_ns: int) -> bool:
        if fmmu.bytewise:
            low, high = max(address, fmmu.start), min(address + len(data), fmmu.end)
            part = bytes(data[low - address : high - address])
            return self.write(fmmu.physical + low - fmmu.start, part, now_ns)
        done = False
        for offset, bit in enumerate(fmmu.bits()):
            at = bit // 8 - address
            if 0 <= at < len(data):
                place = fmmu.physical * 8 + fmmu.physical_bit + offset
                old = self.memory[place // 8]
                mask = 1 << place % 8
                value = data[at] >> bit % 8 & 1
                new = old | mask if value else old & ~mask
                done |= self.write(place // 8, bytes([new]), now_ns)
        return done

    def _logical_read(self, fmmu: Fmmu, address: int, data: bytearray, now_ns: int) -> bool:
        if fmmu.bytewise:
            low, high = max(address, fmmu.start), min(address + len(data), fmmu.end)
            part = self.read(fmmu.physical + low - fmmu.start, high - low, now_ns)
            if part is not None:
                data[low - address : high - address] = part
            return part is not None
        done = False
        for offset, bit in enumerate(fmmu.bits()):
            at = bit // 8 - address
            place = fmmu.physical * 8 + fmmu.physical_bit + offset
            if 0 <= at < len(data) and (byte := self.read(place // 8, 1, now_ns)) is not None:
                mask = 1 << bit % 8
                data[at] = data[at] | mask if byte[0] >> place % 8 & 1 else data[at] & ~mask
                done = True
        return done


def _supports_dc(device: Device) -> bool:
    """The profile names its synchronisation modes; one of them begins with DC."""
    pdo = device.profile.pdo
    return bool(pdo and any(mode.upper().startswith("DC") for mode in pdo.sync_modes))


def _reason(new: AlState, code: int) -> str:
    if code == AlCode.WATCHDOG:
        return "watchdog"
    return f"state {new.name}" if not code else f"error {code:#06x}"
