"""File access over EtherCAT, for firmware (ETG.1000.6 clause 5.8). Generators, no I/O."""

from __future__ import annotations

import struct
from collections.abc import Callable

from drivers.errors import DriveError, ProtocolError, Rejected
from drivers.ethercat.wire.mailbox import FOE, Mail, Mailbox
from drivers.ethercat.wire.registers import GONE_S
from drivers.ethercat.wire.steps import Pause, Steps
from drivers.texts.message import joined, prose, text

ERASE_S, PACKET_S = 30.0, 10.0
"""Time-outs [s]: some drives first erase their memory, or check the whole file at the end."""

_WRITE, _DATA, _ACK, _ERROR, _BUSY = 2, 3, 4, 5, 6

#: Error codes of ETG.1000.6 with a text in the catalogue.
_ERRORS = frozenset(
    {
        0x8000,
        0x8001,
        0x8002,
        0x8003,
        0x8004,
        0x8005,
        0x8006,
        0x8007,
        0x8008,
        0x8009,
        0x800A,
        0x800B,
        0x800C,
        0x800D,
        0x800F,
        0x8010,
        0x8011,
        0x8012,
    }
)


def write_file(
    box: Mailbox,
    name: str,
    data: bytes,
    *,
    password: int,
    on_progress: Callable[[int], None],
) -> Steps[None]:
    """Send ``data`` as file ``name``; ``on_progress`` receives the number of bytes accepted.

    The drive may take `ERASE_S` for the first and the last answer, `PACKET_S` for the others.

    Raises:
        Rejected: the drive refused, with its error code and text.
        LinkTimeout, LinkLost: the transfer broke off; the file in the drive is unusable.
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
        # Breaking off leaves a drive without firmware; a stalled computer does not justify that.
        answer = yield from box.request(FOE, mail, _is_foe, timeout_s, gone_s=GONE_S)
        code = answer[0]
        if code == _ACK:
            reported = int.from_bytes(answer[2:6], "little")
            if reported != packet:
                raise ProtocolError(
                    "ethercat.drive-acknowledged-packet-instead", reported=reported, packet=packet
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
    reason = text(f"ethercat.foe-{code:04x}" if code in _ERRORS else "ethercat.foe-other")
    reported = answer[6:].split(b"\0", 1)[0].decode("utf-8", "replace").strip()
    words = joined((reason, prose(reported)), ": ") if reported else reason
    return Rejected("ethercat.drive-refused-file-foe", abort_code=code, number=code, words=words)


def _is_foe(mail: Mail) -> bool:
    return mail.protocol == FOE and len(mail.payload) >= 2
