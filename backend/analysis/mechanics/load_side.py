"""Backlash, stiffness and transmission error between two encoders, one at each end of a coupling.

While a flank is in contact the twist is δ = ±b/2 + (J·α + F·sign ω)/k, with the acceleration α of
the load, its inertia J and its dry friction F: its equation of motion, whatever the motor does.
Slow passes show the transmission error over the angle, reciprocating moves of some accelerations
show b and J/k. On which flank the load lies follows from the sign of α + F/J·sign ω + pull/J: both
quotients are searched for, and an answer counts only where the friction that it finds puts the load
on the flanks that were assumed. Angles are those of the motor shaft.

Every column of the regression passes the same low-pass filter as the measured angle, so that
quantisation is averaged and no signal is late against another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt
import scipy

from backend.analysis.signals.arrays import FloatArray
from backend.analysis.thresholds import load_side as threshold

BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]
_TURN = 2 * np.pi
GROUP = 100
"""Parts from this number on are groups of reciprocating moves."""


@dataclass(frozen=True)
class TwoSides:
    """Samples [n] of both sides: rad of the motor, counts of the load, Nm of the motor.

    ``part``: 0 counts for nothing; ±j a slow pass forwards or backwards; 100 + j the j-th group of
    reciprocating moves. ``ratio``: motor revolutions of one load revolution.
    """

    rate_hz: float
    angle_rad: FloatArray
    load_counts: FloatArray
    torque_nm: FloatArray
    valid: BoolArray
    part: IntArray
    ratio: float


@dataclass(frozen=True)
class Value:
    """A figure and half the width of its 95 % interval."""

    value: float
    half: float


@dataclass(frozen=True)
class LoadSide:
    """What both encoders show, in rad of the motor shaft.

    ``backlash_rad`` is None where friction or a pull keeps the load on its flank in every move;
    the lost motion bounds it then. ``twist_s2`` is J/k, None where it is no larger than its
    uncertainty; ``most_twist_s2`` is what it does not exceed. Both are None where the load is
    ``pulled`` too much. ``load_inertia_kgm2`` needs the motor's own inertia. ``orders`` holds the
    transmission error per revolution of the load.
    """

    counts_per_rev: float
    lost_motion_rad: Value
    backlash_rad: Value | None
    twist_s2: Value | None
    most_twist_s2: float
    load_inertia_kgm2: Value | None
    orders: tuple[tuple[float, Value], ...]
    error_span_rad: Value
    error_angle_rad: FloatArray
    error_rad: FloatArray
    whole_revolution: bool
    pulled: bool
    residual_rad: float


@dataclass(frozen=True)
class _Table:
    """Filtered and thinned samples [m]. ``fixed`` are the columns that no flank changes: motor
    angle, errors over the angle, an offset for each direction of the slow passes, one for the
    moves, and the speed. ``places`` are waves over the motor's revolution, for its torque."""

    counts: FloatArray
    fixed: FloatArray
    moves: BoolArray
    group: IntArray
    alpha: FloatArray
    motor_alpha: FloatArray
    omega: FloatArray
    torque: FloatArray
    places: FloatArray

    def rows(self, kept: BoolArray) -> _Table:
        """Some of the samples."""
        return _Table(**{name: value[kept] for name, value in vars(self).items()})

    @property
    def sign(self) -> FloatArray:
        """Direction of each sample."""
        return np.sign(self.omega)


@dataclass(frozen=True)
class _Shape:
    """The errors over the angle: orders per load revolution, and Chebyshev polynomials from the
    second on, where a part of one is covered."""

    orders: tuple[float, ...]
    powers: int
    ratio: float
    centre_rad: float
    span_rad: float

    def columns(self, angle_rad: FloatArray) -> FloatArray:
        """[n, 2·orders + powers]"""
        load = angle_rad / self.ratio
        waves = [f(order * load) for order in self.orders for f in (np.cos, np.sin)]
        place = 2.0 * (angle_rad - self.centre_rad) / self.span_rad
        bent = [
            np.cos((2 + power) * np.arccos(np.clip(place, -1.0, 1.0)))
            for power in range(self.powers)
        ]
        return np.column_stack([*waves, *bent, np.empty((angle_rad.size, 0))])


@dataclass(frozen=True)
class _Fit:
    """In rad of the motor: half the gap, J/k, F/k, errors over the angle, lost motion."""

    counts_per_rad: float
    half_gap: float | None
    twist: float
    friction: float
    errors: FloatArray
    lost: float
    square: float

    def amplitude(self, number: int) -> float:
        """Of the error's order of this number."""
        return float(np.hypot(self.errors[2 * number], self.errors[2 * number + 1]))


def load_side(sides: TwoSides, motor_inertia_kgm2: float | None) -> LoadSide:
    """The figures of these samples.

    Raises:
        ValueError: "few": too few samples; "still": the load's counts do not follow the motor.
    """
    shape = _shape(sides)
    table = _table(sides, shape, np.zeros(sides.angle_rad.size))
    first = _fit(table, _flanks(table))
    # The error over the angle is in the second derivative of the counts, too: taken out, once.
    shown = shape.columns(sides.angle_rad) @ first.errors
    table = _table(sides, shape, first.counts_per_rad * shown)
    flanks = _flanks(table)
    kept = _in_contact(table, flanks)
    table, flanks = table.rows(kept), flanks[kept]
    whole = _fit(table, flanks)
    groups = np.unique(table.group)
    again = [_fit(table.rows(on := table.group != g), flanks[on]) for g in groups]
    floor = threshold.COUNTS / abs(whole.counts_per_rad)

    def value(of: Callable[[_Fit], float], least: float = 0.0) -> Value:
        half = np.hypot(_jackknife([of(fit) for fit in again]), threshold.SHARE * of(whole))
        return Value(of(whole), float(np.hypot(half, least)))

    pulled = _pulled(table)
    gap = None
    if not pulled and whole.half_gap is not None and all(fit.half_gap is not None for fit in again):
        gap = value(lambda fit: 2.0 * (fit.half_gap or 0.0), floor)
    twist = value(lambda fit: fit.twist)
    angle, columns = _curve(sides, shape)
    sizes = tuple(
        (order, value(partial(_Fit.amplitude, number=n)))
        for n, order in enumerate(shape.orders)
    )  # fmt: skip
    return LoadSide(
        counts_per_rev=whole.counts_per_rad * _TURN,
        lost_motion_rad=value(lambda fit: fit.lost, floor),
        backlash_rad=gap,
        twist_s2=twist if twist.value > threshold.SEEN * twist.half and not pulled else None,
        most_twist_s2=max(twist.value + twist.half, 0.0),
        load_inertia_kgm2=_load_inertia(table, groups, motor_inertia_kgm2),
        orders=sizes,
        error_span_rad=value(lambda fit: float(np.ptp(columns @ fit.errors)), floor),
        error_angle_rad=angle, error_rad=columns @ whole.errors,
        whole_revolution=shape.powers == 0, pulled=pulled,
        residual_rad=float(np.sqrt(whole.square)),
    )  # fmt: skip


# --- samples ---------------------------------------------------------------------------------


def _shape(sides: TwoSides) -> _Shape:
    """Which errors the slow passes can show: those of a load revolution where they cover one, of
    a motor revolution where they cover that and it is another."""
    slow = sides.angle_rad[(sides.part != 0) & (np.abs(sides.part) < GROUP)]
    if slow.size < threshold.FEWEST:
        raise ValueError("few")
    span, centre = float(np.ptp(slow)), float(0.5 * (np.min(slow) + np.max(slow)))
    if span == 0.0:
        raise ValueError("still")
    whole = span >= threshold.COVERED * _TURN * sides.ratio
    found = set(range(1, threshold.ORDERS + 1)) if whole else set()
    orders = [float(order) for order in found]
    if span >= threshold.COVERED * _TURN:
        own = [k * sides.ratio for k in range(1, threshold.ORDERS + 1)]
        orders += [each for each in own if all(abs(each - o) > threshold.APART for o in orders)]
    return _Shape(
        tuple(sorted(orders)), 0 if whole else threshold.POWERS, sides.ratio, centre, span
    )


def _table(sides: TwoSides, shape: _Shape, error_counts: FloatArray) -> _Table:
    """Filtered and thinned; ``error_counts`` [n] are taken out before the load is accelerated."""
    rate, part = sides.rate_hz, sides.part
    slow = (part != 0) & (np.abs(part) < GROUP)
    scale, _ = np.polyfit(sides.angle_rad[slow], sides.load_counts[slow], 1)
    if abs(scale) * np.ptp(sides.angle_rad[slow]) < threshold.MOVED:
        raise ValueError("still")
    n = 2 * round(0.5 * threshold.WINDOW_S * rate) + 1
    window = np.hanning(n + 2)[1:-1]
    window /= np.sum(window)

    def low(column: FloatArray) -> FloatArray:
        ends = column[0], column[-1]
        padded = np.concatenate([np.full(n // 2, ends[0]), column, np.full(n // 2, ends[1])])
        return np.asarray(scipy.signal.oaconvolve(padded, window, mode="valid"))

    angle = low(sides.angle_rad - shape.centre_rad)
    counts = low(sides.load_counts - sides.load_counts[0])
    load = counts - low(error_counts)
    omega = np.gradient(angle) * rate
    alpha = np.gradient(np.gradient(load / scale)) * rate**2
    motor_alpha = np.gradient(omega) * rate
    waves = [low(column) for column in shape.columns(sides.angle_rad).T]
    places = [
        low(f(k * sides.angle_rad))
        for k in range(1, threshold.ORDERS + 1)
        for f in (np.cos, np.sin)
    ]
    moves = part >= GROUP
    offsets = [(slow & (part > 0)), (slow & (part < 0)), moves]
    fixed = np.column_stack([angle, *waves, omega, *(np.asarray(o, np.float64) for o in offsets)])
    whole = np.convolve(~sides.valid, np.ones(n), mode="same") < 0.5
    settled = _settled(sides, scale, low, moves)
    thin = np.zeros(part.size, dtype=np.bool_)
    thin[:: max(1, round(rate / threshold.THINNED_HZ))] = True
    kept = whole & thin & (part != 0) & (slow | settled)
    group = np.where(moves, part, 0)
    numbers = np.unique(group[kept & moves])
    if numbers.size < threshold.GROUPS or np.count_nonzero(kept & slow) < threshold.FEWEST:
        raise ValueError("few")
    at = np.flatnonzero(kept & slow)
    piece = np.arange(at.size) * 2 * numbers.size // at.size
    group[at] = numbers[piece % numbers.size]
    return _Table(
        counts=counts[kept], fixed=fixed[kept], moves=moves[kept], group=group[kept],
        alpha=alpha[kept], motor_alpha=motor_alpha[kept], omega=omega[kept],
        torque=low(sides.torque_nm)[kept], places=np.column_stack(places)[kept],
    )  # fmt: skip


def _settled(
    sides: TwoSides, scale: float, low: Callable[[FloatArray], FloatArray], moves: BoolArray
) -> BoolArray:  # fmt: skip
    """Samples [n] of the moves in whose window the load neither crosses the gap nor bounces."""
    twist = (sides.load_counts - sides.load_counts[0]) / scale
    twist -= sides.angle_rad - sides.angle_rad[0]
    twist -= np.median(twist)
    spread = np.sqrt(np.maximum(low(twist**2) - low(twist) ** 2, 0.0))
    least = float(np.quantile(spread[moves], threshold.QUIETEST)) if np.any(moves) else 0.0
    return spread <= threshold.RESTLESS * max(least, threshold.COUNTS / abs(scale))


# --- flanks ----------------------------------------------------------------------------------


def _flanks(table: _Table) -> FloatArray:
    """On which flank each sample of the moves lies, ±1 [m], 0 where that is not certain."""
    largest = float(np.quantile(np.abs(table.alpha[table.moves]), threshold.LARGE))
    thin = np.zeros(table.counts.size, dtype=np.bool_)
    thin[:: threshold.COARSE] = True
    some = table.rows(thin)
    best, least = (np.inf, 0.0), np.inf
    seen: set[bytes] = set()
    for pull in _pulls(table, largest):
        for friction in np.linspace(0.0, threshold.FRICTION, threshold.STEPS) * largest:
            flanks = _of(some, friction, pull, largest)
            if flanks.tobytes() in seen:
                continue
            seen.add(flanks.tobytes())
            fit = _fit(some, flanks)
            if fit.half_gap is None or fit.square >= least:
                continue
            if _agrees(some, fit, flanks, pull, largest):
                best, least = (float(friction), pull), fit.square
    return _of(table, *best, largest)


def _of(table: _Table, friction: float, pull: float, largest: float) -> FloatArray:
    """Flanks with F/J and pull/J in rad/s²."""
    if np.isinf(friction):
        return np.where(table.moves, table.sign, 0.0)
    force = table.alpha + friction * table.sign + pull
    certain = table.moves & (np.abs(force) > threshold.NEAR * largest)
    return np.where(certain, np.sign(force), 0.0)


def _pulls(table: _Table, largest: float) -> list[float]:
    """Candidates of pull/J: none, or what the motor's torque shows of one."""
    at = table.moves
    columns = np.column_stack([table.alpha[at], table.sign[at], np.ones(np.count_nonzero(at))])
    inertia, _, pull = np.linalg.lstsq(columns, table.torque[at], rcond=None)[0]
    ratio = pull / inertia if inertia > 0.0 else 0.0
    if abs(ratio) < threshold.NO_PULL * largest:
        return [0.0]
    # The load has a part of the inertia that the torque accelerates.
    return [float(ratio * factor) for factor in threshold.PULLS]


def _pulled(table: _Table) -> bool:
    """Whether a pull takes so much of what accelerates the load that flanks hardly change."""
    largest = float(np.quantile(np.abs(table.alpha[table.moves]), threshold.LARGE))
    return abs(_pulls(table, largest)[0]) > threshold.PULLED * largest


def _agrees(
    table: _Table, fit: _Fit, flanks: FloatArray, pull: float, largest: float
) -> bool:  # fmt: skip
    """Whether the friction that was found puts the load on the flanks that were assumed."""
    gap = abs(fit.half_gap or 0.0)
    if fit.friction <= max(threshold.SMALL * gap, threshold.COUNTS / abs(fit.counts_per_rad)):
        return True
    friction = fit.friction / fit.twist if fit.twist > 0.0 else np.inf
    found = _of(table, float(min(friction, threshold.ENDLESS * largest)), pull, largest)
    both = (found != 0.0) & (flanks != 0.0)
    same = found[both] == flanks[both]
    return bool(same.size) and float(np.mean(same)) >= threshold.SAME


def _in_contact(table: _Table, flanks: FloatArray) -> BoolArray:
    """Samples that lie where the fit says: not those that bounce, or cross the gap."""
    kept = np.ones(table.counts.size, dtype=np.bool_)
    for _ in range(threshold.TRIMMED):
        rest = _residual(table, flanks, kept)
        spread = scipy.stats.median_abs_deviation(rest[kept & table.moves], scale="normal")
        least = threshold.COUNTS
        off = np.abs(rest) > threshold.OUTSIDE * max(spread, least)
        if np.mean(off[table.moves]) > threshold.MOST_OUTSIDE:
            break
        kept = ~(off & table.moves)
    return kept


# --- regression ------------------------------------------------------------------------------


def _design(table: _Table, flanks: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Columns [m, c + 3], flank, acceleration and direction last, and the samples that count."""
    on = table.moves
    own = np.column_stack([flanks, np.where(on, table.alpha, 0.0), np.where(on, table.sign, 0.0)])
    return np.hstack([table.fixed, own]), ~on | (flanks != 0.0)


def _solved(columns: FloatArray, wanted: FloatArray) -> FloatArray:
    size = np.sqrt(np.mean(columns**2, axis=0))
    size[size == 0.0] = 1.0
    return np.asarray(np.linalg.lstsq(columns / size, wanted, rcond=None)[0] / size)


def _fit(table: _Table, flanks: FloatArray) -> _Fit:
    columns, used = _design(table, flanks)
    columns, wanted = columns[used], table.counts[used]
    side, others = columns[:, -3], np.delete(columns, -3, axis=1)
    alone = side - others @ _solved(others, side)
    whole = float(np.sum(side**2))
    separable = whole > 0.0 and float(np.sum(alone**2)) > threshold.SEPARABLE * whole
    if separable:
        found = _solved(columns, wanted)
    else:
        found = np.insert(_solved(others, wanted), others.shape[1] - 2, 0.0)
    rest = wanted - columns @ found
    scale = float(found[0])
    first, last = table.fixed.shape[1] - 4, table.fixed.shape[1]
    forward, backward = found[last - 3], found[last - 2]
    return _Fit(
        scale, float(-found[-3] / scale) if separable else None, float(-found[-2] / scale),
        float(-found[-1] / scale), found[1:first] / scale, float((backward - forward) / scale),
        float(np.mean(rest**2)) / scale**2,
    )  # fmt: skip


def _residual(table: _Table, flanks: FloatArray, kept: BoolArray) -> FloatArray:
    columns, used = _design(table, flanks)
    used = used & kept
    return np.asarray(table.counts - columns @ _solved(columns[used], table.counts[used]))


def _load_inertia(
    table: _Table, groups: IntArray, motor_inertia_kgm2: float | None
) -> Value | None:  # fmt: skip
    """What the torque beyond the motor's own acceleration accelerates, in kg·m²."""
    if motor_inertia_kgm2 is None:
        return None

    def found(at: BoolArray) -> float:
        torque = table.torque[at] - motor_inertia_kgm2 * table.motor_alpha[at]
        moves = table.moves[at]
        # The slow passes show what the torque depends on the place by, with friction of their own.
        signs = [np.where(moves, table.sign[at], 0.0), np.where(moves, 0.0, table.sign[at])]
        own = [table.alpha[at], *signs, table.omega[at], np.ones(torque.size)]
        return float(_solved(np.column_stack([*own, table.places[at]]), torque)[0])

    everything = np.ones(table.counts.size, dtype=np.bool_)
    again = [found(table.group != group) for group in groups]
    inertia = found(everything)
    return Value(inertia, float(np.hypot(_jackknife(again), threshold.SHARE * inertia)))


def _jackknife(again: Sequence[float]) -> float:
    """Half of the 95 % interval, from the values without one group each."""
    values = np.array(again)
    n = values.size
    deviation = np.sqrt((n - 1) / n * np.sum((values - np.mean(values)) ** 2))
    return float(scipy.special.stdtrit(n - 1, 0.975) * deviation)


def _curve(sides: TwoSides, shape: _Shape) -> tuple[FloatArray, FloatArray]:
    """Angles over a load revolution, or over what was covered, and the columns there."""
    if shape.powers == 0:
        angle = np.arange(threshold.BINS) * _TURN * sides.ratio / threshold.BINS
    else:
        share = np.linspace(-0.5, 0.5, threshold.BINS)
        angle = shape.centre_rad + share * shape.span_rad
    return angle, shape.columns(angle)


def unwrapped(counts: FloatArray, bits: int = 32) -> FloatArray:
    """Counts [n] of a counter that wraps around, without its leaps."""
    turn = 2.0**bits
    steps = np.diff(counts)
    steps -= turn * np.round(steps / turn)
    return np.concatenate([counts[:1], counts[0] + np.cumsum(steps)]).astype(np.float64)
