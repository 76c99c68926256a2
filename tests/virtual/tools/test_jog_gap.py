"""A jog whose signs of life have a gap: through the product's own loop, in the drive's time."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from backend.foundation.work.jobs import JobResult
from backend.tools.moving.jog.cyclic import jog_cyclic
from backend.tools.moving.jog.hold import GAP_S, RESUME_S, Hold
from backend.tools.moving.jog.release import END_OF_JOG
from backend.tools.moving.jog.run import JogSettings
from drivers.cia402 import State
from drivers.texts.message import text
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import mechanics, silent

ONE = mechanics((1e-4, 60.0, 0.006))
JOG = JogSettings(1, 120.0, 1200.0, 20.0, 100.0)
#: Speed (rpm) below which the axis is at standstill.
STANDS_RPM = 6.0


class Watched:
    """A jog that is held by ``held`` (time since it moves, in s: alive or not)."""

    def __init__(self, b: DirectBench, held: Callable[[float], bool], release_s: float) -> None:
        self.b, self.held, self.release_s = b, held, release_s
        self.hold = Hold(
            1, lambda: b.link.now_ns / 1e9, lambda braking, _s: self.gaps.append(braking)
        )
        self.gaps: list[bool] = []
        self.track: list[tuple[float, float]] = []
        self._moves_since: float | None = None
        self._before: tuple[float, float] | None = None

    def look(self, block: object) -> None:
        """After every 20 ms of the drive."""
        del block
        now_s = self.b.link.now_ns / 1e9
        device, counts = self.b.link.device, 65536.0
        place = int.from_bytes(device.read(0x6064, 0), "little", signed=True)
        if self._before is not None and now_s > self._before[0]:
            rpm = (place - self._before[1]) / counts / (now_s - self._before[0]) * 60.0
            if self._moves_since is None and rpm > STANDS_RPM:
                self._moves_since = now_s
            if self._moves_since is not None:
                self.track.append((now_s - self._moves_since, rpm))
        self._before = now_s, place
        since = 0.0 if self._moves_since is None else now_s - self._moves_since
        if since >= self.release_s:
            self.hold.release(END_OF_JOG["released"], 1)
        elif self.held(since):
            self.hold.renew(1)

    async def jog(self) -> JobResult:
        unsubscribe = self.b.session.cyclic.blocks(self.look)
        try:
            return await jog_cyclic(self.b.axis, self.b.session, JOG, self.hold, silent())
        finally:
            unsubscribe()

    def fastest(self, begin_s: float, end_s: float) -> float:
        return max(rpm for at, rpm in self.track if begin_s <= at <= end_s)


async def test_a_gap_brakes_the_axis_which_speeds_up_again() -> None:
    async with direct(ONE, drive="mms7") as b:
        start = await b.axis.position_raw()
        x = Watched(b, lambda at: at < 1.0 or at > 1.4, release_s=3.0)
        result = await x.jog()
        assert result["reason_message"] == END_OF_JOG["released"].to_wire()
        assert x.gaps == [True, False]
        assert x.fastest(0.6, 1.0) == pytest.approx(120.0, rel=0.1)
        # The last sign at 1.0 s, 200 ms, a look of the job and the loop's ramp of 100 ms.
        assert x.fastest(1.0 + GAP_S + 0.2, 1.41) < STANDS_RPM
        assert x.fastest(2.2, 2.9) == pytest.approx(120.0, rel=0.1)
        turned = (await b.axis.units()).position(await b.axis.position_raw() - start)
        assert result["moved_rev"] == pytest.approx(turned, abs=0.02)
        assert await b.axis.state() is not State.OPERATION_ENABLED


@pytest.mark.parametrize("release_s", [1.1, 1.25, 1.38])
async def test_a_release_in_a_gap_never_moves_it_again(release_s: float) -> None:
    async with direct(ONE, drive="mms7") as b:
        x = Watched(b, lambda at: at < 1.0 or at > 1.4, release_s=release_s)
        result = await x.jog()
        assert result["reason_message"] == END_OF_JOG["released"].to_wire()
        assert all(rpm < STANDS_RPM for at, rpm in x.track if at > 1.0 + GAP_S + 0.2)
        assert await b.axis.state() is not State.OPERATION_ENABLED


async def test_beyond_500_ms_a_new_press_is_needed() -> None:
    async with direct(ONE, drive="mms7") as b:
        x = Watched(b, lambda at: at < 1.0 or at > 1.0 + RESUME_S + 0.1, release_s=4.0)
        result = await x.jog()
        assert (
            result["reason_message"] == text("jog.end-no-sign-of-life", silent_ms=500.0).to_wire()
        )
        assert all(rpm < STANDS_RPM for at, rpm in x.track if at > 1.0 + GAP_S + 0.2)
        assert await b.axis.state() is not State.OPERATION_ENABLED


async def test_stop_in_a_gap_is_final() -> None:
    """The signs come back, but a person has pressed STOP meanwhile."""
    async with direct(ONE, drive="mms7") as b:
        x = Watched(b, lambda at: at < 1.0 or at > 1.4, release_s=4.0)
        look = x.look

        def looked(block: object) -> None:
            look(block)
            if x.gaps and x.track[-1][0] > 1.3:
                b.axis.stopped = True
                x.hold.release(text("motion.stop-was-pressed"))

        x.look = looked  # type: ignore[method-assign]
        await x.jog()
        assert all(rpm < STANDS_RPM for at, rpm in x.track if at > 1.0 + GAP_S + 0.2)
        assert await b.axis.state() is not State.OPERATION_ENABLED
