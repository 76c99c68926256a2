"""Torques that some machines need beside inertia and friction, told by the moves themselves.

A fan, a pump or a stirrer takes a torque that grows with the square of its speed; a spring, an arm
or a load out of balance one that depends on the place (`place_torque`). Left out, either passes for
inertia or turns friction negative. A term is taken up only where it clearly explains what the
others leave, so that an axis without it is judged as if there were no such thing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.analysis.arrays import BoolArray, FloatArray
from backend.analysis.place_torque import Smooth, find_period, place_columns

#: A term that takes this share of the power that is left is there, whatever the noise.
_PLAIN = 0.5
#: Beside noise a smaller share counts, where chance would hardly take as much: least share, and
#: least ratio of variances (F) for the three things that are fitted.
_SHARE, _F = 0.15, 20.0
#: Of the largest torque, what takes less matters to nobody; of the Coulomb friction, the shape of
#: friction itself is not known better.
_LEAST, _LEAST_OF_FRICTION = 0.01, 0.1
#: An arm may hang on a shaft that is out of balance itself.
_PLACES = 2
#: Relative step of numerical slopes.
_DIFFERENCE = 1e-3


@dataclass(frozen=True)
class Motion:
    """Speed [n] in rad/s, place [n] in rad, and the smoothing that every signal goes through."""

    velocity_rad_s: FloatArray
    angle_rad: FloatArray
    smooth: Smooth


@dataclass(frozen=True)
class Beside:
    """What the terms come to: the largest torque of a fan in the recording, half the span of the
    torque by place, in Nm; 0 where there is none.

    ``torque_nm`` [n] is what they make of the torque of the recording; empty where none is found.
    """

    fan_nm: float
    place_nm: float
    periods_rad: tuple[float, ...]
    torque_nm: FloatArray


NOTHING_BESIDE = Beside(0.0, 0.0, (), np.empty(0))


@dataclass(frozen=True)
class Terms:
    """What the torque is made of beside inertia and friction.

    ``periods_rad`` are those of torques that depend on the place.
    """

    fan: bool = False
    periods_rad: tuple[float, ...] = ()

    def columns(self, motion: Motion) -> FloatArray:
        """Their shapes [n, columns]: that of a fan first, then two for each period."""
        velocity = motion.velocity_rad_s
        fan = [motion.smooth(velocity * np.abs(velocity))] if self.fan else []
        places = [place_columns(motion.angle_rad, p, motion.smooth) for p in self.periods_rad]
        return np.column_stack([np.empty((velocity.size, 0)), *fan, *places])

    def sized(self, motion: Motion, sizes: FloatArray) -> Beside:
        """What they come to; ``sizes`` begins with those of `columns`."""
        columns, at = self.columns(motion), int(self.fan)
        if not columns.shape[1]:
            return NOTHING_BESIDE
        sizes = sizes[: columns.shape[1]]
        fan, place = columns[:, :at] @ sizes[:at], columns[:, at:] @ sizes[at:]
        return Beside(
            float(np.max(np.abs(fan))), 0.5 * float(np.ptp(place)), self.periods_rad, fan + place
        )

    def slopes(self, motion: Motion) -> list[FloatArray]:
        """How the shapes change with the logarithm of their period, [n] each."""
        found: list[FloatArray] = []
        for period in self.periods_rad:
            ahead, behind = (
                place_columns(motion.angle_rad, period * (1.0 + step), motion.smooth)
                for step in (_DIFFERENCE, -_DIFFERENCE)
            )
            found.extend(((ahead - behind) / (2 * _DIFFERENCE)).T)
        return found


def find_terms(others: FloatArray, torque_nm: FloatArray, motion: Motion, keep: BoolArray) -> Terms:
    """The terms that the torque [n] shows beside ``others`` [n, columns].

    The third of ``others`` is the direction of motion, whose size is the Coulomb friction.
    """

    largest = float(np.max(np.abs(torque_nm[keep])))

    def fitted(terms: Terms) -> _Fit:
        extra = terms.columns(motion)[keep]
        a = np.column_stack([others[keep], extra])
        scale = np.maximum(np.max(np.abs(a), axis=0), 1e-12)
        x = np.linalg.lstsq(a / scale, torque_nm[keep], rcond=None)[0] / scale
        made = extra @ x[others.shape[1] :]
        least = max(_LEAST * largest, _LEAST_OF_FRICTION * float(abs(x[2])))
        seen = 0.5 * float(np.ptp(made)) >= least
        return _Fit(terms, np.asarray(torque_nm[keep] - a @ x), seen)

    best = fitted(Terms())
    while True:
        terms = best.terms
        possible = [] if terms.fan else [Terms(True, terms.periods_rad)]
        if len(terms.periods_rad) < _PLACES:
            known = np.column_stack([others, terms.columns(motion)])
            period = find_period(known, torque_nm, motion.angle_rad, keep, motion.smooth)
            if period is not None:
                possible.append(Terms(terms.fan, (*terms.periods_rad, period)))
        if not possible:
            return terms
        better = min(map(fitted, possible), key=lambda fit: fit.power)
        if not better.seen or not _clearly(best, better, keep):
            return terms
        best = better


@dataclass(frozen=True)
class _Fit:
    """What terms leave of the torque [rows], and whether they are large enough to matter."""

    terms: Terms
    rest: FloatArray
    seen: bool

    @property
    def power(self) -> float:
        return float(np.sum(self.rest**2))


def _clearly(before: _Fit, after: _Fit, keep: BoolArray) -> bool:
    """Whether the second explains so much more that chance is not the reason."""
    taken = before.power - after.power
    if taken > _PLAIN * before.power:
        return True
    freedom = independent_share(after.rest, keep) * float(np.count_nonzero(keep))
    return taken > _SHARE * before.power and taken / 3.0 > _F * after.power / max(freedom, 1.0)


def independent_share(residual: FloatArray, keep: BoolArray) -> float:
    """Share of samples that are independent, from the residual's autocorrelation."""
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
