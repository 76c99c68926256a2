"""Margins of a tuned loop, measured within the measured band and predicted beyond it.

A closed loop is measured up to a frequency; its last crossover may lie above it. Within the band
margins are read from the lines, with the interval that the lines' deviations give. Beyond it they
are those of a set of loops: every plant of the design, shifted by the gain and delay (with their
deviations) by which the measured lines differ from the prediction. The verdict is the worst of
both. A measurement that shows a gain margin directly (the loop is stable with so much more gain)
removes those loops from the set that contradict it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from backend.analysis.loop.loop_goals import Goals, sensitivity_peak, stable, worst_of
from backend.analysis.signals.arrays import BoolArray, ComplexArray, FloatArray
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

    ``measured`` is None where the lines begin above the loop's crossover: what they show counts in
    ``stated``, but they cover no crossover. ``last_crossover_hz`` is the highest crossover of all
    possible loops. ``coverage``: all crossings are measured; or those beyond the band are bounded
    by a measurement with the gain raised by ``shown_gain_db``; or they are only predicted, with
    which no design is kept. ``stated`` are the worst figures of both bands, ``worst`` the ends of
    their intervals; 60 dB and 90° where no crossing is known. ``delay_s`` and ``gain_db`` are the
    corrections of the prediction by the measured lines. ``designed`` is `predicted` for the plants
    of the design alone; it decides whether the design is kept. ``contradicted``: the loop was
    stable with a raised gain at which none of the possible ones is, so that nothing is known
    beyond the band.
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

    def missed(
        self, guaranteed: Goals, margin_deg: float, margin_db: float, ms_ratio: float
    ) -> tuple[Missed, ...]:
        """Return the figures that miss the guaranteed ones by more than the tolerances; empty if
        none.

        The stated figures must reach the goals within the tolerances. The worst ends of the
        intervals of each band must not be more than `WORST_DEG` or `WORST_DB` below them.
        """
        found = []
        if self.contradicted:
            found.append(Missed("contradiction", self.shown_gain_db or 0.0, 0.0))
        if not self.stable:
            found.append(Missed("stability", 0.0, 1.0))
        if self.coverage == "predicted":
            band = self.measured.high_hz if self.measured is not None else 0.0
            found.append(Missed("coverage", self.last_crossover_hz, band))
        pairs: tuple[tuple[Missing, float, float, float], ...] = (
            ("phase_margin", self.stated.phase_margin_deg, guaranteed.phase_margin_deg, margin_deg),
            ("gain_margin", self.stated.gain_margin_db, guaranteed.gain_margin_db, margin_db),
        )
        for what, value, limit, slack in pairs:
            if value < limit - slack:
                found.append(Missed(what, value, limit))
        if self.stated.ms > guaranteed.ms * ms_ratio:
            found.append(Missed("peak_sensitivity", self.stated.ms, guaranteed.ms))
        reported = {each.what for each in found}
        ends = (
            *_short(self.measured, "measured", guaranteed),
            *_short(self.designed, "predicted", guaranteed),
        )
        return (*found, *(each for each in ends if each.what not in reported))


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
    possible = _moved(frequency_hz, loops, gain, delay)
    contradicted = False
    if shown_gain_db is not None:
        more = possible * 10 ** (shown_gain_db / 20.0)
        left = possible[np.asarray(stable(more))]
        # If no loop of the set explains the measurement, the set is wrong and supports no
        # statement.
        contradicted = not left.size
        possible = possible if contradicted else left
    over = np.abs(possible) > 1.0
    crossing = np.flatnonzero(np.any(over[:, 1:] != over[:, :-1], axis=0))
    last = float(frequency_hz[crossing[-1] + 1]) if crossing.size else 0.0
    measured = seen
    if lines is not None and crossing.size and _begins_beyond(lines):
        # What the lines show counts, but the margin of that crossover is not among it.
        measured = None
    top = 0.0 if measured is None else measured.high_hz
    coverage: Coverage = "measured" if last <= top else "predicted"
    if coverage == "predicted" and shown_gain_db is not None:
        coverage = "gain_steps"
    nominal_only = _moved_once(frequency_hz, nominal, gain, delay)
    # Where the lines show no crossover, it is one of the prediction, wherever that has it.
    shown = seen is not None and seen.phase_margin_deg is not None
    designed = _beyond(frequency_hz, possible, nominal_only, top, needs_phase=not shown)
    sound = bool(np.all(stable(possible)))
    every = possible
    if alternatives is not None and shown_gain_db is not None:
        others = _moved(frequency_hz, alternatives, gain, delay)
        others = others[np.asarray(stable(others * 10 ** (shown_gain_db / 20.0)))]
        every = np.concatenate([possible, others])
    beyond = _beyond(
        frequency_hz, every, nominal_only, top, threshold.PER_OCTAVE, shown_gain_db, not shown
    )
    stated, worst = _worst(seen, beyond)
    return LoopVerdict(
        measured, beyond, last, coverage, shown_gain_db, stated, worst, sound,
        delay, _in_db(gain), contradicted, designed,
    )  # fmt: skip


def _begins_beyond(lines: Lines) -> bool:
    """Whether the lines begin above a crossover: an integral part has more than 0 dB below it."""
    return bool(np.abs(lines.closed[0]) <= np.abs(1.0 - lines.closed[0]))


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
) -> ComplexArray:
    """Every loop with gains and delays over their whole intervals.

    Intermediate values are needed where a raised gain excludes the ends.
    """
    turn = -2j * np.pi * frequency_hz
    rows = [
        loops * np.exp(a + turn * d)
        for a in np.linspace(size.low, size.high, threshold.SIZES)
        for d in np.linspace(late_s.low, late_s.high, threshold.DELAYS)
    ]
    return np.concatenate(rows)


def excluding_db(
    verdict: LoopVerdict, frequency_hz: FloatArray, loops: ComplexArray, guaranteed: Goals
) -> float:
    """Return the gain [dB] at which no loop that misses the guaranteed margins is stable; 0 where
    none misses them.

    ``loops`` as in `judge`. A loop misses a margin if it is below it by more than the worst end of
    an interval may be. A loop that is stable with more gain than returned is therefore none of
    them.
    """
    size = Interval(*(getattr(verdict.gain_db, e) / _IN_DB for e in ("value", "low", "high")))
    least = 0.0
    for row in _moved(frequency_hz, loops, size, verdict.delay_s):
        worst = worst_of(row[None, :])
        if not worst.stable:
            continue
        misses = (
            worst.phase_margin_deg < guaranteed.phase_margin_deg - WORST_DEG
            or worst.gain_margin_db < guaranteed.gain_margin_db - WORST_DB
            or worst.ms > guaranteed.ms * _WORST_RATIO
        )
        least = max(least, worst.gain_margin_db if misses else 0.0)
    return least


def _moved_once(
    frequency_hz: FloatArray, loop: ComplexArray, size: Interval, late_s: Interval
) -> ComplexArray:
    """The nominal loop with the gain and delay that the measured lines show."""
    moved = loop * np.exp(size.value - 2j * np.pi * frequency_hz * late_s.value)
    return np.asarray(moved)[None, :]


def _beyond(
    frequency_hz: FloatArray,
    possible: ComplexArray,
    nominal: ComplexArray,
    from_hz: float,
    per_octave: float = 0.0,
    shown_gain_db: float | None = None,
    needs_phase: bool = False,
) -> BandVerdict | None:
    """Margins above the measured band: of the nominal loop, and the worst of the possible loops.

    The uncertainty of a gain margin grows by ``per_octave`` (logarithm); a gain margin shown by a
    raised gain is certain. ``needs_phase``: a loop that crosses 0 dB below the band only has the
    phase margin of that crossover, which nothing else shows.
    """
    first = int(np.searchsorted(frequency_hz, from_hz))
    # A crossover may lie between the last line and the first frequency above it.
    use: BoolArray = np.arange(frequency_hz.size) >= max(first - 1, 0)
    if frequency_hz.size - first < 2:
        return None
    f = frequency_hz[use]
    worst, mean = worst_of(possible[:, use]), worst_of(nominal[:, use])
    octaves = np.log2(np.maximum(f / from_hz, 1.0)) if from_hz > 0.0 else np.zeros(f.size)
    larger = np.exp(per_octave * octaves)
    least_db = max(worst_of(possible[:, use] * larger).gain_margin_db, shown_gain_db or 0.0)
    least_db = min(worst.gain_margin_db, least_db)
    peak = sensitivity_peak(nominal[:, use])
    over = np.abs(possible[:, use]) > 1.0
    crosses = bool(np.any(over[:, 1:] != over[:, :-1]))
    phase = (
        Interval(mean.phase_margin_deg, worst.phase_margin_deg, mean.phase_margin_deg)
        if crosses
        else None
    )
    if phase is None and needs_phase and first > 1:
        whole = _beyond(frequency_hz, possible, nominal, 0.0)
        phase = None if whole is None else whole.phase_margin_deg
    gain = Interval(mean.gain_margin_db, least_db, mean.gain_margin_db)
    return BandVerdict(
        max(float(f[0]), from_hz),
        float(f[-1]),
        phase,
        gain if least_db < threshold.MOST_DB else None,
        Interval(peak, peak, max(worst.ms, peak)),
    )


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
