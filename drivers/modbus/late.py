"""Answers that may still come after their time-out, and how to be sure that they no longer can.

Modbus RTU answers carry no number: one that comes too late looks like the answer to the next
question of the same shape, and a late refusal looks like a refusal of the next question. After
a failed question, therefore, a check is asked first: a harmless read whose answer has a shape
that nothing outstanding has. Drives answer in order, so once it has come, nothing older can
follow. Where the check is refused, that proves something only if nothing outstanding could have
been refused in the same way; the second check is then a read of another function (04).
"""

from __future__ import annotations

from dataclasses import dataclass

from drivers.modbus.framing import READ, READ_INPUT, Query, find_answer, read_query

_FRAMES_KEPT = 4096


@dataclass(frozen=True, slots=True)
class _Outstanding:
    query: Query
    expiry_s: float
    may_be_refused: bool


class LateAnswers:
    """Book-keeping for one station. Times are the line's clock in seconds."""

    def __init__(self) -> None:
        self._outstanding: dict[bytes, _Outstanding] = {}
        self._good: dict[bytes, Query] = {}
        self._good_frames: set[bytes] = set()

    def answered(self, query: Query) -> None:
        """Remember a read that this drive answers with values: it makes a good check."""
        if query.frame[1] == READ and query.frame not in self._good_frames:
            if len(self._good_frames) >= _FRAMES_KEPT:
                self._good_frames.clear()
            self._good_frames.add(query.frame)
            self._good[query.head] = query

    def failed(self, query: Query, expiry_s: float) -> None:
        """No good answer came to ``query``; it may still come until ``expiry_s``."""
        may_be_refused = query.frame not in self._good_frames
        self._outstanding[query.head] = _Outstanding(query, expiry_s, may_be_refused)

    def pending(self, now_s: float) -> bool:
        """True if something may still come."""
        if not self._outstanding:
            return False
        for head in [h for h, item in self._outstanding.items() if item.expiry_s <= now_s]:
            del self._outstanding[head]
        return bool(self._outstanding)

    def check(self, near: Query) -> Query:
        """A read whose answer looks different from all that may come, best one known to work."""
        for head, query in self._good.items():
            if head not in self._outstanding:
                return query
        return self._unlike(near, READ)

    def second_check(self, near: Query) -> Query:
        """A read whose refusal, too, looks different: many drives do not know function 04."""
        return self._unlike(near, READ_INPUT)

    def _unlike(self, near: Query, function: int) -> Query:
        start = min(int.from_bytes(near.frame[2:4], "big"), 0xFF00)
        shapes = (read_query(near.station, start, count, function) for count in range(1, 126))
        return next(query for query in shapes if query.head not in self._outstanding)

    def refusal_proves(self, check: Query) -> bool:
        """True if this refusal can only be that of ``check``."""
        return not any(
            item.may_be_refused and item.query.refusal == check.refusal
            for item in self._outstanding.values()
        )

    def clear(self) -> None:
        """Nothing can come any more."""
        self._outstanding.clear()

    def cut(self, buffer: bytearray, query: Query) -> int:
        """Remove late answers from the bytes that came after ``query``; returns how many."""
        removed = 0
        for head, item in self._outstanding.items():
            if head == query.head:
                continue
            answer = find_answer(buffer, item.query)
            alike = answer.exception is not None and item.query.refusal == query.refusal
            if answer.frame is not None and not alike:
                del buffer[answer.start : answer.end]
                removed += 1
        return removed
