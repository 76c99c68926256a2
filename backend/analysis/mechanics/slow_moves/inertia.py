"""Inertia and friction from bidirectional moves.

torque = J·a + b·ω + Tc·sign(ω) + Tg, with every signal passed through the *same* zero-phase filter
(so that the filter cancels), samples near standstill left out, outliers weighted down (Huber 1964),
oscillating loads modelled separately (`load_swing`), torques that depend on the position or grow
with the square of the speed where they are detected (`load_terms`), and intervals that account for
the few independent samples of a filtered signal and for residuals that oscillate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy

from backend.analysis.mechanics.slow_moves.load_swing import find_swings, lag_of_load, lag_slopes
from backend.analysis.mechanics.slow_moves.load_terms import (
    NO_LOAD_TERMS,
    FoundTerms,
    Motion,
    Terms,
    find_terms,
    independent_share,
)
from backend.analysis.mechanics.slow_moves.position_torque import angle_of
from backend.analysis.signals.arrays import BoolArray, FloatArray
from backend.analysis.thresholds import inertia as threshold

SYSTEMATIC_SHARE = np.array(threshold.SYSTEMATIC_SHARE)

#: Number of columns of a rigid axis with friction, as `_columns` makes them.
_RIGID = 6

#: Reasons why data do not support a result, in the order in which they are stated.
Reason = Literal[
    "at-limit", "one-direction", "too-little-acceleration", "torque-opposes-acceleration",
    "negative-friction", "does-not-follow", "backlash", "below-motor-inertia", "too-few-samples",
]  # fmt: skip


@dataclass(frozen=True)
class Interval:
    """A value with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class InertiaResult:
    """Results in SI units at the motor shaft.

    ``identifiable`` is False when the data do not support a result, for the stated ``reasons``; the
    values are then those of the regression and must not be used. ``load_ratio`` is the inertia
    ratio, load to motor.
    """

    inertia_kgm2: Interval
    viscous_nms: Interval
    coulomb_nm: Interval
    gravity_nm: Interval
    load_ratio: float | None
    r2: float
    identifiable: bool
    reasons: tuple[Reason, ...]
    load_terms: FoundTerms = NO_LOAD_TERMS
    """Torques in addition to inertia and friction."""


def _smoothing_kernel(sample_rate_hz: float, cutoff_hz: float) -> FloatArray:
    """Symmetric (zero-phase) Gaussian with its -3 dB point at the cut-off."""
    sigma = np.sqrt(np.log(2.0) / 2.0) / np.pi / cutoff_hz * sample_rate_hz
    reach = max(1, int(np.ceil(4 * sigma)))
    n = np.arange(-reach, reach + 1)
    kernel = np.exp(-0.5 * (n / max(sigma, 1e-6)) ** 2)
    return np.asarray(kernel / np.sum(kernel))


def _slope_kernel(kernel: FloatArray) -> FloatArray:
    """Kernel that smooths as ``kernel`` does and differentiates (per sample): t·k(t), scaled so
    that a ramp of slope 1 gives exactly 1.
    """
    n = np.arange(kernel.size) - kernel.size // 2
    slope = n * kernel
    return np.asarray(-slope / np.sum(n * slope))


def _huber(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Robust solution of a·x = b by reweighting; solution and weights."""
    weight: FloatArray = np.ones(b.size)
    x: FloatArray = np.zeros(a.shape[1])
    for _ in range(15):
        root = np.sqrt(weight)
        x = np.linalg.lstsq(a * root[:, None], b * root, rcond=None)[0]
        residual = np.abs(b - a @ x)
        scale = 1.4826 * float(np.median(residual))
        if scale <= 0:
            break
        weight = np.minimum(1.0, 1.345 * scale / np.maximum(residual, 1e-300))
    return x, weight


def _swinging_variance(
    a: FloatArray, residual: FloatArray, weight: FloatArray, keep: BoolArray, block: int
) -> FloatArray:
    """Variances of the solution of a·x = b with an oscillating residual (Newey & West 1987).

    The unmodelled part of an oscillation is correlated over many samples and with the columns.
    Bartlett's weights of the lags up to ``block`` are those of overlapping sums of that length.
    """
    scores = np.zeros((keep.size + 2 * block, a.shape[1]))
    scores[block : block + keep.size][keep] = a * (weight * residual)[:, None]
    total = np.cumsum(scores, axis=0)
    sums = total[block:] - total[:-block]
    normal = np.linalg.pinv((a * weight[:, None]).T @ a)
    return np.asarray(np.diag(normal @ (sums.T @ sums / block) @ normal))


def estimate_inertia(
    torque_nm: FloatArray,
    velocity_rad_s: FloatArray,
    sample_rate_hz: float,
    *,
    cutoff_hz: float = 40.0,
    minimum_speed_rad_s: float | None = None,
    torque_limit_nm: float | None = None,
    motor_inertia_kgm2: float | None = None,
    valid: BoolArray | None = None,
    position_rad: FloatArray | None = None,
    loop_nms: float | None = None,
) -> InertiaResult:
    """Regress over whole recordings of moves in both directions.

    ``torque_nm`` is the motor's torque. ``minimum_speed_rad_s`` defaults to 5 % of the peak speed.
    The motion must be smooth between bus cycles (interpolated, or made by the drive's own profile):
    with a reference that steps every cycle T, the torque sampled next to each step has an error of
    half a step, about ω_speed·T/2 of the acceleration torque. ``position_rad`` [n] is the motor's;
    without it the speed is integrated. Samples at the torque limit, in gaps (``valid`` False) and
    within the filter's reach of either are left out. ``loop_nms`` is the gain of the speed loop
    that made the moves, None where it is not known: by it the interval of the inertia includes
    what the moment of sampling within a cycle makes of the torque (`_sampled`).

    Raises:
        ValueError: the arrays differ in length, or are shorter than the filter.
    """
    n = torque_nm.size
    if velocity_rad_s.size != n:
        raise ValueError(f"torque has {n} samples and velocity {velocity_rad_s.size}")
    kernel = _smoothing_kernel(sample_rate_hz, cutoff_hz)
    if n < 8 * kernel.size:
        raise ValueError(f"{n} samples are too few for a filter of {kernel.size}")
    saturated = np.zeros(n, dtype=np.bool_)
    if torque_limit_nm is not None:
        saturated = np.abs(torque_nm) >= 0.98 * torque_limit_nm
    spoilt = saturated
    angle = angle_of(velocity_rad_s, sample_rate_hz) if position_rad is None else position_rad
    if valid is not None and np.any(valid):
        spoilt = saturated | ~valid
        # Interpolated, since a step at a gap would excite the model of an oscillating load.
        count = np.arange(n)
        velocity_rad_s = np.interp(count, count[valid], velocity_rad_s[valid])
        angle = np.interp(count, count[valid], angle[valid])
    peak = float(np.max(np.abs(velocity_rad_s)))
    slowest = 0.05 * peak if minimum_speed_rad_s is None else minimum_speed_rad_s
    matrix = _columns(velocity_rad_s, kernel, slowest, sample_rate_hz)
    torque = _smooth(torque_nm, kernel)
    near_spoilt = np.convolve(spoilt.astype(np.float64), np.ones(kernel.size), "same") > 0.5
    keep = (np.abs(matrix[:, 1]) > slowest) & ~near_spoilt
    keep[: kernel.size] = keep[-kernel.size :] = False
    samples, saturated_share = int(np.count_nonzero(keep)), float(np.mean(saturated))
    if samples < threshold.FEWEST:
        return _nothing(saturated_share)
    middle = 0.5 * (float(np.min(angle)) + float(np.max(angle)))
    slope = _slope_kernel(kernel)
    motion = Motion(
        velocity_rad_s,
        angle - middle,
        lambda x: _smooth(x, kernel),
        lambda x: _smooth(x, slope) * sample_rate_hz,
    )
    highest_hz = threshold.SWINGS_TO * cutoff_hz
    terms, matrix, bends = _machine(matrix, torque, motion, keep, sample_rate_hz, highest_hz)
    found, sizes = _regress(
        matrix[keep],
        torque[keep],
        bends[keep],
        keep,
        round(threshold.ALIKE_S * sample_rate_hz),
        saturated_share,
        motor_inertia_kgm2,
    )
    if loop_nms and np.isfinite(found.inertia_kgm2.value):
        late_s = 0.0
        if position_rad is not None:
            # By the position: a reported speed may be late by itself.
            speed = np.gradient(angle) * sample_rate_hz
            rigid = _columns(speed, kernel, slowest, sample_rate_hz)
            late_s = _torque_late(np.column_stack([rigid, matrix[:, _RIGID:]])[keep], torque[keep])
        sampled = _sampled(found.inertia_kgm2, loop_nms, late_s, 1.0 / sample_rate_hz)
        found = replace(found, inertia_kgm2=sampled)
    return replace(found, load_terms=terms.sized(motion, sizes[_RIGID:]))


def _torque_late(a: FloatArray, b: FloatArray) -> float:
    """Time [s] by which the torque b is later than the motion of the columns a; 0 if not later."""
    scale = np.maximum(np.max(np.abs(a), axis=0), 1e-12)
    x = _huber(a / scale, b)[0] / scale
    return float(max(-x[4] / x[0], 0.0)) if x[0] > 0 else 0.0


def _sampled(inertia: Interval, loop_nms: float, late_s: float, cycle_s: float) -> Interval:
    """Interval of the inertia with the uncertainty of the moment at which the torque is sampled.

    Setpoints that are held make the torque of a speed loop a sawtooth in step with the samples:
    they are off by the gain times up to half a cycle times the acceleration of the setpoint, which
    is collinear with the inertia's torque. The sampled torque is then later than the motion. A
    filter of 6077h looks alike, so that either may be. Otherwise the moment is not known better
    than `threshold.SAMPLED_S`.
    """
    half = np.hypot(0.5 * (inertia.high - inertia.low), loop_nms * threshold.SAMPLED_S)
    held = 0.5 * cycle_s * loop_nms if late_s > threshold.LATER_S else 0.0
    middle = 0.5 * (inertia.high + inertia.low)
    return Interval(inertia.value, float(middle - half), float(middle + half + held))


def _machine(
    rigid: FloatArray,
    torque: FloatArray,
    motion: Motion,
    keep: BoolArray,
    rate: float,
    highest_hz: float,
) -> tuple[Terms, FloatArray, FloatArray]:
    """Components of the torque in addition to a rigid inertia and friction.

    Returns the terms, all columns (the rigid ones, those of the terms, those of oscillating loads)
    and their slopes [n, columns] by the parameters that were searched.
    """
    acceleration = rigid[:, 0]

    def lags(known: FloatArray) -> tuple[list[FloatArray], list[FloatArray]]:
        swings = find_swings(known, torque, acceleration, keep, rate, highest_hz)
        return (
            [lag_of_load(acceleration, s, rate) for s in swings],
            [c for s in swings for c in lag_slopes(acceleration, s, rate)],
        )

    swinging, slopes = lags(rigid)
    terms = find_terms(np.column_stack([rigid, *swinging]), torque, motion, keep)
    known = np.column_stack([rigid, terms.columns(motion)])
    if terms != Terms():
        # Without the terms they may have been taken for an oscillating load.
        swinging, slopes = lags(known)
    bends = np.column_stack([np.empty((torque.size, 0)), *slopes, *terms.slopes(motion)])
    return terms, np.column_stack([known, *swinging]), bends


def _smooth(x: FloatArray, kernel: FloatArray) -> FloatArray:
    return np.asarray(
        scipy.ndimage.convolve1d(np.asarray(x, dtype=np.float64), kernel, mode="nearest")
    )


def _columns(
    velocity_rad_s: FloatArray, kernel: FloatArray, slowest: float, rate: float
) -> FloatArray:
    """Columns of the regression [n, 6]: acceleration, velocity, direction, one, and the first and
    second derivative of the acceleration.
    """
    # The derivative of the smoothing kernel itself: a difference of samples would smooth more than
    # the other signals are smoothed, which would bias J low.
    acceleration = _smooth(velocity_rad_s, _slope_kernel(kernel)) * rate
    direction = _smooth(np.clip(velocity_rad_s / max(0.2 * slowest, 1e-12), -1.0, 1.0), kernel)
    # A speed reported later than the torque (by the drive's filter, 0.2 ms are enough) biases the
    # two frictions against each other: to first order that is the first derivative.
    late = np.gradient(acceleration) * rate
    # A load behind a spring of antiresonance ω_a appears heavier by (ω/ω_a)²: to first order that
    # is the second derivative, which would otherwise count as inertia.
    springy = np.gradient(late) * rate
    return np.column_stack(
        [acceleration, _smooth(velocity_rad_s, kernel), direction, np.ones(direction.size), late,
         springy]
    )  # fmt: skip


def _nothing(saturated_share: float) -> InertiaResult:
    """The result where there are too few samples for a regression."""
    nothing = Interval(float("nan"), float("nan"), float("nan"))
    reasons: tuple[Reason, ...] = ("too-few-samples",)
    if saturated_share > 0.05:
        reasons += ("at-limit",)
    return InertiaResult(nothing, nothing, nothing, nothing, None, 0.0, False, reasons)


def _intervals(
    a: FloatArray,
    bends: FloatArray,
    x: FloatArray,
    residual: FloatArray,
    weight: FloatArray,
    keep: BoolArray,
    block: int,
) -> list[Interval]:
    """J, viscous, Coulomb and gravity torque with their 95 % intervals.

    ``bends`` are the slopes of the torque by the searched frequencies and dampings of oscillations.
    """
    whole = np.column_stack([a, bends])
    scale = np.maximum(np.max(np.abs(whole), axis=0), 1e-12)
    whole = whole / scale
    share = independent_share(residual * np.sqrt(weight), keep)
    count = float(np.sum(weight))
    freedom = max(count * share - whole.shape[1], 1.0)
    normal = np.linalg.pinv((whole * weight[:, None]).T @ whole)
    # Sum of squares over the independent share of samples, variance inflated accordingly.
    variance = float(np.sum(weight * residual**2)) / max(count - 4.0, 1.0) / share
    plain = np.diag(normal) * variance * float(scipy.special.stdtrit(freedom, 0.975)) ** 2
    blocks = max(float(np.count_nonzero(keep)) / block - 1.0, 1.0)
    swinging = _swinging_variance(whole, residual, weight, keep, block)
    swinging = swinging * float(scipy.special.stdtrit(blocks, 0.975)) ** 2
    uncertainty = np.sqrt(np.maximum(np.maximum(plain, swinging), 0.0)) / scale
    half = np.hypot(uncertainty[:4], SYSTEMATIC_SHARE * np.abs(x[:4]))
    # Errors of Coulomb friction at reversals are compensated by viscous friction at these speeds.
    speed = float(np.sqrt(np.mean(a[:, 1] ** 2)))
    half[1] = np.hypot(half[1], threshold.DISTINGUISHED * abs(x[2]) / speed)
    return [
        Interval(float(v), float(v - h), float(v + h)) for v, h in zip(x[:4], half, strict=True)
    ]


def _regress(
    a: FloatArray,
    b: FloatArray,
    bends: FloatArray,
    keep: BoolArray,
    block: int,
    saturated_share: float,
    motor_inertia_kgm2: float | None,
) -> tuple[InertiaResult, FloatArray]:
    """Solve, judge and report; returns the result, and the coefficient of every column."""
    scale = np.maximum(np.max(np.abs(a), axis=0), 1e-12)
    x, weight = _huber(a / scale, b)
    driving = min(float(x[1] / scale[1]), 0.0)
    if driving < 0:
        # Negative viscous friction is caused by noise: there is too little of it to be detected.
        x, weight = _huber(a / scale * (np.arange(a.shape[1]) != 1), b)
    residual = b - (a / scale) @ x
    parts = _intervals(a, bends, x / scale, residual, weight, keep, block)
    # The upper end is as far above zero as the estimate was below it.
    parts[1] = Interval(parts[1].value, parts[1].low + driving, parts[1].high - driving)
    total = float(np.sum(weight * (b - np.average(b, weights=weight)) ** 2))
    r2 = 1.0 - float(np.sum(weight * residual**2)) / total if total > 0 else 0.0
    reasons = _reasons(a, b, residual, weight, parts, r2, saturated_share)
    ratio = None
    if motor_inertia_kgm2 is not None:
        ratio = parts[0].value / motor_inertia_kgm2 - 1.0
        if ratio < -0.1:
            reasons.append("below-motor-inertia")
    result = InertiaResult(
        parts[0], parts[1], parts[2], parts[3], ratio, r2,
        not reasons, tuple(reasons),
    )  # fmt: skip
    return result, np.asarray(x / scale)


def _reasons(
    a: FloatArray,
    b: FloatArray,
    residual: FloatArray,
    weight: FloatArray,
    parts: list[Interval],
    r2: float,
    saturated_share: float,
) -> list[Reason]:
    """Reasons why the data do not support a result."""
    reasons: list[Reason] = []
    inertia = parts[0]
    if saturated_share > 0.05:
        reasons.append("at-limit")
    if np.min(a[:, 1]) >= 0 or np.max(a[:, 1]) <= 0:
        reasons.append("one-direction")
    accelerating = float(np.std(a[:, 0])) * abs(inertia.value)
    noise = float(np.sqrt(np.average(residual**2, weights=weight)))
    if accelerating < 3 * noise or inertia.high - inertia.low > 0.3 * abs(inertia.value):
        reasons.append("too-little-acceleration")
    if inertia.value <= 0:
        reasons.append("torque-opposes-acceleration")
    if parts[2].high < 0:
        reasons.append("negative-friction")
    if r2 < 0.8 and accelerating >= 3 * noise:
        reasons.append("does-not-follow")
    if _looks_like_backlash(a, b, residual):
        reasons.append("backlash")
    return reasons


def _looks_like_backlash(a: FloatArray, b: FloatArray, residual: FloatArray) -> bool:
    """Whether few residuals are far above all others, as impacts cause them."""
    scale = 1.4826 * float(np.median(np.abs(residual)))
    span = float(np.std(b))
    if scale <= 0 or span <= 0 or float(np.std(a[:, 0])) <= 0:
        return False
    knocks = np.abs(residual) > max(8 * scale, 0.25 * span)
    return bool(np.mean(knocks) > 0.002)
