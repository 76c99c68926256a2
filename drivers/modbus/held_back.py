"""Recognises a serial adapter that holds answers back, from the times of ordinary exchanges.

A USB chip delivers received bytes when its buffer is full or its latency timer has run out (FTDI
AN232B-04: 16 ms by default). An exchange then takes the time of that timer, whatever its length on
the wire. A slow drive, or a path with a delay such as Bluetooth, adds to the time on the wire
instead: an exchange that is 1 ms longer takes 1 ms more.
"""

from __future__ import annotations

from collections import deque
from statistics import linear_regression, median

#: Exchanges of which the times are kept, and the least number that allows a statement.
_KEPT, _LEAST = 200, 40
#: A statement needs exchanges of different length: between the tenths with the shortest and the
#: longest time on the wire [s].
_SPREAD_S = 0.001
#: Increase of the duration per time on the wire: 0 with the timer, 1 without.
_SLOPE = 0.3
#: A timer shorter than this costs little [s].
_TIMER_S = 0.003
#: Half of the exchanges are as long as the timer to within this [s]: USB frames of 1 ms.
_SHARP_S = 0.001


class HeldBack:
    """Times of the latest answered exchanges of one adapter."""

    def __init__(self) -> None:
        self._times: deque[tuple[float, float]] = deque(maxlen=_KEPT)

    def add(self, wire_s: float, took_s: float) -> None:
        """Take the time on the wire, request and answer, and the duration of an exchange [s]."""
        self._times.append((wire_s, took_s))

    def clear(self) -> None:
        """Forget all times: the adapter is another one, or set in another way."""
        self._times.clear()

    def timer_s(self) -> float | None:
        """Return the time for which answers are held back [s].

        None: they are not, or the exchanges so far do not show it.
        """
        times = sorted(self._times)
        if len(times) < _LEAST:
            return None
        wire = [wire_s for wire_s, _ in times]
        took = [took_s for _, took_s in times]
        tenth = len(times) // 10
        timer = median(took)
        if wire[-1 - tenth] - wire[tenth] < _SPREAD_S or timer < _TIMER_S:
            return None
        if timer <= wire[-1 - tenth]:
            return None  # the wire alone takes as long
        off = median(abs(each - timer) for each in took)
        typical = [pair for pair in times if abs(pair[1] - timer) <= 3 * _SHARP_S]
        if off > _SHARP_S or len(typical) < len(times) * 3 // 4:
            return None
        slope, _ = linear_regression(wire, took)
        return timer if slope < _SLOPE else None
