"""A mailbox slave of scripted bytes, written from ETG.1000.4 and not from our own slave."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field

from drivers.ethercat.wire.mailbox import Mailbox
from drivers.ethercat.wire.steps import Read, Write
from tests.wire.ethercat_host.by_hand import ByHand

OUT, IN = 0x1000, 0x1100


def coe(service: int, data: bytes) -> bytes:
    return struct.pack("<H", service << 12) + data


def mail(payload: bytes, protocol: int = 3, counter: int = 1) -> bytes:
    return struct.pack("<HHBB", len(payload), 0, 0, protocol | counter << 4) + payload


@dataclass
class ScriptedSlave(ByHand):
    """``react`` turns a request payload into answer payloads; a clock ticks 50 µs a frame."""

    react: Callable[[bytes], list[bytes]]
    size: int = 128
    """Of the mailbox to the slave; the one from it has ``answer_size``, or the same."""
    answer_size: int = 0
    now: float = 0.0
    delay_s: float = 0.0
    alive: bool = True
    lose: set[int] = field(default_factory=set)
    """Numbers of frames (from 0) that arrive at the slave but do not come back."""
    frames: int = 0
    requests: list[bytes] = field(default_factory=list)
    counters: list[int] = field(default_factory=list)
    waiting: list[tuple[float, bytes]] = field(default_factory=list)
    last: bytes = b""
    emergencies: list[bytes] = field(default_factory=list)
    repeat: int = 0
    counts: bool = True
    """It numbers its own mails."""
    sent: int = 0

    def box(self, timeout_s: float = 1.0) -> Mailbox:
        return Mailbox(
            OUT,
            self.size,
            IN,
            self.answer_size or self.size,
            lambda: self.now,
            self.emergencies.append,
            timeout_s,
        )

    def queue(self, payload: bytes, protocol: int = 3, delay_s: float = 0.0) -> None:
        self.sent = self.sent % 7 + 1
        counter = self.sent if self.counts else 0
        self.waiting.append((self.now + delay_s, mail(payload, protocol, counter)))

    def frame(self, step: Read | Write) -> bytes | None:
        self.now += 50e-6
        number, self.frames = self.frames, self.frames + 1
        answer = self._access(step) if self.alive else None
        return None if number in self.lose else answer

    def _access(self, step: Read | Write) -> bytes | None:
        ready = bool(self.waiting) and self.waiting[0][0] <= self.now
        if isinstance(step, Write):
            if step.register == OUT:
                assert len(step.data) == self.size, "only the last byte of a mailbox sends it"
                length = int.from_bytes(step.data[:2], "little")
                counter = step.data[5] >> 4
                if self.counters and counter == self.counters[-1]:
                    return b""  # ETG.1000.4 clause 5.6: the same counter is a repeated mail
                self.counters.append(counter)
                payload = step.data[6 : 6 + length]
                self.requests.append(payload)
                for answer in self.react(payload):
                    self.queue(answer, step.data[5] & 0x0F, self.delay_s)
            elif step.register == 0x80E and step.data[0] & 2 != self.repeat:
                self.repeat = step.data[0] & 2
                self.waiting.insert(0, (self.now, self.last))
            return b""
        if step.register == 0x805:
            return b"\0"
        if step.register == 0x80D:
            return b"\x08" if ready else b"\0"
        if step.register in (0x80E, 0x80F):
            return bytes([self.repeat | 1])
        size = self.answer_size or self.size
        assert step[:2] == (IN, size)
        if not ready:
            return b"" if step.may_be_empty else None
        self.last = self.waiting.pop(0)[1]
        assert len(self.last) <= size
        return self.last.ljust(size, b"\0")
