"""Margins of a tuned loop, measured within the measured band and predicted beyond it.

A closed loop is measured over a band; its first crossover may lie below it, and its last above.
Within the band margins are read from the lines, with the interval that the lines' deviations
give. Beyond it they are those of a set of loops: every plant of the design, shifted by the gain
and delay (with their deviations) by which the measured lines differ from the prediction. The
verdict is the worst of both. A measurement that shows a gain margin directly (the loop is stable
with so much more gain) removes those loops from the set that contradict it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from backend.analysis.loop.loop_goals import Goals, each_of, sensitivity_peak, stable, worst_of
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import loop_verdict as threshold

#: Standard deviations to either side of a value that give a 95 % interval.
_CI95 = 1.96

Coverage = Literal["measured", "gain_steps", "predicted"]
Missing = Literal[
    "phase_margin", "gain_margin", "peak_sensitivity", "stability", "coverage", "contradiction"
]
#: Origin of a figure that misses its limit: the stated value, or the worst interval end of a band.
End = Literal["stated", "measured", "predicted"]
WORST_DEG = threshold.WORST_DEG
WORST_DB = threshold.WORST_DB
_WORST_RATIO = 10 ** (WORST_DB / 20.0)
#: Converts the natural logarithm of a magnitude to dB.
_IN_DB = 20.0 / float(np.log(10.0))


@dataclass(frozen=True)
class Interval:
    """A value with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class BandVerdict:
    """Margins over one band, in degrees and dB; None where nothing crosses there.

    ``peak_sensitivity`` is the largest |S| within the band: it may be below 1 there and is then not
    the peak sensitivity Ms of the loop (by Bode's integral that is above 1).
    """

    low_hz: float
    high_hz: float
    phase_margin_deg: Interval | None
    gain_margin_db: Interval | None
    peak_sensitivity: Interval | None


@dataclass(frozen=True)
class Missed:
    """One figure that misses its limit; ``end`` is the part of its interval that does."""

    what: Missing
    value: float
    limit: float
    end: End = "stated"


@dataclass(frozen=True)
class LoopVerdict:
    """``measured`` over its band, ``predicted`` beyond it, and the worst case of both.

    ``predicted`` covers what lies above the band and, where the lines begin above a crossover, what
    lies below it. ``last_crossover_hz`` is the highest crossover of all possible loops.
    ``uncovered_hz`` is a crossover that no line covers, and the end of the band next to it [Hz].
    ``coverage``: all crossings are measured; or the others are bounded by a measurement with the
    gain raised by ``shown_gain_db``; or they are only predicted, with which no design is kept.
    ``stated`` are the worst figures of both bands, ``worst`` the ends of their intervals; 60 dB
    and 90° where no crossing is known. ``delay_s`` and ``gain_db`` are the corrections of the
    prediction by the measured lines. ``designed`` is `predicted` for the plants of the design
    alone; it decides whether the design is kept. ``contradicted``: the loop was stable with a
    raised gain at which none of the possible ones is, so that nothing is known beyond the band.
    """

    measured: BandVerdict | None
    predicted: BandVerdict | None
    last_crossover_hz: float
    coverage: Coverage
    shown_gain_db: float | None
    stated: Goals
    worst: Goals
    stable: bool
    delay_s: Interval
    gain_db: Interval
    contradicted: bool = False
    designed: BandVerdict | None = None
    uncovered_hz: tuple[float, float] | None = None

    def missed(
        self, guaranteed: Goals, margin_deg: float, margin_db: float, ms_ratio: float
    ) -> tuple[Missed, ...]:
        """Return the figures that miss the guaranteed ones by more than the tolerances; empty if
        none.

        The stated figures must reach the goals within the tolerances. The worst ends of the
        intervals of each band must not be more than `WORST_DEG` or `WORST_DB` below them. What the
        lines show ends as "stated" or "measured"; what is predicted, and a loop among the possible
        ones that is not stable, as "predicted".
        """
        found = []
        if self.contradicted:
            found.append(Missed("contradiction", self.shown_gain_db or 0.0, 0.0))
        if not self.stable:
            found.append(Missed("stability", 0.0, 1.0, "predicted"))
        if self.coverage == "predicted" and self.uncovered_hz is not None:
            found.append(Missed("coverage", *self.uncovered_hz))
        slack = (margin_deg, margin_db, ms_ratio)
        found += _below(self.measured, "stated", guaranteed, *slack)
        reported = {each.what for each in found}
        ends = (
            *_short(self.measured, "measured", guaranteed),
            *_short(self.designed, "predicted", guaranteed),
            *_below(self.predicted, "predicted", guaranteed, *slack),
        )
        for each in ends:
            if each.what not in reported:
                found.append(each)
                reported.add(each.what)
        return tuple(found)


def _below(
    band: BandVerdict | None,
    end: End,
    guaranteed: Goals,
    margin_deg: float,
    margin_db: float,
    ms_ratio: float,
) -> list[Missed]:
    """Stated values of a band that miss a guaranteed one by more than the tolerances.

    Of a prediction the worst end of the interval is named, as everywhere.
    """
    if band is None:
        return []

    def named(each: Interval, worst: float) -> float:
        return worst if end == "predicted" else each.value

    found = []
    phase, gain, peak = band.phase_margin_deg, band.gain_margin_db, band.peak_sensitivity
    if phase is not None and phase.value < guaranteed.phase_margin_deg - margin_deg:
        limit = guaranteed.phase_margin_deg
        found.append(Missed("phase_margin", named(phase, phase.low), limit, end))
    if gain is not None and gain.value < guaranteed.gain_margin_db - margin_db:
        limit = guaranteed.gain_margin_db
        found.append(Missed("gain_margin", named(gain, gain.low), limit, end))
    if peak is not None and peak.value > guaranteed.ms * ms_ratio:
        found.append(Missed("peak_sensitivity", named(peak, peak.high), guaranteed.ms, end))
    return found


def _short(band: BandVerdict | None, end: End, guaranteed: Goals) -> list[Missed]:
    """Interval ends of a band that are too far below a guaranteed value."""
    if band is None:
        return []
    found = []
    phase, gain, peak = band.phase_margin_deg, band.gain_margin_db, band.peak_sensitivity
    if phase is not None and phase.low < guaranteed.phase_margin_deg - WORST_DEG:
        found.append(Missed("phase_margin", phase.low, guaranteed.phase_margin_deg, end))
    if gain is not None and gain.low < guaranteed.gain_margin_db - WORST_DB:
        found.append(Missed("gain_margin", gain.low, guaranteed.gain_margin_db, end))
    if peak is not None and peak.high > guaranteed.ms * _WORST_RATIO:
        found.append(Missed("peak_sensitivity", peak.high, guaranteed.ms, end))
    return found


@dataclass(frozen=True)
class Lines:
    """A measured closed loop [n]; ``deviation`` (one sigma) of its logarithm, per component."""

    frequency_hz: FloatArray
    closed: ComplexArray
    deviation: FloatArray


def judge(
    lines: Lines | None,
    frequency_hz: FloatArray,
    loops: ComplexArray,
    nominal: ComplexArray,
    *,
    shown_gain_db: float | None = None,
    late_s: tuple[float, float] | None = None,
    size: tuple[float, float] | None = None,
    alternatives: ComplexArray | None = None,
) -> LoopVerdict:
    """Return the verdict on a loop.

    ``loops`` [m, n] on the dense grid ``frequency_hz`` are all loops that may be the real one,
    ``nominal`` [n] the predicted one. ``lines`` None: nothing was measured. ``late_s`` and ``size``
    (logarithm) are delay and gain of the measured lines beyond the prediction, each with its
    deviation; None where they show nothing. ``alternatives`` [k, n] are loops that the design does
    not include and no measurement excludes above its band: where a raised gain does not exclude
    them either, they widen the stated intervals there.
    """
    seen = None
    if lines is not None and lines.frequency_hz.size >= threshold.FEW:
        seen = _measured(lines)
    delay, gain = (
        _known(late_s, threshold.LATE_S, threshold.UNSEEN_S),
        _known(size, threshold.SIZE, threshold.UNSEEN),
    )
    # The measured delay may worsen the prediction beyond the band, but never improve it.
    delay = Interval(max(delay.value, 0.0), max(delay.low, 0.0), max(delay.high, threshold.LATE_S))
    possible, likely = _moved(frequency_hz, loops, gain, delay)
    contradicted = False
    if shown_gain_db is not None:
        left = np.asarray(stable(possible * 10 ** (shown_gain_db / 20.0)))
        # If no loop of the set explains the measurement, the set is wrong and supports no
        # statement.
        contradicted = not np.any(left)
        if not contradicted:
            possible, likely = possible[left], likely[left]
    gap = _gap(lines if seen is not None else None, frequency_hz, possible)
    coverage: Coverage = "measured" if gap.uncovered_hz is None else "predicted"
    if coverage == "predicted" and shown_gain_db is not None:
        coverage = "gain_steps"
    nominal_only = _moved_once(frequency_hz, nominal, gain, delay)
    if shown_gain_db is not None:
        found = _left_of(frequency_hz, nominal, gain, delay, shown_gain_db)
        # With none of its gains and delays the nominal plant is what is left: another one is.
        nominal_only = possible[[int(np.argmax(likely))]] if found is None else found
    designed = _beyond(frequency_hz, possible, nominal_only, gap)
    sound = bool(np.all(stable(possible)))
    every = possible
    if alternatives is not None and shown_gain_db is not None:
        others, _likely_too = _moved(frequency_hz, alternatives, gain, delay)
        others = others[np.asarray(stable(others * 10 ** (shown_gain_db / 20.0)))]
        every = np.concatenate([possible, others])
    beyond = _beyond(frequency_hz, every, nominal_only, gap, threshold.PER_OCTAVE, shown_gain_db)
    stated, worst = _worst(seen, beyond)
    return LoopVerdict(
        seen, beyond, gap.last_hz, coverage, shown_gain_db, stated, worst, sound,
        delay, _in_db(gain), contradicted, designed, gap.uncovered_hz,
    )  # fmt: skip


@dataclass(frozen=True)
class _Gap:
    """What the lines do not cover: the dense grid up to ``below`` and from ``above`` on.

    ``below`` and ``above`` are indices, ``below`` 0 where nothing is open there. ``top_hz`` is the
    end of the measured band, ``last_hz`` the highest crossover; ``uncovered_hz`` as in
    `LoopVerdict`.
    """

    below: int
    above: int
    top_hz: float
    last_hz: float
    uncovered_hz: tuple[float, float] | None


def _gap(lines: Lines | None, frequency_hz: FloatArray, possible: ComplexArray) -> _Gap:
    over = np.abs(possible) > 1.0
    crosses = over[:, 1:] != over[:, :-1]
    at = np.flatnonzero(np.any(crosses, axis=0))
    first, last = (
        (float(frequency_hz[at[0]]), float(frequency_hz[at[-1] + 1])) if at.size else (0.0, 0.0)
    )
    if lines is None:
        return _Gap(0, 0, 0.0, last, (last, 0.0) if at.size else None)
    low, top = float(lines.frequency_hz[0]), float(lines.frequency_hz[-1])
    # The segment that the end of the band lies in belongs to both: no crossover is between them.
    below = 0
    above = max(int(np.searchsorted(frequency_hz, top, "right")) - 1, 0)
    uncovered_hz = (last, top) if last > top else None
    if at.size and not _amplifies(lines.closed[0]):
        # Above all crossovers, or below one that an integral part has: it lies below the lines.
        below = int(np.searchsorted(frequency_hz, low)) + 1
        uncovered_hz = uncovered_hz or (min(first, low), low)
    if at.size and _amplifies(lines.closed[-1]):
        # The loop crosses above the lines, also where the prediction does before their end.
        each = crosses[np.any(crosses, axis=1)]
        above = min(above, int(np.min(each.shape[1] - 1 - np.argmax(each[:, ::-1], axis=1))))
        uncovered_hz = uncovered_hz or (max(last, top), top)
    return _Gap(below, above, top, last, uncovered_hz)


def _amplifies(closed: complex) -> bool:
    """Whether the loop has more than 0 dB where its closed loop has this value."""
    return bool(abs(closed) > abs(1.0 - closed))


def _in_db(size: Interval) -> Interval:
    return Interval(_IN_DB * size.value, _IN_DB * size.low, _IN_DB * size.high)


def _measured(lines: Lines) -> BandVerdict:
    """Margins of the measured lines; the deviation of S = 1 - T is |T| times that of log T."""
    f, closed = lines.frequency_hz, lines.closed
    loop = closed / (1.0 - closed)
    apart = lines.deviation * np.abs(closed)
    steep = lines.deviation / np.maximum(np.abs(1.0 - closed), 1e-9)
    s = np.abs(1.0 - closed)
    top = int(np.argmax(s))
    peak = Interval(
        float(s[top]), float(np.max(s - _CI95 * apart)), float(s[top] + _CI95 * apart[top])
    )
    over = np.abs(loop) > 1.0
    at = np.flatnonzero(over[1:] != over[:-1])
    margins = []
    for i in at:
        share = _share(np.log(np.abs(loop[i])), np.log(np.abs(loop[i + 1])))
        turn = np.unwrap(np.angle(-loop[i : i + 2]))
        value = float(np.degrees(abs(turn[0] * (1 - share) + turn[1] * share)))
        off = _CI95 * float(np.degrees(max(steep[i], steep[i + 1])))
        margins.append(Interval(value, value - off, value + off))
    phase = _least(margins)
    gains = []
    flips = (loop.imag[1:] > 0) != (loop.imag[:-1] > 0)
    for i in np.flatnonzero(flips & (loop.real[1:] < 0) & (loop.real[:-1] < 0)):
        share = _share(float(loop.imag[i]), float(loop.imag[i + 1]))
        level = -(loop.real[i] * (1 - share) + loop.real[i + 1] * share)
        if 0.0 < level < 1.0:
            value = float(-20.0 * np.log10(level))
            off = _CI95 * 20.0 / np.log(10.0) * float(max(steep[i], steep[i + 1]))
            gains.append(Interval(value, value - off, value + off))
    gain = _least(gains)
    return BandVerdict(float(f[0]), float(f[-1]), phase, gain, peak)


def _least(margins: list[Interval]) -> Interval | None:
    """Smallest of several margins, for value and interval ends separately: the lowest end need not
    belong to the lowest value.
    """
    if not margins:
        return None
    return Interval(
        min(m.value for m in margins), min(m.low for m in margins), min(m.high for m in margins)
    )


def _share(before: float, after: float) -> float:
    """Fraction (0 to 1) of the way between two values of opposite sign at which zero lies."""
    return 0.5 if before == after else float(np.clip(before / (before - after), 0.0, 1.0))


def _known(found: tuple[float, float] | None, least: float, unseen: float) -> Interval:
    """Interval of a value from its deviation, at least ``least``; without a value, ``unseen``."""
    if found is None:
        return Interval(0.0, -least, unseen)
    value, std = found
    off = float(np.hypot(_CI95 * std, least))
    return Interval(value, value - off, value + off)


def _moved(
    frequency_hz: FloatArray, loops: ComplexArray, size: Interval, late_s: Interval
) -> tuple[ComplexArray, FloatArray]:
    """Every loop with gains and delays over their whole intervals, and how likely each is.

    Intermediate values are needed where a raised gain excludes the ends: so many that the phase
    differs little from one to the next where the loops cross 0 dB for the last time.
    """
    turn = -2j * np.pi * frequency_hz
    at = np.flatnonzero(np.any(np.abs(loops) > 1.0, axis=0))
    last_hz = float(frequency_hz[at[-1]]) if at.size else 0.0
    turned_deg = 360.0 * last_hz * (late_s.high - late_s.low)
    delays = int(np.clip(np.ceil(turned_deg / threshold.APART_DEG) + 1, *threshold.DELAYS))
    sizes, lates = (
        each.ravel()
        for each in np.meshgrid(
            np.linspace(size.low, size.high, threshold.SIZES),
            np.linspace(late_s.low, late_s.high, delays),
            indexing="ij",
        )
    )
    rows = [loops * np.exp(a + turn * d) for a, d in zip(sizes, lates, strict=True)]
    likely = _likely(sizes, size) * _likely(lates, late_s)
    return np.concatenate(rows), np.repeat(likely, len(loops))


def excluding_db(
    verdict: LoopVerdict, frequency_hz: FloatArray, loops: ComplexArray, guaranteed: Goals
) -> float:
    """Return the gain [dB] at which no loop that misses the guaranteed margins is stable; 0 where
    none misses them.

    ``loops`` as in `judge`. A loop misses a margin if it is below it by more than the worst end of
    an interval may be. A loop that is stable with more gain than returned is therefore none of
    them.
    """
    moved, _likely_each = _moved(frequency_hz, loops, _size_of(verdict), verdict.delay_s)
    every = each_of(moved)
    misses = (
        (every.phase_margin_deg < guaranteed.phase_margin_deg - WORST_DEG)
        | (every.gain_margin_db < guaranteed.gain_margin_db - WORST_DB)
        | (every.ms > guaranteed.ms * _WORST_RATIO)
    )
    return float(np.max(every.gain_margin_db[misses & every.stable], initial=0.0))


def as_measured(
    verdict: LoopVerdict, frequency_hz: FloatArray, nominal: ComplexArray
) -> ComplexArray:
    """The nominal loop [1, n] with the delay and gain that the lines of a verdict show."""
    return _moved_once(frequency_hz, nominal, _size_of(verdict), verdict.delay_s)


def _size_of(verdict: LoopVerdict) -> Interval:
    """The gain of the measured lines beyond the prediction, as a logarithm."""
    gain = verdict.gain_db
    return Interval(gain.value / _IN_DB, gain.low / _IN_DB, gain.high / _IN_DB)


def _moved_once(
    frequency_hz: FloatArray, loop: ComplexArray, size: Interval, late_s: Interval
) -> ComplexArray:
    """The nominal loop with the gain and delay that the measured lines show."""
    moved = loop * np.exp(size.value - 2j * np.pi * frequency_hz * late_s.value)
    return np.asarray(moved)[None, :]


def _left_of(
    frequency_hz: FloatArray,
    loop: ComplexArray,
    size: Interval,
    late_s: Interval,
    shown_gain_db: float,
) -> ComplexArray | None:
    """The nominal loop as measured; where a raised gain excludes that, the mean of what it leaves.

    Gain and delay are normal over their intervals. None where nothing is left.
    """
    once = _moved_once(frequency_hz, loop, size, late_s)
    more = 10 ** (shown_gain_db / 20.0)
    if bool(stable(once * more)[0]):
        return once
    grids = [np.linspace(each.low, each.high, threshold.LEFT_STEPS) for each in (size, late_s)]
    sizes, delays = (each.ravel() for each in np.meshgrid(*grids))
    turn = -2j * np.pi * frequency_hz
    left = np.asarray(stable(loop * np.exp(sizes[:, None] + turn * delays[:, None]) * more))
    if not np.any(left):
        return None
    weight = np.where(left, _likely(sizes, size) * _likely(delays, late_s), 0.0)
    mean = [float(np.average(each, weights=weight)) for each in (sizes, delays)]
    return np.asarray(loop * np.exp(mean[0] + turn * mean[1]))[None, :]


def _likely(values: FloatArray, interval: Interval) -> FloatArray:
    """Relative probability of these values, from the larger half of a 95 % interval."""
    half = max(interval.high - interval.value, interval.value - interval.low, 1e-12)
    std = half / _CI95
    return np.asarray(np.exp(-0.5 * ((values - interval.value) / std) ** 2))


def _beyond(
    frequency_hz: FloatArray,
    possible: ComplexArray,
    nominal: ComplexArray,
    gap: _Gap,
    per_octave: float = 0.0,
    shown_gain_db: float | None = None,
) -> BandVerdict | None:
    """Margins outside the measured band: of the nominal loop, and the worst of the possible loops.

    The uncertainty of a gain margin grows by ``per_octave`` (logarithm) above the band; a gain
    margin shown by a raised gain is certain.
    """
    octaves = np.zeros(frequency_hz.size)
    if gap.top_hz > 0.0:
        octaves = np.maximum(np.log2(frequency_hz / gap.top_hz), 0.0)
    larger = possible * np.exp(per_octave * octaves)
    open_ = [part for part in (slice(0, gap.below), slice(gap.above, None)) if _long(part, octaves)]
    if not open_:
        return None
    worst = [worst_of(possible[:, part]) for part in open_]
    mean = [worst_of(nominal[:, part]) for part in open_]
    least_db = min(worst_of(larger[:, part]).gain_margin_db for part in open_)
    least_db = max(least_db, shown_gain_db or 0.0)
    least_db = min(least_db, *(each.gain_margin_db for each in worst))
    peak = max(sensitivity_peak(nominal[:, part]) for part in open_)
    over = np.abs(possible) > 1.0
    crosses = any(bool(np.any(over[:, part][:, 1:] != over[:, part][:, :-1])) for part in open_)
    usual_deg = min(each.phase_margin_deg for each in mean)
    least_deg = min(each.phase_margin_deg for each in worst)
    usual_db = min(each.gain_margin_db for each in mean)
    return BandVerdict(
        float(frequency_hz[0 if gap.below else gap.above]),
        float(frequency_hz[-1]),
        Interval(usual_deg, least_deg, usual_deg) if crosses else None,
        Interval(usual_db, least_db, usual_db) if least_db < threshold.MOST_DB else None,
        Interval(peak, peak, max(peak, *(each.ms for each in worst))),
    )


def _long(part: slice, grid: FloatArray) -> bool:
    """Whether a part of the grid has a segment."""
    return grid[part].size >= 2


def _worst(measured: BandVerdict | None, beyond: BandVerdict | None) -> tuple[Goals, Goals]:
    """The worst stated figures of both bands, and the worst ends of their intervals."""
    bands = [band for band in (measured, beyond) if band is not None]
    phase = [b.phase_margin_deg for b in bands if b.phase_margin_deg is not None]
    gain = [b.gain_margin_db for b in bands if b.gain_margin_db is not None]
    peak = [b.peak_sensitivity for b in bands if b.peak_sensitivity is not None]

    def goals(end: Literal["value", "worst"]) -> Goals:
        low = "value" if end == "value" else "low"
        high = "value" if end == "value" else "high"
        return Goals(
            min((getattr(i, low) for i in gain), default=threshold.MOST_DB),
            min((getattr(i, low) for i in phase), default=90.0),
            max([1.0, *(getattr(i, high) for i in peak)]),
        )

    return goals("value"), goals("worst")
