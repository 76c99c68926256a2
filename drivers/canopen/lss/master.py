"""Master side of the layer setting services, for a worker thread.

Each service leaves all slaves in the waiting state. Source: CiA 305 v3.0.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from queue import Empty, SimpleQueue

from drivers.canopen.lss import codes
from drivers.canopen.lss.codes import LssIdentity
from drivers.errors import LinkTimeout, NotAllowed, OutOfRange

_ANSWER_S = 0.1
"""Time-out [s], not set by CiA 305; slaves take some ms, and each bit of a scan one such time."""
_LATE_ANSWER_S = 0.5
"""Time-out [s] for a scan that lost its node: covers delays in an adapter or a computer."""
_STORE_S = 2.0
_OUT_OF_RANGE, _NOT_SUPPORTED = 1, 1
_PARTS = 4


class LssMaster:
    """One master on one bus; ``send`` sends a frame with the master's identifier."""

    def __init__(
        self,
        send: Callable[[bytes], None],
        answer_s: float = _ANSWER_S,
        late_answer_s: float = _LATE_ANSWER_S,
    ) -> None:
        self._send = send
        self._answer_s = answer_s
        self._late_answer_s = late_answer_s
        self._answers: SimpleQueue[bytes] = SimpleQueue()
        self._turn = threading.Lock()

    def deliver(self, data: bytes) -> None:
        """Take a frame with the slaves' identifier (called on the receiving thread)."""
        if len(data) == 8:
            self._answers.put(data)

    def unconfigured(self) -> bool:
        """Return whether at least one node without node-ID is on the bus.

        Raises:
            LinkLost: the adapter is gone.
        """
        with self._turn:
            self._wait_all()
            request = codes.frame(codes.IDENTIFY_UNCONFIGURED)
            return bool(self._ask(request, codes.UNCONFIGURED))

    def find(self, progress: Callable[[float], None]) -> LssIdentity | None:
        """Find the identity of one node without node-ID, bit by bit; None if there is none.

        Of several nodes the one with the smallest numbers is found.

        Raises:
            LinkTimeout: a node stopped answering, or does not support fast scan.
            LinkLost: the adapter is gone.
        """
        with self._turn:
            try:
                return self._scan(progress, self._answer_s)
            except LinkTimeout:
                # A missing answer is a bit of the number: a late answer resulted in a wrong number.
                return self._scan(progress, self._late_answer_s)

    def _scan(self, progress: Callable[[float], None], answer_s: float) -> LssIdentity | None:
        def recognised(number: int, bit: int, part: int, following: int) -> bool:
            request = codes.fastscan(number, bit, part, following)
            return bool(self._ask(request, codes.IDENTIFIED, within_s=answer_s))

        self._wait_all()
        if not recognised(0, codes.RESET_SCAN, 0, 0):
            return None
        parts: list[int] = []
        for part in range(_PARTS):
            number = 0
            for bit in range(31, -1, -1):
                progress((part * 32 + 31 - bit) / (32 * _PARTS))
                if not recognised(number, bit, part, part):
                    number |= 1 << bit
            if not recognised(number, 0, part, (part + 1) % _PARTS):
                self._wait_all()
                raise LinkTimeout("canopen.lss-scan-lost", part=part + 1)
            parts.append(number)
        self._wait_all()
        return LssIdentity(*parts)

    def only_node(self) -> tuple[LssIdentity, int | None] | None:
        """Return identity and node-ID of the only node with these services; None if there is none.

        Raises:
            NotAllowed: several answer.
            LinkTimeout: it answers only in part.
        """
        with self._turn:
            self._send(codes.frame(codes.SWITCH_ALL, codes.CONFIGURATION))
            try:
                return self._inquired()
            finally:
                self._wait_all()

    def _inquired(self) -> tuple[LssIdentity, int | None] | None:
        found: list[int] = []
        for command in codes.INQUIRE:
            answers = self._ask(codes.frame(command), command, everybody=True)
            if len(answers) > 1:
                raise NotAllowed("canopen.lss-several", nodes=len(answers))
            if not answers and not found:
                return None
            if not answers:
                raise LinkTimeout("canopen.lss-no-answer")
            found.append(codes.number_of(answers[0]))
        answers = self._ask(codes.frame(codes.INQUIRE_NODE_ID), codes.INQUIRE_NODE_ID)
        node = answers[0][1] if answers else None
        known = None if node == codes.NO_NODE_ID else node
        return LssIdentity(*found), known

    def set_node(self, identity: LssIdentity, node: int, *, store: bool) -> None:
        """Set the node-ID of a node; a node without one uses it at once.

        Raises:
            OutOfRange: not 1 to 127, or the node refuses the number.
            NotAllowed: it cannot store it.
            LinkTimeout: no node with this identity answers.
        """
        if not 1 <= node <= 127:
            raise OutOfRange("canopen.not-canopen-node-number", value=node, limit="1…127")
        with self._turn:
            self._select(identity)
            try:
                code = self._result(codes.frame(codes.NODE_ID, node), codes.NODE_ID)
                if code:
                    raise OutOfRange("canopen.lss-node-refused", value=node, error_code=code)
                if store:
                    self._store()
            finally:
                self._wait_all()

    def set_bit_rate(self, identity: LssIdentity, kbit: int, *, store: bool) -> None:
        """Set a node's bit rate [kbit/s]; it takes effect after a power cycle of the node.

        Raises:
            OutOfRange: not a bit rate of CiA 305, or not supported by the node.
            NotAllowed: the node cannot store it.
            LinkTimeout: no node with this identity answers.
        """
        index = codes.BIT_RATES_KBIT.get(kbit)
        if index is None:
            known = ", ".join(str(rate) for rate in codes.BIT_RATES_KBIT)
            raise OutOfRange("canopen.lss-no-bit-rate", value=kbit, limit=f"{known} kbit/s")
        with self._turn:
            self._select(identity)
            try:
                code = self._result(codes.frame(codes.BIT_TIMING, 0, index), codes.BIT_TIMING)
                if code:
                    raise OutOfRange("canopen.lss-rate-refused", value=kbit, error_code=code)
                if store:
                    self._store()
            finally:
                self._wait_all()

    def _select(self, identity: LssIdentity) -> None:
        self._wait_all()
        for command, number in zip(codes.SELECT[:-1], identity, strict=False):
            self._send(codes.with_number(command, number))
        last = codes.with_number(codes.SELECT[-1], identity.serial)
        if not self._ask(last, codes.SELECTED):
            raise LinkTimeout("canopen.lss-not-found", serial=identity.serial)

    def _store(self) -> None:
        code = self._result(codes.frame(codes.STORE), codes.STORE, _STORE_S)
        if code:
            known = "canopen.lss-cannot-store" if code == _NOT_SUPPORTED else "canopen.lss-store"
            raise NotAllowed(known, error_code=code)

    def _result(self, request: bytes, command: int, within_s: float | None = None) -> int:
        answers = self._ask(request, command, within_s=within_s)
        if not answers:
            raise LinkTimeout("canopen.lss-no-answer")
        return answers[0][1]

    def _wait_all(self) -> None:
        self._send(codes.frame(codes.SWITCH_ALL, codes.WAITING))

    def _ask(
        self,
        request: bytes,
        command: int,
        *,
        everybody: bool = False,
        within_s: float | None = None,
    ) -> list[bytes]:
        """Return the answers with this command; with ``everybody`` all that arrive in time."""
        while not self._answers.empty():
            self._answers.get()
        self._send(request)
        found: list[bytes] = []
        deadline = time.monotonic() + (self._answer_s if within_s is None else within_s)
        while (left_s := deadline - time.monotonic()) > 0:
            try:
                answer = self._answers.get(timeout=left_s)
            except Empty:
                break
            if answer[0] == command:
                found.append(answer)
                if not everybody:
                    break
        return found
