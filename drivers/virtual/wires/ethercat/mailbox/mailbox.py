"""The mailbox of one slave (ETG.1000.4 clause 7): counters, queue, repeat, errors.

A request is answered after ``delay_ns``, one at a time: meanwhile the next one stays in sync
manager 0, which is then full. A lost answer is repeated when the master toggles the repeat request;
a request received twice with the same counter is executed once.
"""

from __future__ import annotations

import struct
from collections import deque
from typing import Protocol

from drivers.virtual.wires.ethercat.controller.syncmanager import SyncManager
from drivers.virtual.wires.ethercat.mailbox.coe import CoeServer, MailboxError

HEADER = 6
_ERROR, _COE, _FOE = 0, 3, 4
_UNSUPPORTED, _INVALID_SIZE = 0x02, 0x08


_QUEUE_LIMIT = 16
"""Messages queued for the mailbox; the memory of a real drive is small, too."""


class FileServer(Protocol):
    """A file service of the mailbox (FoE)."""

    def handle(self, payload: bytes) -> list[bytes]:
        """Return the answers to one FoE message."""

    def enter(self, capacity: int, *, boot: bool) -> None:
        """Open a mailbox with ``capacity`` bytes of payload, in BOOT or above."""


class Mailbox:
    """Both directions of one slave's mailbox."""

    def __init__(
        self, inbox: SyncManager, outbox: SyncManager, coe: CoeServer, foe: FileServer | None
    ) -> None:
        self._inbox = inbox
        self._outbox = outbox
        self._coe = coe
        self._foe = foe
        self.delay_ns = 0
        self.muted = False
        """Injected fault: requests are accepted and never answered."""
        self.die_after_segments: int | None = None
        """Injected fault: no answer after this many segments of a segmented transfer."""
        self.open = False
        self._boot = False
        self.due_ns: int | None = None
        """Time at which the present request will be answered."""
        self._request = b""
        self._queue: deque[bytes] = deque()
        self._last_sent = b""
        self._last_counter = 0
        self._counter = 0
        inbox.on_written = self._written
        outbox.on_read = self._send_next
        self._now_ns = 0

    def start(self, *, boot: bool = False) -> None:
        """Reset counters and buffers on the transition from Init to Pre-Op or Boot."""
        self.open = True
        self._boot = boot
        if self._foe is not None:
            self._foe.enter(min(self._inbox.length, self._outbox.length) - HEADER, boot=boot)
        self._inbox.locked = self._outbox.locked = False
        self._inbox.reset()
        self._outbox.reset()
        self._outbox.repeat_ack = self._outbox.repeat_request
        self._queue.clear()
        self.due_ns = None
        self._last_counter = self._counter = 0
        self._last_sent = b""
        self._coe.reset()

    def stop(self) -> None:
        """Disable both directions in Init."""
        self.open = False
        self._inbox.locked = self._outbox.locked = True
        self._inbox.full = self._outbox.full = False
        self.due_ns = None
        self._queue.clear()

    def at(self, now_ns: int) -> None:
        """Set the time of the next access; sync managers have no clock."""
        self._now_ns = now_ns

    def run(self, now_ns: int) -> None:
        """Answer the request that is due, then take the next one."""
        self._now_ns = now_ns
        while self.due_ns is not None and self.due_ns <= now_ns:
            done_ns, self.due_ns = self.due_ns, None
            self._answer(self._request)
            self._take(done_ns)

    def repeat_toggled(self) -> None:
        """The master has written the activation byte of sync manager 1."""
        if self._outbox.repeat_request == self._outbox.repeat_ack:
            return
        if self._last_sent and not self._outbox.full:
            self._outbox.put(self._last_sent)
        self._outbox.repeat_ack = self._outbox.repeat_request

    def emergency(self, code: int, register: int, data: bytes) -> None:
        """Queue an emergency; it is lost if the mailbox is not open or the queue is full."""
        if self.open and not self.muted and len(self._queue) < _QUEUE_LIMIT:
            self._post(_COE, CoeServer.emergency(code, register, data))

    # -- requests -------------------------------------------------------------------------------

    def _written(self) -> None:
        if self.due_ns is None:
            self._take(self._now_ns)

    def _take(self, now_ns: int) -> None:
        if not self._inbox.full or not self.open:
            return
        message = self._inbox.take()
        counter = message[5] >> 4 & 0x07
        if counter and counter == self._last_counter:
            return
        self._last_counter = counter
        self._request = message
        self.due_ns = now_ns + self.delay_ns
        if not self.delay_ns:
            self.run(now_ns)

    def _answer(self, message: bytes) -> None:
        length, _, _, kind = struct.unpack_from("<HHBB", message)
        if self.muted:
            return
        if length + HEADER > len(message):
            self._error(_INVALID_SIZE)
            return
        payload = message[HEADER : HEADER + length]
        kind &= 0x0F
        try:
            answers = self._dispatch(kind, payload)
        except MailboxError as error:
            self._error(error.detail)
            return
        limit = self.die_after_segments
        if limit is not None and self._coe.segments_answered > limit:
            self.muted = True
            return
        for answer in answers:
            self._post(kind, answer)

    def _dispatch(self, kind: int, payload: bytes) -> list[bytes]:
        if kind == _COE and not self._boot:
            return self._coe.handle(payload)
        if kind == _FOE and self._foe is not None:
            return self._foe.handle(payload)
        raise MailboxError(_UNSUPPORTED)

    def _error(self, detail: int) -> None:
        self._post(_ERROR, struct.pack("<HH", 0x0001, detail))

    # -- answers --------------------------------------------------------------------------------

    def _post(self, kind: int, payload: bytes) -> None:
        self._counter = self._counter % 7 + 1
        header = struct.pack("<HHBB", len(payload), 0, 0, kind | self._counter << 4)
        self._queue.append(header + payload)
        if not self._outbox.full:
            self._send_next()

    def _send_next(self) -> None:
        if self._queue:
            self._last_sent = self._queue.popleft()
            self._outbox.put(self._last_sent)
