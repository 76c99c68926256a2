"""Samples of both sides of a coupling, filtered and thinned: the data that `load_side` fits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from backend.analysis.signals.arrays import FloatArray
from backend.analysis.thresholds import load_side as threshold

BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]
_TURN = 2 * np.pi
GROUP = 100
"""Part numbers from this one on are groups of reciprocating moves."""


class FewSamples(ValueError):
    """Raised if too few samples are left for a result."""


class LoadStands(ValueError):
    """Raised if the counts of the load do not follow the motor."""


@dataclass(frozen=True)
class TwoSides:
    """Samples [n] of both sides: rad of the motor, counts of the load, Nm of the motor.

    ``part``: 0 is not evaluated; ±j is a slow pass forwards or backwards; 100 + j the j-th group of
    reciprocating moves. ``ratio``: motor revolutions per load revolution.
    """

    rate_hz: float
    angle_rad: FloatArray
    load_counts: FloatArray
    torque_nm: FloatArray
    valid: BoolArray
    part: IntArray
    ratio: float


@dataclass(frozen=True)
class Table:
    """Filtered and thinned samples [m]. ``fixed`` are the columns that do not depend on the flank:
    motor angle, errors over the angle, the speed, an offset for each direction of the slow passes,
    and one for the moves. ``places`` are harmonics of the motor angle, for its torque."""

    counts: FloatArray
    fixed: FloatArray
    moves: BoolArray
    group: IntArray
    alpha: FloatArray
    motor_alpha: FloatArray
    omega: FloatArray
    torque: FloatArray
    places: FloatArray

    def rows(self, kept: BoolArray) -> Table:
        """Return some of the samples."""
        return Table(**{name: value[kept] for name, value in vars(self).items()})

    @property
    def sign(self) -> FloatArray:
        """Direction of each sample."""
        return np.sign(self.omega)


@dataclass(frozen=True)
class ErrorShape:
    """Basis of the errors over the angle: orders per load revolution, and Chebyshev polynomials
    from the second on where only a part of a revolution is covered."""

    orders: tuple[float, ...]
    powers: int
    ratio: float
    centre_rad: float
    span_rad: float

    def columns(self, angle_rad: FloatArray) -> FloatArray:
        """Return the basis functions [n, 2·orders + powers] at these angles."""
        load = angle_rad / self.ratio
        waves = [f(order * load) for order in self.orders for f in (np.cos, np.sin)]
        place = 2.0 * (angle_rad - self.centre_rad) / self.span_rad
        bent = [
            np.cos((2 + power) * np.arccos(np.clip(place, -1.0, 1.0)))
            for power in range(self.powers)
        ]
        return np.column_stack([*waves, *bent, np.empty((angle_rad.size, 0))])


def shape_of(sides: TwoSides) -> ErrorShape:
    """Return the errors that the slow passes can show: those of a load revolution where they cover
    one, of a motor revolution where they cover that and its orders differ.

    Raises:
        FewSamples: of slow passes.
        LoadStands: the motor itself did not move.
    """
    slow = sides.angle_rad[(sides.part != 0) & (np.abs(sides.part) < GROUP)]
    if slow.size < threshold.FEWEST:
        raise FewSamples
    span, centre = float(np.ptp(slow)), float(0.5 * (np.min(slow) + np.max(slow)))
    if span == 0.0:
        raise LoadStands
    whole = span >= threshold.COVERED * _TURN * sides.ratio
    found = set(range(1, threshold.ORDERS + 1)) if whole else set()
    orders = [float(order) for order in found]
    if span >= threshold.COVERED * _TURN:
        own = [k * sides.ratio for k in range(1, threshold.ORDERS + 1)]
        orders += [each for each in own if all(abs(each - o) > threshold.APART for o in orders)]
    return ErrorShape(
        tuple(sorted(orders)), 0 if whole else threshold.POWERS, sides.ratio, centre, span
    )


def table_of(sides: TwoSides, shape: ErrorShape, error_counts: FloatArray) -> Table:
    """Filter and thin the samples; ``error_counts`` [n] are subtracted for the load's acceleration.

    Raises:
        FewSamples: of slow passes or of groups of moves.
        LoadStands: the counts of the load do not follow the motor.
    """
    rate, part = sides.rate_hz, sides.part
    slow = (part != 0) & (np.abs(part) < GROUP)
    scale, _ = np.polyfit(sides.angle_rad[slow], sides.load_counts[slow], 1)
    if abs(scale) * np.ptp(sides.angle_rad[slow]) < threshold.MOVED:
        raise LoadStands
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
        raise FewSamples
    at = np.flatnonzero(kept & slow)
    piece = np.arange(at.size) * 2 * numbers.size // at.size
    group[at] = numbers[piece % numbers.size]
    return Table(
        counts=counts[kept], fixed=fixed[kept], moves=moves[kept], group=group[kept],
        alpha=alpha[kept], motor_alpha=motor_alpha[kept], omega=omega[kept],
        torque=low(sides.torque_nm)[kept], places=np.column_stack(places)[kept],
    )  # fmt: skip


def _settled(
    sides: TwoSides, scale: float, low: Callable[[FloatArray], FloatArray], moves: BoolArray
) -> BoolArray:
    """Samples [n] of the moves whose window contains no crossing of the backlash and no bounce."""
    twist = (sides.load_counts - sides.load_counts[0]) / scale
    twist -= sides.angle_rad - sides.angle_rad[0]
    twist -= np.median(twist)
    spread = np.sqrt(np.maximum(low(twist**2) - low(twist) ** 2, 0.0))
    least = float(np.quantile(spread[moves], threshold.QUIETEST)) if np.any(moves) else 0.0
    return spread <= threshold.RESTLESS * max(least, threshold.COUNTS / abs(scale))


def curve_of(sides: TwoSides, shape: ErrorShape) -> tuple[FloatArray, FloatArray]:
    """Return angles over a load revolution, or over the covered range, and the columns there."""
    if shape.powers == 0:
        angle = np.arange(threshold.BINS) * _TURN * sides.ratio / threshold.BINS
    else:
        share = np.linspace(-0.5, 0.5, threshold.BINS)
        angle = shape.centre_rad + share * shape.span_rad
    return angle, shape.columns(angle)


def unwrapped(counts: FloatArray, bits: int = 32) -> FloatArray:
    """Return the counts [n] of a counter that wraps around, without the jumps."""
    turn = 2.0**bits
    steps = np.diff(counts)
    steps -= turn * np.round(steps / turn)
    return np.concatenate([counts[:1], counts[0] + np.cumsum(steps)]).astype(np.float64)
