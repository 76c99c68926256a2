"""Designs for a drive from the measured plant, and the raw values that realise them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.loop.design import Candidate, design
from backend.analysis.loop.loop_goals import LoadClass
from backend.analysis.loop.loop_structure import DriveLoops
from backend.analysis.loop.measured_plant import MeasuredPlant, measured_plant
from backend.analysis.loop.mode_above import modes_above
from backend.analysis.mechanics.mechanical_model import MechanicalModel
from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.thresholds import autotune_candidates as threshold
from backend.tools.tuning.autotune.design import gains as gain_tool
from backend.tools.tuning.notch import effect as notch_effect
from backend.tools.tuning.notch import filters as notch_tool
from backend.tools.tuning.notch.meaning import meaning_of
from backend.tools.tuning.sweep.evaluation import SweepResult
from drivers.texts.message import Text, text

_UNMET: dict[LoadClass, Text] = {
    "stiff": text("autotune.no-design-stiff"),
    "medium": text("autotune.no-design-medium"),
    "compliant": text("autotune.no-design-compliant"),
}


@dataclass(frozen=True)
class Design:
    """All candidates, fastest first; ``caution`` is the reason for careful ones, else None."""

    load: LoadClass
    candidates: tuple[Candidate, ...]
    caution: Text | None = None


def load_class(mechanics: SweepResult) -> LoadClass:
    """Stiff, medium or compliant, by the frequency of the first antiresonance."""
    low = [r.frequency_hz for r in mechanics.resonances if r.kind == "antiresonance"]
    first = min(low, default=np.inf)
    return "compliant" if first < 80.0 else "medium" if first < 300.0 else "stiff"


def candidates_for(
    drive: Drive, facts: AxisFacts, plant: MeasuredPlant, inertia_kgm2: float, load: LoadClass,
    sample_rate_hz: float | None = None, *, filters: bool = False, notches: bool = True,
    highest_hz: float | None = None,
) -> tuple[Candidate, ...]:  # fmt: skip
    """All candidates for a measured plant; with a sample rate only those that can be verified.

    ``filters``: the drive's torque and speed filters may be changed, too. No candidate has a speed
    bandwidth above ``highest_hz``.
    """
    profile = drive.profile
    loops = gain_tool.loops_of(drive, facts)
    if filters:
        loops = replace(loops, choices=gain_tool.filter_choices(drive, loops.filters))
    verifiable = None if sample_rate_hz is None else threshold.VERIFIABLE * sample_rate_hz
    limits = [hz for hz in (loops.highest_speed_bandwidth_hz, verifiable, highest_hz) if hz]
    loops = replace(loops, highest_speed_bandwidth_hz=min(limits, default=None))
    meaning = meaning_of(drive)
    known = meaning is not None or not notch_effect.unknown(drive)
    slots = len(profile.notch.slots) if profile.notch is not None and known and notches else 0

    def designed(loops: DriveLoops) -> tuple[Candidate, ...]:
        return design(
            plant,
            inertia_kgm2,
            loops,
            load,
            slots=slots,
            notch_response=lambda notch, f: notch_tool.response(profile, notch, f, meaning),
        )

    return _seen_by_the_bus(designed, loops, sample_rate_hz)


def _seen_by_the_bus(
    designed: Callable[[DriveLoops], tuple[Candidate, ...]],
    loops: DriveLoops,
    sample_rate_hz: float | None,
) -> tuple[Candidate, ...]:
    """Slow the designs down until their -3 dB bandwidth lies in the band that this bus resolves."""
    table: tuple[Candidate, ...] = ()
    for _ in range(threshold.NARROWINGS):
        table = designed(loops)
        widest = max((c.bandwidth_hz or np.inf for c in table if c.marks), default=0.0)
        if sample_rate_hz is None or widest <= threshold.SEEN * sample_rate_hz:
            break
        share = max(threshold.SEEN * sample_rate_hz / widest, 0.5)
        loops = replace(
            loops, highest_speed_bandwidth_hz=share * (loops.highest_speed_bandwidth_hz or 0.0)
        )
    return table


def design_for(
    drive: Drive,
    facts: AxisFacts,
    mechanics: SweepResult,
    inertia_kgm2: float,
    load: LoadClass | None,
    sample_rate_hz: float,
) -> Design:
    """The best designs; cautious ones if no model fits the data or no design meets its goals.

    Empty where not even cautious designs meet their goals.
    """
    caution = text("autotune.no-mechanical-model")
    if mechanics.model is not None:
        load = load or load_class(mechanics)
        plant = plant_of(mechanics, inertia_kgm2, facts, cautious=False)
        table = candidates_for(
            drive, facts, plant, inertia_kgm2, load, sample_rate_hz, filters=True
        )
        if table:
            return Design(load, table)
        caution = _UNMET[load]
    return cautious_design(drive, facts, mechanics, inertia_kgm2, sample_rate_hz, caution)


def plant_of(
    mechanics: SweepResult, inertia_kgm2: float, facts: AxisFacts, *, cautious: bool
) -> MeasuredPlant:
    """Plant for the design: the measured axis, or with ``cautious`` only the certain part of it."""
    if mechanics.model is None or cautious:
        return cautious_plant(mechanics, inertia_kgm2, facts.motor_inertia_kgm2)
    return measured_plant(mechanics.frf, mechanics.model)


def cautious_design(
    drive: Drive,
    facts: AxisFacts,
    mechanics: SweepResult,
    inertia_kgm2: float,
    sample_rate_hz: float,
    caution: Text,
) -> Design:
    """Designs of gains alone that are safe for any axis, slower than a design on a model.

    An axis with backlash is at times the whole inertia and at times the motor alone.
    """
    plant = plant_of(mechanics, inertia_kgm2, facts, cautious=True)
    table = candidates_for(
        drive, facts, plant, inertia_kgm2, "compliant", sample_rate_hz, notches=False
    )
    return Design("compliant", table, caution)


def cautious_plant(
    mechanics: SweepResult, inertia_kgm2: float, motor_inertia_kgm2: float | None
) -> MeasuredPlant:
    """The certain part of an axis that no model fits.

    It consists of the coherent lines of the direct estimate and a rigid axis above and below them.
    A variant has the lowest inertia possible: the motor alone, as within a backlash, or, where that
    inertia is unknown, the lowest that the measured lines show. Where the last lines are those of a
    spring, the resonance that follows above them belongs to it.
    """
    frf = mechanics.direct
    use = frf.in_band & (frf.coherence > threshold.COHERENT)
    lightest = inertia_kgm2
    if np.any(use):
        omega = 2.0 * np.pi * frf.frequency_hz[use]
        lightest = min(lightest, float(np.min(1.0 / (np.abs(frf.response[use]) * omega))))
    if motor_inertia_kgm2 is not None:
        # The inertia is at least the motor's; a line that shows less is a resonance peak, which the
        # lines contain.
        lightest = motor_inertia_kgm2
    rigid = MechanicalModel(1.0 / inertia_kgm2, 1e-3)
    variants = (MechanicalModel(1.0 / lightest, 1e-3),)
    above = modes_above(frf, threshold.COHERENT)
    return measured_plant(frf, rigid, variants=variants, fitted=False, above=above)


async def plan(
    axis: Axis, candidate: Candidate, inertia_kgm2: float, motor_inertia_kgm2: float | None = None
) -> dict[str, int]:
    """Raw values that realise a candidate: gains, inertia, filters and notches.

    Raises:
        OutOfRange: the drive cannot hold as little gain as designed.
    """
    rotor = await gain_tool.rotor_inertia(axis, motor_inertia_kgm2)
    raw = gain_tool.plan_design(axis.drive, candidate.gains, inertia_kgm2, rotor)
    raw |= gain_tool.plan_filters(axis.drive, candidate.filters)
    if axis.drive.profile.notch is not None:
        raw |= await notch_tool.plan_notches(axis.drive, candidate.notches, meaning_of(axis.drive))
    return raw
