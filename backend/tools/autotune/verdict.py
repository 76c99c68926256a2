"""The verdict on a tuned loop from its measurement and from the plant it was designed for."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.loop_goals import Goals
from backend.analysis.loop.loop_structure import LoopFilters, speed_loop
from backend.analysis.loop.loop_verdict import Lines, LoopVerdict, Missed, judge
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.loop.notch import Notch
from backend.analysis.response.frf import Frf
from backend.analysis.response.reference_path import reference_paths
from backend.analysis.response.sampling import Hold
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.axis.axis import Axis
from backend.tools.autotune import gains as gain_tool
from backend.tools.autotune.axis_facts import AxisFacts
from backend.tools.notch import filters as notch_tool
from backend.tools.notch.meaning import meaning_of

#: What a measured margin is known to; the designs keep more than this in reserve.
MARGIN_DB, MARGIN_DEG, MS_RATIO = 1.0, 1.0, 1.03
#: Lines that margins are read from: coherence, standard deviation of the phase, how many at least.
COHERENT, BLURRED_DEG, LINES = 0.9, 4.0, 12
#: The measured band ends where the next line is farther than this factor away.
_GAP = 1.5
#: A loop is seen where its lines begin within its bandwidth: its crossover may else be missed.
WITHIN = 10 ** (-3.0103 / 20.0)
_UNITS: dict[str, tuple[str, int]] = {
    "phase_margin": ("°", 0),
    "gain_margin": (" dB", 1),
    "peak_sensitivity": ("", 2),
}


def fixed_of(
    axis: Axis, facts: AxisFacts, notches: tuple[Notch, ...], filters: LoopFilters, f: FloatArray
) -> ComplexArray:
    """All of a drive's loop but its gains and the mechanics, on these lines.

    Raises:
        NotAllowed, ValueError: a part of the loop has no known meaning.
    """
    drive = axis.drive
    fixed = gain_tool.loops_of(drive, facts).with_filters(filters).response(f)
    if notches:
        fixed = fixed * notch_tool.combined(drive.profile, notches, f, meaning_of(drive))
    return fixed


def sharp_lines(frf: Frf) -> Lines | None:
    """The lines that noise hardly moves, up to the first gap; None where they tell no loop."""
    use = frf.in_band & (frf.coherence > COHERENT) & ~(frf.std_deg > BLURRED_DEG)
    f, closed = frf.frequency_hz[use], frf.response[use]
    if f.size < LINES or np.abs(closed[0]) < WITHIN:
        return None
    parts = (np.log(10.0) / 20.0 * frf.std_db[use], np.radians(frf.std_deg[use]))
    deviation = np.sqrt(0.5 * sum(np.nan_to_num(part, nan=0.0) ** 2 for part in parts))
    gaps = np.flatnonzero(f[1:] > _GAP * f[:-1])
    # Below 20 Hz lines of a linear grid are far apart by themselves.
    end = next((int(i) + 1 for i in gaps if f[i] > 20.0), f.size)
    return Lines(f[:end], closed[:end], np.asarray(deviation)[:end])


def verdict_of(
    axis: Axis, facts: AxisFacts, plant: MeasuredPlant, candidate: Candidate, frf: Frf,
    hold: Hold | None, shown_gain_db: float | None = None,
) -> LoopVerdict:  # fmt: skip
    """What is known of this design's loop; the worst over the ways its reference may have come.

    Raises:
        NotAllowed, ValueError: a part of the loop has no known meaning.
    """

    def loops(f: FloatArray, plants: ComplexArray) -> ComplexArray:
        fixed = fixed_of(axis, facts, candidate.notches, candidate.filters, f)
        return speed_loop(f, plants, fixed, candidate.gains)

    dense = plant.frequency_hz
    every, nominal = loops(dense, plant.shifted()), loops(dense, plant.response())
    seen = sharp_lines(frf)
    if seen is None:
        return judge(None, dense, every, nominal, shown_gain_db=shown_gain_db)
    f = seen.frequency_hz
    expected = loops(f, plant.on(f).response())
    paths = reference_paths(
        f, seen.closed, seen.deviation, expected, rate_hz=frf.sample_rate_hz,
        hold=hold or ("linear" if facts.interpolates else "zero"),
    )  # fmt: skip
    found = [
        judge(
            Lines(f, path.closed, seen.deviation), dense, every, nominal,
            shown_gain_db=shown_gain_db, late_s=path.loop_late_s, size=path.loop_size,
        )
        for path in paths
    ]  # fmt: skip
    return min(found, key=lambda v: v.stated.phase_margin_deg)


def in_words(missed: tuple[Missed, ...]) -> list[str]:
    """What a verdict misses, for people."""
    words = []
    for each in missed:
        if each.what == "contradiction":
            words.append(
                f"stable with {each.value:.1f} dB more gain, with which no loop is that the "
                "measurements allow: nothing is known above the measured band"
            )
        elif each.what == "stability":
            words.append("not stable for everything that the axis may be")
        elif each.what == "coverage":
            words.append(
                f"the last crossover at {each.value:.0f} Hz lies above the {each.limit:.0f} Hz "
                "that were measured"
            )
        else:
            words.append(_figure(each))
    return words


def _figure(each: Missed) -> str:
    """One margin that is missed, spelled out as the page's list of translations has it."""
    unit, digits = _UNITS[each.what]
    have, wanted = f"{each.value:.{digits}f}", f"{each.limit:.{digits}f}"
    words = {
        ("phase_margin", "measured"): (
            f"phase margin {have}° at worst (measured) instead of {wanted}°"
        ),
        ("phase_margin", "predicted"): (
            f"phase margin {have}° at worst (predicted) instead of {wanted}°"
        ),
        ("gain_margin", "measured"): (
            f"gain margin {have} dB at worst (measured) instead of {wanted} dB"
        ),
        ("gain_margin", "predicted"): (
            f"gain margin {have} dB at worst (predicted) instead of {wanted} dB"
        ),
        ("peak_sensitivity", "measured"): (
            f"sensitivity {have} at worst (measured) instead of {wanted}"
        ),
        ("peak_sensitivity", "predicted"): (
            f"sensitivity {have} at worst (predicted) instead of {wanted}"
        ),
    }
    names = {
        "phase_margin": "phase margin", "gain_margin": "gain margin",
        "peak_sensitivity": "sensitivity",
    }  # fmt: skip
    stated = f"{names[each.what]} {have}{unit} instead of {wanted}{unit}"
    return words.get((each.what, each.end), stated)


def misses(verdict: LoopVerdict, promised: Goals) -> tuple[Missed, ...]:
    """What a verdict misses of a promise, with what a margin may be off by."""
    return verdict.missed(promised, MARGIN_DEG, MARGIN_DB, MS_RATIO)


def as_json(verdict: LoopVerdict) -> dict[str, object]:
    """For files and pages."""
    return asdict(verdict)
