"""Loop gains and notches on the measured response.

The drive's loop: speed error -> PI -> notches -> torque filter -> current loop and delay ->
mechanics -> speed filter. Candidates are every notch set of a small family with the highest gain
that keeps the goals for all modes shifted by ±5 % and a range of damping; the prediction rests
on the measured lines, and on the model only between and above them.

Gain margin, phase margin and maximum sensitivity as in Åström & Hägglund, *Advanced PID Control*
(2006), section 4.6.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal

import numpy as np

from backend.analysis.arrays import BoolArray, ComplexArray, FloatArray
from backend.analysis.frf import Frf
from backend.analysis.margins import Margins, bandwidth, closed_from_open, margins
from backend.analysis.mechanical_model import MechanicalModel
from backend.analysis.notch import Notch
from backend.analysis.sampling import delay_response, lag_response
from backend.analysis.step import step_metrics

TURN = 2.0 * np.pi
LoadClass = Literal["stiff", "medium", "compliant"]
Mark = Literal["robust", "balanced", "fast"]
NotchResponse = Callable[[Notch, FloatArray], ComplexArray]

#: Modes may move by this factor in frequency and this in damping after the measurement.
FREQUENCY_FACTORS = (0.95, 1.0, 1.05)
DAMPING_FACTORS = (0.6, 1.0, 1.4)


@dataclass(frozen=True)
class Goals:
    """What every candidate must keep in its worst case."""

    gain_margin_db: float
    phase_margin_deg: float
    ms: float


_BALANCED: dict[LoadClass, Goals] = {
    "stiff": Goals(8.0, 45.0, 1.9),
    "medium": Goals(9.0, 48.0, 1.8),
    "compliant": Goals(10.0, 52.0, 1.7),
}


def goals_for(load: LoadClass, mark: Mark) -> Goals:
    """Goals of a load class: robust asks for more margin, fast accepts less."""
    base = _BALANCED[load]
    if mark == "robust":
        return Goals(base.gain_margin_db + 3.0, base.phase_margin_deg + 7.0, base.ms - 0.25)
    if mark == "fast":
        return Goals(base.gain_margin_db - 2.0, base.phase_margin_deg - 8.0, base.ms + 0.3)
    return base


@dataclass(frozen=True)
class DriveLoops:
    """The fixed parts of the drive's loop; None means not there.

    ``delay_s`` is everything that the loop itself adds: computing, holding the torque, measuring
    the speed.
    """

    current_bandwidth_hz: float
    delay_s: float
    speed_filter_hz: float | None = None
    torque_filter_hz: float | None = None
    highest_speed_bandwidth_hz: float | None = None

    def response(self, frequency_hz: FloatArray) -> ComplexArray:
        """All fixed parts in series."""
        return np.asarray(
            lag_response(frequency_hz, self.current_bandwidth_hz)
            * lag_response(frequency_hz, self.torque_filter_hz)
            * lag_response(frequency_hz, self.speed_filter_hz)
            * delay_response(frequency_hz, self.delay_s)
        )


@dataclass(frozen=True)
class Gains:
    """``speed_nms`` Nm per rad/s; ``integral_hz`` corner of the PI; ``position_1_s`` 1/s.

    ``speed_bandwidth_hz`` is speed_nms/(2π·J), as drives with a bandwidth convention state it.
    """

    speed_nms: float
    integral_hz: float
    position_1_s: float
    speed_bandwidth_hz: float


@dataclass(frozen=True)
class Candidate:
    """One row of the table.

    ``bandwidth_hz`` (-3 dB), ``overshoot_percent`` and ``settling_s`` (2 %) are of the speed
    loop; ``nominal`` margins are predicted for the axis as measured, ``promised`` is the worst
    over all shifts; ``phase_cost_deg`` is what the notches take at the crossover.
    """

    notches: tuple[Notch, ...]
    gains: Gains
    bandwidth_hz: float | None
    position_bandwidth_hz: float | None
    nominal: Margins
    promised: Goals
    phase_cost_deg: float
    overshoot_percent: float
    settling_s: float | None
    marks: tuple[Mark, ...] = ()


def continuous_notch(notch: Notch, frequency_hz: FloatArray) -> ComplexArray:
    """Notch response for drives that realise it without noticeable rounding."""
    return notch.response(frequency_hz)


#: A resonance is known a little way beyond the highest line.
_BEYOND = 1.25


@dataclass(frozen=True)
class MeasuredPlant:
    """Mechanics on a dense grid: measured lines where there are any, the model elsewhere.

    ``measured_hz`` is the highest of these lines.
    """

    frequency_hz: FloatArray
    correction: ComplexArray
    model: MechanicalModel
    measured_hz: float

    def response(self, frequency_factor: float = 1.0, damping_factor: float = 1.0) -> ComplexArray:
        """Response with all modes moved; the measured deviation from the model stays."""
        moved = self.model.perturbed(frequency_factor, damping_factor)
        return np.asarray(moved.response(self.frequency_hz) * self.correction)


def measured_plant(
    frf: Frf, model: MechanicalModel, *, highest_hz: float = 6000.0, lines: int = 400
) -> MeasuredPlant:
    """Join a corrected measurement with its model.

    The ratio measurement/model is smooth, so it may be interpolated between lines where the
    response itself may not; outside the measured band it fades to 1 within a third of an octave.
    """
    use = frf.in_band & (frf.coherence > 0.8)
    f = frf.frequency_hz[use]
    grid = [np.geomspace(1.0, highest_hz, lines)]
    special = [m.frequency_hz for m in model.modes] + [a[0] for a in model.antiresonances()]
    grid += [np.geomspace(0.85 * x, 1.18 * x, 60) for x in special if 1.0 < x < highest_hz / 1.2]
    dense = np.unique(np.concatenate(grid))
    if f.size < 2:
        return MeasuredPlant(dense, np.ones(dense.size, dtype=np.complex128), model, 0.0)
    log_ratio = np.log(frf.response[use] / model.response(f))
    fade_f = np.concatenate([[f[0] / 1.26], f, [f[-1] * 1.26]])
    fade = np.concatenate([[0.0], log_ratio, [0.0]])
    x, xp = np.log(dense), np.log(fade_f)
    joined = np.interp(x, xp, fade.real) + 1j * np.interp(x, xp, fade.imag)
    return MeasuredPlant(dense, np.exp(joined), model, float(f[-1]))


#: Notches that are tried on a resonance: centre and width as multiples of its frequency, depth.
#: A wide one above it takes the gain down from the resonance on, where the motor turns alone, and
#: costs less phase below than one upon it.
_SHAPES = (
    *((1.0, ratio, depth) for ratio in (0.25, 0.5, 0.9, 1.5) for depth in (-8.0, -14.0, -22.0)),
    (1.2, 1.0, -10.0), (1.5, 2.0, -6.0), (1.5, 2.0, -10.0), (1.5, 2.0, -16.0),
)  # fmt: skip


def notch_sets(model: MechanicalModel, slots: int, highest_hz: float) -> list[tuple[Notch, ...]]:
    """No notch, then notches on the highest one, two, … resonances in several shapes.

    A mode above ``highest_hz`` stands for whatever is stiffer than what was measured: where it
    lies exactly nobody knows, so it gets no notch.
    """
    heights = []
    for mode in model.modes:
        if mode.frequency_hz > highest_hz:
            continue
        f = np.array([mode.frequency_hz])
        rest = replace(model, modes=tuple(m for m in model.modes if m is not mode))
        rise = float(np.abs(model.response(f))[0] / np.abs(rest.response(f))[0])
        heights.append((20 * np.log10(max(rise, 1e-6)), mode))
    ranked = [m for h, m in sorted(heights, key=lambda x: -x[0]) if h > 2.0][:slots]
    sets: list[tuple[Notch, ...]] = [()]
    for count, (place, ratio, depth) in product(range(1, len(ranked) + 1), _SHAPES):
        chosen = sorted(ranked[:count], key=lambda m: m.frequency_hz)
        sets.append(
            tuple(Notch(place * m.frequency_hz, ratio * m.frequency_hz, depth) for m in chosen)
        )
    return sets


@dataclass(frozen=True)
class _Worst:
    """Worst margins over all shifts, per gain [k]."""

    gain_margin_db: FloatArray
    phase_margin_deg: FloatArray
    ms: FloatArray
    stable: BoolArray

    def meets(self, goals: Goals) -> BoolArray:
        return np.asarray(
            self.stable
            & (self.gain_margin_db >= goals.gain_margin_db)
            & (self.phase_margin_deg >= goals.phase_margin_deg)
            & (self.ms <= goals.ms)
        )


def _worst(loops: ComplexArray, gains: FloatArray) -> _Worst:
    """Margins of ``gains`` [k] times ``loops`` [shifts, lines], read on the dense grid."""
    angle = np.angle(-loops)  # 0 at the critical direction
    flips = (np.sign(angle[:, 1:]) != np.sign(angle[:, :-1])) & (np.abs(angle[:, 1:]) < 2.0)
    # The interpolated gain where the phase passes -180°.
    share = np.abs(angle[:, :-1]) / np.maximum(np.abs(angle[:, :-1]) + np.abs(angle[:, 1:]), 1e-12)
    log_gain = np.log(np.abs(loops))
    at_flip = log_gain[:, :-1] + share * (log_gain[:, 1:] - log_gain[:, :-1])
    flip_gains = np.exp(at_flip[flips])
    results: list[tuple[float, float, float, bool]] = []
    for gain in gains:
        level = gain * flip_gains
        below = level[level < 1.0]
        gm = float(-20 * np.log10(np.max(below))) if below.size else 60.0
        over = log_gain + np.log(gain) > 0
        cross = over[:, 1:] != over[:, :-1]
        near = np.minimum(np.abs(angle[:, 1:]), np.abs(angle[:, :-1]))
        pm = float(np.degrees(np.min(near[cross]))) if np.any(cross) else 90.0
        one = 1.0 + gain * loops
        ms = float(1.0 / np.min(np.abs(one)))
        results.append((gm, pm, ms, bool(np.all(_stable(one)))))
    columns = list(zip(*results, strict=True))
    return _Worst(
        np.array(columns[0]), np.array(columns[1]), np.array(columns[2]), np.array(columns[3])
    )


def _stable(return_difference: ComplexArray) -> BoolArray:
    """Nyquist per row: followed down from the top, 1 + L must not have wound round the origin."""
    turn = np.unwrap(np.angle(return_difference)[:, ::-1], axis=1)
    end = np.degrees(turn[:, -1])
    return np.asarray((end > -270.0) & (end < 90.0))


def step_of_closed_loop(
    frequency_hz: FloatArray, closed: ComplexArray, *, duration_s: float = 1.0
) -> tuple[FloatArray, FloatArray]:
    """Unit step response (time, value) of a closed loop known by its frequency response."""
    resolution = 0.5 / duration_s
    top = float(frequency_hz[-1])
    f = np.arange(0.0, top, resolution)
    real = np.interp(f, frequency_hz, closed.real, left=1.0)
    imag = np.interp(f, frequency_hz, closed.imag, left=0.0)
    low = f < frequency_hz[0]
    imag[low] = closed.imag[0] * f[low] / frequency_hz[0]
    # A cosine taper at the top end keeps the cut from ringing.
    taper = 0.5 + 0.5 * np.cos(np.pi * np.clip((f / top - 0.7) / 0.3, 0.0, 1.0))
    impulse = np.fft.irfft((real + 1j * imag) * taper)
    value = np.cumsum(impulse)
    time = (np.arange(value.size) + 0.5) / (2.0 * top)
    half = value.size // 2
    return time[:half], value[:half]


def design(
    plant: MeasuredPlant,
    inertia_kgm2: float,
    loops: DriveLoops,
    load: LoadClass,
    *,
    slots: int,
    notch_response: NotchResponse = continuous_notch,
    integral_ratios: tuple[float, ...] = (5.0, 10.0),
) -> tuple[Candidate, ...]:
    """All useful candidates, fastest first; up to three carry a mark.

    ``inertia_kgm2`` is the whole axis', ``slots`` the drive's notches, ``notch_response`` what
    the drive makes of a notch (ValueError where it cannot, the set is then left out). Empty when
    nothing meets any goal. The PI corner is the speed bandwidth divided by each ratio.
    """
    f = plant.frequency_hz
    s = 1j * TURN * f
    shifts = np.array([plant.response(*q) for q in product(FREQUENCY_FACTORS, DAMPING_FACTORS)])
    fixed = loops.response(f)
    highest = loops.highest_speed_bandwidth_hz or 0.5 * loops.current_bandwidth_hz
    bandwidths = np.geomspace(1.0, highest, 48)
    found: list[Candidate] = []
    marks: tuple[Mark, ...] = ("robust", "balanced", "fast")
    for notches in notch_sets(plant.model, slots, _BEYOND * plant.measured_hz):
        try:
            filters = np.prod([notch_response(n, f) for n in notches], axis=0) * fixed
        except ValueError:
            continue
        for ratio in integral_ratios:
            levels = _levels(shifts * filters, s, bandwidths, inertia_kgm2, ratio)
            for mark in marks:
                good = np.flatnonzero(levels.meets(goals_for(load, mark)))
                if good.size == 0:
                    continue
                i = int(good[-1])
                promised = Goals(
                    float(levels.gain_margin_db[i]),
                    float(levels.phase_margin_deg[i]),
                    float(levels.ms[i]),
                )
                found.append(
                    _candidate(
                        plant, shifts, filters, fixed, notches, float(bandwidths[i]), ratio,
                        inertia_kgm2, promised, mark,
                    )
                )  # fmt: skip
    return _table(found)


def _levels(
    open_parts: ComplexArray, s: ComplexArray, bandwidths: FloatArray, inertia: float, ratio: float
) -> _Worst:
    """Worst margins for every speed bandwidth; the PI corner moves with it."""
    rows = [
        _worst(open_parts * (1.0 + TURN * b / ratio / s), np.array([TURN * b * inertia]))
        for b in bandwidths
    ]
    return _Worst(
        np.concatenate([r.gain_margin_db for r in rows]),
        np.concatenate([r.phase_margin_deg for r in rows]),
        np.concatenate([r.ms for r in rows]),
        np.concatenate([r.stable for r in rows]),
    )


def speed_loop(
    frequency_hz: FloatArray, plant: ComplexArray, fixed: ComplexArray, gains: Gains
) -> ComplexArray:
    """Open speed loop; ``fixed`` contains all filters, notches, current loop and delay."""
    s = 1j * TURN * frequency_hz
    pi = gains.speed_nms * (1.0 + TURN * gains.integral_hz / s)
    return np.asarray(pi * fixed * plant)


def _candidate(
    plant: MeasuredPlant, shifts: ComplexArray, filters: ComplexArray, fixed: ComplexArray,
    notches: tuple[Notch, ...], bandwidth_hz: float, ratio: float, inertia: float,
    promised: Goals, mark: Mark,
) -> Candidate:  # fmt: skip
    """Complete one row: position gain, prediction, step."""
    f = plant.frequency_hz
    gains = Gains(TURN * bandwidth_hz * inertia, bandwidth_hz / ratio, 0.0, bandwidth_hz)
    gains = replace(gains, position_1_s=_position_gain(f, shifts, filters, gains))
    loop = speed_loop(f, plant.response(), filters, gains)
    closed = closed_from_open(loop)
    nominal = margins(f, loop)
    cost = 0.0
    if nominal.crossover_hz is not None and notches:
        taken = np.unwrap(np.angle(filters / fixed))
        cost = -float(np.degrees(np.interp(nominal.crossover_hz, f, taken)))
    time, value = step_of_closed_loop(f, closed)
    metrics = step_metrics(time, value, target=1.0, initial=0.0)
    outer = closed_from_open(gains.position_1_s / (1j * TURN * f) * closed)
    return Candidate(
        notches=notches,
        gains=gains,
        bandwidth_hz=bandwidth(f, closed).minus_3db_hz,
        position_bandwidth_hz=bandwidth(f, outer).minus_3db_hz,
        nominal=nominal,
        promised=promised,
        phase_cost_deg=cost,
        overshoot_percent=metrics.overshoot_percent,
        settling_s=metrics.settling_s,
        marks=(mark,),
    )


def _position_gain(
    f: FloatArray, shifts: ComplexArray, filters: ComplexArray, gains: Gains
) -> float:
    """Highest position gain with 8 dB, 60° and Ms 1.6, at most a quarter of the speed bandwidth."""
    loops = speed_loop(f, shifts, filters, gains)
    outer = closed_from_open(loops) / (1j * TURN * f)
    trial = np.geomspace(0.05, 1.0, 16) * TURN * gains.speed_bandwidth_hz / 4.0
    good = np.flatnonzero(_worst(outer, trial).meets(Goals(8.0, 60.0, 1.6)))
    return float(trial[good[-1]]) if good.size else float(trial[0]) / 4.0


def _table(found: list[Candidate]) -> tuple[Candidate, ...]:
    """Merge equal rows, give each mark to the best of its level, fastest first."""

    def merit(c: Candidate) -> float:
        # A notch must earn its place: 3 % of bandwidth each.
        return c.gains.speed_bandwidth_hz * (1.0 - 0.03 * len(c.notches))

    winners: dict[Mark, Candidate] = {}
    for c in found:
        mark = c.marks[0]
        if mark not in winners or merit(c) > merit(winners[mark]):
            winners[mark] = c
    rows: dict[tuple[object, ...], Candidate] = {}
    for c in found:
        key = (c.notches, c.gains)
        marks = tuple(m for m, w in winners.items() if (w.notches, w.gains) == key)
        rows[key] = replace(c, marks=marks)
    return tuple(sorted(rows.values(), key=lambda c: -c.gains.speed_bandwidth_hz))
