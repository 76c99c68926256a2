"""The figures of the commissioning tools: found, compared with the truth of the mechanics, and met.

    python -m benchmarks.commissioning [ITEM …]

Each item is measured on virtual axes whose physics are not what its tool assumes; the truth is read
from the mechanics or follows from their equations. Items: first_power, brake, friction, cycle,
vibration, load_side, gantry, health, safety.
"""

from __future__ import annotations

import asyncio
import math
import sys
import time
from collections.abc import Awaitable, Callable, Iterable
from typing import Any

import numpy as np

from backend.tools.tool import Run
from backend.tools.watching.cycle.run import TOOL as CYCLE
from backend.tools.watching.cycle.settings import CycleSettings
from backend.tools.watching.trend.compare import compare
from benchmarks import cycle_load, health_trend
from benchmarks._commissioning_mechanics import gantry, load_side, vibration
from benchmarks._figures import Figure, at_least, at_most, off_percent, print_figures, share
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.mechanics import MechanicsSpec, PhaseSpec
from tests.unit.health import drawn_checks as checks
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import silent
from tests.virtual.tools.set_ups import brake as brakes
from tests.virtual.tools.set_ups import cycle as cycles
from tests.virtual.tools.set_ups import first_power as motors
from tests.virtual.tools.set_ups import friction as frictions
from tests.virtual.tools.set_ups import health as worn
from tests.virtual.tools.set_ups import safety_check as safeties

Figures = list[Figure]
TURN = 2 * math.pi


class Shaft:
    """Place in rev and torque in Nm of a motor, step by step, as the mechanics have them."""

    def __init__(self, bench: DirectBench) -> None:
        device: Any = bench.link.device
        self.at_ms: list[float] = []
        self.place_rev: list[float] = []
        self.torque_nm: list[float] = []
        axis, advance = device.core.axis, device.advance

        def watched(t_ns: int) -> None:
            advance(t_ns)
            self.at_ms.append(t_ns / 1e6)
            self.place_rev.append(float(axis._x[0]) / TURN)
            self.torque_nm.append(float(axis.s[k.S_TORQUE]))

        device.advance = watched

    @property
    def way_rev(self) -> float:
        """The furthest from where it was."""
        return float(np.max(np.abs(np.asarray(self.place_rev) - self.place_rev[0])))


# --- 1 first power ---------------------------------------------------------------------------

_HALL = PhaseSpec(commutation="hall")
#: Family, motor, and where its rotor stands in rev.
_WRONG: tuple[tuple[str, MechanicsSpec, float], ...] = (
    ("r6l", motors.motor(PhaseSpec(order="shifted")), 0.0),
    ("mms7", motors.motor(PhaseSpec(order="shifted")), 0.01),
    ("m6l", motors.motor(PhaseSpec(order="shifted")), 0.02),
    ("mms7", motors.motor(PhaseSpec(order="exchanged")), 0.0),
    ("r6l", motors.motor(PhaseSpec(order="exchanged")), 0.025),
    ("ep3e", motors.motor(PhaseSpec(order="exchanged")), 0.05),
    ("m6l", motors.motor(inverted=True), 0.0),
    ("r6l", motors.motor(_HALL, inverted=True), 0.0),
    ("ep3e", motors.motor(PhaseSpec(angle_deg=180.0)), 0.0),
    ("mms7", motors.motor(PhaseSpec(angle_deg=150.0)), 0.0),
)
#: Two exchanged phases make no torque here: cos(2pθ) = 0 at θ = 1/(8p).
_BLIND_REV = 1.0 / 32


async def first_power(small: bool) -> Figures:
    """Wrongly phased motors are found, below 10 % torque and 0.1 rev."""
    found, passed, torques, ways = [], [], [], []

    async def made(drive: str, spec: MechanicsSpec, at_rev: float) -> tuple[str, str]:
        async with direct(spec, drive=drive) as bench:
            motors.shaft(bench).place(TURN * at_rev)
            bench.link.highest.update(speed=0.0, torque=0.0)
            shaft = Shaft(bench)
            result = await motors.first_power(bench)
            torques.append(0.1 * bench.link.highest["torque"])
            ways.append(shaft.way_rev)
            return motors.finding(result, "phases")

    for drive, spec, at_rev in _WRONG[:1] if small else _WRONG:
        found.append((await made(drive, spec, at_rev))[0] == "failed")
    for drive in () if small else motors.FAMILIES:
        passed.append((await made(drive, motors.motor(), 0.0))[0] == "passed")
    blind = []
    if not small:
        exchanged = motors.motor(PhaseSpec(order="exchanged"))
        blind.append((await made("r6l", exchanged, _BLIND_REV))[0] != "passed")
    return [
        share("wrongly phased motors found", found, 1.0),
        *([share("right motors passed", passed, 1.0)] if passed else []),
        *([share("no torque at this rotor angle: not passed", blind, 1.0)] if blind else []),
        at_most("highest torque", max(torques), 10.0, "% of rated"),
        at_most("furthest turn of the shaft", max(ways), 0.1, "rev"),
    ]


# --- 2 brake ---------------------------------------------------------------------------------

_BRAKES = (("m6l", brakes.ASKED, brakes.M6L), ("r6l", brakes.CUT, {}), ("ep3e", brakes.CUT, {}))


async def brake(small: bool) -> Figures:
    """The torque at which a worn brake slips, and how soon the torque is gone."""
    off, aborted, gone, held, slipped, verdicts = [], [], [], [], [], []
    for drive, asked, settings in _BRAKES[1:2] if small else _BRAKES:
        for worn_share in (0.6,) if small else (0.4, 0.6, 0.85):
            spec = brakes.braked(
                worn_share * brakes.RATED_NM,
                windup_rev=brakes.WINDUP_REV,
                supplied=asked is brakes.ASKED,
            )
            truth = 100.0 * (worn_share + brakes.COULOMB_NM / brakes.RATED_NM)
            async with direct(spec, drive=drive, settings=settings) as bench:
                shaft = Shaft(bench)
                result = await brakes.brake_of(bench.axis, bench.session, asked)
            verdicts.append(result.verdict == "slipped")
            for way in result.ways:
                off.append(100.0 * abs(way.torque_percent / truth - 1.0))
                aborted.append(math.inf if way.abort_ms is None else way.abort_ms)
            gone.append(_torque_gone_ms(shaft, asked.slip_limit_rev))
            slipped.append(max(abs(way.travel_rev) for way in result.ways))
        if small:
            break
        good = brakes.braked(
            2.0 * brakes.RATED_NM, windup_rev=0.008, supplied=asked is brakes.ASKED
        )
        async with direct(good, drive=drive, settings=settings) as bench:
            shaft = Shaft(bench)
            result = await brakes.brake_of(bench.axis, bench.session, asked)
        verdicts.append(result.verdict == "held")
        held.append(shaft.way_rev)
    figures = [
        share("brakes judged right", verdicts, 1.0),
        at_most("torque at the slip, off by", max(off), 5.0, "%"),
        at_most("torque command withdrawn after", max(aborted), 20.0, "ms"),
        at_most("shaft without torque after", max(gone), 20.0, "ms"),
    ]
    if held:
        figures.append(at_most("shaft under a brake that holds", max(held), 0.02, "rev"))
    return [*figures, Figure("shaft under a brake that slips", "", f"{max(slipped):.3f} rev", None)]


def _torque_gone_ms(shaft: Shaft, limit_rev: float) -> float:
    """From the slip limit until the motor makes less than a twentieth of its rated torque."""
    place, at = np.asarray(shaft.place_rev) - shaft.place_rev[0], np.asarray(shaft.at_ms)
    torque = np.abs(shaft.torque_nm)
    passed = int(np.argmax(np.abs(place) >= limit_rev))
    less = passed + int(np.argmax(torque[passed:] < 0.05 * brakes.RATED_NM))
    return float(at[less] - at[passed])


# --- 3 friction and ripple -------------------------------------------------------------------


async def friction(small: bool) -> Figures:
    """The curve over speed, and the periods of the ripple, on every family."""
    curve, named, amplitude = [], [], []
    truth = 100.0 * frictions.RIPPLE.cogging_nm / frictions.RATED_NM
    for drive in ("r6l",) if small else ("mms7", "m6l", "r6l", "ep3e", "ds_c"):
        async with frictions.under(drive, frictions.RIPPLED) as (axis, session):
            found = await frictions.mapped(axis, session)
        curve.append(100.0 * frictions.largest_error(found, frictions.RIPPLED))
        orders = {each.order_per_rev: each.amplitude_percent for each in found.harmonics}
        named.append({1, 24} <= set(orders) <= {1, 24, 48})
        amplitude.append(100.0 * abs(orders.get(24, 0.0) / truth - 1.0))
    return [
        at_most("friction over speed, off by", max(curve), 5.0, "%"),
        share("periods per revolution named, no other", named, 1.0),
        at_most("amplitude of the cogging, off by", max(amplitude), 15.0, "%"),
    ]


# --- 4 the real cycle ------------------------------------------------------------------------


async def cycle(small: bool) -> Figures:
    """RMS, peak and braking energy of a cycle that somebody else moves; the moment of the trip."""
    kept: dict[str, Any] = {}
    asked = CycleSettings(
        duration_s=4.5 if small else 7.5, motor_rated_nm=cycles.RATED_NM, thermal_time_min=15.0
    )
    async with direct(cycles.rigid(), drive="m6l") as bench:
        moving = asyncio.create_task(cycles.machine(bench, 5 if small else 8))
        await asyncio.sleep(1.5)
        run = Run(bench.axis, None, silent(), lambda _n, arrays, _m: kept.update(arrays))
        found = await CYCLE.run(run, asked)
        await moving
    assert found.period_s is not None
    assert found.power is not None
    whole = (kept["time_s"] > 0.01) & (kept["time_s"] <= found.periods * found.period_s)
    torque = cycles.torques_nm(kept["time_s"], kept["speed_rpm"])[whole]
    rms, peak = float(np.sqrt(np.mean(torque**2))), float(np.max(np.abs(torque)))
    power = torque * kept["speed_rpm"][whole] * cycles.RPM
    braking = -float(np.sum(power[power < 0.0])) * 1e-3 / found.periods
    per_nm = 100.0 / cycles.RATED_NM
    figures = [
        at_most("RMS torque, off by", off_percent(found.rms_percent, rms * per_nm), 2.0, "%"),
        at_most("peak torque, off by", off_percent(found.peak_percent, peak * per_nm), 5.0, "%"),
        at_most("braking energy, off by", off_percent(found.power.braking_j, braking), 5.0, "%"),
    ]
    if small:
        return figures
    inside, right, cases = cycle_load.judged()
    return [
        *figures,
        at_least("trips in the stated range of time", inside, cases, f"of {cases}"),
        at_least("verdicts that the motor does not contradict", right, cases, f"of {cases}"),
    ]


# --- 7 health --------------------------------------------------------------------------------

_NOISES = (checks.normal, checks.heavy, checks.skewed, checks.linked, checks.by_day,
           checks.sometimes_wrong)  # fmt: skip


async def health(small: bool) -> Figures:
    """Changes found, false alarms, and how soon the trend of 2 000 runs opens."""
    rng, draws = np.random.default_rng(24), 200 if small else 2000
    alarms = [
        float(np.mean([bool(checks.alarms(compare(*checks.drawn(rng, noise, 3, {}))))
                       for _ in range(draws)]))
        for noise in _NOISES
    ]  # fmt: skip
    figures = [at_most("false alarms, worst of six noises", 100.0 * max(alarms), 1.0, "%")]
    for what, factor in ((("resonance", 1), 1.05), (("friction", 1), 1.2)):
        found = [
            float(np.mean([what in checks.alarms(compare(
                *checks.drawn(rng, noise, 5, {what: factor}))) for _ in range(draws // 5)]))
            for noise in _NOISES[:4]
        ]  # fmt: skip
        figures.append(
            at_least(f"{what[0]} changed by {factor - 1:.0%}: found", 100 * min(found), 95.0, "%")
        )
    if small:
        return figures
    return [*figures, *await _worn_axes(), *_trend()]


async def _worn_axes() -> Figures:
    healthy = (await worn.checked(worn.axis_of(), 5)).rounds
    before, again = healthy[:3], healthy[3:]
    loose = (await worn.checked(worn.axis_of(stiffness=0.7), 2)).rounds
    rubbing = (await worn.checked(worn.axis_of(friction=1.2), 2, response=False)).rounds
    found = [set(worn.changed(compare(before, each))) for each in (again, loose, rubbing)]
    return [
        share("virtual axis as it was: nothing found", [not found[0]], 1.0),
        share("stiffness -30 %: the resonance alone", [found[1] == {"resonance 1"}], 1.0),
        share("friction +20 %: friction alone", [found[2] == {"friction 1"}], 1.0),
    ]


def _trend() -> Figures:
    return [
        at_most(f"trend of {health_trend.RUNS} runs from {name}", taken, health_trend.AIM_S, "s")
        for name, taken in health_trend.opened().items()
    ]


# --- 8 safety record -------------------------------------------------------------------------


async def safety(_small: bool) -> Figures:
    """Torque-free time and stopping distance of an axis that coasts, and of one that brakes."""
    async with direct(safeties.stiff(), drive="r6l") as bench:
        found = await safeties.recorded(bench, safeties.off)
    async with direct(safeties.stiff(), drive="r6l") as bench:
        asked = safeties.ASKED.model_copy(update={"function": "ss1"})
        ramp = await safeties.recorded(bench, safeties.braked, asked)
    omega = safeties.RPM / 60.0 * TURN
    free_ms = math.inf if found.torque_free_ms is None else found.torque_free_ms
    figures = [at_most("torque-free time of an STO", free_ms, 4.0, "ms")]
    # Coulomb friction alone, and the ramp of the set-up.
    coast_s = safeties.INERTIA * omega / safeties.COULOMB_NM
    for name, each, stop_s in (("STO", found, coast_s), ("SS1", ramp, 0.2)):
        rev = 0.5 * omega / TURN * stop_s
        time_off = off_percent(each.stop_ms or 0.0, 1e3 * stop_s)
        figures.append(at_most(f"{name}: time to standstill, off by", time_off, 10.0, "%"))
        way_off = off_percent(each.stop_rev or 0.0, rev)
        figures.append(at_most(f"{name}: stopping distance, off by", way_off, 6.0, "%"))
    return figures


ITEMS: dict[str, Callable[[bool], Awaitable[Figures]]] = {
    "first_power": first_power, "brake": brake, "friction": friction, "cycle": cycle,
    "vibration": vibration, "load_side": load_side, "gantry": gantry, "health": health,
    "safety": safety,
}  # fmt: skip


async def _item(name: str, small: bool) -> Figures:
    return await ITEMS[name](small)


def measured(names: Iterable[str], small: bool = False) -> dict[str, Figures]:
    """The figures of these items, each with an event loop of its own; printed as they come."""
    found = {}
    for name in names:
        begun = time.perf_counter()
        try:
            found[name] = asyncio.run(_item(name, small))
        except Exception as error:
            # A busy computer may lose the process data of one item; the others are measured.
            print(f"{name} broken: {error}", flush=True)
            found[name] = [Figure("not measured", "", type(error).__name__, False)]
        print(f"{name}: {time.perf_counter() - begun:.0f} s", flush=True)
        for each in found[name]:
            print(f"  {each.name}: {each.value} ({each.aim or 'no aim'})", flush=True)
    return found


def main() -> int:
    """Print the table; 0 where every aim is met."""
    return not print_figures(measured(sys.argv[1:] or ITEMS))


if __name__ == "__main__":
    raise SystemExit(main())
