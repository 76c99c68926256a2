"""File access over EtherCAT, for firmware (ETG.1000.6 clause 5.8). Generators, no I/O."""

from __future__ import annotations

import struct
from collections.abc import Callable

from drivers.errors import DriveError, ProtocolError, Rejected
from drivers.ethercat.wire.mailbox import FOE, Mail, Mailbox
from drivers.ethercat.wire.registers import GONE_S
from drivers.ethercat.wire.steps import Pause, Steps

ERASE_S, PACKET_S = 30.0, 10.0
"""Drives that erase their memory first, or check the whole file at the end, take their time."""

_WRITE, _DATA, _ACK, _ERROR, _BUSY = 2, 3, 4, 5, 6

_ERRORS = {
    0x8000: "unspecified error",
    0x8001: "no such file",
    0x8002: "access denied",
    0x8003: "the drive's memory is full",
    0x8004: "not allowed in this state",
    0x8005: "wrong packet number",
    0x8006: "the file exists already",
    0x8007: "no such user or password",
    0x8008: "only possible in the BOOT state",
    0x8009: "not possible in the BOOT state",
    0x800A: "the drive has no right to do that",
    0x800B: "program error: the file is not for this drive",
    0x800C: "wrong checksum",
    0x800D: "the firmware does not fit the hardware",
    0x800F: "no file there to read",
    0x8010: "the file header is missing",
    0x8011: "flash memory error",
    0x8012: "the file is not compatible",
}


def write_file(
    box: Mailbox,
    name: str,
    data: bytes,
    *,
    password: int,
    on_progress: Callable[[int], None],
) -> Steps[None]:
    """Send ``data`` as file ``name``; ``on_progress`` gets the number of bytes taken so far.

    Raises:
        Rejected: the drive refused, with its error code and text.
        LinkTimeout, LinkLost: the transfer broke off; the file in the drive is unusable.

    The drive may take `ERASE_S` for the first and the last answer, `PACKET_S` for the others.
    """
    request = struct.pack("<BxI", _WRITE, password) + name.encode("ascii", "replace")
    room = box.payload_size - 6
    yield from _until_acknowledged(box, request, 0, ERASE_S)
    sent = 0
    packet = 0
    while True:
        # A short packet ends the file; a file that fills its last packet ends with an empty one.
        part = data[sent : sent + room]
        packet += 1
        mail = struct.pack("<BxI", _DATA, packet) + part
        timeout_s = PACKET_S if len(part) == room else ERASE_S
        yield from _until_acknowledged(box, mail, packet, timeout_s)
        sent += len(part)
        on_progress(sent)
        if len(part) < room:
            return


def _until_acknowledged(box: Mailbox, mail: bytes, packet: int, timeout_s: float) -> Steps[None]:
    waited = 0.0
    while True:
        # Broken off it leaves a drive without firmware: a computer that stands still is no reason.
        answer = yield from box.request(FOE, mail, _is_foe, timeout_s, gone_s=GONE_S)
        code = answer[0]
        if code == _ACK:
            told = int.from_bytes(answer[2:6], "little")
            if told != packet:
                raise ProtocolError(
                    "ethercat.drive-acknowledged-packet-instead", told=told, packet=packet
                )
            return
        if code == _ERROR:
            raise _refused(answer)
        if code != _BUSY:
            raise ProtocolError("ethercat.unexpected-foe-answer", number=code)
        waited += 0.05
        if waited > timeout_s:
            raise DriveError("ethercat.drive-busy-packet", timeout_s=timeout_s, packet=packet)
        yield Pause(0.05)


def _refused(answer: bytes) -> Rejected:
    code = int.from_bytes(answer[2:6], "little")
    text = _ERRORS.get(code, "a reason of the maker's own")
    told = answer[6:].split(b"\0", 1)[0].decode("utf-8", "replace").strip()
    words = f"{text}: {told}" if told else text
    return Rejected("ethercat.drive-refused-file-foe", code=code, words=words, number=code)


def _is_foe(mail: Mail) -> bool:
    return mail.protocol == FOE and len(mail.payload) >= 2
