"""STOP of a load that gravity pulls, with a holding brake on the motor: how far does it sink?

    python -m benchmarks.stopping --vertical [--family m6l …] [--markdown]

The load pulls with `GRAVITY_NM`; positive is up. The brake is on the output that its family has for
it. Judged by the shaft: a load that has stopped and sinks again was let go before its brake
held. The virtual brake grips at once; how slow a real one may be shows the time for which the
drive keeps the power on with the brake output off (`Sinking.lead_s`).
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

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
#: What holds the load, and what lifts it in addition to that, in percent of the rated torque.
_HOLDS_PERCENT, _LIFTS_PERCENT = 100.0 * GRAVITY_NM / 1.27, 8.0
#: After the answer the load is looked at for so long.
_AFTER_S = 2.0
_EVERY_S = 0.001
#: Commands before that are lost (000:1377, 002:8273).
_BRAKE_OPENS_S = 0.5
#: A load sinks less than this where brake and power change over in order: 2° of the motor are
#: 0.03 mm of a screw with a lead of 5 mm.
SINKS_DEG = 2.0
TROUBLES = ("none", "605Ah tampered", "process data lost")
_BY_PROCESS_DATA = "jog by process data"
_TAMPERED = frozenset({"holding", "raising", "lowering"})


async def _holding(bench: Rig) -> None:
    """Enabled at standstill."""
    bench.poke("60FF:00", 0)
    await enable(bench, mode_of(bench, Mode.PV, Mode.CSV))
    await asyncio.sleep(SEEN_S)


async def _raising(bench: Rig) -> None:
    await _at_speed(bench, SPEED_RPM)


async def _lowering(bench: Rig) -> None:
    await _at_speed(bench, -SPEED_RPM)


async def _at_speed(bench: Rig, rpm: float) -> None:
    units = await bench.connected.axis.units()
    await set_ramps(bench)
    bench.poke("60FF:00", 0)
    await enable(bench, mode_of(bench, Mode.PV, Mode.CSV))
    await asyncio.sleep(_BRAKE_OPENS_S)
    bench.poke("60FF:00", units.velocity_raw(rpm))
    await bench.until_rpm(0.9 * SPEED_RPM)


async def _positioning(bench: Rig) -> None:
    """Profile position, 90 revolutions up."""
    units = await bench.connected.axis.units()
    await set_ramps(bench)
    bench.poke("6081:00", units.velocity_raw_of(bench.device.profile.by_key["6081:00"], SPEED_RPM))
    await enable(bench, Mode.PP)
    await asyncio.sleep(_BRAKE_OPENS_S)
    start = await bench.connected.axis.position_raw()
    bench.poke("607A:00", start + units.position_raw(90.0))
    bench.poke("6040:00", 0x3F)
    await bench.until_rpm(0.9 * SPEED_RPM)


async def _homing(bench: Rig) -> None:
    """Method 18 searches a limit switch that does not come."""
    units, by_key = await bench.connected.axis.units(), bench.device.profile.by_key
    await set_ramps(bench)
    bench.poke("6098:00", 18)
    bench.poke("6099:01", units.velocity_raw_of(by_key["6099:01"], SPEED_RPM))
    if "609A:00" in by_key:
        bench.poke("609A:00", units.acceleration_raw(3000.0))
    await enable(bench, Mode.HM)
    await asyncio.sleep(_BRAKE_OPENS_S)
    bench.poke("6040:00", 0x1F)
    await bench.until_rpm(0.9 * SPEED_RPM)


async def _torque(bench: Rig) -> None:
    """6071h lifts the load, then holds it at its speed."""
    units = await bench.connected.axis.units()
    await set_ramps(bench)
    bench.poke("6071:00", units.torque_raw(_HOLDS_PERCENT))
    await enable(bench, mode_of(bench, Mode.PT, Mode.CST))
    bench.poke("6071:00", units.torque_raw(_HOLDS_PERCENT + _LIFTS_PERCENT))
    await bench.until_rpm(0.9 * SPEED_RPM, 8.0)
    bench.poke("6071:00", units.torque_raw(_HOLDS_PERCENT))
    await asyncio.sleep(SEEN_S)


#: The brake's output and times, where they are no defaults: 000:1360, 003:530, 003:544, 004:2604.
_BRAKE: dict[str, tuple[tuple[str, int], ...]] = {
    "mms7": (("2108:01", 1),),
    "m6l": (("2001:12", 1), ("2003:10", 18)),
    "ds_c": (("2400:0D", 6), ("2401:00", 50), ("2402:00", 100)),
}


def with_brake(bench: Rig) -> None:
    """Assign the brake output of this family."""
    for key, raw in _BRAKE.get(bench.family, ()):
        bench.poke(key, raw)


_EVERY = frozenset(FAMILIES)
VERTICAL: dict[str, tuple[Begin, frozenset[str]]] = {
    "holding": (_holding, _EVERY),
    "raising": (_raising, _EVERY),
    "lowering": (_lowering, _EVERY),
    "profile position": (_positioning, _EVERY - {"ep3e"}),
    "jog": MOTIONS["jog"],
    _BY_PROCESS_DATA: MOTIONS[_BY_PROCESS_DATA],
    "homing": (_homing, _EVERY),
    "torque": (_torque, _EVERY),
}


@dataclass(frozen=True)
class Sinking:
    """What became of the load. ``stood_s`` is None where it never stopped.

    ``sank_deg`` is how far it went down from where it stood first, or from the place of STOP where
    it never stood. ``lead_s`` is how long the power was on with the brake applied; None where the
    power stays on.
    """

    family: str
    motion: str
    trouble: str
    verdict: str
    stood_s: float | None
    sank_deg: float
    rpm_at_end: float
    lead_s: float | None
    steps: tuple[str, ...]

    @property
    def held(self) -> bool:
        """The load was held all the time, and the answer says that it is at standstill."""
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
        with_brake(bench)
        await asyncio.sleep(0.1)
        await VERTICAL[motion][0](bench)
        if trouble == "605Ah tampered":
            bench.poke("605A:00", 0)
            await asyncio.sleep(SEEN_S)
        elif trouble == "process data lost":
            bench.link.lose_process_data()
        return await stop(bench, motion, trouble)


async def stop(bench: Rig, motion: str, trouble: str) -> Sinking:
    """Press STOP, and look at the load until some time after the answer."""
    loop = asyncio.get_running_loop()
    began, trace = loop.time(), [_row(bench, 0.0)]
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
        bench.family, motion, trouble, axis["verdict"], stood_s, sank_deg, trace[-1].rpm,
        lead_s(trace), tuple(step["code"] for step in axis["steps"]),
    )  # fmt: skip


class Row(NamedTuple):
    """The shaft and the drive's outputs at one moment after STOP."""

    at_s: float
    rpm: float
    deg: float
    powered: bool = True
    released: bool = True


def sinking(trace: Sequence[Row]) -> tuple[float | None, float]:
    """When a load first stood [s], and how far it sank then [°]."""
    first = next((row for row in trace if row.rpm <= STANDS_RPM), None)
    start = trace[0] if first is None else first
    lowest = min(row.deg for row in trace if row.at_s >= start.at_s)
    return None if first is None else first.at_s, max(0.0, start.deg - lowest)


def lead_s(trace: Sequence[Row]) -> float | None:
    """For how long the brake was applied when the power went [s]; None where it stays on."""
    off = next((row.at_s for row in trace if not row.powered), None)
    applied = next((row.at_s for row in trace if not row.released), None)
    return None if off is None or applied is None else off - applied


async def _record(bench: Rig, began: float, trace: list[Row]) -> None:
    while True:
        trace.append(_row(bench, asyncio.get_running_loop().time() - began))
        await asyncio.sleep(_EVERY_S)


def _row(bench: Rig, at_s: float) -> Row:
    rpm, deg, control = bench.shaft_rpm, bench.shaft_deg, bench.device.control
    return Row(at_s, rpm, deg, bench.device.axis.powered, control.brake.released)
