"""Friction map from recordings of constant speeds. Pure: also works on stored raw data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from backend.analysis.mechanics.stribeck import SpeedModel, speed_model
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Recording
from backend.tools.mechanics.friction.result import (
    Estimate,
    Finding,
    FrictionPoint,
    FrictionResult,
    Harmonic,
)
from backend.tools.mechanics.friction.settings import FrictionSettings
from backend.tools.thresholds import friction_evaluate as threshold
from backend.tools.tool import Arrays, Meta
from drivers.errors import NotAllowed

FloatArray = npt.NDArray[np.float64]
_TURN = 2 * np.pi
_RPM = 60.0 / _TURN


@dataclass(frozen=True)
class Map:
    """Raw data [n]: ``plateau`` numbers the constant speeds, negative backwards; 0 between them."""

    sample_rate_hz: float
    position_rad: FloatArray
    torque_nm: FloatArray
    valid: npt.NDArray[np.bool_]
    plateau: npt.NDArray[np.int64]
    torque_step_nm: float
    inertia_kgm2: float
    ripple_rpm: float | None
    by_travel: bool
    by_time: bool

    @classmethod
    def of(
        cls, recordings: Sequence[Recording], numbers: Sequence[FloatArray], *,
        torque_step_nm: float, inertia_kgm2: float, ripple_rpm: float | None, by_travel: bool,
        by_time: bool,
    ) -> Map:  # fmt: skip
        """Join the recordings, one for each speed, with each sample's signed plateau number."""
        plateau = [
            np.sign(n) * (100 * index * (n != 0) + np.abs(n)) for index, n in enumerate(numbers)
        ]
        return cls(
            recordings[0].sample_rate_hz,
            np.concatenate([each.position_rad for each in recordings]),
            np.concatenate([each.torque_nm for each in recordings]),
            np.concatenate([each.valid for each in recordings]),
            np.concatenate(plateau).astype(np.int64),
            torque_step_nm,
            inertia_kgm2,
            ripple_rpm,
            by_travel,
            by_time,
        )

    def arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """The samples as arrays for storage."""
        return {
            "position_rad": self.position_rad,
            "torque_nm": self.torque_nm,
            "valid": self.valid,
            "plateau": self.plateau,
        }

    def facts(self) -> dict[str, object]:
        """The scalar facts for storage, with the arrays."""
        return {
            "sample_rate_hz": self.sample_rate_hz,
            "torque_step_nm": self.torque_step_nm,
            "inertia_kgm2": self.inertia_kgm2,
            "ripple_rpm": self.ripple_rpm,
            "by_travel": self.by_travel,
            "by_time": self.by_time,
        }


@dataclass(frozen=True)
class _Plateau:
    """One constant speed: rad [n], % of rated [n], signed rpm; ``even`` where it was held constant.

    ``valid`` [n] is False where a sample was lost; there the arrays hold a straight line, which
    contains no ripple.
    """

    speed: int
    angle: FloatArray
    torque: FloatArray
    valid: npt.NDArray[np.bool_]
    rpm: float
    even: bool

    @property
    def revolutions(self) -> float:
        return float(abs(self.angle[-1] - self.angle[0])) / _TURN


@dataclass(frozen=True)
class _Ripple:
    """Complex amplitudes of orders 1…K in %, torque = Re(c·exp(jkθ)), and their deviations."""

    orders: npt.NDArray[np.int64]
    amplitude: npt.NDArray[np.complex128]
    deviation: FloatArray
    stands_out: npt.NDArray[np.bool_]

    def at(self, angle: FloatArray, rpm: float) -> FloatArray:
        """Ripple that the measured torque shows at this speed, [n] in %."""
        shown = self.stands_out & (self.orders * abs(rpm) / 60.0 <= threshold.FOLLOWED_HZ)
        total = np.zeros(angle.size)
        for order, amplitude in zip(self.orders[shown], self.amplitude[shown], strict=True):
            total += np.real(amplitude * np.exp(1j * order * angle))
        return total


def evaluate(data: Map, settings: FrictionSettings, facts: AxisFacts) -> FrictionResult:
    """Evaluate the recordings.

    Raises:
        NotAllowed: no speed was held in both directions.
    """
    found = _plateaus(data, facts.rated_torque_nm)
    even = [each for each in found if each.even]
    uneven = sorted({abs(each.rpm) for each in found if not each.even})
    step = data.torque_step_nm / facts.rated_torque_nm * 100.0
    findings: list[Finding] = []
    slow = [
        each
        for each in even
        if data.ripple_rpm is not None and abs(abs(each.rpm) / data.ripple_rpm - 1.0) < 0.1
    ]
    inertia = data.inertia_kgm2 / facts.rated_torque_nm * 100.0
    rate = data.sample_rate_hz
    ripple = _ripple(slow, settings.orders, rate, inertia, step)
    points = _points(even, ripple, rate, inertia, step)
    if not any(p.speed_rpm > 0 for p in points) or not any(p.speed_rpm < 0 for p in points):
        raise NotAllowed("friction.no-speed-held-evenly", value=round(max(uneven, default=0.0), 4))
    model = _model(points, step)
    # Friction varies with the ripple of the speed itself; now that the model is known, that part is
    # removed.
    own = ripple and _ripple(slow, settings.orders, rate, inertia, step, model)
    if not settings.ripple:
        findings.append(Finding(code="ripple_not_asked"))
    elif ripple is None:
        findings.append(Finding(code="ripple_needs_revolution"))
    elif not np.any(ripple.stands_out):
        smallest = float(threshold.STANDS_OUT * np.max(ripple.deviation))
        findings.append(Finding(code="ripple_not_seen", value=smallest, unit="%"))
    if uneven:
        findings.append(Finding(code="uneven_speeds", value=uneven[-1], unit="rpm"))
    fastest = max(abs(p.speed_rpm) for p in points)
    slowest = min(abs(p.speed_rpm) for p in points)
    if data.by_travel:
        findings.append(Finding(code="fastest_by_travel", value=fastest, unit="rpm"))
    if data.by_time:
        findings.append(Finding(code="slowest_by_time", value=slowest, unit="rpm"))
    findings += _findings(model)
    findings.append(Finding(code="standstill_not_measured", value=slowest, unit="rpm"))
    speeds, curve = model.curve()
    angle, forward, backward = _by_angle(slow if ripple is not None else [])
    harmonics = _harmonics(own)
    if harmonics:
        findings.append(Finding(code="compensation_in_controller"))
    return FrictionResult(
        rated_torque_nm=facts.rated_torque_nm if facts.torque_known else None,
        points=tuple(points),
        curve_speed_rpm=speeds,
        curve_percent=curve,
        coulomb_percent=_estimate(model.value(1)),
        viscous_percent_per_rpm=_estimate(model.value(2)),
        stribeck_percent=_estimate(model.value(3)) if model.reached else None,
        stribeck_speed_rpm=_estimate(model.stribeck_speed()) if model.reached else None,
        load_percent=_estimate(model.value(0)),
        harmonics=harmonics,
        ripple_speed_rpm=data.ripple_rpm if ripple is not None else None,
        ripple_angle_deg=angle,
        ripple_forward_percent=forward,
        ripple_backward_percent=backward,
        compensation_percent=_compensation(harmonics, angle),
        findings=(Finding(code="mapped", value=float(len(points))), *findings),
        motion_s=data.position_rad.size / data.sample_rate_hz,
    )


def reevaluate(arrays: Arrays, meta: Meta) -> FrictionResult:
    """Evaluate stored raw data again.

    Raises:
        ValueError: not the raw data of a friction map.
    """
    given, facts = meta.get("settings"), meta.get("facts")
    if not isinstance(given, dict) or not isinstance(facts, dict) or "plateau" not in arrays:
        raise ValueError("not the raw data of a friction map")
    ripple = meta["ripple_rpm"]
    data = Map(
        float(str(meta["sample_rate_hz"])),
        np.asarray(arrays["position_rad"], np.float64),
        np.asarray(arrays["torque_nm"], np.float64),
        np.asarray(arrays["valid"], np.bool_),
        np.asarray(arrays["plateau"], np.int64),
        float(str(meta["torque_step_nm"])),
        float(str(meta["inertia_kgm2"])),
        None if ripple is None else float(str(ripple)),
        bool(meta["by_travel"]),
        bool(meta["by_time"]),
    )
    return evaluate(data, FrictionSettings.model_validate(given), AxisFacts(**facts))


# --- plateaus --------------------------------------------------------------------------------


def _plateaus(data: Map, rated_nm: float) -> list[_Plateau]:
    found = []
    for number in np.unique(data.plateau[data.plateau != 0]):
        at = np.flatnonzero(data.plateau == number)
        if at.size < 4 * threshold.BLOCKS or float(np.mean(data.valid[at])) < threshold.ARRIVED:
            continue
        angle, torque = data.position_rad[at], data.torque_nm[at] / rated_nm * 100.0
        edges = np.linspace(0, at.size - 1, threshold.BLOCKS + 1).astype(int)
        blocks = np.diff(angle[edges]) / np.diff(edges) * data.sample_rate_hz * _RPM
        rpm = float((angle[-1] - angle[0]) / (at.size - 1) * data.sample_rate_hz * _RPM)
        shares = blocks / rpm if rpm else np.zeros(threshold.BLOCKS)
        right = rpm * number > 0
        even = bool(right and np.all((shares > threshold.EVEN[0]) & (shares < threshold.EVEN[1])))
        speed = int(abs(number)) // 100
        found.append(_Plateau(speed, angle, torque, data.valid[at], rpm, even))
    return found


def _points(
    plateaus: Sequence[_Plateau], ripple: _Ripple | None, rate: float, inertia: float, step: float
) -> list[FrictionPoint]:
    """Mean torque of each speed and direction, from fastest backwards to fastest forwards."""
    points = []
    for speed, sign in sorted({(each.speed, np.sign(each.rpm)) for each in plateaus}):
        same = [e for e in plateaus if e.speed == speed and np.sign(e.rpm) == sign]
        means, blocks, turns = [], [], 0.0
        for each in same:
            mean, parts, revolutions = _level(each, ripple, rate, inertia)
            means.append(mean)
            blocks.append(parts)
            turns += revolutions
        torque, every = float(np.mean(means)), np.concatenate(blocks)
        scatter = float(np.std(every, ddof=1)) / np.sqrt(every.size)
        half = float(scipy.special.stdtrit(every.size - 1, 0.975)) * scatter
        half = float(
            np.hypot(np.hypot(half, step / np.sqrt(12.0)), 1.96 * threshold.SHARE * torque)
        )
        points.append(
            FrictionPoint(
                speed_rpm=float(np.mean([each.rpm for each in same])),
                torque_percent=torque,
                torque_ci95_percent=(torque - half, torque + half),
                revolutions=turns,
            )
        )
    return sorted(points, key=lambda point: point.speed_rpm)


def _level(
    plateau: _Plateau, ripple: _Ripple | None, rate: float, inertia: float
) -> tuple[float, FloatArray, float]:
    """Mean torque, the means of its blocks, and the number of revolutions that they cover.

    Whole revolutions are used where there is at least one; the torque for acceleration is removed.
    """
    angle, torque, valid = plateau.angle, plateau.torque, plateau.valid
    whole = np.floor(plateau.revolutions + threshold.NEARLY)
    revolutions = plateau.revolutions
    if whole >= 1.0:
        within = np.abs(angle - angle[0]) <= whole * _TURN
        angle, torque, valid = angle[within], torque[within], valid[within]
        revolutions = float(whole)
    if ripple is not None:
        torque = torque - ripple.at(angle, plateau.rpm)
    count = int(whole) if whole >= 4.0 else threshold.BLOCKS
    blocks = zip(np.array_split(torque, count), np.array_split(valid, count), strict=True)
    parts = np.array([np.mean(part[arrived]) for part, arrived in blocks if np.any(arrived)])
    lost = inertia * _acceleration(angle, int(whole), rate)
    return float(np.mean(torque[valid])) - lost, parts - lost, revolutions


def _acceleration(angle: FloatArray, whole: int, rate: float) -> float:
    """Mean acceleration [rad/s²] from the times of the first and the last revolution.

    It is 0 with fewer than two revolutions: within one, the ripple of the speed cannot be
    distinguished from an acceleration.
    """
    if whole < 2:
        return 0.0
    gone = np.abs(angle - angle[0])
    marks = np.interp([0.0, _TURN, (whole - 1) * _TURN, whole * _TURN], gone, np.arange(gone.size))
    first, last = (marks[1] - marks[0]) / rate, (marks[3] - marks[2]) / rate
    if min(first, last) <= 0.0:
        return 0.0
    apart = 0.5 * (marks[2] + marks[3] - marks[0] - marks[1]) / rate
    change = _TURN / last - _TURN / first
    return float(np.sign(angle[-1] - angle[0]) * change / apart)


# --- ripple ----------------------------------------------------------------------------------


def _ripple(
    plateaus: Sequence[_Plateau], orders: int, rate: float, inertia: float, step: float,
    friction: SpeedModel | None = None,
) -> _Ripple | None:  # fmt: skip
    """Orders of the torque over a slow revolution in each direction; None without both."""
    ways = [
        next((e for e in plateaus if np.sign(e.rpm) == sign and e.revolutions >= 1.0), None)
        for sign in (1.0, -1.0)
    ]
    if any(way is None for way in ways):
        return None
    k = np.arange(1, orders + 1)
    fits = () if friction is None else (friction.best, *friction.alike)
    both = np.array([
        [_acting(amplitude, way.rpm, inertia, s) for s in [f.slope(way.rpm) for f in fits] or [0.0]]
        for way in ways if way is not None
        for amplitude in [_orders(way, k, rate)]
    ])  # fmt: skip
    forward, backward = both[:, 0]
    # The phase shift by the loop's delay has the opposite sign in the other direction.
    mean, half_difference = 0.5 * (forward + backward), 0.5 * np.abs(forward - backward)
    chance = float(np.median(np.abs(mean))) / np.sqrt(2.0 * np.log(2.0))
    stands_out = (np.abs(mean) > threshold.STANDS_OUT * chance) & (
        np.abs(mean) > threshold.OF_STEP * step
    )
    stands_out &= half_difference < np.abs(mean)
    # Two revolutions leave two degrees of freedom; `_harmonics` multiplies by 1.96 deviations.
    few = float(scipy.special.stdtrit(2, 0.975)) / 1.96
    deviation = np.hypot(chance, few * half_difference / np.sqrt(2.0))
    # Friction curves that fit equally well differ in their slopes.
    deviation = np.hypot(deviation, np.max(np.abs(np.mean(both, axis=0) - mean), axis=0) / 1.96)
    return _Ripple(k, mean, np.where(stands_out, deviation, chance), stands_out)


def _orders(plateau: _Plateau, k: npt.NDArray[np.int64], rate: float) -> npt.NDArray[np.complex128]:
    """Complex amplitudes of the torque and of the angle [k, 2] by least squares."""
    angle, torque = plateau.angle[plateau.valid], plateau.torque[plateau.valid]
    time = np.flatnonzero(plateau.valid) / rate
    trend = np.column_stack([np.ones(angle.size), time - time.mean()])
    turning = np.outer(angle, k)
    if np.all(plateau.valid):
        columns = np.hstack([trend, np.cos(turning), -np.sin(turning)])
        both = np.linalg.lstsq(columns, np.column_stack([torque, angle]), rcond=None)[0]
        return np.asarray(both[2 : 2 + k.size] + 1j * both[2 + k.size :])
    return np.column_stack([_pursued(trend, turning, each) for each in (torque, angle)])


def _acting(
    amplitude: npt.NDArray[np.complex128], rpm: float, inertia: float, slope: float
) -> npt.NDArray[np.complex128]:
    """Torque acting on the motor [k]: the measured orders less inertia and friction of the ripple.

    ``slope`` is that of friction over speed, in % per rpm.
    """
    k = np.arange(1, amplitude.shape[0] + 1)
    speed = rpm / _RPM
    swing = 1j * k * speed * amplitude[:, 1]
    found = amplitude[:, 0] - inertia * 1j * k * speed * swing - slope * _RPM * swing
    return np.asarray(found, dtype=np.complex128)


def _pursued(
    trend: FloatArray, turning: FloatArray, wanted: FloatArray
) -> npt.NDArray[np.complex128]:
    """Complex amplitudes [k] of ``wanted`` [n] with missing samples, by matching pursuit.

    With a gap longer than a period, all orders together are nearly linearly dependent, and a fit of
    all of them would let them cancel one another. The largest is fitted first, then jointly with
    the largest of the residual, as long as one is significant.
    """
    chosen: list[int] = []
    while True:
        within = turning[:, chosen]
        columns = np.hstack([trend, np.cos(within), -np.sin(within)])
        fitted = np.linalg.lstsq(columns, wanted, rcond=None)[0]
        left = 2.0 * np.mean((wanted - columns @ fitted)[:, None] * np.exp(-1j * turning), axis=0)
        chance = float(np.median(np.abs(left))) / np.sqrt(2.0 * np.log(2.0))
        size = np.abs(left)
        size[chosen] = 0.0
        largest = int(np.argmax(size))
        if size[largest] <= threshold.STANDS_OUT * chance or 2 * len(chosen) >= left.size:
            break
        chosen.append(largest)
    left[chosen] = fitted[2 : 2 + len(chosen)] + 1j * fitted[2 + len(chosen) :]
    return np.asarray(left)


def _harmonics(ripple: _Ripple | None) -> tuple[Harmonic, ...]:
    if ripple is None:
        return ()
    found = []
    for index in np.flatnonzero(ripple.stands_out):
        # Re(c·exp(jkθ)) = |c|·sin(kθ + arg c + 90°).
        size = float(np.abs(ripple.amplitude[index]))
        half = float(np.hypot(1.96 * ripple.deviation[index], threshold.SHARE_OF_RIPPLE * size))
        phase = float(np.degrees(np.angle(ripple.amplitude[index]))) + 90.0
        found.append(
            Harmonic(
                order_per_rev=int(ripple.orders[index]),
                amplitude_percent=size,
                amplitude_ci95_percent=(max(size - half, 0.0), size + half),
                phase_deg=(phase + 180.0) % 360.0 - 180.0,
            )
        )
    return tuple(sorted(found, key=lambda each: -each.amplitude_percent))


def _compensation(harmonics: Sequence[Harmonic], angle_deg: Sequence[float]) -> tuple[float, ...]:
    """Sum of the harmonics at these angles [n] in %; empty without a harmonic."""
    if not harmonics:
        return ()
    angle = np.radians(np.asarray(angle_deg))
    total = np.zeros(angle.size)
    for each in harmonics:
        phase = np.radians(each.phase_deg)
        total += each.amplitude_percent * np.sin(each.order_per_rev * angle + phase)
    return tuple(float(each) for each in total)


def _by_angle(
    plateaus: Sequence[_Plateau],
) -> tuple[tuple[float, ...], tuple[float | None, ...], tuple[float | None, ...]]:
    """Torque about its mean over one revolution, forwards and backwards; None without samples."""
    if not plateaus:
        return (), (), ()
    curves = []
    for sign in (1.0, -1.0):
        way = [e for e in plateaus if np.sign(e.rpm) == sign]
        angle = np.concatenate([e.angle[e.valid] for e in way])
        torque = np.concatenate([e.torque[e.valid] - np.mean(e.torque[e.valid]) for e in way])
        place = np.floor(np.mod(angle, _TURN) / _TURN * threshold.BINS).astype(int) % threshold.BINS
        count = np.bincount(place, minlength=threshold.BINS)
        total = np.bincount(place, torque, minlength=threshold.BINS)
        curves.append(tuple(float(s / n) if n else None for s, n in zip(total, count, strict=True)))
    return tuple((np.arange(threshold.BINS) + 0.5) * 360.0 / threshold.BINS), curves[0], curves[1]


# --- over speed ------------------------------------------------------------------------------


def _model(points: Sequence[FrictionPoint], step: float) -> SpeedModel:
    ends = np.array([p.torque_ci95_percent for p in points])
    half = np.maximum(0.5 * (ends[:, 1] - ends[:, 0]), step / np.sqrt(12.0))
    return speed_model(
        np.array([p.speed_rpm for p in points]), np.array([p.torque_percent for p in points]), half
    )


def _estimate(found: tuple[float, float, float]) -> Estimate:
    return Estimate(value=found[0], ci95=found[1:])


def _findings(model: SpeedModel) -> list[Finding]:
    """Findings on what the measured speeds do not determine."""
    least = float(np.min(np.abs(model.speed)))
    if not model.enough:
        return [Finding(code="few_speeds", value=float(model.speeds))]
    found = []
    if model.best.speed is None:
        found.append(Finding(code="stribeck_not_seen", value=least, unit="rpm"))
    elif not model.reached:
        found.append(Finding(code="stribeck_not_reached", value=least, unit="rpm"))
    if (misfit := model.misfit()) > 0.0:
        found.append(Finding(code="model_misfit", value=100.0 * misfit, unit="%"))
    return found
