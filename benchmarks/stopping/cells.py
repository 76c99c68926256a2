"""One cell of the matrix: a motion, a trouble, STOP, and what the shaft does."""

from __future__ import annotations

import asyncio
import contextlib
from dataclasses import dataclass

from benchmarks.stopping.clock import run_simulated
from benchmarks.stopping.motions import FAMILIES, MOTIONS, SEEN_S
from benchmarks.stopping.rig import Rig, rig

#: A shaft slower than this stands: six degrees of a second hand's turn, below every window.
STANDS_RPM = 3.0
_AFTER_S = 0.6
_EVERY_S = 0.005

TROUBLES = ("none", "605Ah tampered", "mailbox mute", "process data lost")
#: Motions of a bus master that stop reaches by process data alone.
_BY_PROCESS_DATA = "jog by process data"
#: 605Ah rules every motion but these: process data stop by themselves.
_NOT_TAMPERED = frozenset({_BY_PROCESS_DATA})
#: A jog over a link without process data has none to lose, and DS_C documents no watchdog.
_WITHOUT_PROCESS_DATA = frozenset({"jog"})
#: Manuals that have no way to brake: 001:894 with 001:487.
_UNBRAKED = frozenset({("ep3e", "torque")})


@dataclass(frozen=True)
class Outcome:
    """What the answer said and what the shaft did. ``None`` is a shaft that did not stop."""

    family: str
    motion: str
    trouble: str
    verdict: str
    answer_s: float
    stood_s: float | None
    degrees: float
    shaft_rpm_at_answer: float
    steps: tuple[str, ...]
    speed_reported: float | None

    @property
    def truthful(self) -> bool:
        """The answer equals the shaft."""
        turns = self.shaft_rpm_at_answer > STANDS_RPM
        if self.verdict == "stopped":
            return not turns and self.stood_s is not None
        if self.verdict == "unreachable":
            return self.trouble == "mailbox mute"
        return turns

    @property
    def held(self) -> bool:
        """It stood, or nothing could be commanded to the drive and that was said."""
        if self.trouble == "mailbox mute" and self.motion != _BY_PROCESS_DATA:
            return self.truthful and self.verdict == "unreachable"
        # What no command brakes must be said: a drive's own fault reaction, and EP3E's CST.
        coasts = self.trouble == "process data lost" or (self.family, self.motion) in _UNBRAKED
        return self.truthful and (self.verdict == "stopped" or coasts)


def cells(families: tuple[str, ...] = FAMILIES) -> list[tuple[str, str, str]]:
    """Every cell that a family has: family, motion, trouble."""
    found = []
    for family in families:
        for motion, (_, having) in MOTIONS.items():
            if family not in having:
                continue
            found += [
                (family, motion, trouble) for trouble in TROUBLES if _has(family, motion, trouble)
            ]
    return found


def _has(family: str, motion: str, trouble: str) -> bool:
    if trouble == "605Ah tampered":
        return motion not in _NOT_TAMPERED and family != "ds_c"
    if trouble == "process data lost":
        return motion not in _WITHOUT_PROCESS_DATA and family != "ds_c"
    return True


def run_cell(family: str, motion: str, trouble: str) -> Outcome:
    """Try one cell in simulated time."""
    found: Outcome = run_simulated(lambda: _cell(family, motion, trouble))
    return found


async def _cell(family: str, motion: str, trouble: str) -> Outcome:
    async with rig(family) as bench:
        await asyncio.sleep(0.1)
        tampered = trouble == "605Ah tampered"
        # An identification may be over before the monitor has looked: there it comes first.
        first = tampered and motion == "identification"
        if first:
            bench.before_trigger = lambda: _tamper(bench)
        await MOTIONS[motion][0](bench)
        if tampered and not first:
            await _tamper(bench)
        return await _stop(bench, motion, trouble)


async def _tamper(bench: Rig) -> None:
    """Another tool makes quick stop coast, and the monitor has the time to see it."""
    bench.poke("605A:00", 0)
    await asyncio.sleep(SEEN_S)


async def _stop(bench: Rig, motion: str, trouble: str) -> Outcome:
    loop = asyncio.get_running_loop()
    if trouble == "mailbox mute":
        bench.link.mute = True
    if trouble == "process data lost":
        bench.link.lose_process_data()
    began, start_deg = loop.time(), bench.shaft_deg
    trace: list[tuple[float, float, float]] = []
    recording = asyncio.create_task(_record(bench, trace))
    try:
        answer = (await bench.http.post("/stop", json={})).json()
        answered = loop.time()
        rpm = bench.shaft_rpm
        await asyncio.sleep(_AFTER_S)
    finally:
        recording.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await recording
    axis = answer["axes"][0]
    moving = [at for at, speed, _ in trace if speed > STANDS_RPM]
    stood = None if trace[-1][1] > STANDS_RPM else (moving[-1] - began if moving else 0.0)
    return Outcome(
        bench.family, motion, trouble, axis["verdict"], answered - began, stood,
        abs(trace[-1][2] - start_deg), rpm, tuple(step["code"] for step in axis["steps"]),
        axis["speed"],
    )  # fmt: skip


async def _record(bench: Rig, trace: list[tuple[float, float, float]]) -> None:
    loop = asyncio.get_running_loop()
    while True:
        trace.append((loop.time(), bench.shaft_rpm, bench.shaft_deg))
        await asyncio.sleep(_EVERY_S)
