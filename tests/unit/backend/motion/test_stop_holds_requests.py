"""A STOP that is carried out holds other requests back, for a bounded time and share."""

from __future__ import annotations

import asyncio

from backend.api.admission.requests import FREE_SHARE, HELD_S, Beginnings


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


async def begun(beginnings: Beginnings) -> bool:
    """Whether a request begins within some turns."""
    done = asyncio.Event()
    beginnings.begin(done.set)
    for _ in range(10):
        await asyncio.sleep(0.005)
    return done.is_set()


async def test_none_begins_while_a_stop_is_carried_out() -> None:
    beginnings = Beginnings(Clock())
    assert await begun(beginnings)
    with beginnings.held():
        assert not await begun(beginnings)
    assert await begun(beginnings)


async def test_a_stop_that_takes_long_shuts_nobody_out() -> None:
    """An axis with a long ramp is watched for seconds."""
    clock = Clock()
    beginnings = Beginnings(clock)
    with beginnings.held():
        assert not await begun(beginnings)
        clock.now += HELD_S
        assert await begun(beginnings)


async def test_one_who_presses_stop_all_the_time_leaves_a_share() -> None:
    clock = Clock()
    beginnings = Beginnings(clock)
    with beginnings.held():
        clock.now += 0.04
    with beginnings.held():
        assert await begun(beginnings), "right after the hold before"
    clock.now += 0.04 * FREE_SHARE
    with beginnings.held():
        assert not await begun(beginnings)
