"""Answers by SOEM's four-bit index: old ones are never used once frames were lost in a row."""

from __future__ import annotations

from collections import deque

import pysoem
import pytest

from drivers.ethercat.process.library_wire import LibraryWire
from drivers.ethercat.wire.steps import Read, Write

INDICES = 16
"""SOEM's EC_MAXBUF."""
MEMORY = {0x0000: b"\x11\x00", 0x0010: b"\x01\x10", 0x0130: b"\x02\x00", 0x0134: b"\x00\x00"}


PATIENCE_US = 2000
MAILBOX = Read(0x1100, 128, may_be_empty=True)


class Queue:
    """One slave behind SOEM's buffers: answers lie in order, and those of another index than the
    one that is waited for are dropped (ecx_inframe). What is not answered costs the time-out.

    As pysoem 1.1.13, it does not state the working counter.
    """

    def __init__(self) -> None:
        self.now = 0.0
        self._index = 0
        self._answers: deque[tuple[int, bytes | None]] = deque()
        self._delayed: deque[tuple[int, bytes | None]] = deque()
        self.delay = False
        self.gone = False
        self.writes: list[tuple[int, bytes]] = []

    def deliver(self) -> None:
        """What was delayed arrives at once."""
        self._answers.extend(self._delayed)
        self._delayed.clear()

    def _fprd(self, address: int, size: int, timeout_us: int) -> bytes:
        return self._asked(MEMORY.get(address), timeout_us)[:size]

    def _fpwr(self, address: int, data: bytes, timeout_us: int) -> None:
        self.writes.append((address, data))
        self._asked(b"", timeout_us)

    def _asked(self, answer: bytes | None, timeout_us: int) -> bytes:
        self._index = (self._index + 1) % INDICES
        if not self.gone:
            (self._delayed if self.delay else self._answers).append((self._index, answer))
        while self._answers:
            index, data = self._answers.popleft()
            if index == self._index:
                if data is None:
                    break
                return data
        else:
            self.now += timeout_us * 1e-6
        raise pysoem.WkcError


def wire(queue: Queue) -> LibraryWire:
    coin = iter([True, False, True, True, False] * 1000).__next__
    made = LibraryWire(coin, lambda: queue.now)
    made.found([queue], PATIENCE_US)
    return made


def read(made: LibraryWire, register: int) -> bytes | None:
    return made.exchange([(1, Read(register, 2))], PATIENCE_US)[0]


def test_the_model_shows_what_is_guarded_against() -> None:
    """Without the guard each request would be answered by one that is 16 old, for ever."""
    queue = Queue()
    queue.delay = True
    for _ in range(INDICES):
        with pytest.raises(pysoem.WkcError):
            queue._fprd(0x0134, 2, 0)
    queue.delay = False
    queue.deliver()
    for _ in range(50):
        assert queue._fprd(0x0130, 2, 0) in (MEMORY[0x0134], MEMORY[0x0130])
    queue._fprd(0x0134, 2, 0)
    assert queue._fprd(0x0130, 2, 0) == MEMORY[0x0130]


def test_single_lost_frames_are_no_matter() -> None:
    queue = Queue()
    made = wire(queue)
    for _ in range(5):
        queue.delay = True
        assert read(made, 0x0134) is None
        assert made.silent
        queue.delay = False
        queue.deliver()
        assert read(made, 0x0130) == MEMORY[0x0130]
        assert not made.silent
    assert not made.mixed_up


def test_old_answers_after_a_pause_are_not_used() -> None:
    queue = Queue()
    made = wire(queue)
    queue.delay = True
    for _ in range(INDICES):
        assert read(made, 0x0134) is None
    queue.delay = False
    queue.deliver()
    seen = [read(made, 0x0130) for _ in range(60)]
    assert set(seen) <= {None, MEMORY[0x0130]}
    assert made.mixed_up or seen[-1] == MEMORY[0x0130]


def test_answers_are_used_again_after_a_cable_is_mended() -> None:
    queue = Queue()
    made = wire(queue)
    queue.gone = True
    for _ in range(40):
        assert read(made, 0x0130) is None
    queue.gone = False
    assert read(made, 0x0130) == MEMORY[0x0130]
    assert not made.mixed_up


def test_nothing_is_written_before_answers_are_proven() -> None:
    queue = Queue()
    made = wire(queue)
    queue.gone = True
    for _ in range(40):
        read(made, 0x0130)
    assert made.exchange([(1, Write(0x0120, b"\x02\0"))], PATIENCE_US) == [None]
    assert queue.writes == []


def test_an_empty_mailbox_is_no_lost_frame() -> None:
    queue = Queue()
    made = wire(queue)
    for _ in range(40):
        assert made.exchange([(1, MAILBOX)], PATIENCE_US) == [b""]
        assert not made.silent
    queue.gone = True
    assert made.exchange([(1, MAILBOX)], PATIENCE_US) == [None]
    assert made.silent


def test_after_a_lost_frame_nothing_more_is_sent_in_its_turn() -> None:
    queue = Queue()
    made = wire(queue)
    queue.gone = True
    accesses = [(1, Read(0x0130, 2)), (1, Write(0x0120, b"\x02\0"))]
    assert made.exchange(accesses, PATIENCE_US) == [None, None]
    assert queue.writes == []
    assert queue.now == pytest.approx(PATIENCE_US * 1e-6)


def test_stations_that_no_search_found_do_not_answer() -> None:
    assert wire(Queue()).exchange([(2, Read(0x0130, 2))], PATIENCE_US) == [None]
