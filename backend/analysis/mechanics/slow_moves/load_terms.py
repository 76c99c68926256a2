"""Torques of some machines in addition to inertia and friction, detected from the moves.

A fan, a pump or a stirrer takes a torque that grows with the square of its speed; a spring, an arm
or an unbalanced load one that depends on the position (`position_torque`); an inertia that depends
on the position takes torque by the square of the speed; a cable, a hose or a seal is a spring that
yields (`Terms.rests_rad`); and friction is larger near standstill (Stribeck 1902). If omitted, they
appear as inertia, as backlash, or make friction negative. A term is accepted only where it clearly
explains what the others leave, so that an axis without it is evaluated as if the term did not
exist.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.mechanics.slow_moves.position_torque import (
    COGGING_RAD,
    Smooth,
    find_period,
    place_columns,
)
from backend.analysis.signals.arrays import BoolArray, FloatArray
from backend.analysis.thresholds import load_terms as threshold


@dataclass(frozen=True)
class Motion:
    """Speed [n] in rad/s, position [n] in rad, and the smoothing applied to every signal.

    ``slope`` smooths equally and differentiates by time.
    """

    velocity_rad_s: FloatArray
    angle_rad: FloatArray
    smooth: Smooth
    slope: Smooth


@dataclass(frozen=True)
class FoundTerms:
    """Sizes of the terms in Nm: the largest torque of a fan in the recording, and half the span of
    the position-dependent torque of the machine; 0 where there is none.

    ``torque_nm`` [n] is the torque of all terms over the recording, static friction and
    the motor's cogging included; empty where none is found.
    """

    fan_nm: float
    place_nm: float
    periods_rad: tuple[float, ...]
    torque_nm: FloatArray


NO_LOAD_TERMS = FoundTerms(0.0, 0.0, (), np.empty(0))


@dataclass(frozen=True)
class Terms:
    """Terms of the torque in addition to inertia and friction.

    ``static_rad_s`` is the speed within which static friction falls, 0 where there is none;
    ``periods_rad`` are those of torques that depend on the position, ``cranks_rad`` those of
    inertias that do. ``rests_rad``: after a reversal, friction rises over such ways (play operators
    of Prandtl and Ishlinskii: a few stand for any law that does not depend on the speed).
    """

    fan: bool = False
    static_rad_s: float = 0.0
    periods_rad: tuple[float, ...] = ()
    cranks_rad: tuple[float, ...] = ()
    rests_rad: tuple[float, ...] = ()

    def columns(self, motion: Motion) -> FloatArray:
        """Return the shapes [n, columns]: a fan's, static friction's, two for each period of a
        torque and of an inertia, and one for each rest length.

        The latter is what friction lacks after a reversal, so that the coefficient of the direction
        of motion stays the whole friction.
        """
        velocity = motion.velocity_rad_s
        parts: list[FloatArray] = [np.empty((velocity.size, 0))]
        if self.fan:
            parts.append(motion.smooth(velocity * np.abs(velocity))[:, None])
        if self.static_rad_s:
            falling = np.exp(-((velocity / self.static_rad_s) ** 2))
            parts.append(motion.smooth(np.sign(velocity) * falling)[:, None])
        parts += [place_columns(motion.angle_rad, p, motion.smooth) for p in self.periods_rad]
        parts += [crank_columns(motion, p) for p in self.cranks_rad]
        parts += [_rest_column(motion, rest)[:, None] for rest in self.rests_rad]
        return np.column_stack(parts)

    def may_hide(self, before: Terms) -> bool:
        """Return whether the term added to ``before`` is also accepted near the noise level."""
        if self.static_rad_s != before.static_rad_s:
            return False
        if self.rests_rad != before.rests_rad:
            return False  # next to a load that oscillates, it could be viscous friction
        if self.cranks_rad != before.cranks_rad:
            return True
        return self.periods_rad == before.periods_rad or self.periods_rad[-1] > COGGING_RAD

    def sized(self, motion: Motion, sizes: FloatArray) -> FoundTerms:
        """Return the sizes of the terms; ``sizes`` begins with the coefficients of `columns`."""
        columns = self.columns(motion)
        if not columns.shape[1]:
            return NO_LOAD_TERMS
        made = columns * sizes[: columns.shape[1]]
        at = int(self.fan) + int(self.static_rad_s > 0)
        # Torques that repeat more than twice per turn are the motor's own cogging, not the
        # machine's.
        reported = [i for i, period in enumerate(self.periods_rad) if period > COGGING_RAD]
        place = sum(made[:, at + 2 * i] + made[:, at + 2 * i + 1] for i in reported)
        return FoundTerms(
            float(np.max(np.abs(made[:, 0]))) if self.fan else 0.0,
            0.5 * float(np.ptp(place)),
            tuple(self.periods_rad[i] for i in reported),
            made.sum(axis=1),
        )

    def slopes(self, motion: Motion) -> list[FloatArray]:
        """Return the derivatives of the shapes by the logarithm of their period, [n] each."""
        found: list[FloatArray] = []
        for period in self.periods_rad:
            ahead, behind = (
                place_columns(motion.angle_rad, period * (1.0 + step), motion.smooth)
                for step in (threshold.DIFFERENCE, -threshold.DIFFERENCE)
            )
            found.extend(((ahead - behind) / (2 * threshold.DIFFERENCE)).T)
        for rest in self.rests_rad:
            longer, shorter = (
                _rest_column(motion, rest * (1.0 + step))
                for step in (threshold.RESTS_STEP, -threshold.RESTS_STEP)
            )
            found.append(np.asarray((longer - shorter) / (2 * threshold.RESTS_STEP)))
        return found


def crank_columns(motion: Motion, period_rad: float) -> FloatArray:
    """Return the torques [n, 2] of an inertia that varies as sine and as cosine of the position.

    With J(θ) the torque is d(J·ω)/dt - J'·ω²/2 (Lagrange). As `place_columns` do, they say nothing
    where a period takes less than four samples.
    """
    k = 2 * np.pi / period_rad
    phase, velocity = k * motion.angle_rad, motion.velocity_rad_s
    seen = np.abs(np.gradient(phase)) < 0.5 * np.pi
    sine, cosine = np.sin(phase) * seen, np.cos(phase) * seen
    half = 0.5 * k * velocity**2
    return np.column_stack(
        [
            motion.slope(sine * velocity) - motion.smooth(half * cosine),
            motion.slope(cosine * velocity) + motion.smooth(half * sine),
        ]
    )


def _rest_column(motion: Motion, rest_rad: float) -> FloatArray:
    """Return what friction that rises over ``rest_rad`` lacks of that without a rest length [n]."""
    steps = np.diff(motion.angle_rad, prepend=motion.angle_rad[0]) * (2.0 / rest_rad)

    def yielded(state: float, step: float) -> float:
        return min(max(state + step, -1.0), 1.0)

    force = np.fromiter(itertools.accumulate(steps.tolist(), yielded), np.float64, steps.size)
    return motion.smooth(force - np.sign(motion.velocity_rad_s))


def find_terms(others: FloatArray, torque_nm: FloatArray, motion: Motion, keep: BoolArray) -> Terms:
    """Return the terms that the torque [n] shows besides ``others`` [n, columns].

    The third of ``others`` is the direction of motion, whose coefficient is the Coulomb friction.
    """
    largest = float(np.max(np.abs(torque_nm[keep])))
    fastest = float(np.max(np.abs(motion.velocity_rad_s)))

    def fitted(terms: Terms) -> _Fit:
        extra = terms.columns(motion)[keep]
        a = np.column_stack([others[keep], extra])
        scale = np.maximum(np.max(np.abs(a), axis=0), 1e-12)
        x = np.linalg.lstsq(a / scale, torque_nm[keep], rcond=None)[0] / scale
        made = extra @ x[others.shape[1] :]
        least = max(threshold.LEAST * largest, threshold.LEAST_OF_FRICTION * float(abs(x[2])))
        seen = 0.5 * float(np.ptp(made)) >= least
        return _Fit(terms, np.asarray(torque_nm[keep] - a @ x), seen)

    best = fitted(Terms())
    while True:
        terms = best.terms
        possible = [] if terms.fan else [replace(terms, fan=True)]
        if not terms.static_rad_s:
            possible += [replace(terms, static_rad_s=share * fastest) for share in threshold.STATIC]
        if len(terms.periods_rad) < threshold.PLACES:
            known = np.column_stack([others, terms.columns(motion)])
            period = find_period(known, torque_nm, motion.angle_rad, keep, motion.smooth)
            possible.append(replace(terms, periods_rad=(*terms.periods_rad, period)))
        if not terms.cranks_rad:
            possible += [
                replace(terms, cranks_rad=(2 * np.pi / order,)) for order in threshold.CRANKS
            ]
        if len(terms.rests_rad) < threshold.RESTS:
            possible += [
                replace(terms, rests_rad=(*terms.rests_rad, rest))
                for rest in threshold.REST_LENGTHS
                if rest not in terms.rests_rad
            ]
        if not possible:
            return terms
        better = min(map(fitted, possible), key=lambda fit: fit.power)
        if not better.seen or not _clearly(best, better, keep):
            return terms
        best = better


@dataclass(frozen=True)
class _Fit:
    """Residual torque [rows] with these terms, and whether the terms are large enough to matter."""

    terms: Terms
    rest: FloatArray
    seen: bool

    @property
    def power(self) -> float:
        return float(np.sum(self.rest**2))


def _clearly(before: _Fit, after: _Fit, keep: BoolArray) -> bool:
    """Whether the second fit explains significantly more than chance."""
    taken = before.power - after.power
    if taken > threshold.PLAIN * before.power:
        return True
    if not after.terms.may_hide(before.terms):
        return False
    freedom = independent_share(after.rest, keep) * float(np.count_nonzero(keep))
    return taken > threshold.SHARE * before.power and taken / 3.0 > threshold.F * after.power / max(
        freedom, 1.0
    )


def independent_share(residual: FloatArray, keep: BoolArray) -> float:
    """Return the share of independent samples, from the residual's autocorrelation."""
    whole = np.zeros(keep.size)
    whole[keep] = residual
    n = 1 << int(np.ceil(np.log2(2 * keep.size)))
    power = np.abs(np.fft.rfft(whole, n)) ** 2
    correlation = np.fft.irfft(power, n)[: keep.size // 2]
    if correlation[0] <= 0:
        return 1.0
    rho = correlation / correlation[0]
    negative = np.flatnonzero(rho <= 0.05)
    length = int(negative[0]) if negative.size else rho.size
    return float(1.0 / (1.0 + 2.0 * np.sum(rho[1:length])))
