"""Firmware download: in BOOT if the drive has that state, otherwise in PREOP.

Source: ETG.1000.6 clauses 6.4 (BOOT) and 5.8 (FoE), ETG.5003-2 (firmware update): INIT, mailboxes
as the EEPROM states them for BOOT, BOOT, the file, INIT, and up again.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Literal

from drivers.errors import DriveError, LinkLost, LinkTimeout, NotAllowed, Rejected
from drivers.ethercat.exchange.setup import SYNC_MANAGERS, restore_mailbox
from drivers.ethercat.process.stations.station import (
    Station,
    change_state,
    identify,
    to_preop,
    with_eeprom,
)
from drivers.ethercat.wire import foe, sii
from drivers.ethercat.wire.al_status import AlState
from drivers.ethercat.wire.mailbox import Mailbox
from drivers.ethercat.wire.steps import Pause, Steps, Write
from drivers.texts.message import Text, joined, text

Where = Literal["auto", "BOOT", "PREOP"]
Report = Callable[[float, Text], None]

_NO_BOOT = 0x0013
_BACK_S = 60.0
_BACK_PAUSE_S = 0.5


def load(
    station: Station,
    name: str,
    data: bytes,
    *,
    password: int,
    where: Where,
    managers: bytes,
    clock: Callable[[], float],
    report: Report,
) -> Steps[str]:
    """Send a file and bring the drive back to PREOP; return the state in which it was accepted.

    ``managers`` are the registers of sync managers 0 and 1 for PREOP. "auto" means BOOT if the
    EEPROM states mailboxes for it.

    Raises:
        Rejected, NotAllowed: the drive refused, as text; it is back in PREOP if possible.
        LinkTimeout, LinkLost: the transfer broke off; the message states how far it got.
    """
    boot = yield from with_eeprom(station, sii.boot_mailbox(clock))
    if where == "BOOT" and boot is None:
        raise NotAllowed("ethercat.station-names-no-mailboxes", station=station.number)
    if boot is not None and where != "PREOP":
        entered = yield from _enter_boot(station, boot, managers, clock, report, where)
        if entered:
            yield from _in_boot(
                station, boot, name, data, password=password, managers=managers, clock=clock,
                report=report,
            )  # fmt: skip
            return "BOOT"
    yield from to_preop(station, clock)
    yield from _send(station.box, name, data, password=password, report=report)
    report(1.0, text("ethercat.file-drive"))
    yield from identify(station, clock)
    return "PREOP"


def _enter_boot(
    station: Station,
    boot: sii.BootMailbox,
    managers: bytes,
    clock: Callable[[], float],
    report: Report,
    where: Where,
) -> Steps[bool]:
    """Enter BOOT; return False if the drive has no BOOT after all and is in PREOP again."""
    report(0.0, text("ethercat.going-boot"))
    yield from change_state(station, AlState.INIT, clock)
    for number, (address, size, control) in enumerate(
        ((boot.out_address, boot.out_size, 0x26), (boot.in_address, boot.in_size, 0x22))
    ):
        manager = struct.pack("<HHBBBB", address, size, control, 0, 1, 0)
        yield Write(SYNC_MANAGERS + 8 * number, manager)
    try:
        yield from change_state(station, AlState.BOOT, clock)
    except NotAllowed:
        missing = station.al_code == _NO_BOOT
        yield from restore_mailbox(station, managers, clock)
        if missing and where == "auto":
            return False
        raise
    return True


def _in_boot(
    station: Station,
    boot: sii.BootMailbox,
    name: str,
    data: bytes,
    *,
    password: int,
    managers: bytes,
    clock: Callable[[], float],
    report: Report,
) -> Steps[None]:
    box = Mailbox(
        boot.out_address, boot.out_size, boot.in_address, boot.in_size, clock, lambda _data: None
    )
    try:
        yield from _send(box, name, data, password=password, report=report)
    except DriveError as error:
        after = yield from _after_failure(station, managers, clock)
        error.text = joined((error.text, after))
        raise
    report(1.0, text("ethercat.file-drive-starts-not"))
    yield from _back(station, managers, clock)
    yield from identify(station, clock)


def _after_failure(station: Station, managers: bytes, clock: Callable[[], float]) -> Steps[Text]:
    """Try to bring the drive back; return a message with the result for the user."""
    try:
        yield from restore_mailbox(station, managers, clock)
    except DriveError as error:
        return text("ethercat.not-back-after-failure", cause=error.text)
    return text("ethercat.back-after-failure")


def _back(station: Station, managers: bytes, clock: Callable[[], float]) -> Steps[None]:
    """Bring the drive up again; one that restarts with its new firmware is away for a while.

    Raises:
        LinkLost: it did not come back within a minute.
    """
    deadline = clock() + _BACK_S
    while True:
        try:
            yield from restore_mailbox(station, managers, clock)
        except (LinkLost, LinkTimeout) as error:
            if clock() > deadline:
                raise LinkLost(
                    "ethercat.station-took-file-not",
                    station=station.number,
                    back_s=_BACK_S,
                    cause=error.text,
                ) from error
        else:
            return
        yield Pause(_BACK_PAUSE_S)


def _send(box: Mailbox, name: str, data: bytes, *, password: int, report: Report) -> Steps[None]:
    sent = 0

    def progress(now: int) -> None:
        nonlocal sent
        sent = now
        report(
            now / max(len(data), 1), text("ethercat.bytes-not-switch-off", now=now, bytes=len(data))
        )

    try:
        yield from foe.write_file(box, name, data, password=password, on_progress=progress)
    except Rejected as error:
        error.text = text(
            "ethercat.refused-after-bytes", cause=error.text, sent_bytes=sent, size_bytes=len(data)
        )
        raise
    except DriveError as error:
        error.text = text(
            "ethercat.download-broke-off", cause=error.text, sent_bytes=sent, size_bytes=len(data)
        )
        error.own_remedy = error.text.remedy()
        raise
