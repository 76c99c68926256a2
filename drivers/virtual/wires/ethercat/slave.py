"""One slave: a controller with its drive.

Events occur in the order of segment time: all events due before a frame arrives (answers, state
changes, SYNC0, watchdog) are processed before the frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drivers.virtual.device import Device, SdoAbort, StartsWithNetwork
from drivers.virtual.wires.ethercat.clock import WireClock
from drivers.virtual.wires.ethercat.controller import registers as reg
from drivers.virtual.wires.ethercat.controller import sii
from drivers.virtual.wires.ethercat.controller.al import AlStateMachine
from drivers.virtual.wires.ethercat.controller.controller import Controller
from drivers.virtual.wires.ethercat.controller.dc import DistributedClock
from drivers.virtual.wires.ethercat.controller.registers import AlCode, AlState
from drivers.virtual.wires.ethercat.mailbox.coe import CoeServer
from drivers.virtual.wires.ethercat.mailbox.dictionary import CoeDictionary, SyncReport
from drivers.virtual.wires.ethercat.mailbox.foe import FirmwareStore
from drivers.virtual.wires.ethercat.mailbox.mailbox import HEADER, Mailbox
from drivers.virtual.wires.ethercat.process import ProcessData

_HOUSEKEEPING_NS = 1_000_000
_NEVER = 1 << 62

MAILBOXES = (256, 256)
"""Size in bytes of the mailboxes to and from the drive; the address range has no more room."""


def _layout(mailboxes: tuple[int, int]) -> tuple[sii.SmLayout, ...]:
    return (
        sii.SmLayout(0x1000, mailboxes[0], 0x26, 1, 1),
        sii.SmLayout(0x1100, mailboxes[1], 0x22, 1, 2),
        sii.SmLayout(0x1200, 0, 0x64, 1, 3),
        sii.SmLayout(0x1500, 0, 0x20, 1, 4),
    )


BOOT_LAYOUT = (
    sii.SmLayout(0x1000, 512, 0x26, 1, 1),
    sii.SmLayout(0x1200, 512, 0x22, 1, 2),
)
"""In BOOT there are no process data, so the mailboxes may use their memory."""


@dataclass(frozen=True, slots=True)
class SlaveIdentity:
    """Distinguishes two drives of one family."""

    serial: int = 0
    alias: int = 0


class Slave:
    """See the module docstring. Not thread-safe: called by the segment's thread."""

    dictionary_type: type[CoeDictionary] = CoeDictionary

    def __init__(
        self,
        device: Device,
        clock: WireClock,
        identity: SlaveIdentity | None = None,
        mailboxes: tuple[int, int] = MAILBOXES,
    ) -> None:
        self.device = device
        self._layout = self.sii_layout(mailboxes)
        link = device.profile.link("ethercat")
        self._has_dc = _supports_dc(device)
        self.report = SyncReport()
        self.dictionary = self.dictionary_type(
            device, lambda: self.al.state, self.report, self._has_dc
        )
        complete = bool(link and link.complete_access)
        self.coe = CoeServer(self.dictionary, complete, self._layout[1].length - HEADER)
        self.files = FirmwareStore() if link and link.foe else None
        memory = bytearray(0x10000)
        self.dc = DistributedClock(memory, clock)
        content = _sii_content(
            device, self.dictionary, identity or SlaveIdentity(), self._layout, self._has_dc
        )
        self.controller = Controller(self, sii.Eeprom(sii.build(content)), self.dc, memory)
        sms = self.controller.sms
        self.al = AlStateMachine(self)
        self.mailbox = Mailbox(sms[0], sms[1], self.coe, self.files)
        self.process = ProcessData(
            device, self.dictionary, self.report, self.dc, outputs=sms[2], inputs=sms[3]
        )
        self._housekeeping_ns = 0
        self._now_ns = 0
        self.power_on(0)

    def sii_layout(self, mailboxes: tuple[int, int]) -> tuple[sii.SmLayout, ...]:
        """Return the sync managers as in the EEPROM."""
        return _layout(mailboxes)

    # -- power ----------------------------------------------------------------------------------

    def power_on(self, now_ns: int) -> None:
        """Set registers to power-on values; EEPROM and the drive's NVM keep their content."""
        self.controller.power_on(self._has_dc)
        self.restart(now_ns)
        self.dictionary.reset()
        self.dc.power_on(now_ns)

    def restart(self, now_ns: int) -> None:
        """Restart the drive's processor; the controller keeps its registers."""
        self.al.power_on()
        self.mailbox.stop()
        self.process.stop()
        self._housekeeping_ns = self._now_ns = now_ns
        self._show()

    # -- time -----------------------------------------------------------------------------------

    def run(self, now_ns: int) -> None:
        """Process all events due up to ``now_ns``, in order of time."""
        self.process.skip_to(now_ns)
        while True:
            event = tick = self.process.next_tick_ns or _NEVER
            if (dog := self._watchdog_due()) < event:
                event = dog
            if (mailbox := self.mailbox.due_ns) is not None and mailbox < event:
                event = mailbox
            if (state := self.al.due_ns) is not None and state < event:
                event = state
            due = min(event, self._housekeeping_ns)
            if due > now_ns:
                break
            self._now_ns = max(self._now_ns, due)
            if due == tick:
                self.process.tick(due)
                self._forward_emergencies()
                self._housekeeping_ns = due + 2 * _HOUSEKEEPING_NS
            elif due == dog:
                self._watchdog_fired(due)
            elif due == mailbox:
                self.device.advance(due)
                self.mailbox.run(due)
                self.controller.show_mailbox()
            elif due == state:
                self.al.run(due)
                self._show()
                self.process.skip_to(now_ns)
            else:
                self._housekeeping(min(event, now_ns))
        self._now_ns = now_ns
        self.mailbox.at(now_ns)
        self.process.at(now_ns)

    def after_frame(self, now_ns: int) -> None:
        """Process the end of a frame."""
        self.process.after_frame(now_ns)
        if self.al.due_ns is not None:
            self.al.retry(now_ns)
            self._show()

    def _housekeeping(self, now_ns: int) -> None:
        """Run the drive without SYNC0, at most once per millisecond."""
        self._housekeeping_ns = now_ns + _HOUSEKEEPING_NS
        if self.process.next_tick_ns is None:
            self.device.advance(now_ns)
        self._forward_emergencies()

    def _forward_emergencies(self) -> None:
        for code, register, data in self.device.take_emergencies():
            self.mailbox.emergency(code, register, data)
            self.controller.show_mailbox()

    def _watchdog_due(self) -> int:
        if self.al.state != AlState.OP or not self.controller.watchdog_ns:
            return _NEVER
        written = self.process.written_ns
        if written is None or not self.controller.sms[2].watches:
            return _NEVER
        return written + self.controller.watchdog_ns

    def _watchdog_fired(self, now_ns: int) -> None:
        self.controller.watchdog_expired = True
        self.controller.count(reg.WATCHDOG_COUNTER)
        self.device.advance(now_ns)
        self.al.fall(AlState.SAFEOP, AlCode.WATCHDOG)
        self._show()

    def _show(self) -> None:
        self.controller.show_state(self.al.status, self.al.code)

    # -- events of the controller ---------------------------------------------------------------

    def state_requested(self, control: int, now_ns: int) -> None:
        """The master has written AL control."""
        self._now_ns = now_ns
        self.al.request(control, now_ns)
        self._show()

    def mailbox_repeat_requested(self) -> None:
        """The master may have lost the last answer."""
        self.mailbox.repeat_toggled()

    def configuration_changed(self) -> None:
        """Cause an error state if the master disables what the present state needs."""
        heading = min(self.al.state, self.al.target)
        if heading == AlState.BOOT and not self._mailbox_set(BOOT_LAYOUT):
            self.al.fall(AlState.INIT, AlCode.INVALID_MAILBOX_BOOT)
        elif heading >= AlState.PREOP and heading != AlState.BOOT and not self._mailbox_set():
            self.al.fall(AlState.INIT, AlCode.INVALID_MAILBOX_PREOP)
        elif heading >= AlState.SAFEOP and (code := self.process.check()):
            self.al.fall(AlState.PREOP, code)
        self._show()

    # -- calls of the state machine --------------------------------------------------------------

    def check(self, target: AlState) -> int:
        """Forbid states for which the master's configuration is invalid."""
        if not self.controller.eeprom.loaded and target != AlState.INIT:
            return AlCode.EEPROM_ERROR
        if target == AlState.BOOT:
            if self.files is None:
                return AlCode.BOOT_UNSUPPORTED
            return 0 if self._mailbox_set(BOOT_LAYOUT) else AlCode.INVALID_MAILBOX_BOOT
        if target == AlState.PREOP and self.al.state == AlState.INIT:
            if self.files is not None and not self.files.intact:
                return AlCode.NO_VALID_FIRMWARE
            return 0 if self._mailbox_set() else AlCode.INVALID_MAILBOX_PREOP
        if target == AlState.SAFEOP and self.al.state == AlState.PREOP:
            return self.process.check()
        if target == AlState.OP and self.dc.sync0_requested and self.dc.sync0_first_ns is None:
            return AlCode.NO_SYNC
        return 0

    def _mailbox_set(self, wanted: Sequence[sii.SmLayout] | None = None) -> bool:
        """Whether sync managers 0 and 1 are set as the EEPROM describes them."""
        layout = self._layout if wanted is None else wanted
        return all(
            sm.enabled
            and sm.mailbox
            and sm.writable == (sm.number == 0)
            and (sm.start, sm.length) == (layout[sm.number].start, layout[sm.number].length)
            for sm in self.controller.sms[:2]
        )

    def waits_for(self, target: AlState) -> int:
        """Op requires the first outputs (004:990-992) and, with DC, the first SYNC0."""
        if target != AlState.OP:
            return 0
        if not self.process.synchronised:
            return AlCode.NO_SYNC
        if self.process.has_outputs and not self.process.received:
            return AlCode.WATCHDOG
        return 0

    def entered(self, old: AlState, new: AlState, code: int) -> None:
        """Start and stop the mailbox, process data and the drive's reaction."""
        if new == AlState.INIT:
            self.mailbox.stop()
        elif old == AlState.INIT:
            self.mailbox.start(boot=new == AlState.BOOT)
        if old >= AlState.SAFEOP > new:
            self.process.stop()
        rising = old == AlState.INIT and new == AlState.PREOP
        if rising and isinstance(self.device, StartsWithNetwork):
            self.device.network_started()
        if old < AlState.SAFEOP <= new:
            self.process.start(self._now_ns)
        self.process.operate(new == AlState.OP)
        if new == AlState.OP:
            self.controller.watchdog_expired = False
        elif old == AlState.OP:
            self.device.communication_lost(_reason(new, code))
        self.controller.show_sync_managers()


def _supports_dc(device: Device) -> bool:
    """Whether the profile lists a synchronisation mode with distributed clocks."""
    pdo = device.profile.pdo
    return bool(pdo and any("DC" in mode.upper() for mode in pdo.sync_modes))


def _reason(new: AlState, code: int) -> str:
    if code == AlCode.WATCHDOG:
        return "watchdog"
    return f"error {code:#06x}" if code else f"state {new.name}"


def _sii_content(
    device: Device,
    dictionary: CoeDictionary,
    identity: SlaveIdentity,
    layout: tuple[sii.SmLayout, ...],
    has_dc: bool,
) -> sii.SiiContent:
    """Return the EEPROM content, from the profile and the drive's own 1018h."""
    profile = device.profile
    link = profile.link("ethercat")
    vendor, product, revision, serial = (_identity_word(device, n) for n in (1, 2, 3, 4))
    details = sii.COE_SDO | sii.COE_INFO
    if profile.pdo is not None:
        details |= sii.COE_ASSIGN | (sii.COE_CONFIGURE if profile.pdo.remappable else 0)
    if link and link.complete_access:
        details |= sii.COE_COMPLETE_ACCESS
    return sii.SiiContent(
        vendor_id=vendor,
        product_code=product,
        revision=revision,
        serial=serial or identity.serial,
        alias=identity.alias,
        name=profile.identity.model,
        group=profile.identity.maker,
        coe_details=details,
        foe=bool(link and link.foe),
        sync_managers=layout,
        boot=BOOT_LAYOUT if link and link.foe else None,
        rx_pdos=_sii_pdos(device, dictionary, "rx", 2),
        tx_pdos=_sii_pdos(device, dictionary, "tx", 3),
        clocks=has_dc,
    )


def _identity_word(device: Device, subindex: int) -> int:
    """Return a word of the drive's 1018h, as in its dictionary; otherwise of the profile."""
    try:
        return int.from_bytes(device.read(0x1018, subindex)[:4], "little")
    except SdoAbort:
        identity = device.profile.identity
        known = (identity.vendor_id, identity.product_code, identity.revision, None)
        return known[subindex - 1] or 0


def _sii_pdos(
    device: Device, dictionary: CoeDictionary, direction: str, sm: int
) -> tuple[sii.SiiPdo, ...]:
    pdo = device.profile.pdo
    chosen = dictionary.assigned_pdos(direction)
    return tuple(
        sii.SiiPdo(s.index, sm if s.index in chosen else 0xFF, dictionary.mapping(s.index))
        for s in (pdo.sets if pdo else ())
        if s.direction == direction
    )
