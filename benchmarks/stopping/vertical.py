"""STOP of a load that gravity pulls, with a holding brake on the motor: how far does it sink?

    python -m benchmarks.stopping --vertical [--family m6l …] [--markdown]

The load pulls with `GRAVITY_NM`; positive is up. Judged by the shaft: a load that has come to rest
and sinks again, or that goes down faster than it was lowered, was let go before its brake held.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.stopping.cells import STANDS_RPM
from benchmarks.stopping.clock import run_simulated
from benchmarks.stopping.motions import (
    FAMILIES,
    MOTIONS,
    SEEN_S,
    SPEED_RPM,
    Begin,
    enable,
    mode_of,
    set_ramps,
)
from benchmarks.stopping.rig import Rig, free_axis, rig
from drivers.cia402 import Mode

#: A quarter of the rated torque of 1.27 Nm: 1600 rad/s² on the motor's own 2e-4 kg m².
GRAVITY_NM = 0.32
#: What holds the load, and what lifts it beside that, in percent of the rated torque.
_HOLDS_PERCENT, _LIFTS_PERCENT = 100.0 * GRAVITY_NM / 1.27, 8.0
#: After the answer the load is looked at for so long.
_AFTER_S = 2.0
_EVERY_S = 0.001
#: A load sinks less than this where brake and power change over in order: 2° of the motor are
#: 0.03 mm of a screw with a lead of 5 mm.
SINKS_DEG = 2.0
TROUBLES = ("none", "605Ah tampered", "process data lost")
_BY_PROCESS_DATA = "jog by process data"
_TAMPERED = frozenset({"holding", "raising", "lowering"})


async def _holding(bench: Rig) -> None:
    """Enabled at rest."""
    bench.poke("60FF:00", 0)
    await enable(bench, mode_of(bench, Mode.PV, Mode.CSV))
    await asyncio.sleep(SEEN_S)


async def _raising(bench: Rig) -> None:
    await _at_speed(bench, SPEED_RPM)


async def _lowering(bench: Rig) -> None:
    await _at_speed(bench, -SPEED_RPM)


async def _at_speed(bench: Rig, rpm: float) -> None:
    units = await bench.member.axis.units()
    await set_ramps(bench)
    bench.poke("60FF:00", 0)
    await enable(bench, mode_of(bench, Mode.PV, Mode.CSV))
    await asyncio.sleep(0.5)  # the brake opens
    bench.poke("60FF:00", units.velocity_raw(rpm))
    await bench.until_rpm(0.9 * SPEED_RPM)


async def _positioning(bench: Rig) -> None:
    """Profile position, by a job of the server."""
    body = {
        "mode": "PP", "target": 90.0, "relative": True, "speed": SPEED_RPM, "acceleration": 3000.0,
        "deceleration": 3000.0, "travel_limit": 100.0, "torque_limit": 100.0, "timeout_s": 60.0,
    }  # fmt: skip
    answer = await bench.http.post(f"/drives/{bench.member.drive.id}/jobs/move", json=body)
    assert answer.is_success, answer.text
    await bench.until_rpm(0.9 * SPEED_RPM, 6.0)


async def _torque(bench: Rig) -> None:
    """6071h lifts the load, then holds it at its speed."""
    units = await bench.member.axis.units()
    await set_ramps(bench)
    bench.poke("6071:00", units.torque_raw(_HOLDS_PERCENT))
    await enable(bench, mode_of(bench, Mode.PT, Mode.CST))
    bench.poke("6071:00", units.torque_raw(_HOLDS_PERCENT + _LIFTS_PERCENT))
    await bench.until_rpm(0.9 * SPEED_RPM, 8.0)
    bench.poke("6071:00", units.torque_raw(_HOLDS_PERCENT))
    await asyncio.sleep(SEEN_S)


_EVERY = frozenset(FAMILIES)
VERTICAL: dict[str, tuple[Begin, frozenset[str]]] = {
    "holding": (_holding, _EVERY),
    "raising": (_raising, _EVERY),
    "lowering": (_lowering, _EVERY),
    "profile position": (_positioning, _EVERY - {"ep3e"}),
    "jog": MOTIONS["jog"],
    _BY_PROCESS_DATA: MOTIONS[_BY_PROCESS_DATA],
    "homing": MOTIONS["homing"],
    "torque": (_torque, _EVERY),
}


@dataclass(frozen=True)
class Sinking:
    """What became of the load. ``stood_s`` is None where it never came to rest.

    ``sank_deg`` is how far it went down from where it stood first, or from the place of STOP where
    it never stood.
    """

    family: str
    motion: str
    trouble: str
    verdict: str
    stood_s: float | None
    sank_deg: float
    rpm_at_end: float
    powered_at_end: bool
    steps: tuple[str, ...]

    @property
    def held(self) -> bool:
        """The load was held all the time, and the answer says that it stands."""
        stands = self.stood_s is not None and self.rpm_at_end <= STANDS_RPM
        return stands and self.sank_deg <= SINKS_DEG and self.verdict == "stopped"


def vertical_cells(families: Sequence[str] = FAMILIES) -> list[tuple[str, str, str]]:
    """Every cell: family, motion, trouble."""
    return [
        (family, motion, trouble)
        for family in families
        for motion, (_, having) in VERTICAL.items()
        if family in having
        for trouble in TROUBLES
        if _has(family, motion, trouble)
    ]


def _has(family: str, motion: str, trouble: str) -> bool:
    if trouble == "605Ah tampered":
        return motion in _TAMPERED and family != "ds_c"
    return trouble == "none" or motion == _BY_PROCESS_DATA


def run_vertical(family: str, motion: str, trouble: str) -> Sinking:
    """Try one cell in simulated time."""
    found: Sinking = run_simulated(lambda: _cell(family, motion, trouble))
    return found


async def _cell(family: str, motion: str, trouble: str) -> Sinking:
    async with rig(family, free_axis(brake=True, gravity_nm=GRAVITY_NM)) as bench:
        await asyncio.sleep(0.1)
        await VERTICAL[motion][0](bench)
        if trouble == "605Ah tampered":
            bench.poke("605A:00", 0)
            await asyncio.sleep(SEEN_S)
        elif trouble == "process data lost":
            bench.link.lose_process_data()
        return await _stop(bench, motion, trouble)


async def _stop(bench: Rig, motion: str, trouble: str) -> Sinking:
    loop = asyncio.get_running_loop()
    began, trace = loop.time(), [(0.0, bench.shaft_rpm, bench.shaft_deg)]
    recording = asyncio.create_task(_record(bench, began, trace))
    try:
        answer = (await bench.http.post("/stop", json={})).json()
        await asyncio.sleep(_AFTER_S)
    finally:
        recording.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await recording
    axis = answer["axes"][0]
    stood_s, sank_deg = sinking(trace)
    return Sinking(
        bench.family, motion, trouble, axis["verdict"], stood_s, sank_deg, trace[-1][1],
        bench.device.axis.powered, tuple(step["code"] for step in axis["steps"]),
    )  # fmt: skip


def sinking(trace: Sequence[tuple[float, float, float]]) -> tuple[float | None, float]:
    """When a load first stood [s], and how far it went down from there [°]; rows of time, rpm, °."""
    first = next((row for row in trace if row[1] <= STANDS_RPM), None)
    start = trace[0] if first is None else first
    lowest = min(deg for at, _, deg in trace if at >= start[0])
    return None if first is None else first[0], max(0.0, start[2] - lowest)


async def _record(bench: Rig, began: float, trace: list[tuple[float, float, float]]) -> None:
    loop = asyncio.get_running_loop()
    while True:
        trace.append((loop.time() - began, bench.shaft_rpm, bench.shaft_deg))
        await asyncio.sleep(_EVERY_S)
