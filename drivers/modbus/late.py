"""Late answers after a time-out, and how to make sure that none can come any more.

Modbus RTU answers carry no number: a late one looks like the answer to the next request of the same
form, and a late refusal looks like a refusal of the next request. After a failed request,
therefore, a check is sent first: a harmless read whose answer has a form that no outstanding answer
has. Drives answer in order, so once it has arrived, nothing older can follow. If the check is
refused, that is conclusive only if nothing outstanding could have been refused in the same form;
the second check is then a read of another function (04).
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
    """Records the late answers of one station. Times are the line's clock in seconds."""

    def __init__(self) -> None:
        self._outstanding: dict[bytes, _Outstanding] = {}
        self._good: dict[bytes, Query] = {}
        self._good_frames: set[bytes] = set()

    def answered(self, query: Query) -> None:
        """Record a read that this drive answers with values: it is a suitable check."""
        if query.frame[1] == READ and query.frame not in self._good_frames:
            if len(self._good_frames) >= _FRAMES_KEPT:
                self._good_frames.clear()
            self._good_frames.add(query.frame)
            self._good[query.head] = query

    def failed(self, query: Query, expiry_s: float) -> None:
        """Record that ``query`` had no good answer; it may still come until ``expiry_s``."""
        may_be_refused = query.frame not in self._good_frames
        self._outstanding[query.head] = _Outstanding(query, expiry_s, may_be_refused)

    def pending(self, now_s: float) -> bool:
        """Return whether an answer may still come."""
        if not self._outstanding:
            return False
        for head in [h for h, item in self._outstanding.items() if item.expiry_s <= now_s]:
            del self._outstanding[head]
        return bool(self._outstanding)

    def check(self, near: Query) -> Query | None:
        """Return a read whose answer differs from all that may come, if possible a proven one.

        None if answers of every length may come, as many requests had none within a short time.
        """
        for head, query in self._good.items():
            if head not in self._outstanding:
                return query
        return self._unlike(near, READ)

    def second_check(self, near: Query) -> Query | None:
        """Return a read whose refusal differs, too: many drives do not know function 04."""
        return self._unlike(near, READ_INPUT)

    def _unlike(self, near: Query, function: int) -> Query | None:
        start = min(int.from_bytes(near.frame[2:4], "big"), 0xFF00)
        shapes = (read_query(near.station, start, count, function) for count in range(1, 126))
        return next((query for query in shapes if query.head not in self._outstanding), None)

    def refusal_proves(self, check: Query) -> bool:
        """Return whether this refusal can only be that of ``check``."""
        return not any(
            item.may_be_refused and item.query.refusal == check.refusal
            for item in self._outstanding.values()
        )

    def clear(self) -> None:
        """Record that no answer can come any more."""
        self._outstanding.clear()

    def cut(self, buffer: bytearray, query: Query) -> int:
        """Remove late answers from the bytes received after ``query``; return how many."""
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
