"""The mailbox of one slave: framing and transactions as generators without any I/O.

See `drivers.ethercat.wire.steps` for what a transaction yields and receives. Source: ETG.1000.4
clause 5.6 (mailbox header, counter, repeat), ETG.1000.6 clause 5.6 (CoE).
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from drivers.errors import LinkLost, LinkTimeout, ProtocolError
from drivers.ethercat.wire.steps import Pause, Read, Steps, Write
from drivers.texts.message import text

MAILBOX_ERROR = 0
COE = 3
FOE = 4
Protocol = Literal[0, 3, 4]

SM0_STATUS = 0x805
SM1_STATUS = 0x80D
SM1_ACTIVATE = 0x80E
SM1_PDI = 0x80F
_FULL = 0x08

_ERRORS = {
    1: "ethercat.mailbox-syntax",
    2: "ethercat.mailbox-protocol",
    3: "ethercat.mailbox-channel",
    4: "ethercat.mailbox-service",
    5: "ethercat.mailbox-header",
    6: "ethercat.mailbox-too-short",
    7: "ethercat.mailbox-no-memory",
    8: "ethercat.mailbox-length",
    9: "ethercat.mailbox-at-work",
}

_RESEND_S = 0.02
_DEAD_READS, _DEAD_S, _DEAD_PAUSE_S = 5, 0.05, 0.002
"""A station is gone after this many reads and this time: the segment may only be stalled."""
_WORTH_WAITING_S = 0.0003
_LONGEST_WAIT_S, _FIRST_USUAL_S = 0.01, 0.0002
_LOOKS, _LOOK_AGAIN_S = 4, 40e-6
_EARLIER, _LATER = 0.997, 0.25
_MOST_LATE = 32
"""Mails read after the time-out: the answer may be behind others, but some drives never end."""


class Overtaken(LinkTimeout):
    """A stop was sent while this transaction waited for its answer.

    A read can be repeated; a write is never repeated, and its outcome is unknown.
    """


class _Seen(NamedTuple):
    """Result of reading the mailbox without reading its status.

    ``repeat_at`` is set if a frame was lost: a repeat must not be requested at once, as the slave
    may not have answered yet and would repeat an old mail.
    """

    mail: Mail | None
    at_s: float
    at_once: bool = False
    repeat_at: float | None = None


class Mail(NamedTuple):
    """One mailbox message without its header."""

    protocol: int
    payload: bytes


def frame(protocol: int, counter: int, payload: bytes, size: int) -> bytes:
    """Return a mail padded to the full ``size``: writing the last byte signals it to the slave.

    Raises:
        ProtocolError: the payload does not fit.
    """
    if len(payload) + 6 > size:
        raise ProtocolError(
            "ethercat.bytes-not-fit-mailbox", payload_count_bytes=len(payload), size_bytes=size
        )
    header = struct.pack("<HHBB", len(payload), 0, 0, protocol | counter << 4)
    return (header + payload).ljust(size, b"\0")


def parse(data: bytes) -> Mail:
    """Split a mailbox that was read into header and payload.

    Raises:
        ProtocolError: the announced length does not fit the mailbox.
    """
    length = int.from_bytes(data[:2], "little")
    if length > len(data) - 6:
        raise ProtocolError(
            "ethercat.drive-mailbox-announces-bytes", length_bytes=length, count=len(data) - 6
        )
    return Mail(data[5] & 0x0F, data[6 : 6 + length])


@dataclass
class Mailbox:
    """One slave's pair of mailboxes and their state.

    Counters run from 2 to 7: SOEM, which requests the mapping by itself in ``config_map``, begins
    with 1 after ``config_init``, and a slave drops a mail that repeats the last counter.
    """

    out_address: int
    out_size: int
    in_address: int
    in_size: int
    clock: Callable[[], float]
    on_emergency: Callable[[bytes], None]
    timeout_s: float = 1.0
    counter: int = field(default=1, init=False)
    unsettled: bool = field(default=False, init=False)
    """A request timed out: its answer may still come and must not be taken for the next one."""
    repeats: int = field(default=0, init=False)
    usual_s: float = field(default=0.0, init=False)
    """Usual response time [s]: reading the mailbox earlier only disturbs."""
    _last_counter: int = field(default=0, init=False)
    _asked_again: bool = field(default=False, init=False)
    epoch: int = field(default=0, init=False)
    """Incremented by `overtake`: an earlier request ends with its answer, or is `Overtaken`."""
    stopping: bool = field(default=False, init=False)
    """A stop waits for its short delay: nothing may be repeated before it."""
    _aside: deque[Mail] = field(default_factory=lambda: deque(maxlen=8), init=False)
    """Answers to interrupted requests that arrived while the stop waited for its own."""

    @property
    def payload_size(self) -> int:
        """Longest payload that can be sent."""
        return self.out_size - 6

    def request(
        self,
        protocol: int,
        payload: bytes,
        matches: Callable[[Mail], bool],
        timeout_s: float | None = None,
        *,
        keep: bool = False,
        gone_s: float = _DEAD_S,
    ) -> Steps[bytes]:
        """Send a mail and wait for the one that ``matches``; others are dropped.

        With ``keep``, others are kept for the transaction that this one has interrupted. The
        station is treated as gone only if frames are lost for ``gone_s``.

        Raises:
            LinkLost: the station answers no frame at all.
            LinkTimeout: the mailbox does not answer.
            Overtaken: a stop came in between, and the answer did not come before it.
            ProtocolError: the slave answers with a mailbox error.
        """
        deadline = self.clock() + (self.timeout_s if timeout_s is None else timeout_s)
        epoch = self.epoch
        self._next_counter()
        mail = frame(protocol, self.counter, payload, self.out_size)
        delivered = yield from self._send(mail, epoch, gone_s)
        return (
            yield from self._wait(
                mail, delivered, matches, deadline, epoch=epoch, keep=keep, gone_s=gone_s
            )
        )

    def overtake(self) -> None:
        """Prevent that anything sent so far is repeated (ETG.1000.4 clause 5.6).

        Otherwise an enabling control word whose frame was lost would follow the stop.
        """
        self.epoch += 1
        self.stopping = False
        self.unsettled = True
        self._aside.clear()

    def post(self, protocol: int, payload: bytes) -> Steps[None]:
        """Send a mail that is not answered."""
        self._next_counter()
        mail = frame(protocol, self.counter, payload, self.out_size)
        yield from self._send(mail, self.epoch, _DEAD_S)

    def receive(self, matches: Callable[[Mail], bool], timeout_s: float) -> Steps[bytes]:
        """Wait for one more mail, as within a file transfer."""
        deadline = self.clock() + timeout_s
        return (yield from self._wait(b"", True, matches, deadline, epoch=self.epoch))

    def drain(self) -> Steps[None]:
        """Empty the mailbox: emergencies are reported, everything else is dropped."""
        for _ in range(32):
            status = yield Read(SM1_STATUS, 1)
            if status is None or not status[0] & _FULL:
                return
            mail = yield from self._fetch()
            if mail is not None:
                self._is_emergency(mail)

    def _next_counter(self) -> None:
        self.counter = self.counter + 1 if self.counter < 7 else 2

    def _send(self, mail: bytes, epoch: int, gone_s: float) -> Steps[bool]:
        """Send a mail; return True if the slave certainly has it.

        False if a lost frame or a full mailbox leaves that open: `_wait` then sends it again. The
        other mailbox is not read, as it may already hold the answer.
        """
        tries, deadline = 0, self.clock() + gone_s
        while tries < _DEAD_READS or self.clock() < deadline:
            tries += 1
            if (yield Write(self.out_address, mail)) is not None:
                return True
            if (yield Read(SM0_STATUS, 1)) is not None:
                return False
            if self.epoch != epoch or self.stopping:
                raise _overtaken()
            if tries >= _DEAD_READS:
                yield Pause(_DEAD_PAUSE_S)
        raise _lost()

    def _wait(
        self,
        mail: bytes,
        delivered: bool,
        matches: Callable[[Mail], bool],
        deadline: float,
        *,
        epoch: int,
        keep: bool = False,
        gone_s: float = _DEAD_S,
    ) -> Steps[bytes]:
        asked = self.clock()
        resend_at = asked + _RESEND_S
        dead, dead_from = 0, asked
        late = 0
        pause_s = 0.0
        early, looked_at, at_once, repeat_at = yield from self._look(mail, delivered)
        while True:
            if early is None:
                looked_at, at_once = self.clock(), False
                status = yield Read(SM1_STATUS, 1)
                if status is not None:
                    dead, dead_from = 0, self.clock()
                else:
                    dead += 1
            if self.epoch != epoch:
                return self._kept(matches, early)
            if dead >= _DEAD_READS:
                if self.clock() - dead_from > gone_s:
                    self.unsettled = True
                    raise _lost()
                yield Pause(_DEAD_PAUSE_S)
            if early is not None or (status is not None and status[0] & _FULL):
                answer = early or (yield from self._fetch())
                early = None
                if self.epoch != epoch:
                    return self._kept(matches, answer)
                late += self.clock() > deadline
                if late > _MOST_LATE:
                    raise self._late()
                if answer is None or self._is_emergency(answer):
                    continue
                if answer.protocol == MAILBOX_ERROR:
                    self._raise_error(answer.payload)
                if matches(answer):
                    self._learn(looked_at - asked, at_once=at_once)
                    return answer.payload
                if keep:
                    self._aside.append(answer)
                continue
            now = self.clock()
            if repeat_at is not None and now > repeat_at:
                # The first read may have emptied the mailbox, and its frame was lost.
                repeat_at = None
                yield from self._ask_again()
                continue
            if now > deadline:
                raise self._late()
            if not delivered and now > resend_at and not self.stopping:
                # The same counter: a slave that did receive the mail drops the copy.
                delivered = (yield Write(self.out_address, mail)) is not None
                resend_at = now + _RESEND_S
            if pause_s:
                yield Pause(pause_s)
            pause_s = min(pause_s + 0.00002, 0.0005)

    def _late(self) -> LinkTimeout:
        self.unsettled = True
        return LinkTimeout("ethercat.drive-not-answer-time")

    def _look(self, mail: bytes, delivered: bool) -> Steps[_Seen]:
        """Read the mailbox without reading its status, at the time the answer is usually there.

        Two frames for a transaction instead of three or more: reading an empty mailbox has no
        effect (working counter 0), and reading again is one frame.
        """
        at = self.clock()
        if not mail or not delivered or not self.usual_s:
            return _Seen(None, at)
        epoch = self.epoch
        if self.usual_s > _WORTH_WAITING_S:
            yield Pause(min(self.usual_s, _LONGEST_WAIT_S))
        for number in range(_LOOKS):
            if number:
                yield Pause(_LOOK_AGAIN_S)
            if self.epoch != epoch:
                break
            at = self.clock()
            data = yield Read(self.in_address, self.in_size, may_be_empty=True)
            if data is None:
                return _Seen(None, at, repeat_at=self.clock() + max(3 * self.usual_s, _RESEND_S))
            if data:
                return _Seen(self._received(data), at, at_once=number == 0)
        return _Seen(None, at)

    def _received(self, data: bytes) -> Mail | None:
        """Parse a mail; None for one that the slave has sent before (ETG.1000.4 clause 5.6)."""
        mail, counter = parse(data), data[5] >> 4 & 0x07
        repeated = self._asked_again and counter != 0 and counter == self._last_counter
        self._asked_again = False
        self._last_counter = counter
        return None if repeated else mail

    def _kept(self, matches: Callable[[Mail], bool], last: Mail | None = None) -> bytes:
        """Return the answer that came before the stop's own: a slave answers in order."""
        for mail in (*self._aside, *(() if last is None else (last,))):
            if mail.protocol != MAILBOX_ERROR and matches(mail):
                payload: bytes = mail.payload
                return payload
        raise _overtaken()

    def _learn(self, took_s: float, *, at_once: bool) -> None:
        """Adapt the delay before the first read so that it just finds the answer.

        The delay is slightly reduced while the first read succeeds, and increased by a part of the
        excess otherwise. A single slow answer (a drive that writes its memory) has a limited
        effect.
        """
        if at_once:
            self.usual_s *= _EARLIER
        elif not self.usual_s:
            self.usual_s = took_s
        else:
            longer_s = max(took_s - self.usual_s, 0.0) * _LATER
            self.usual_s += min(longer_s, self.usual_s / 2 + _FIRST_USUAL_S)

    def _fetch(self) -> Steps[Mail | None]:
        """Read the full mailbox; request a repeat if the frame with it was lost."""
        epoch = self.epoch
        for _ in range(4):
            data = yield Read(self.in_address, self.in_size)
            if data is not None:
                return self._received(data)
            if self.epoch != epoch:
                return None
            yield from self._ask_again()
        return None

    def _ask_again(self) -> Steps[None]:
        """Toggle the repeat bit and wait for the slave to confirm it (ETG.1000.4 clause 5.6)."""
        self.repeats += 1
        self._asked_again = True
        wanted: int | None = None
        for _ in range(40):
            if wanted is None:
                now = yield Read(SM1_ACTIVATE, 1)
                wanted = None if now is None else now[0] ^ 0x02
            else:
                yield Write(SM1_ACTIVATE, bytes([wanted]))
                reported = yield Read(SM1_PDI, 1)
                if reported is not None and (reported[0] ^ wanted) & 0x02 == 0:
                    return
            yield Pause(0.0005)

    def _is_emergency(self, mail: Mail) -> bool:
        """Return True for a CoE emergency (ETG.1000.6 clause 5.6.4), after reporting it."""
        if mail.protocol != COE or len(mail.payload) < 10:
            return False
        if int.from_bytes(mail.payload[:2], "little") >> 12 != 1:
            return False
        self.on_emergency(mail.payload[2:10])
        return True

    def _raise_error(self, payload: bytes) -> None:
        code = int.from_bytes(payload[2:4], "little")
        known = _ERRORS.get(code)
        reason = text("ethercat.mailbox-other", number=code) if known is None else text(known)
        raise ProtocolError("ethercat.drive-refused-mail", text=reason)


def _overtaken() -> Overtaken:
    return Overtaken("ethercat.stop-sent-first-whether")


def _lost() -> LinkLost:
    return LinkLost("ethercat.station-no-longer-answers")
