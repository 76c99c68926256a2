"""Holding a jog button in tests for as long as it takes, however busy the computer is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import httpx

from tests.support.station import Live, until

There = Callable[[Any, float], bool]


@contextmanager
def jogged(
    http: httpx.Client, page: Live, drive: str, there: There, **settings: object
) -> Iterator[float]:
    """Jog until it is ``there``, by the axis' state and where it began; still held inside.

    Gives where it began. A computer that stalls for 200 ms ends a jog, rightly: then once more.
    ``settings`` are those of the message ``jog_start``; the direction is 1 unless given.
    """
    ended = []
    for _ in range(5):
        start = float(_state(http, drive)["position"])
        page.send(**({"type": "jog_start", "drive": drive, "direction": 1} | settings))
        with page.holding(drive):
            page.send(type="ping", n=1)
            page.wait("pong", n=1)  # what was sent before has begun
            now = until(
                partial(_there_or_over, http, page, drive, there, start), what="it is there"
            )
            if now["moving_job"] is not None:
                yield start
                return
        ended.append(page.wait("jog_ended", drive=drive))
    raise AssertionError(ended)


def fast(now: Any, _start: float) -> bool:
    """The axis is at a speed at which nobody jogs by mistake."""
    return abs(float(now["velocity"] or 0.0)) > 100


def _there_or_over(http: httpx.Client, page: Live, drive: str, there: There, start: float) -> Any:
    """The axis' state where it is there or is jogged no more, else None."""
    page.listen()
    now = _state(http, drive)
    return now if now["moving_job"] is None or there(now, start) else None


def _state(http: httpx.Client, drive: str) -> Any:
    return http.get(f"/drives/{drive}/state").raise_for_status().json()
