"""Backlash, stiffness and transmission error between two encoders, one at each end of a coupling.

While a flank is in contact the twist is δ = ±b/2 + (J·α + F·sign ω)/k, with the acceleration α of
the load, its inertia J and its dry friction F: the load's equation of motion, which holds for any
motion of the motor. Slow passes show the transmission error over the angle; reciprocating moves at
several accelerations show b and J/k. The flank in contact follows from the sign of
α + F/J·sign ω + pull/J: both quotients are searched for, and a result is accepted only where the
friction found puts the load on the assumed flanks. Angles are those of the motor shaft.

Every column of the regression passes the same low-pass filter as the measured angle, so that
quantisation is averaged and no signal lags another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy

from backend.analysis.mechanics.load_side_samples import (
    BoolArray,
    IntArray,
    Table,
    TwoSides,
    curve_of,
    shape_of,
    table_of,
)
from backend.analysis.signals.arrays import FloatArray
from backend.analysis.thresholds import load_side as threshold

_TURN = 2 * np.pi


@dataclass(frozen=True)
class Value:
    """A value and half the width of its 95 % interval."""

    value: float
    half: float


@dataclass(frozen=True)
class LoadSide:
    """Results from both encoders, in rad of the motor shaft.

    ``backlash_rad`` is None where no assignment of the samples to two flanks agrees with the data,
    as where friction or a pull keeps the load on its flank in every move; the lost motion is then
    its bound. ``twist_s2`` is J/k, None where it is no larger than its uncertainty;
    ``most_twist_s2`` is its upper limit. Both are None where ``backlash_rad`` is, as they rest on
    the same flanks, and where the load is ``pulled`` too much. ``load_inertia_kgm2`` needs the
    motor's own inertia. ``orders`` contains the transmission error per revolution of the load.
    """

    counts_per_rev: float
    lost_motion_rad: Value
    backlash_rad: Value | None
    twist_s2: Value | None
    most_twist_s2: float | None
    load_inertia_kgm2: Value | None
    orders: tuple[tuple[float, Value], ...]
    error_span_rad: Value
    error_angle_rad: FloatArray
    error_rad: FloatArray
    whole_revolution: bool
    pulled: bool
    residual_rad: float


@dataclass(frozen=True)
class _Fit:
    """In rad of the motor: half the backlash, J/k, F/k, errors over the angle, lost motion."""

    counts_per_rad: float
    half_gap: float | None
    twist: float
    friction: float
    errors: FloatArray
    lost: float
    square: float

    def amplitude(self, number: int) -> float:
        """Return the amplitude of the error order of this index."""
        return float(np.hypot(self.errors[2 * number], self.errors[2 * number + 1]))


def load_side(sides: TwoSides, motor_inertia_kgm2: float | None) -> LoadSide:
    """Evaluate these samples.

    Raises:
        FewSamples: too few are left.
        LoadStands: the counts of the load do not follow the motor.
    """
    shape = shape_of(sides)
    table = table_of(sides, shape, np.zeros(sides.angle_rad.size))
    first = _fit(table, _flanks(table))
    # The error over the angle is also in the second derivative of the counts: subtract it once.
    shown = shape.columns(sides.angle_rad) @ first.errors
    table = table_of(sides, shape, first.counts_per_rad * shown)
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
    angle, columns = curve_of(sides, shape)
    sizes = tuple(
        (order, value(partial(_Fit.amplitude, number=n), floor))
        for n, order in enumerate(shape.orders)
    )
    return LoadSide(
        counts_per_rev=whole.counts_per_rad * _TURN,
        lost_motion_rad=value(lambda fit: fit.lost, floor),
        backlash_rad=gap,
        twist_s2=twist if gap is not None and twist.value > threshold.SEEN * twist.half else None,
        most_twist_s2=None if gap is None else max(twist.value + twist.half, 0.0),
        load_inertia_kgm2=_load_inertia(table, groups, motor_inertia_kgm2),
        orders=sizes,
        error_span_rad=value(lambda fit: float(np.ptp(columns @ fit.errors)), floor),
        error_angle_rad=angle,
        error_rad=columns @ whole.errors,
        whole_revolution=shape.powers == 0,
        pulled=pulled,
        residual_rad=float(np.sqrt(whole.square)),
    )


# --- flanks ----------------------------------------------------------------------------------


def _flanks(table: Table) -> FloatArray:
    """Flank of each sample of the moves, ±1 [m], 0 where it is uncertain."""
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
            # Overlapping flanks (negative backlash) are rejected, however well they fit.
            if 2.0 * fit.half_gap < -threshold.COUNTS / abs(fit.counts_per_rad):
                continue
            if _agrees(some, fit, flanks, pull, largest):
                best, least = (float(friction), pull), fit.square
    return _of(table, *best, largest)


def _of(table: Table, friction: float, pull: float, largest: float) -> FloatArray:
    """Flanks for F/J and pull/J in rad/s²."""
    if np.isinf(friction):
        return np.where(table.moves, table.sign, 0.0)
    force = table.alpha + friction * table.sign + pull
    certain = table.moves & (np.abs(force) > threshold.NEAR * largest)
    return np.where(certain, np.sign(force), 0.0)


def _pulls(table: Table, largest: float) -> list[float]:
    """Candidates of pull/J: none, or values that the motor's torque indicates."""
    at = table.moves
    columns = np.column_stack([table.alpha[at], table.sign[at], np.ones(np.count_nonzero(at))])
    inertia, _, pull = np.linalg.lstsq(columns, table.torque[at], rcond=None)[0]
    ratio = pull / inertia if inertia > 0.0 else 0.0
    if abs(ratio) < threshold.NO_PULL * largest:
        return [0.0]
    # The load has only a part of the inertia that the torque accelerates.
    return [float(ratio * factor) for factor in threshold.PULLS]


def _pulled(table: Table) -> bool:
    """Whether a pull is so large a part of the load's acceleration that flanks hardly change."""
    largest = float(np.quantile(np.abs(table.alpha[table.moves]), threshold.LARGE))
    return abs(_pulls(table, largest)[0]) > threshold.PULLED * largest


def _agrees(table: Table, fit: _Fit, flanks: FloatArray, pull: float, largest: float) -> bool:
    """Whether the friction found puts the load on the assumed flanks."""
    gap = abs(fit.half_gap or 0.0)
    if fit.friction <= max(threshold.SMALL * gap, threshold.COUNTS / abs(fit.counts_per_rad)):
        return True
    friction = fit.friction / fit.twist if fit.twist > 0.0 else np.inf
    found = _of(table, float(min(friction, threshold.ENDLESS * largest)), pull, largest)
    both = (found != 0.0) & (flanks != 0.0)
    same = found[both] == flanks[both]
    return bool(same.size) and float(np.mean(same)) >= threshold.SAME


def _in_contact(table: Table, flanks: FloatArray) -> BoolArray:
    """Samples that agree with the fit, without those that bounce or cross the backlash."""
    kept = np.ones(table.counts.size, dtype=np.bool_)
    for _ in range(threshold.TRIMMED):
        rest = _residual(table, flanks, kept)
        moving = rest[kept & table.moves]
        # Median absolute deviation, scaled to the standard deviation of a normal distribution.
        spread = 1.4826 * np.median(np.abs(moving - np.median(moving)))
        least = threshold.COUNTS
        off = np.abs(rest) > threshold.OUTSIDE * max(spread, least)
        if np.mean(off[table.moves]) > threshold.MOST_OUTSIDE:
            break
        kept = ~(off & table.moves)
    return kept


# --- regression ------------------------------------------------------------------------------


def _design(table: Table, flanks: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Columns [m, c + 3], flank, acceleration and direction last, and the samples to use."""
    on = table.moves
    own = np.column_stack([flanks, np.where(on, table.alpha, 0.0), np.where(on, table.sign, 0.0)])
    return np.hstack([table.fixed, own]), ~on | (flanks != 0.0)


def _solved(columns: FloatArray, wanted: FloatArray) -> FloatArray:
    """Least squares; by the normal equations, refined once, where their condition permits."""
    size = np.sqrt(np.mean(columns**2, axis=0))
    size[size == 0.0] = 1.0
    scaled = columns / size
    normal = scaled.T @ scaled
    if np.linalg.cond(normal) > threshold.CONDITION:
        return np.asarray(np.linalg.lstsq(scaled, wanted, rcond=None)[0] / size)
    found = np.linalg.solve(normal, scaled.T @ wanted)
    found += np.linalg.solve(normal, scaled.T @ (wanted - scaled @ found))
    return np.asarray(found / size)


def _fit(table: Table, flanks: FloatArray) -> _Fit:
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
        scale,
        float(-found[-3] / scale) if separable else None,
        float(-found[-2] / scale),
        float(-found[-1] / scale),
        found[1:first] / scale,
        float((backward - forward) / scale),
        float(np.mean(rest**2)) / scale**2,
    )


def _residual(table: Table, flanks: FloatArray, kept: BoolArray) -> FloatArray:
    columns, used = _design(table, flanks)
    used = used & kept
    return np.asarray(table.counts - columns @ _solved(columns[used], table.counts[used]))


def _load_inertia(table: Table, groups: IntArray, motor_inertia_kgm2: float | None) -> Value | None:
    """Load inertia in kg·m², from the torque in excess of the motor's own acceleration torque."""
    if motor_inertia_kgm2 is None:
        return None

    def found(at: BoolArray) -> float:
        torque = table.torque[at] - motor_inertia_kgm2 * table.motor_alpha[at]
        moves = table.moves[at]
        # The slow passes determine the position-dependent torque, with a friction of their own.
        signs = [np.where(moves, table.sign[at], 0.0), np.where(moves, 0.0, table.sign[at])]
        own = [table.alpha[at], *signs, table.omega[at], np.ones(torque.size)]
        return float(_solved(np.column_stack([*own, table.places[at]]), torque)[0])

    everything = np.ones(table.counts.size, dtype=np.bool_)
    again = [found(table.group != group) for group in groups]
    inertia = found(everything)
    # The torque accelerates both, so the whole uncertainty of the sum belongs to the load.
    floor = threshold.SHARE_OF_INERTIA * (inertia + motor_inertia_kgm2)
    return Value(inertia, float(np.hypot(_jackknife(again), floor)))


def _jackknife(again: Sequence[float]) -> float:
    """Half of the 95 % interval, from the values with one group left out each."""
    values = np.array(again)
    n = values.size
    deviation = np.sqrt((n - 1) / n * np.sum((values - np.mean(values)) ** 2))
    return float(scipy.special.stdtrit(n - 1, 0.975) * deviation)
