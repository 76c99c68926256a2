"""Motor temperature under a repeated load, and the time until it exceeds its limit.

Of a motor's thermal behaviour a catalogue states the rated torque (continuous at 40 °C,
IEC 60034-1) and one time constant. It does not state how much of the rise lies between winding and
housing, how fast the winding follows, which part of the losses depends on the speed, or how far
the current exceeds the torque at high torque. The result is therefore a range over all motors that
agree with the catalogue: two bodies (winding, housing), each of those quantities at its ends.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from backend.analysis.duty.load import Signals
from backend.analysis.thresholds import duty_heat as threshold

FloatArray = npt.NDArray[np.float64]
#: Ambient temperature for which the rated torque holds (IEC 60034-1), °C.
RATED_AMBIENT_C = 40.0


@dataclass(frozen=True)
class Heat:
    """Ends of the range. ``rise`` is the highest temperature rise as a share of the permitted one;
    ``trip_s`` is the time to the limit from a motor at ambient temperature, None where the limit is
    never reached; ``about_s`` is that time for the motor in the middle of the range."""

    rise: tuple[float, float]
    trip_s: tuple[float | None, float | None]
    about_s: float | None


@dataclass(frozen=True)
class _Losses:
    """Losses of one motor variant over the rated losses: in the winding [n], and elsewhere."""

    share: float
    winding: FloatArray
    elsewhere: float


def permitted_rise(ambient_c: float, rated_rise_k: float | None) -> float | None:
    """Return the permitted rise at this ambient temperature, as a share of the rated rise.

    None where the rated rise is needed and not stated.
    """
    if ambient_c == RATED_AMBIENT_C:
        return 1.0
    if rated_rise_k is None:
        return None
    return (RATED_AMBIENT_C + rated_rise_k - ambient_c) / rated_rise_k


def heat_of(
    signals: Signals,
    rated_rpm: float | None,
    *,
    permitted: float,
    time_constant_s: float | None,
    scale: tuple[float, float] = (1.0, 1.0),
    standstill: float | None = None,
) -> Heat:
    """Return the range of the rise, and of the time at which it exceeds the permitted value.

    ``scale`` are the ends of the effective torque's interval, as factors. ``standstill`` is the
    continuous torque at standstill, per unit of the rated torque: the squares of both differ by the
    speed-dependent losses.
    """
    even = signals.evenly(20_000)
    rises: list[float] = []
    trips: list[float | None] = []
    shares = threshold.SPEED_SHARE
    if standstill is not None:
        share = 1.0 - 1.0 / max(standstill, 1.0) ** 2
        shares = ((1.0 - threshold.STATED) * share, (1.0 + threshold.STATED) * share)
    for losses in _losses(
        even, rated_rpm, shares, tuple(zip(threshold.SATURATION, scale, strict=True))
    ):
        for winding, tau_w in itertools.product(threshold.WINDING, _winding_taus(time_constant_s)):
            thermal = _Bodies(losses, winding, tau_w, even.spacing_s)
            rises.append(thermal.highest() / permitted)
            if time_constant_s is None:
                continue
            for factor, copper in itertools.product(threshold.TIME_CONSTANT, threshold.COPPER):
                trips.append(thermal.too_warm_s(permitted, factor * time_constant_s, copper))
    known = [each for each in trips if each is not None]
    latest = None if not known or len(known) < len(trips) else max(known)
    about = None
    if time_constant_s is not None:
        middle = (0.5 * sum(shares), 0.5 * sum(threshold.SATURATION))
        losses = _one(even, rated_rpm, middle[0], 1.5, middle[1])
        tau_w = float(np.sqrt(np.prod(threshold.WINDING_SHARE))) * time_constant_s
        motor = _Bodies(losses, threshold.WINDING[1], tau_w, even.spacing_s)
        about = motor.too_warm_s(permitted, time_constant_s, 0.5 * sum(threshold.COPPER))
    return Heat((min(rises), max(rises)), (min(known, default=None), latest), about)


def _winding_taus(time_constant_s: float | None) -> tuple[float, ...]:
    if time_constant_s is None:
        return threshold.WINDING_S
    return tuple(share * time_constant_s for share in threshold.WINDING_SHARE)


def _losses(
    even: Signals,
    rated_rpm: float | None,
    shares: tuple[float, float],
    currents: Iterable[tuple[float, float]],
) -> Iterator[_Losses]:
    for (saturation, factor), share, power in itertools.product(
        currents, shares, threshold.SPEED_POWER if rated_rpm is not None else (0.0, np.inf)
    ):
        yield _one(even, rated_rpm, share, power, saturation, factor)


def _one(
    even: Signals,
    rated_rpm: float | None,
    share: float,
    power: float,
    saturation: float,
    factor: float = 1.0,
) -> _Losses:
    """Losses of one motor variant. Without a rated speed the speed-dependent part is unknown:
    ``power`` 0 takes it as at rated speed, infinity as none, other values as half."""
    torque = np.abs(even.torque_percent) / 100.0
    current = factor * torque * (1.0 + saturation * np.maximum(torque - 1.0, 0.0))
    if rated_rpm is None:
        fast = {0.0: 1.0, np.inf: 0.0}.get(power, 0.5)
    else:
        fast = float(np.mean((np.abs(even.speed_rpm) / rated_rpm) ** power))
    return _Losses(share, (1.0 - share) * current**2, share * fast)


class _Bodies:
    """Winding and housing, with thermal resistances for which the rated load gives a rise of 1."""

    def __init__(self, losses: _Losses, winding: float, tau_w: float, spacing_s: float) -> None:
        whole = winding * (1.0 - losses.share) + (1.0 - winding)
        self._to_housing, self._to_air = winding / whole, (1.0 - winding) / whole
        self._tau_w = tau_w
        self._copper = float(np.mean(losses.winding))
        self._elsewhere = losses.elsewhere
        self._swing = self._to_housing * self._swing_of(losses.winding, spacing_s)

    def _swing_of(self, losses: FloatArray, spacing_s: float) -> float:
        """Peak rise of the winding above its mean within the repeated load, per unit of loss."""
        decay = float(np.exp(-spacing_s / self._tau_w))
        about = np.concatenate([losses, losses]) - self._copper
        answer = scipy.signal.lfilter([1.0 - decay], [1.0, -decay], about)
        return float(max(np.max(answer[losses.size :]), 0.0))

    def highest(self) -> float:
        """Return the final rise, with the resistance at the permitted temperature."""
        copper, air = self._copper, self._to_air
        return self._to_housing * copper + air * (copper + self._elsewhere) + self._swing

    def too_warm_s(self, permitted: float, tau_s: float, copper: float) -> float | None:
        """Return when the winding has risen by ``permitted``; None if never.

        ``copper`` is the increase of the resistance per rated rise, relative to that at the limit.
        """
        if self.highest() < permitted:
            return None
        r_w, r_h = self._to_housing, self._to_air
        c_w, c_h = self._tau_w / r_w, tau_s / r_h
        matrix = np.array(
            [
                [(-1.0 / r_w + self._copper * copper) / c_w, 1.0 / (r_w * c_w)],
                [1.0 / (r_w * c_h), (-1.0 / r_w - 1.0 / r_h) / c_h],
            ]
        )
        given = np.array([self._copper * (1.0 - copper * permitted) / c_w, self._elsewhere / c_h])
        values, vectors = np.linalg.eig(matrix)
        still = np.linalg.solve(vectors, given)
        moments = np.geomspace(1e-3 * self._tau_w, threshold.LONGEST * tau_s, threshold.MOMENTS)
        # ∫ e^{λt} dt of each eigenvector; λ is never exactly zero with losses of finite precision.
        grown = np.expm1(np.clip(np.outer(moments, values.real), None, 50.0)) / values.real
        winding = grown @ (vectors[0].real * still.real)
        winding = winding + self._swing * -np.expm1(-moments / self._tau_w)
        over = np.flatnonzero(winding >= permitted)
        if not over.size:
            return None
        first = int(over[0])
        if first == 0:
            return float(moments[0])
        ends = winding[first - 1 : first + 1]
        return float(np.interp(permitted, ends, moments[first - 1 : first + 1]))
