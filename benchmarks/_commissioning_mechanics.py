"""Slow vibration, load side and gantry: figures against the truth of their mechanics."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from backend.tools.tuning.gantry.result import GantryResult
from benchmarks._figures import Figure, at_most, off_percent, share
from drivers.virtual.mechanics import MechanicsSpec, gantry_response
from drivers.virtual.wires.netns import Namespace, unavailable
from tests.unit.analysis import two_sided_cases as two_sided
from tests.unit.analysis.gantry_plant import Gantry
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import At
from tests.virtual.tools.set_ups import gantry as gantries
from tests.virtual.tools.set_ups import load_side as sides
from tests.virtual.tools.set_ups import shaping as arms

Figures = list[Figure]
TURN = 2 * math.pi


# --- 5 slow vibration ------------------------------------------------------------------------

_ARMS = (
    ("m6l", 8.0, 6e3),
    ("mms7", 6.0, 6e3),
    ("mms7", 15.0, 12e3),
    ("ep3e", 8.0, 6e3),
    ("r6l", 8.0, 6e3),
)


async def vibration(small: bool) -> Figures:
    """What a shaper leaves, by the tool and by the load itself, which the tool does not see."""
    left, load_left, off = [], [], []
    for drive, frequency_hz, acceleration in _ARMS[-1:] if small else _ARMS:
        asked = arms.ASKED.model_copy(update={"acceleration": acceleration})
        async with direct(arms.arm(frequency_hz, **arms.ROUGH), drive=drive) as bench:
            load, marks = arms.Load(bench), list[int]()
            shaped = At("with the shaper", _mark(marks, load))
            found = await arms.shape(bench, asked, None, shaped.progress)
        if found.comparison is None or found.mode is None or not marks:
            left.append(math.inf)
            continue
        left.append(min(found.comparison.ratio, found.comparison.settling_ratio or 1.0))
        ends = load.ends()
        free = [each for each in ends if each < marks[0]]
        calm = [each for each in ends if each > marks[0]]
        means = [float(np.mean([load.left(end) for end in some])) for some in (calm, free)]
        load_left.append(means[0] / means[1])
        speed = np.asarray(load.speeds)[free[0] + 100 : free[0] + 700]
        off.append(off_percent(found.mode.frequency_hz, arms.zero_crossings_hz(speed)))
    return [
        at_most("residual or settling with the shaper", 100.0 * max(left), 50.0, "%"),
        at_most(
            "vibration of the load itself", 100.0 * max(load_left, default=math.inf), 50.0, "%"
        ),
        at_most("frequency of the mode, off by", max(off, default=math.inf), 5.0, "%"),
    ]


def _mark(marks: list[int], load: arms.Load) -> Callable[[], None]:
    return lambda: marks.append(len(load.speeds))


# --- 6 load side and gantry ------------------------------------------------------------------


async def load_side(small: bool) -> Figures:
    """Backlash and stiffness between both encoders, drawn axes and one virtual drive."""
    gaps, stiff = [], []
    for case, each in () if small else two_sided.campaign():
        if each.backlash_rad is not None:
            off = abs(each.backlash_rad.value - case.axis.gap_rad)
            gaps.append(off <= max(0.05 * case.axis.gap_rad, 2 * case.count_rad))
        if (value := two_sided.stiffness_of(each)) is not None:
            stiff.append(abs(value.value / case.axis.stiffness - 1.0) <= 0.1)
    async with direct(sides.axis(), sides.CYCLE_S, drive=sides.DRIVE) as bench:
        found = await sides.measured(bench)
    drawn = (
        []
        if small
        else [
            share("drawn axes: backlash within 5 % or two counts", gaps, 0.9),
            share("drawn axes: stiffness within 10 %", stiff, 0.9),
        ]
    )
    gap, spring = found.backlash_deg, found.stiffness_nm_per_rad
    return [
        *drawn,
        at_most(
            "virtual drive: backlash, off by",
            off_percent(gap.value, math.degrees(sides.GAP)) if gap else math.inf,
            5.0,
            "%",
        ),
        at_most(
            "virtual drive: stiffness, off by",
            off_percent(spring.value, sides.STIFFNESS) if spring else math.inf,
            10.0,
            "%",
        ),
    ]


async def gantry(_small: bool) -> Figures:
    """The four lines of a pair of axes and its modes, and what is out of square.

    Two equal motors, and two of unequal inertia, torque constant and friction.
    """
    reason = unavailable()
    if reason is not None:
        return [Figure(f"not measured: {reason}", "", "", False)]
    unequal = gantries.unequal(brake=True)
    with Namespace.create() as namespace:
        async with gantries.gantry(namespace) as two:
            found = await gantries.measured(two)
        spec = gantries.SQUARE.model_copy(update={"square_error_rad": _SQUARE_RAD})
        async with gantries.gantry(namespace, spec, brake=True) as two:
            bent = await gantries.measured(two)
        async with gantries.gantry(namespace, spec, motors=unequal) as two:
            other = await gantries.measured(two)
    motors = tuple(each.motor.inertia_kgm2 for each in unequal)
    return [
        *_pair("", found, (gantries.motor(), gantries.motor()), Gantry()),
        *_square("", bent),
        *_pair("unequal motors: ", other, unequal, Gantry(motors=(motors[0], motors[1]))),
        *_square("unequal motors: ", other),
    ]


_SQUARE_RAD = 0.12


def _pair(
    which: str, found: GantryResult, motors: tuple[MechanicsSpec, MechanicsSpec], plant: Gantry
) -> Figures:
    """The lines of a pair of axes, and its modes."""
    f = np.array(found.frequency_hz)
    truth = gantry_response(gantries.SQUARE, motors, f)
    inside, off = list[bool](), []
    for entry in found.entries:
        true_db = 20 * np.log10(np.abs(truth[:, entry.speed - 1, entry.torque - 1]))
        away = np.abs(np.array(entry.magnitude_db) - true_db)
        inside += [bool(each) for each in away <= np.array(entry.half_db)]
        off.append(float(np.median(away[f < 180.0])))
    true_modes = plant.modes()
    modes = [
        abs(mode.frequency_hz / frequency_hz - 1.0) <= 0.02
        for mode, (frequency_hz, _, _) in zip(found.modes, true_modes, strict=False)
    ]
    modes += [False] * (len(true_modes) - len(modes))
    return [
        at_most(f"{which}lines below 180 Hz, median off by", max(off), 0.3, "dB"),
        share(f"{which}lines inside their intervals", inside, 0.93),
        share(f"{which}modes within 2 %", modes, 1.0),
    ]


def _square(which: str, bent: GantryResult) -> Figures:
    """What is out of square."""
    away_rev = math.inf if bent.out_of_square_rev is None else bent.out_of_square_rev.value
    named = [gantries.codes(bent)[0] == "out_of_square"]
    off = off_percent(away_rev, -_SQUARE_RAD / TURN)
    return [
        share(f"{which}out of square named", named, 1.0),
        at_most(f"{which}out of square, off by", off, 10.0, "%"),
    ]
