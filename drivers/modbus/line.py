"""Master of one serial line: one request, one answer, one thread.

Blocking code; `drivers.modbus.link.RegisterLink` runs it on the bus's thread. Nothing is repeated
here, because only the caller knows whether a repetition is harmless.

After a failed request its answer may still come; `drivers.modbus.late` prevents it from being
mistaken for another one.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import NoReturn

from drivers.errors import DriveError, LinkLost, LinkTimeout, ProtocolError, Rejected
from drivers.flight.kinds import serial_ring
from drivers.flight.serial import RecordedPort
from drivers.link import LinkQuality
from drivers.modbus.framing import (
    EXCEPTION_TEXTS,
    READ,
    UNKNOWN_EXCEPTION,
    Answer,
    Query,
    find_answer,
    read_query,
    write_many_query,
    write_one_query,
)
from drivers.modbus.held_back import HeldBack
from drivers.modbus.late import LateAnswers
from drivers.modbus.port import LineSettings, Port, is_pseudo_terminal, open_port
from drivers.modbus.timing import sleep_precisely
from drivers.texts.message import Text, text

#: A line that sends longer than this without a pause is not a Modbus line at these settings.
_BABBLE_S = 1.0


@dataclass(slots=True)
class Counters:
    """Counters of one station since the line was first opened."""

    transactions: int = 0
    timeouts: int = 0
    crc_errors: int = 0
    framing_errors: int = 0
    retries: int = 0
    refusals: int = 0
    late_checks: int = 0
    late_answers: int = 0
    round_trip_ms: float | None = None


class Line:
    """Master of one serial line. Not thread-safe: one thread calls it.

    ``on_change`` receives loss (False) and return (True) of the adapter, on the line's thread.
    ``clock`` and ``sleep`` use seconds; ``opener`` creates the port: tests replace them.
    """

    def __init__(
        self,
        settings: LineSettings,
        *,
        on_change: Callable[[bool, Text], None] = lambda _up, _text: None,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = sleep_precisely,
        opener: Callable[[LineSettings], Port] = open_port,
    ) -> None:
        self.settings = settings
        self.echo: bool | None = None
        self.losses = 0
        self.strays = 0
        """Number of times that data without a matching request arrived, such as a late answer."""
        self._on_change = on_change
        self._clock = clock
        self._sleep = sleep
        self._opener = opener
        self._port: Port | None = None
        self.ring = serial_ring(settings.device)
        self._parity: str = settings.parity
        self._counters: dict[int, Counters] = {}
        self._late: dict[int, LateAnswers] = {}
        self._last_failed = b""
        self._restless = False
        self._echo_taken = False
        self._quiet_since = 0.0
        self._held_back = HeldBack()

    @property
    def is_open(self) -> bool:
        """True while the adapter is available."""
        return self._port is not None

    def open(self) -> None:
        """Open the adapter.

        Raises:
            LinkLost: no such port, no permission, in use.
            OutOfRange: the adapter does not support these settings.
        """
        if self._port is not None:
            return
        self._port = RecordedPort(self._opener(self.settings), self.ring)
        if is_pseudo_terminal(self.settings.device):
            self._parity = "none (pseudo-terminal)"
        self.echo = None
        self._held_back.clear()
        self._late.clear()
        self._last_failed = b""
        self._restless = True  # old bytes may be waiting

    def close(self) -> None:
        """Close the adapter. Further calls have no effect."""
        if self._port is not None:
            self._port.close()
            self._port = None

    def reopen(self) -> bool:
        """Try to reopen a lost adapter; return whether it is open now."""
        if self._port is None:
            try:
                self.open()
            except DriveError:
                return False
            self._on_change(True, text("event.serial-port-back", device=self.settings.device))
        return True

    def read(self, station: int, start: int, count: int, timeout_s: float | None = None) -> bytes:
        """Read ``count`` registers; return 2 · count bytes, each register high byte first.

        Raises:
            LinkTimeout, LinkLost, ProtocolError (damaged answer), Rejected, OutOfRange
        """
        return self._ask(read_query(station, start, count), timeout_s)[3:-2]

    def seek(self, station: int, start: int, count: int, timeout_s: float) -> bytes:
        """Read as `read`, at an address that may be unused.

        The silence of an address that never answered is not a fault of the line and is not counted.
        """
        counters = self._count(station)
        before = replace(counters)
        try:
            return self.read(station, start, count, timeout_s)
        except LinkTimeout:
            if counters.round_trip_ms is None:
                self._counters[station] = before
            raise

    def write(
        self, station: int, start: int, words: tuple[int, ...], *, at_any_rate: bool = False
    ) -> None:
        """Write one register (06) or several at once (16).

        With ``at_any_rate`` (a stop) it is sent even if the preceding check fails: a drive whose
        answers do not come, or come too late, may still receive it. The error is raised
        nevertheless.

        Raises:
            LinkTimeout: no valid answer; whether the drive accepted the value is unknown.
            LinkLost, Rejected, OutOfRange
        """
        if len(words) == 1:
            query = write_one_query(station, start, words[0])
        else:
            query = write_many_query(station, start, words)
        try:
            self._ask(query, None, at_any_rate=at_any_rate)
        except ProtocolError as error:
            raise LinkTimeout("modbus.answer-station-write-came", station=station) from error

    def count_retry(self, station: int) -> None:
        """Count a read that the caller repeats."""
        self._count(station).retries += 1

    def quality(self, station: int | None) -> LinkQuality:
        """Return the counters of one station or of all. Callable from any thread."""
        if station is None:
            picked = list(self._counters.values())
        else:
            picked = [self._counters.get(station, Counters())]
        times = [c.round_trip_ms for c in picked if c.round_trip_ms is not None]
        echo = {None: "unknown", True: "yes", False: "no"}[self.echo]
        held_s = self._held_back.timer_s() if self.is_open else None
        return LinkQuality(
            connected=self.is_open,
            transactions=sum(c.transactions for c in picked),
            timeouts=sum(c.timeouts for c in picked),
            crc_errors=sum(c.crc_errors for c in picked),
            framing_errors=sum(c.framing_errors for c in picked),
            retries=sum(c.retries for c in picked),
            round_trip_ms=sum(times) / len(times) if times else None,
            state=self._state(held_s),
            details={
                "baudrate": self.settings.baudrate,
                "parity": self._parity,
                "echo": echo,
                "losses": self.losses,
                "refusals": sum(c.refusals for c in picked),
                "late_checks": sum(c.late_checks for c in picked),
                "late_answers": sum(c.late_answers for c in picked),
                **({} if held_s is None else {"held_back_ms": round(held_s * 1000, 1)}),
            },
        )

    def _state(self, held_s: float | None) -> Text:
        if not self.is_open:
            return text("link.no-adapter")
        if held_s is None:
            return text("link.open")
        return text("link.held-back", held_ms=held_s * 1000, reads=1 / held_s)

    # --- one transaction ---

    def _ask(self, query: Query, timeout_s: float | None, *, at_any_rate: bool = False) -> bytes:
        if self._port is None:
            raise LinkLost("modbus.serial-port-not-open", device=self.settings.device)
        try:
            late = self._late.get(query.station)
            if late is None:
                late = self._late[query.station] = LateAnswers()
            try:
                self._clear_the_way(self._port, late, query, timeout_s)
            except (LinkTimeout, ProtocolError):
                if at_any_rate:
                    self._port.write(query.frame)
                    late.failed(query, self._clock() + self.settings.late_s)
                raise
            return self._exchange(self._port, late, query, timeout_s)
        except LinkLost as error:
            self._port.close()
            self._port = None
            self.losses += 1
            self._on_change(False, error.text)
            raise

    def _exchange(
        self, port: Port, late: LateAnswers, query: Query, timeout_s: float | None
    ) -> bytes:
        settings = self.settings
        pause = self._quiet_since + settings.pause_s - self._clock()
        if pause > 0:
            self._sleep(pause)
        sent_at = self._clock()
        self._echo_taken = False
        port.write(query.frame)
        wire_s = (len(query.frame) + query.length) * settings.char_s
        limit_s = settings.timeout_s if timeout_s is None else timeout_s
        answer, received = self._await(port, late, query, sent_at + wire_s + limit_s)
        counters = self._count(query.station)
        counters.transactions += 1
        counters.crc_errors += answer.crc_errors
        self._quiet_since = self._clock()
        if answer.frame is None:
            late.failed(query, self._clock() + settings.late_s)
            self._fail(query, answer, received, counters, limit_s)
        self._accept(answer, received, counters, sent_at)
        self._held_back.add(wire_s, self._quiet_since - sent_at)
        code = answer.exception
        if code is not None:
            counters.refusals += 1
            why = EXCEPTION_TEXTS.get(code, UNKNOWN_EXCEPTION)
            raise Rejected(
                "modbus.station-exception",
                abort_code=code,
                remedy=why.remedy(),
                station=query.station,
                text=why,
                number=code,
            )
        late.answered(query)
        return answer.frame

    def _await(
        self, port: Port, late: LateAnswers, query: Query, deadline: float
    ) -> tuple[Answer, bytes]:
        """Collect bytes until the answer is complete or cannot come any more."""
        data = port.read(deadline - self._clock())
        if self.echo is False and len(data) == query.length:
            answer = find_answer(data, query)  # the usual case: one portion, nothing else
            if answer.frame is not None:
                return answer, data
        buffer = bytearray(data)
        while True:
            self._cut_echo(buffer, query)
            self._count(query.station).late_answers += late.cut(buffer, query)
            answer = find_answer(buffer, query)
            if answer.frame is not None:
                return answer, bytes(buffer)
            left = deadline - self._clock()
            own_echo_due = self.echo and not self._echo_taken
            if not own_echo_due and _looks_damaged(buffer, query, answer):
                left = min(left, self.settings.gap_s)
            # Data that arrived while this computer was stalled are still accepted.
            data = port.read(max(left, 0.0)) if left > -_BABBLE_S else b""
            if not data:
                return answer, bytes(buffer)
            buffer += data

    def _cut_echo(self, buffer: bytearray, query: Query) -> None:
        """Remove our own bytes if the adapter echoes them (two-wire RS485)."""
        if self.echo is False or not buffer:
            return
        place = buffer.find(query.frame)
        if place < 0:
            return
        if self.echo is None and query.frame[1] == READ:
            self.echo = True
        if self.echo and not self._echo_taken:
            del buffer[: place + len(query.frame)]
            self._echo_taken = True

    def _fail(
        self, query: Query, answer: Answer, received: bytes, counters: Counters, limit_s: float
    ) -> NoReturn:
        """Count the failure and raise its error."""
        self._last_failed = query.frame
        if received:
            self._restless = True
            self.strays += 1
            counters.framing_errors += not answer.crc_errors
            shown = received[:24].hex(" ") + (" …" if len(received) > 24 else "")
            raise ProtocolError(
                "modbus.station-sent-damaged-answer", station=query.station, shown=shown
            )
        counters.timeouts += 1
        only_echo = text("modbus.only-echo") if self.echo else ""
        raise LinkTimeout(
            "modbus.station-not-answer-within",
            station=query.station,
            limit_ms=limit_s * 1000,
            only_echo=only_echo,
        )

    def _accept(self, answer: Answer, received: bytes, counters: Counters, sent_at: float) -> None:
        self._last_failed = b""
        if self.echo is None:
            self.echo = False
        if answer.start or answer.end != len(received):
            counters.framing_errors += 1
            self.strays += 1
            self._restless = self._restless or answer.end != len(received)
        took_ms = (self._quiet_since - sent_at) * 1000
        old = counters.round_trip_ms
        counters.round_trip_ms = took_ms if old is None else old + (took_ms - old) / 16

    # --- what must be done before a question ---

    def _clear_the_way(
        self, port: Port, late: LateAnswers, query: Query, timeout_s: float | None
    ) -> None:
        """Make sure that what follows the request is its answer."""
        self._settle(port)
        same_read_again = query.frame[1] == READ and query.frame == self._last_failed
        if late.pending(self._clock()) and not same_read_again:
            self._outwait(port, late, query, timeout_s)
        check = late.check(query) if self.echo is None and query.frame[1] != READ else None
        if check is not None:
            with suppress(Rejected):
                self._exchange(port, late, check, timeout_s)

    def _settle(self, port: Port) -> None:
        """Discard stray bytes; if there were any, wait until the line is silent."""
        if not self._restless:
            if not port.read(0.0):
                return
            self.strays += 1
        until = self._clock() + _BABBLE_S
        pause = 0.0 if not self._counters else self.settings.gap_s
        while port.read(pause):
            pause = self.settings.gap_s
            if self._clock() > until:
                raise ProtocolError("modbus.line-never-falls-silent", device=self.settings.device)
        self._restless = False
        self._quiet_since = self._clock()

    def _outwait(
        self, port: Port, late: LateAnswers, query: Query, timeout_s: float | None
    ) -> None:
        """Make sure that no late answer can be mistaken for the one to ``query``.

        Raises:
            LinkTimeout: no answer to the check, or no conclusive one; the request was not sent.
        """
        for choose in (late.check, late.second_check):
            check = choose(query)
            if check is None:
                break
            self._count(query.station).late_checks += 1
            try:
                self._exchange(port, late, check, timeout_s)
            except Rejected:
                if not late.refusal_proves(check):
                    late.failed(check, self._clock() + self.settings.late_s)
                    continue
            late.clear()
            self._settle(port)
            return
        raise LinkTimeout(
            "modbus.station-answers-too-late", station=query.station, late_s=self.settings.late_s
        )

    def _count(self, station: int) -> Counters:
        return self._counters.setdefault(station, Counters())


def _looks_damaged(buffer: bytearray, query: Query, answer: Answer) -> bool:
    """Return whether the data are a damaged answer, not just noise before one."""
    return bool(answer.crc_errors) or len(buffer) >= query.length or buffer.startswith(query.head)
