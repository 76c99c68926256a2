"""Verdict on a tuned loop from its measurement and from the plant it was designed for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from backend.analysis.loop.design import Candidate
from backend.analysis.loop.loop_goals import Goals
from backend.analysis.loop.loop_structure import LoopFilters, speed_loop
from backend.analysis.loop.loop_verdict import Lines, LoopVerdict, Missed, judge
from backend.analysis.loop.measured_plant import MeasuredPlant
from backend.analysis.loop.notch import Notch
from backend.analysis.response.frf import Frf
from backend.analysis.response.signal_path.reference_path import ReferencePath, reference_paths
from backend.analysis.response.signal_path.sampling import Hold
from backend.analysis.signals.arrays import BoolArray, ComplexArray, FloatArray
from backend.axes.axis.axis import Axis
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.thresholds import autotune_verdict as threshold
from backend.tools.tuning.autotune.design import gains as gain_tool
from backend.tools.tuning.notch import filters as notch_tool
from backend.tools.tuning.notch.meaning import meaning_of
from drivers.texts.message import Text, text

MARGIN_DB = threshold.MARGIN_DB
MARGIN_DEG = threshold.MARGIN_DEG
MS_RATIO = threshold.MS_RATIO
COHERENT = threshold.COHERENT
BLURRED_DEG = threshold.BLURRED_DEG
LINES = threshold.LINES
#: The lines must begin within the loop's bandwidth, or its crossover may lie below them.
WITHIN = 10 ** (-3.0103 / 20.0)
#: By goal and band: the message code, and the unit suffix of its parameters.
_MARGINS: dict[tuple[str, str], tuple[str, str]] = {
    ("phase_margin", "measured"): ("autotune.phase-margin-measured", "_deg"),
    ("phase_margin", "predicted"): ("autotune.phase-margin-predicted", "_deg"),
    ("gain_margin", "measured"): ("autotune.gain-margin-measured", "_db"),
    ("gain_margin", "predicted"): ("autotune.gain-margin-predicted", "_db"),
    ("peak_sensitivity", "measured"): ("autotune.sensitivity-measured", ""),
    ("peak_sensitivity", "predicted"): ("autotune.sensitivity-predicted", ""),
}
#: The same where the whole loop misses the goal.
_STATED = {
    "phase_margin": ("autotune.phase-margin", "_deg"),
    "gain_margin": ("autotune.gain-margin", "_db"),
    "peak_sensitivity": ("autotune.sensitivity", ""),
}


def fixed_of(
    axis: Axis, facts: AxisFacts, notches: tuple[Notch, ...], filters: LoopFilters, f: FloatArray
) -> ComplexArray:
    """Frequency response of the drive's loop without its gains and the mechanics [lines].

    Raises:
        NotAllowed, ValueError: a part of the loop has no known meaning.
    """
    drive = axis.drive
    fixed = gain_tool.loops_of(drive, facts).with_filters(filters).response(f)
    if notches:
        fixed = fixed * notch_tool.combined(drive.profile, notches, f, meaning_of(drive))
    return fixed


def sharp(frf: Frf) -> BoolArray:
    """Which lines have a small standard deviation [n]; an unknown one, of a single period, is none.

    Lines without any scatter are of a single period as well.
    """
    return _known_to(frf, BLURRED_DEG)


def _known_to(frf: Frf, deg: float) -> BoolArray:
    """Coherent lines whose standard deviation is known and at most this [n]."""
    known = np.isfinite(frf.std_db) & np.isfinite(frf.std_deg)
    known &= np.hypot(frf.std_db, frf.std_deg) > 0.0
    coherent = frf.in_band & (frf.coherence > COHERENT)
    return np.asarray(known & coherent & (frf.std_deg <= deg))


def sharp_lines(frf: Frf) -> Lines | None:
    """Lines from which margins can be read; None where they begin above the loop's bandwidth."""
    found = reported_lines(frf)
    return None if found is None or np.abs(found.closed[0]) < WITHIN else found


def reported_lines(frf: Frf) -> Lines | None:
    """Lines with a small standard deviation, up to the first gap; None where there are too few.

    In a slow loop they lie above its crossover: they show its gain and delay, but not the margins
    of that crossover.
    """
    found = _lines(frf, BLURRED_DEG)
    return None if found is None else _up_to_gap(found)


def _lines(frf: Frf, deg: float) -> Lines | None:
    """Lines with a standard deviation up to this, beyond gaps too; None where there are too few."""
    use = _known_to(frf, deg)
    f, closed = frf.frequency_hz[use], frf.response[use]
    if f.size < LINES:
        return None
    parts = (np.log(10.0) / 20.0 * frf.std_db[use], np.radians(frf.std_deg[use]))
    return Lines(f, closed, np.asarray(np.sqrt(0.5 * sum(part**2 for part in parts))))


def _up_to_gap(lines: Lines) -> Lines:
    part = pieces(lines.frequency_hz)[0]
    return Lines(lines.frequency_hz[part], lines.closed[part], lines.deviation[part])


def pieces(frequency_hz: FloatArray) -> list[slice]:
    """Parts of these lines without a gap. Between two of them the loop may turn either way."""
    gaps = np.flatnonzero(frequency_hz[1:] > threshold.GAP * frequency_hz[:-1])
    # Below 20 Hz the lines of a linear grid are far apart anyway.
    ends = [int(i) + 1 for i in gaps if frequency_hz[i] > 20.0]
    return [slice(a, b) for a, b in zip([0, *ends], [*ends, frequency_hz.size], strict=True)]


def loops_of(
    axis: Axis, facts: AxisFacts, candidate: Candidate, f: FloatArray, plants: ComplexArray
) -> ComplexArray:
    """Open speed loops of this design with each of these plants [plants, lines].

    Raises:
        NotAllowed, ValueError: a part of the loop has no known meaning.
    """
    fixed = fixed_of(axis, facts, candidate.notches, candidate.filters, f)
    return speed_loop(f, plants, fixed, candidate.gains)


def verdict_of(
    axis: Axis,
    facts: AxisFacts,
    plant: MeasuredPlant,
    candidate: Candidate,
    frf: Frf,
    hold: Hold | None,
    shown_gain_db: float | None = None,
) -> LoopVerdict:
    """Verdict on this design's loop; the worst one of `verdicts_of`.

    Raises:
        NotAllowed, ValueError: a part of the loop has no known meaning.
    """
    found = verdicts_of(axis, facts, plant, candidate, frf, hold, shown_gain_db)
    return worst_of_paths(found)


def worst_of_paths(found: Sequence[LoopVerdict]) -> LoopVerdict:
    """The worst verdict over the possible paths of a reference.

    A path with which no loop is stable with the gain that was raised is not the reference's.
    """
    possible = [each for each in found if not each.contradicted] or found
    return min(possible, key=lambda v: v.stated.phase_margin_deg)


def verdicts_of(
    axis: Axis,
    facts: AxisFacts,
    plant: MeasuredPlant,
    candidate: Candidate,
    frf: Frf,
    hold: Hold | None,
    shown_gain_db: float | None = None,
) -> tuple[LoopVerdict, ...]:
    """Verdicts on this design's loop, one for each possible path of its reference.

    Raises:
        NotAllowed, ValueError: a part of the loop has no known meaning.
    """

    def loops(f: FloatArray, plants: ComplexArray) -> ComplexArray:
        return loops_of(axis, facts, candidate, f, plants)

    dense = plant.frequency_hz
    every, nominal = loops(dense, plant.shifted()), loops(dense, plant.response())
    alternatives = None
    if facts.motor_inertia_kgm2:
        alternatives = loops(dense, plant.motor_alone_above(facts.motor_inertia_kgm2))[None, :]

    def judged(lines: Lines | None, path: ReferencePath | None) -> LoopVerdict:
        late_s, size = (path.loop_late_s, path.loop_size) if path else (None, None)
        if lines is None and late_s is not None and size is not None:
            # Many blurred lines average their noise, but not what all of them are off by.
            late_s = (late_s[0], float(np.hypot(late_s[1], threshold.COMMON_LATE_S)))
            size = (size[0], float(np.hypot(size[1], threshold.COMMON_SIZE)))
        return judge(
            lines,
            dense,
            every,
            nominal,
            shown_gain_db=shown_gain_db,
            late_s=late_s,
            size=size,
            alternatives=alternatives,
        )

    # Delay and gain of the loop show on all lines together, each by its deviation; margins only on
    # sharp ones, without gaps between them.
    shown = _lines(frf, threshold.SHOWN_DEG)
    if shown is None:
        return (judged(None, None),)
    f = shown.frequency_hz
    expected = loops(f, plant.on(f).response())
    paths = reference_paths(
        f,
        shown.closed,
        shown.deviation,
        expected,
        rate_hz=frf.sample_rate_hz,
        hold=hold or ("linear" if facts.interpolates else "zero"),
    )
    clear = sharp(frf)[_known_to(frf, threshold.SHOWN_DEG)]
    found = []
    for path in paths:
        lines = None
        if np.count_nonzero(clear) >= LINES:
            lines = _up_to_gap(Lines(f[clear], path.closed[clear], shown.deviation[clear]))
        found.append(judged(lines, path))
    return tuple(found)


def in_words(missed: tuple[Missed, ...]) -> list[Text]:
    """Messages for the goals that a verdict misses."""
    said = []
    for each in missed:
        if each.what == "contradiction":
            said.append(text("autotune.contradiction", gain_db=each.value))
        elif each.what == "stability":
            said.append(text("autotune.not-stable"))
        elif each.what == "coverage" and each.limit == 0.0:
            said.append(text("autotune.crossover-unmeasured", crossover_hz=each.value))
        elif each.what == "coverage":
            below = each.value < each.limit
            code = (
                "autotune.crossover-below-measured"
                if below
                else "autotune.crossover-above-measured"
            )
            said.append(text(code, crossover_hz=each.value, measured_hz=each.limit))
        else:
            code, unit = _MARGINS.get((each.what, each.end)) or _STATED[each.what]
            said.append(Text(code, {f"have{unit}": each.value, f"wanted{unit}": each.limit}))
    return said


def misses(verdict: LoopVerdict, guaranteed: Goals) -> tuple[Missed, ...]:
    """Goals that a verdict misses by more than the tolerance of a margin."""
    return verdict.missed(guaranteed, MARGIN_DEG, MARGIN_DB, MS_RATIO)
