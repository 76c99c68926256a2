"""CANopen over EtherCAT: SDO transfers and complete access.

Generators over `Mailbox`; no I/O. Source: ETG.1000.6 clause 5.6.2. Aborts are accepted with any low
command bits and under either service number: the stacks of several manufacturers differ there.
"""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Callable
from typing import NoReturn

from drivers.errors import DriveError, LinkTimeout, NotAllowed, ProtocolError, Rejected
from drivers.ethercat.wire.mailbox import COE, Mail, Mailbox, Overtaken
from drivers.ethercat.wire.steps import Pause, Steps
from drivers.objects.sdo_abort import rejected
from drivers.texts.message import Text, text

_REQUEST = 2 << 12
_RESPONSE = 3
MAX_BYTES = 1 << 20
_DROPPED_S = 0.1
OVERTAKEN_READS = 3
_STOP_AGAIN_S = 0.002

ABORT_COMMAND = 0x05040001
ABORT_TOGGLE = 0x05030000


def upload(
    box: Mailbox,
    index: int,
    subindex: int,
    *,
    complete: bool = False,
    timeout_s: float | None = None,
) -> Steps[bytes]:
    """Read an object; with ``complete`` all of it, subindex 0 first.

    A read interrupted by a stop is repeated from its beginning.

    Raises:
        Rejected: the drive aborted.
        LinkTimeout, LinkLost, ProtocolError: see `Mailbox.request`.
    """
    for _ in range(OVERTAKEN_READS):
        epoch = box.epoch
        try:
            return (
                yield from _upload(box, index, subindex, complete=complete, timeout_s=timeout_s)
            )
        except DriveError:
            # A stop in the middle ends a segmented transfer in the drive as well.
            if box.epoch == epoch:
                raise
    return (yield from _upload(box, index, subindex, complete=complete, timeout_s=timeout_s))


def _upload(
    box: Mailbox, index: int, subindex: int, *, complete: bool, timeout_s: float | None
) -> Steps[bytes]:
    yield from settle(box)
    command = 0x50 if complete else 0x40
    request = struct.pack("<HBHB4x", _REQUEST, command, index, subindex)
    answer = yield from box.request(COE, request, _answer_to(index, subindex), timeout_s)
    _raise_abort(answer, index, subindex, writing=False)
    command = answer[2]
    if command & 0xE0 != 0x40:
        yield from _give_up(
            box,
            index,
            subindex,
            ABORT_COMMAND,
            _unexpected(command),
        )
    if command & 0x02:
        return answer[6 : 10 - (command >> 2 & 3 if command & 0x01 else 0)]
    if len(answer) < 10:
        yield from _give_up(box, index, subindex, ABORT_COMMAND, text("sdo.answer-without-length"))
    size = int.from_bytes(answer[6:10], "little")
    if size > MAX_BYTES:
        yield from _give_up(
            box, index, subindex, 0x05040005, text("sdo.announced-too-much", announced=size)
        )
    data = bytearray(answer[10:])
    if len(data) < size:
        yield from _upload_segments(box, index, subindex, size=size, data=data, timeout_s=timeout_s)
    return bytes(data[:size])


def _upload_segments(
    box: Mailbox,
    index: int,
    subindex: int,
    *,
    size: int,
    data: bytearray,
    timeout_s: float | None,
) -> Steps[None]:
    toggle = 0
    while True:
        request = struct.pack("<HB7x", _REQUEST, 0x60 | toggle)
        answer = yield from box.request(COE, request, _is_segment, timeout_s)
        _raise_abort(answer, index, subindex, writing=False)
        command = answer[2]
        if command & 0xE0:
            yield from _give_up(
                box,
                index,
                subindex,
                ABORT_COMMAND,
                _unexpected(command),
            )
        if command & 0x10 != toggle:
            yield from _give_up(
                box, index, subindex, ABORT_TOGGLE, text("sdo.segment-twice-or-lost")
            )
        part = answer[3:]
        data += part[: 7 - (command >> 1 & 7)] if len(part) <= 7 else part
        if len(data) > size:
            yield from _give_up(
                box, index, subindex, 0x06070010, text("sdo.more-than-announced", announced=size)
            )
        if command & 0x01:
            break
        toggle ^= 0x10
    if len(data) != size:
        raise ProtocolError("ethercat.drive-announced-bytes-sent", size_bytes=size, count=len(data))


def download(
    box: Mailbox,
    index: int,
    subindex: int,
    data: bytes,
    *,
    complete: bool = False,
    timeout_s: float | None = None,
) -> Steps[None]:
    """Write an object: expedited up to 4 bytes, otherwise in one mail or in segments.

    Raises:
        Rejected: the drive aborted.
        NotAllowed: a stop came first; nothing was sent.
        LinkTimeout, LinkLost, ProtocolError: see `Mailbox.request`.
    """
    epoch = box.epoch
    try:
        yield from settle(box)
    except Overtaken as overtaken:
        raise stopped_first() from overtaken
    if box.epoch != epoch or box.stopping:
        raise stopped_first()
    room = box.payload_size - 10
    if 1 <= len(data) <= 4 and not complete:
        command = 0x23 | (4 - len(data)) << 2
        request = struct.pack("<HBHB", _REQUEST, command, index, subindex) + data.ljust(4, b"\0")
        sent = len(data)
    else:
        command = 0x31 if complete else 0x21
        header = struct.pack("<HBHBI", _REQUEST, command, index, subindex, len(data))
        sent = min(room, len(data))
        request = header + data[:sent]
    answer = yield from box.request(COE, request, _answer_to(index, subindex), timeout_s)
    _raise_abort(answer, index, subindex, writing=True)
    if answer[2] & 0xE0 != 0x60:
        yield from _give_up(
            box,
            index,
            subindex,
            ABORT_COMMAND,
            _unexpected(answer[2]),
        )
    toggle = 0
    while sent < len(data):
        part = data[sent : sent + box.payload_size - 3]
        sent += len(part)
        command = toggle | (sent == len(data)) | (max(7 - len(part), 0) << 1)
        request = struct.pack("<HB", _REQUEST, command) + part.ljust(7, b"\0")
        answer = yield from box.request(COE, request, _is_segment, timeout_s)
        _raise_abort(answer, index, subindex, writing=True)
        if answer[2] & 0xE0 != 0x20 or answer[2] & 0x10 != toggle:
            yield from _give_up(box, index, subindex, ABORT_TOGGLE, text("sdo.segment-out-of-turn"))
        toggle ^= 0x10


def stop_write(box: Mailbox, index: int, subindex: int, data: bytes) -> Steps[None]:
    """Write up to four bytes even while another transaction waits for its answer.

    Nothing is drained or read first. It is sent again if the mailbox is still busy, and once after
    an abort, which may belong to the interrupted transaction.

    Raises:
        Rejected: the drive aborted it.
        LinkTimeout, LinkLost, ProtocolError: see `Mailbox.request`.
    """
    box.overtake()
    command = 0x23 | (4 - len(data)) << 2
    request = struct.pack("<HBHB", _REQUEST, command, index, subindex) + data.ljust(4, b"\0")
    answers = _answer_to(index, subindex)

    def matches(mail: Mail) -> bool:
        return answers(mail) and mail.payload[2] & 0xE0 in (0x60, 0x80)

    deadline = box.clock() + box.timeout_s
    aborted = False
    while True:
        left_s = max(deadline - box.clock(), 0.0)
        try:
            answer = yield from box.request(COE, request, matches, left_s, keep=True)
            _raise_abort(answer, index, subindex, writing=True)
        except ProtocolError:
            if box.clock() > deadline:
                raise
            yield Pause(_STOP_AGAIN_S)
        except Rejected:
            if aborted:
                raise
            aborted = True
        else:
            return


def stopped_first() -> NotAllowed:
    """Create the error of a write that was cancelled by a stop before it was sent."""
    return NotAllowed("ethercat.stop-came-first-not")


def settle(box: Mailbox, *, force: bool = False) -> Steps[None]:
    """Make sure that no late answer can be mistaken for the next one.

    A slave answers in order. After a time-out another object is read first: when that answer
    arrives, every older answer has arrived and been dropped.
    """
    if not (box.unsettled or force):
        return
    yield from box.drain()
    if force:
        # SOEM used this mailbox: the slave drops our mail if its counter equals SOEM's last one.
        with contextlib.suppress(LinkTimeout):
            request = struct.pack("<HBHB4x", _REQUEST, 0x40, 0x1000, 0)
            yield from box.request(COE, request, _answer_to(0x1000, 0), _DROPPED_S)
    for fence in ((0x1018, 1), (0x1000, 0)):
        request = struct.pack("<HBHB4x", _REQUEST, 0x40, *fence)
        yield from box.request(COE, request, _answer_to(*fence))
    box.unsettled = False


def split_complete(data: bytes, sizes: dict[int, int], *, proven: bool) -> dict[int, bytes]:
    """Split a complete-access answer by subindex; empty where its layout is not certain.

    ``sizes`` are the lengths of the known entries. Subindex 0 is padded to 16 bits (ETG.1000.6
    clause 5.6.2.1); some slaves send it as one byte, some omit reserved subindices. An answer is
    certain if every byte is accounted for *and* subindex 0 agrees: all of 1…n, or the highest known
    one. Where it disagrees, ``proven`` states that this layout has been verified by single reads.
    """
    if not data:
        return {}
    first = [sub for sub in sorted(sizes) if sub <= data[0]]
    candidates = [first] if first == list(range(1, data[0] + 1)) else []
    if proven or data[0] == max(sizes, default=0):
        candidates.append(sorted(sizes))
    for order in candidates:
        total = sum(sizes[sub] for sub in order)
        if len(data) == total + 2 and data[1] == 0:
            start = 2
        elif len(data) == total + 1:
            start = 1
        else:
            continue
        parts = {0: data[:1]}
        for sub in order:
            parts[sub] = data[start : start + sizes[sub]]
            start += sizes[sub]
        return parts
    return {}


def _answer_to(index: int, subindex: int) -> Callable[[Mail], bool]:
    mux = struct.pack("<HB", index, subindex)

    def matches(mail: Mail) -> bool:
        if not _is_sdo(mail):
            return False
        return mail.payload[3:6] == mux or _is_anonymous_abort(mail.payload)

    return matches


def _is_segment(mail: Mail) -> bool:
    return _is_sdo(mail)


def _is_sdo(mail: Mail) -> bool:
    if mail.protocol != COE or len(mail.payload) < 6:
        return False
    service = int.from_bytes(mail.payload[:2], "little") >> 12
    return service == _RESPONSE or (service == 2 and mail.payload[2] & 0xE0 == 0x80)


def _is_anonymous_abort(payload: bytes) -> bool:
    return payload[2] & 0xE0 == 0x80 and payload[3:6] == b"\0\0\0"


def _raise_abort(answer: bytes, index: int, subindex: int, *, writing: bool) -> None:
    if answer[2] & 0xE0 == 0x80:
        code = int.from_bytes(answer[6:10], "little")
        raise rejected(code, parameter=f"{index:04X}:{subindex:02X}", writing=writing)


def _unexpected(answer: int) -> Text:
    return text("sdo.unexpected-answer", answer=f"{answer:#04x}")


def _give_up(box: Mailbox, index: int, subindex: int, code: int, why: Text) -> Steps[NoReturn]:
    """Abort the transfer towards the slave, then raise ProtocolError."""
    yield from box.post(COE, struct.pack("<HBHBI", _REQUEST, 0x80, index, subindex, code))
    box.unsettled = True
    at = f"{index:04X}:{subindex:02X}"
    raise ProtocolError("sdo.transfer-given-up", parameter=at, why=why)
