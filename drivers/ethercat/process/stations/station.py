"""State of one slave, and the transactions with it."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field

from drivers.errors import DriveError, LinkLost, LinkTimeout, NotAllowed, ProtocolError, Rejected
from drivers.ethercat.wire import coe, esc, sii
from drivers.ethercat.wire.al_status import ERROR_BIT, AlState, al_status_text, state_name
from drivers.ethercat.wire.mailbox import Mailbox
from drivers.ethercat.wire.registers import GONE_S, TRIES, read_again
from drivers.ethercat.wire.steps import Pause, Read, Steps, T, Write
from drivers.objects.codec import serial_or_none, text_of
from drivers.texts.message import Text, text

AL_CONTROL, AL_STATUS = 0x120, 0x130
_SYNC_MANAGERS, _NO_MAILBOXES = 0x800, 0x0016
_SERVO = 402
_TURN_S = 0.002

#: Time-outs of state changes [s] (ETG.1020 clause 5.3.7.2).
STATE_TIMEOUT_S = {
    AlState.INIT: 5.0,
    AlState.PREOP: 3.0,
    AlState.BOOT: 3.0,
    AlState.SAFEOP: 10.0,
    AlState.OP: 10.0,
}


@dataclass
class Station:
    """One slave, counted from 1 in the order of the cable."""

    number: int
    vendor_id: int = 0
    product_code: int = 0
    revision: int = 0
    name: str = ""
    serial: int | None = None
    alias: int = 0
    hardware: str = ""
    firmware: str = ""
    mailbox: Mailbox | None = None
    distributed_clock: bool = False
    al_state: int = 0
    al_code: int = 0
    lost: bool = False
    badly_found: bool = False
    """Frames of the search were lost: the presence of its clock could not be read, or its EEPROM
    states a mailbox that was not set up.
    """
    complete_access: bool = True
    single_only: set[int] = field(default_factory=set)
    """Objects whose layout in complete access was not certain."""
    to_prove: dict[int, bytes] = field(default_factory=dict)
    proven: dict[int, tuple[tuple[int, int], ...]] = field(default_factory=dict)
    """Layouts of whole objects, with lengths, that were verified by single reads."""
    describes: bool = True
    """The drive has the SDO information service, as far as is known."""
    device_profile: int | None = None
    """Low word of 1000h; None if it was not read."""
    notes: list[Text] = field(default_factory=list)
    ports: esc.PortCounters | None = None
    wiring: esc.PortCounters | None = None
    """Its ports when all stations last answered: shows what is behind a cable that is now cut."""
    clock_ahead_ns: int | None = None
    """Deviation from the reference clock; None without distributed clock."""
    eeprom_used: bool = False
    """A transaction accesses its EEPROM; see `with_eeprom`."""

    @property
    def identity(self) -> list[int | None]:
        """Vendor, product and serial number, which identify this drive."""
        return [self.vendor_id, self.product_code, self.serial]

    @property
    def box(self) -> Mailbox:
        """The mailbox.

        Raises:
            NotAllowed: a device without one.
            LinkLost: the search did not set it up.
        """
        if self.badly_found:
            raise LinkLost(
                "ethercat.station-found-part-frames", station=self.number, name=self.name
            )
        if self.mailbox is None:
            raise NotAllowed("ethercat.station-no-mailbox-no", station=self.number, name=self.name)
        return self.mailbox

    def require_parameters(self) -> None:
        """Check that the state is one in which a drive answers parameter requests.

        Raises:
            LinkLost: it stays in INIT with an error; the message states its AL status.
        """
        if self.al_state != AlState.INIT | ERROR_BIT:
            return
        reported = al_status_text(self.al_code)
        raise LinkLost(
            "ethercat.station-al-status-answers",
            remedy=(reported.remedy() or text("ethercat.try-switch-drive-off")),
            station=self.number,
            state_name=state_name(self.al_state),
            status=reported,
            al_code=self.al_code,
        )


def al_status(station: Station) -> Steps[bool]:
    """Read the AL state and code into ``station``; return False without an answer."""
    return (yield from _al_status(station)) is True


def _al_status(station: Station) -> Steps[bool | None]:
    """Read as `al_status`; None for a lost frame, which does not indicate a lost station."""
    data = yield Read(AL_STATUS, 6, may_be_empty=True)
    if not data:
        return None if data is None else False
    station.al_state = data[0] & 0x1F
    station.al_code = int.from_bytes(data[4:6], "little")
    return True


def answers(station: Station, clock: Callable[[], float]) -> Steps[bool]:
    """Return whether the station answers, after reading its AL state and code.

    A frame that comes back unprocessed is conclusive after `registers.TRIES`; lost frames, as while
    the segment or the computer is stalled, are repeated for `registers.GONE_S`.
    """
    deadline = clock() + GONE_S
    untouched = 0
    while True:
        reported = yield from _al_status(station)
        if reported:
            return True
        untouched += reported is False
        if untouched >= TRIES or clock() > deadline:
            return False
        if reported is None:
            yield Pause(0.005)


def change_state(
    station: Station, target: AlState, clock: Callable[[], float], timeout_s: float | None = None
) -> Steps[None]:
    """Bring the slave to ``target``, acknowledging an error first.

    Raises:
        NotAllowed: the slave refused; the reason is its AL status code as text.
        LinkTimeout: it did not get there within ``timeout_s``, by default the time of ETG.1020.
        LinkLost: it does not answer.
    """
    limit_s = STATE_TIMEOUT_S[target] if timeout_s is None else timeout_s
    deadline = clock() + limit_s
    if not (yield from answers(station, clock)):
        raise _gone(station)
    if station.al_state & ERROR_BIT:
        acknowledged = station.al_state & 0x0F | ERROR_BIT
        yield Write(AL_CONTROL, struct.pack("<H", acknowledged))
        while (yield from answers(station, clock)) and station.al_state & ERROR_BIT:
            if clock() > deadline:
                raise _refused(station, target)
            yield Pause(0.001)
    yield Write(AL_CONTROL, struct.pack("<H", target))
    pause_s = 0.0005
    while True:
        if not (yield from answers(station, clock)):
            raise _gone(station)
        if station.al_state == target:
            return
        if station.al_state & ERROR_BIT:
            raise _refused(station, target)
        if clock() > deadline:
            raise LinkTimeout(
                "ethercat.station-still-after-requested",
                station=station.number,
                state_name=state_name(station.al_state),
                limit_s=limit_s,
                target=target.name,
            )
        yield Pause(pause_s)
        pause_s = min(pause_s * 2, 0.01)


def _gone(station: Station) -> LinkLost:
    return LinkLost("ethercat.station-not-answer-check-drive", station=station.number)


def _refused(station: Station, target: AlState) -> NotAllowed:
    known = al_status_text(station.al_code)
    return NotAllowed(
        "ethercat.station-refuses-al-status",
        limit=f"AL status {station.al_code:#06x}",
        remedy=known.remedy(),
        station=station.number,
        target=target.name,
        state_name=state_name(station.al_state),
        status=known,
        al_code=station.al_code,
    )


def identify(station: Station, clock: Callable[[], float]) -> Steps[None]:
    """Go to PREOP, then read identity, alias, ports and the names from the mailbox.

    Data that a slave does not have stay empty; for a slave that refuses PREOP the reason is noted
    as text.
    """
    station.notes.clear()
    alias = yield from read_again(0x12, 2, clock)
    station.alias = int.from_bytes(alias or b"\0\0", "little")
    features = yield from read_again(0x08, 2, clock)
    station.distributed_clock = bool(features and features[0] & 0x04)
    # Without an answer, the presence of a distributed clock is unknown, not excluded.
    station.badly_found = features is None
    if (yield from read_ports(station)):
        station.wiring = station.ports
    try:
        station.serial, right = yield from with_eeprom(station, sii.identity(clock))
        if not right:
            station.notes.append(text("ethercat.note-eeprom-checksum"))
    except DriveError as error:
        station.notes.append(error.text)
    if station.mailbox is None:
        yield from al_status(station)
        station.badly_found |= yield from with_eeprom(station, sii.has_mailbox(clock))
        part = "ethercat.note-found-in-part" if station.badly_found else "ethercat.note-no-mailbox"
        station.notes.append(text(part))
        return
    try:
        yield from to_preop(station, clock)
        reported = yield from _try_read(station, 0x1018, 4)
        if reported is not None and len(reported) == 4:
            station.serial = serial_or_none(int.from_bytes(reported, "little")) or station.serial
        device_type = yield from _try_read(station, 0x1000, 0)
        if device_type is not None and len(device_type) == 4:
            station.device_profile = int.from_bytes(device_type[:2], "little")
            if station.device_profile != _SERVO:
                note = text("ethercat.note-no-drive", device_profile=station.device_profile)
                station.notes.append(note)
        for key, index in (("name", 0x1008), ("hardware", 0x1009), ("firmware", 0x100A)):
            data = yield from _try_read(station, index, 0)
            if data is not None:
                setattr(station, key, text_of(data) or getattr(station, key))
        yield from _compare_identity(station)
    except DriveError as error:
        station.notes.append(error.text)


def with_eeprom(station: Station, steps: Steps[T]) -> Steps[T]:
    """Run ``steps`` while nothing else accesses the EEPROM of this station.

    Transactions of both lanes use it, with the same registers for address and data: one in between
    would give the other a wrong word, or have a wrong one written.
    """
    while station.eeprom_used:
        yield Pause(_TURN_S)
    station.eeprom_used = True
    try:
        return (yield from steps)
    finally:
        station.eeprom_used = False


def to_preop(station: Station, clock: Callable[[], float]) -> Steps[None]:
    """Go to PREOP; retry with new sync managers if a lost frame left the mailboxes without."""
    try:
        yield from change_state(station, AlState.PREOP, clock)
    except NotAllowed:
        if station.al_code != _NO_MAILBOXES:
            raise
        box = station.box
        for number, (address, size, control) in enumerate(
            ((box.out_address, box.out_size, 0x26), (box.in_address, box.in_size, 0x22))
        ):
            manager = struct.pack("<HHBBBB", address, size, control, 0, 1, 0)
            yield Write(_SYNC_MANAGERS + 8 * number, manager)
        yield from change_state(station, AlState.PREOP, clock)


def _compare_identity(station: Station) -> Steps[None]:
    """Note differences between 1018h and the SII for the user."""
    for sub, code, ours in (
        (1, "ethercat.note-other-vendor", station.vendor_id),
        (2, "ethercat.note-other-product", station.product_code),
        (3, "ethercat.note-other-revision", station.revision),
    ):
        data = yield from _try_read(station, 0x1018, sub)
        reported = None if data is None else int.from_bytes(data, "little")
        if reported is not None and reported != ours:
            station.notes.append(text(code, reported=f"{reported:#x}", eeprom=f"{ours:#x}"))


def _try_read(station: Station, index: int, subindex: int) -> Steps[bytes | None]:
    try:
        return (yield from coe.upload(station.box, index, subindex))
    except (Rejected, ProtocolError):
        return None


def clear_ports(station: Station) -> Steps[None]:
    """Clear the error counters; any write to them does (ETG.1000.4 clause 6.2).

    Raises:
        LinkLost: the station does not answer.
    """
    # The counters of processing unit and PDI are optional: a chip without them may not answer.
    yield Write(0x30C, b"\0")
    yield Write(0x30D, b"\0")
    for register, size in ((esc.ERROR_COUNTERS, 8), (0x310, 4)):
        for attempt in range(TRIES):
            if (yield Write(register, bytes(size))) is not None:
                break
            if attempt == TRIES - 1:
                raise _gone(station)


def read_ports(station: Station) -> Steps[bool]:
    """Read link state and error counters of the four ports, and the deviation of the clock.

    Returns whether the station answered; without an answer its last figures are kept.
    """
    status = yield from read_again(esc.DL_STATUS, 2)
    if status is None:
        return False
    counters = yield from read_again(esc.ERROR_COUNTERS, esc.ERROR_COUNTERS_SIZE)
    if counters is not None:
        station.ports = esc.decode_ports(station.number, status, counters)
    if station.distributed_clock:
        difference = yield from read_again(esc.TIME_DIFFERENCE, 4)
        if difference is not None:
            station.clock_ahead_ns = esc.decode_time_difference(difference)
    return counters is not None
