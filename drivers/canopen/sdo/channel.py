"""SDO channel of one node: one transfer at a time, safe against late answers.

An SDO answer contains its object but no number of the request. After a time-out the answer may
therefore still come and would match the next read of the same object. So the channel records
unanswered requests, and before the next transfer reads an object that is *not* among them. A server
works in order: once that answer has arrived, all older answers have arrived and been discarded.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import NoReturn, TypeVar

from drivers.canopen.sdo import transfers as sdo
from drivers.errors import DriveError, LinkTimeout, NotAsked, Rejected

T = TypeVar("T")

Send = Callable[[bytes], None]
"""Sends one request frame; raises LinkLost."""

_PROBE = b"\x40\x00\x10\x00" + bytes(4)
"""Read 1000h, which every CANopen device has (CiA 301 clause 7.5.2.1)."""

_BLOCK_ABOVE = 127 * 7
"""Bytes of one full block: below this, segments take hardly longer."""

_BARRIERS = ((0x1000, 0), (0x1001, 0), (0x1018, 1), (0x1018, 2), (0x1018, 3), (0x1018, 4))


class _BlockUnanswered(LinkTimeout):
    """A node without block transfer ignores the request instead of refusing it."""


class SdoChannel:
    """Runs transfers with one node. `run` may be called from any thread and waits for its turn.

    Counters are plain integers, written by one thread at a time and readable from any thread.
    """

    def __init__(self, node: int, send: Send, clock: Callable[[], float] = time.monotonic) -> None:
        self.node = node
        self.transactions = 0
        self.timeouts = 0
        self.late_answers = 0
        self.strays = 0
        """Answers without a request or an earlier time-out: a second node or master on the bus."""
        self.round_trip_s: float | None = None
        self.no_block_transfer = False
        self._send = send
        self._clock = clock
        self._answers: SimpleQueue[bytes | DriveError] = SimpleQueue()
        self._turn = threading.Lock()
        self._unanswered: set[bytes] = set()
        self._tag = 0

    def deliver(self, frame: bytes) -> None:
        """Take an answer frame of this node (called by the receiving thread)."""
        self._answers.put(frame)

    def fail(self, error: DriveError) -> None:
        """End a waiting transfer at once, as the bus is gone (called by the receiving thread)."""
        self._answers.put(error)

    def run(self, transfer: sdo.Transfer[T], timeout_s: float, at_any_rate: bytes = b"") -> T:
        """Run one transfer to its end.

        The frame ``at_any_rate`` (a stop) is sent even if the transfer cannot start: a node that
        does not answer may still receive it. The error is raised nevertheless.

        Raises:
            LinkTimeout: no answer within ``timeout_s`` of a request; the server was sent an abort.
                NotAsked if it had not answered before either; then nothing was requested.
            LinkLost: the bus went down meanwhile.
            Rejected, ProtocolError: see `drivers.canopen.sdo.transfers`.
        """
        with self._turn:
            if self._unanswered:
                try:
                    self._wait_out_late_answers(timeout_s)
                except LinkTimeout:
                    if at_any_rate:
                        self._send(at_any_rate)
                        self._unanswered.add(at_any_rate[1:4])
                    raise
            self._discard_strays()
            self.transactions += 1
            return self._converse(transfer, timeout_s)

    def _converse(self, transfer: sdo.Transfer[T], timeout_s: float) -> T:
        # A transfer keeps the object of its first exchange: segments do not repeat it.
        mux = b"\0\0\0"
        try:
            exchange = next(transfer)
            while True:
                mux = exchange.mux or mux
                started = self._clock()
                for frame in exchange.send:
                    self._send(frame)
                if not exchange.answered:
                    exchange = transfer.send(b"")
                    continue
                answer = self._await(exchange, started + timeout_s)
                if answer is None:
                    self._time_out(exchange, mux, timeout_s)
                self.round_trip_s = self._clock() - started
                exchange = transfer.send(answer)
        except StopIteration as ended:
            result: T = ended.value
            return result
        finally:
            transfer.close()

    def _await(self, exchange: sdo.Exchange, deadline: float) -> bytes | None:
        while True:
            try:
                answer = self._answers.get(timeout=max(deadline - self._clock(), 0.0))
            except Empty:
                return None
            if isinstance(answer, DriveError):
                raise answer
            if sdo.answers(answer, exchange):
                return answer
            self.strays += 1

    def _time_out(self, exchange: sdo.Exchange, mux: bytes, timeout_s: float) -> NoReturn:
        self.timeouts += 1
        opens_block = bool(exchange.send) and exchange.send[0][0] in sdo.BLOCK_REQUESTS
        self._unanswered.add(mux)
        self._send(sdo.abort_frame(mux, sdo.ABORT_TIMED_OUT))
        index, subindex = int.from_bytes(mux[:2], "little"), mux[2]
        kind = _BlockUnanswered if opens_block else LinkTimeout
        raise kind(
            "canopen.node-not-answer-about",
            parameter=f"{index:04X}:{subindex:02X}",
            limit=f"{timeout_s:g} s",
            node=self.node,
            index=index,
            subindex=subindex,
            timeout_s=timeout_s,
        )

    def _wait_out_late_answers(self, timeout_s: float) -> None:
        """Read another object until *its* answer arrives; see the module docstring."""
        index, subindex = self._next_barrier()
        mux = sdo.multiplexer(index, subindex)
        exchange = sdo.Exchange((b"\x40" + mux + bytes(4),), mux)
        self._send(exchange.send[0])
        deadline = self._clock() + timeout_s
        while True:
            try:
                answer = self._answers.get(timeout=max(deadline - self._clock(), 0.0))
            except Empty:
                self._unanswered.add(mux)
                self._still_silent(mux, timeout_s)
            if isinstance(answer, DriveError):
                raise answer
            # An abort without an object could belong to the request that timed out, so it does not
            # count.
            if len(answer) == 8 and answer[1:4] == mux and answer[0] & 0xE0 in (0x40, 0x80):
                break
            self.late_answers += 1
        self._unanswered.clear()
        self._end_segments([answer])

    def _end_segments(self, answers: Sequence[bytes]) -> None:
        """Abort a segmented transfer that these answers to a read began; it would stay open."""
        for answer in answers:
            if answer[0] & 0xE0 == 0x40 and not answer[0] & 0x02:
                self._send(sdo.abort_frame(answer[1:4], sdo.ABORT_GENERAL))
                return

    def _still_silent(self, mux: bytes, timeout_s: float) -> NoReturn:
        self.timeouts += 1
        self._send(sdo.abort_frame(mux, sdo.ABORT_TIMED_OUT))
        raise NotAsked("canopen.node-not-answered-since", limit=f"{timeout_s:g} s", node=self.node)

    def _next_barrier(self) -> tuple[int, int]:
        for index, subindex in self._candidates():
            if sdo.multiplexer(index, subindex) not in self._unanswered:
                return index, subindex
        # A node without power: the one of 255 requests ago, whose answer does not come any more.
        return self._next_missing()

    def _candidates(self) -> Iterator[tuple[int, int]]:
        yield from _BARRIERS
        for _ in range(255):
            yield self._next_missing()

    def _next_missing(self) -> tuple[int, int]:
        """Return a subindex that does not exist: its refusal contains it, as a barrier must."""
        self._tag = self._tag % 255 + 1
        return 0x1000, self._tag

    def _discard_strays(self) -> None:
        while not self._answers.empty():
            if not isinstance(self._answers.get_nowait(), DriveError):
                self.strays += 1

    def read(self, index: int, subindex: int, timeout_s: float) -> bytes:
        """Read an object; long ones by block transfer if the node supports it."""
        if not self.no_block_transfer:
            try:
                return self.run(sdo.upload(index, subindex, _BLOCK_ABOVE), timeout_s)
            except _BlockUnanswered:
                self.no_block_transfer = True
        return self.run(sdo.upload(index, subindex), timeout_s)

    def write(
        self,
        index: int,
        subindex: int,
        data: bytes,
        timeout_s: float,
        *,
        at_any_rate: bool = False,
    ) -> None:
        """Write an object; long ones by block transfer if the node supports it.

        ``at_any_rate`` as in `run`, for data of up to four bytes.
        """
        if len(data) > _BLOCK_ABOVE and not self.no_block_transfer:
            # Both refusals come before any data were sent, so the segments afterwards do not write
            # twice.
            try:
                return self.run(sdo.block_download(index, subindex, data), timeout_s)
            except _BlockUnanswered:
                self.no_block_transfer = True
            except Rejected as refusal:
                if refusal.abort_code != sdo.ABORT_COMMAND:
                    raise
                self.no_block_transfer = True
        stop = sdo.expedited(index, subindex, data) if at_any_rate else b""
        return self.run(sdo.download(index, subindex, data), timeout_s, stop)

    def begin_probe(self) -> None:
        """Occupy the node and request its device type; `end_probe` must follow."""
        self._turn.acquire()
        self._discard_strays()
        try:
            self._send(_PROBE)
        except DriveError:
            self._turn.release()
            raise

    def end_probe(self) -> list[bytes]:
        """Return all answers to the probe (more than one: several nodes) and release the node."""
        answers: list[bytes] = []
        try:
            while True:
                answer = self._answers.get_nowait()
                if not isinstance(answer, DriveError) and answer[1:4] == _PROBE[1:4]:
                    answers.append(answer)
        except Empty:
            if not answers:
                self._unanswered.add(_PROBE[1:4])
            # Without the adapter there is nothing to abort, and other nodes must still be released.
            with suppress(DriveError):
                self._end_segments(answers)
            return answers
        finally:
            self._turn.release()
