"""Orders, frequencies and resonances from recordings of constant speeds. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from backend.analysis.vibration.level_peak import LevelPeak, level_peaks
from backend.analysis.vibration.orders import Component, Seen, components, levels
from backend.analysis.vibration.sinusoids import Segment, Sinusoid, about_trend, sinusoids
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Recording
from backend.tools.thresholds import vibration_evaluate as threshold
from backend.tools.tool import Arrays, Meta
from backend.tools.watching.vibration.result import (
    Place,
    SpeedRange,
    VibrationFinding,
    VibrationFrequency,
    VibrationOrder,
    VibrationPart,
    VibrationResonance,
    VibrationResult,
    VibrationSpeed,
)
from drivers.errors import NotAllowed

FloatArray = npt.NDArray[np.float64]
_TURN = 2 * np.pi
_RPM = 60.0 / _TURN


@dataclass(frozen=True)
class Plateaus:
    """Raw data [n]: ``plateau`` numbers the constant speeds, negative backwards; 0 between them.

    Its hundreds are the number of the speed. ``closer`` is False where an order had a maximum
    level, but no further speeds about it were measured, for lack of time.
    """

    sample_rate_hz: float
    position_rad: FloatArray
    torque_nm: FloatArray
    valid: npt.NDArray[np.bool_]
    plateau: npt.NDArray[np.int64]
    by_travel: bool
    closer: bool

    @classmethod
    def of(
        cls,
        recordings: Sequence[Recording],
        numbers: Sequence[FloatArray],
        *,
        by_travel: bool,
        closer: bool,
    ) -> Plateaus:
        """Join the recordings, one for each speed, with each sample's signed plateau number."""
        plateau = [
            np.sign(n) * (100 * (index + 1) * (n != 0) + np.abs(n))
            for index, n in enumerate(numbers)
        ]
        return cls(
            recordings[0].sample_rate_hz,
            np.concatenate([each.position_rad for each in recordings]),
            np.concatenate([each.torque_nm for each in recordings]),
            np.concatenate([each.valid for each in recordings]),
            np.concatenate(plateau).astype(np.int64),
            by_travel,
            closer,
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
            "by_travel": self.by_travel,
            "closer": self.closer,
        }


@dataclass(frozen=True)
class _Held:
    """One plateau: its segment, in rpm and % of rated torque, and its significant sinusoids."""

    number: int
    sign: int
    segment: Segment
    found: tuple[Sinusoid, ...]

    @property
    def speed_rps(self) -> float:
        return self.segment.speed_rps


@dataclass(frozen=True)
class Levels:
    """Amplitudes [plateaus, components] of speed in rpm, their deviations, and of torque in %.

    ``hertz`` is the frequency of each component at each plateau.
    """

    held: tuple[_Held, ...]
    components: tuple[Component, ...]
    hertz: FloatArray
    speed: FloatArray
    deviation: FloatArray
    torque: FloatArray
    left: int
    uneven_rpm: tuple[float, ...]
    lost: int
    band_hz: tuple[float, float]

    @property
    def rpm(self) -> FloatArray:
        """Absolute speed [plateaus]."""
        return np.array([60.0 * each.speed_rps for each in self.held])


def levels_of(data: Plateaus, rated_nm: float) -> Levels:
    """Components and levels of the plateaus.

    Raises:
        NotAllowed: no speed was held in both directions.
    """
    band = threshold.LOWEST_HZ, threshold.BAND * data.sample_rate_hz
    held, uneven, lost = _held(data, rated_nm, band)
    if not {1, -1} <= {each.sign for each in held}:
        raise NotAllowed("vibration.no-speed-held", value=round(max(uneven, default=0.0), 4))
    seen = [
        Seen(row, each.number, each.speed_rps, float(each.segment.turns[-1]), one)
        for row, each in enumerate(held)
        for one in each.found
    ]
    found, left = components(seen)
    segments = [each.segment for each in held]
    speed, deviation, torque = levels(segments, found, band)
    hertz = np.array(
        [
            [c.value * each.speed_rps if c.kind == "order" else c.value for c in found]
            for each in held
        ]
    ).reshape(len(held), len(found))
    # A difference of two positions is the mean speed between them.
    shown = np.sinc(np.clip(hertz / data.sample_rate_hz, 0.0, 0.5))
    return Levels(
        tuple(held), tuple(found), np.asarray(hertz, np.float64),
        np.asarray(speed / shown, np.float64),
        np.asarray(deviation / shown, np.float64), np.asarray(torque, np.float64),
        len({one.speed for one in left}), tuple(uneven), lost, band,
    )  # fmt: skip


def closer_about(found: Levels) -> tuple[float, float] | None:
    """Speeds [rev/s] around the maximum level of an order; None where there is none.

    The order is the one whose maximum is highest relative to the levels at the two adjacent speeds.
    """
    best: tuple[float, float, float] | None = None
    for column, component in enumerate(found.components):
        speeds, means = _by_speed(found, column)
        if component.kind != "order" or speeds.size < 3:
            continue
        over = means[1:-1] / np.sqrt(np.maximum(means[:-2] * means[2:], 1e-300))
        over *= means[1:-1] > np.maximum(means[:-2], means[2:])
        over *= [_matters(found, column, float(speed)) for speed in speeds[1:-1]]
        at = 1 + int(np.argmax(over))
        ratio = float(over[at - 1])
        if ratio >= threshold.PEAK and (best is None or ratio > best[0]):
            best = ratio, float(speeds[at - 1]), float(speeds[at + 1])
    return None if best is None else (best[1], best[2])


def evaluate(data: Plateaus, facts: AxisFacts) -> VibrationResult:
    """Evaluate the recordings.

    Raises:
        NotAllowed: no speed was held in both directions.
    """
    found = levels_of(data, facts.rated_torque_nm)
    orders = [i for i, c in enumerate(found.components) if c.kind == "order"]
    fixed = [i for i, c in enumerate(found.components) if c.kind == "frequency"]
    resonances = _resonances(found, orders)
    shown = tuple(sorted((_order(found, i) for i in orders), key=lambda each: -each.largest_rpm))
    steady = tuple(
        sorted((_frequency(found, i) for i in fixed), key=lambda each: -each.largest_rpm)
    )
    return VibrationResult(
        sample_rate_hz=data.sample_rate_hz,
        band_hz=found.band_hz,
        speeds=tuple(_speeds(found)),
        orders=shown,
        frequencies=steady,
        resonances=resonances,
        findings=tuple(_findings(data, found, shown, steady, resonances)),
        motion_s=data.position_rad.size / data.sample_rate_hz,
    )


def reevaluate(arrays: Arrays, meta: Meta) -> VibrationResult:
    """Evaluate stored raw data again.

    Raises:
        ValueError: not the raw data of this tool.
    """
    facts = meta.get("facts")
    if meta.get("tool") != "vibration" or not isinstance(facts, dict) or "plateau" not in arrays:
        raise ValueError("not the raw data of a map of vibration over speed")
    data = Plateaus(
        float(str(meta["sample_rate_hz"])),
        np.asarray(arrays["position_rad"], np.float64),
        np.asarray(arrays["torque_nm"], np.float64),
        np.asarray(arrays["valid"], np.bool_),
        np.asarray(arrays["plateau"], np.int64),
        bool(meta["by_travel"]),
        bool(meta["closer"]),
    )
    return evaluate(data, AxisFacts(**facts))


def _held(
    data: Plateaus, rated_nm: float, band: tuple[float, float]
) -> tuple[list[_Held], list[float], int]:
    """Plateaus with constant speed, slowest first; speeds that were not; number of lost ones."""
    held: list[_Held] = []
    uneven: set[float] = set()
    lost = 0
    for number in np.unique(data.plateau[data.plateau != 0]).tolist():
        at = np.flatnonzero(data.plateau == number)
        if at.size < 8 * threshold.BLOCKS or np.mean(data.valid[at]) < threshold.ARRIVED:
            lost += 1
            continue
        sign = 1 if number > 0 else -1
        angle, rate = data.position_rad[at] * sign, data.sample_rate_hz
        edges = np.linspace(0, at.size - 1, threshold.BLOCKS + 1).astype(int)
        blocks = np.diff(angle[edges]) / np.diff(edges) * rate
        mean = float((angle[-1] - angle[0]) / (at.size - 1) * rate)
        if mean <= 0.0 or np.any(np.abs(blocks / mean - 1.0) > threshold.EVEN):
            uneven.add(abs(mean) * _RPM)
            continue
        valid = data.valid[at][1:] & data.valid[at][:-1]
        middle = 0.5 * (angle[1:] + angle[:-1])
        torque = data.torque_nm[at][1:] / rated_nm * 100.0
        segment = Segment(
            rate,
            np.asarray((middle - middle[0]) / _TURN),
            about_trend(np.diff(angle) * rate * _RPM, valid),
            about_trend(torque, valid),
            valid,
        )
        low = max(band[0], threshold.PERIODS / segment.duration_s)
        found = tuple(sinusoids(segment, low, band[1]))
        held.append(_Held(abs(number) // 100, sign, segment, found))
    return sorted(held, key=lambda each: each.speed_rps), sorted(uneven), lost


def _speeds(found: Levels) -> list[VibrationSpeed]:
    """Each speed and direction: RMS over its plateaus, and the largest sinusoids of one of them."""
    speeds = []
    for number, sign in sorted({(each.number, each.sign) for each in found.held}):
        same = [each for each in found.held if (each.number, each.sign) == (number, sign)]
        rms = [
            np.sqrt(np.mean([np.mean(signal[each.segment.valid] ** 2) for each, signal in pairs]))
            for pairs in (
                [(each, each.segment.speed) for each in same],
                [(each, each.segment.torque) for each in same],
            )
        ]
        rps = float(np.mean([each.speed_rps for each in same]))
        most = max(same, key=lambda each: sum(one.amplitude for one in each.found))
        speeds.append(
            VibrationSpeed(
                speed_rpm=sign * rps * 60.0,
                speed_rms_rpm=float(rms[0]),
                torque_rms_percent=float(rms[1]),
                highest_order=found.band_hz[1] / rps,
                parts=tuple(_parts(most, found)),
            )
        )
    return sorted(speeds, key=lambda each: (abs(each.speed_rpm), each.speed_rpm))


def _parts(held: _Held, found: Levels) -> list[VibrationPart]:
    parts = []
    for one in held.found[: threshold.PARTS]:
        component = Component("frequency", one.frequency_hz, (0.0, 0.0), 1, 1.0, 1.0)
        _, _, torque = levels([held.segment], [component], (0.0, found.band_hz[1]))
        rate = held.segment.rate_hz
        parts.append(
            VibrationPart(
                frequency_hz=one.frequency_hz,
                order_per_rev=one.frequency_hz / held.speed_rps,
                speed_rpm=one.amplitude / float(np.sinc(one.frequency_hz / rate)),
                torque_percent=float(np.nan_to_num(torque[0, 0])),
            )
        )
    return parts


def _by_speed(found: Levels, column: int) -> tuple[FloatArray, FloatArray]:
    """Mean level of a component at each speed that shows it [rev/s, rpm]."""
    shown = np.isfinite(found.speed[:, column])
    numbers = np.array([each.number for each in found.held])
    rps = found.rpm / 60.0
    pairs = sorted(
        (float(np.mean(rps[at])), float(np.mean(found.speed[at, column])))
        for at in (shown & (numbers == n) for n in np.unique(numbers[shown]))
    )
    return np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])


def _matters(found: Levels, column: int, speed_rps: float) -> bool:
    """Whether a component is among the largest at about this speed, judged by acceleration."""
    near = np.abs(found.rpm / 60.0 / speed_rps - 1.0) < threshold.SAME_SPEED
    felt = np.nan_to_num(found.speed[near] * found.hertz[near])
    return bool(np.max(felt[:, column]) >= threshold.MATTERS * np.max(felt))


def _largest(found: Levels, column: int) -> tuple[float, float, float]:
    """Speed [rpm] at which a component is largest, its amplitude [rpm], and the torque's [%]."""
    level = np.where(np.isfinite(found.speed[:, column]), found.speed[:, column], -1.0)
    at = int(np.argmax(level))
    largest, torque = float(level[at]), float(np.nan_to_num(found.torque[at, column]))
    return float(found.rpm[at]), max(largest, 0.0), torque


def _order(found: Levels, column: int) -> VibrationOrder:
    component = found.components[column]
    at_rpm, largest, torque = _largest(found, column)
    shown = np.isfinite(found.speed[:, column])
    return VibrationOrder(
        order_per_rev=component.value, order_ci95=component.ci95, place=_place(component),
        speeds=component.speeds, largest_rpm=largest, at_rpm=at_rpm, torque_percent=torque,
        level_speed_rpm=tuple(float(v) for v in found.rpm[shown]),
        level_rpm=tuple(float(v) for v in found.speed[shown, column]),
    )  # fmt: skip


def _frequency(found: Levels, column: int) -> VibrationFrequency:
    component = found.components[column]
    at_rpm, largest, torque = _largest(found, column)
    return VibrationFrequency(
        frequency_hz=component.value, frequency_ci95_hz=component.ci95, speeds=component.speeds,
        largest_rpm=largest, at_rpm=at_rpm, torque_percent=torque,
    )  # fmt: skip


def _place(component: Component) -> Place:
    low, high = component.ci95
    whole = round(component.value)
    if high - low > threshold.WHOLE:
        return "unknown"
    # An order within this share of a whole number counts as whole, however narrow its interval.
    near = threshold.AS_WHOLE * max(whole, 1)
    return "whole" if whole >= 1 and low - near <= whole <= high + near else "not_whole"


def _resonances(found: Levels, orders: Sequence[int]) -> tuple[VibrationResonance, ...]:
    """Resonances from the levels of all orders together."""
    if not orders:
        return ()
    speed, deviation = found.speed[:, orders], found.deviation[:, orders]
    hertz = found.hertz[:, orders]
    number = np.broadcast_to(np.arange(len(orders)), speed.shape)
    peaks = level_peaks(hertz.ravel(), speed.ravel(), deviation.ravel(), number.ravel())
    return tuple(_resonance(found, peak, orders) for peak in peaks)


def _resonance(found: Levels, peak: LevelPeak, orders: Sequence[int]) -> VibrationResonance:
    low_hz, high_hz = peak.half_level_hz()
    slowest, fastest = float(np.min(found.rpm)), float(np.max(found.rpm))
    ranges: list[tuple[float, SpeedRange]] = []
    for number in peak.orders:
        column = orders[number]
        order = found.components[column].value
        at = 60.0 * peak.frequency_hz / order
        near = np.abs(found.rpm / at - 1.0) < threshold.NEAR
        level = found.speed[near, column]
        if not slowest <= at <= fastest or not np.any(np.isfinite(level)):
            continue
        ranges.append((
            float(np.nanmax(level)),
            SpeedRange(
                order_per_rev=order, speed_rpm=at, low_rpm=60.0 * low_hz / order,
                high_rpm=60.0 * high_hz / order,
            ),
        ))  # fmt: skip
    largest = max((level for level, _ in ranges), default=0.0)
    kept = [pair for pair in ranges if pair[0] >= threshold.EXCITES * largest]
    return VibrationResonance(
        frequency_hz=peak.frequency_hz,
        frequency_ci95_hz=peak.frequency_ci95_hz,
        height=peak.height,
        avoid=tuple(each for _, each in sorted(kept, key=lambda pair: -pair[0])),
    )


def _findings(
    data: Plateaus,
    found: Levels,
    orders: Sequence[VibrationOrder],
    steady: Sequence[VibrationFrequency],
    resonances: Sequence[VibrationResonance],
) -> list[VibrationFinding]:
    finding = VibrationFinding
    if resonances:
        first = [finding(code="resonance", value=r.frequency_hz, unit="Hz") for r in resonances]
    elif orders:
        first = [finding(code="orders_only", value=float(len(orders)))]
    else:
        first = [finding(code="nothing_seen", value=_least(found), unit="rpm")]
    more = [finding(code="fixed_frequency", value=f.frequency_hz, unit="Hz") for f in steady]
    fastest = float(np.max(found.rpm))
    if any(_rises(found, each) for each in orders):
        more.append(finding(code="highest_at_end", value=fastest, unit="rpm"))
    if not data.closer:
        more.append(finding(code="not_closer"))
    if found.left:
        more.append(finding(code="unassigned", value=float(found.left)))
    if found.uneven_rpm:
        more.append(finding(code="uneven_speeds", value=found.uneven_rpm[-1], unit="rpm"))
    if data.by_travel:
        more.append(finding(code="fastest_by_travel", value=fastest, unit="rpm"))
    if found.lost:
        more.append(finding(code="samples_lost", value=float(found.lost)))
    more += [
        finding(code="band", value=found.band_hz[1], unit="Hz"),
        finding(code="highest_order", value=60.0 * found.band_hz[1] / fastest),
        finding(code="motor_side"),
    ]
    listened = [r.frequency_hz for r in resonances] + [f.frequency_hz for f in steady]
    if listened:
        more.append(finding(code="listen", value=listened[0], unit="Hz"))
    return [*first, *more]


def _rises(found: Levels, order: VibrationOrder) -> bool:
    """Whether the level is highest at the highest speeds, well above the levels before."""
    column = next(i for i, c in enumerate(found.components) if c.value == order.order_per_rev)
    speeds, means = _by_speed(found, column)
    at_end = speeds.size >= 3 and float(speeds[-1]) * 60.0 >= 0.95 * float(np.max(found.rpm))
    if not at_end or means[-1] < max(threshold.PEAK * np.median(means), np.max(means)):
        return False
    return _matters(found, column, float(speeds[-1]))


def _least(found: Levels) -> float:
    """Approximate amplitude [rpm] that would have been significant in the noisiest plateau."""
    rms = [float(np.sqrt(np.mean(e.segment.speed[e.segment.valid] ** 2))) for e in found.held]
    sizes = [int(np.count_nonzero(e.segment.valid)) for e in found.held]
    least = [2.0 * r * np.sqrt(threshold.STANDS_OUT / n) for r, n in zip(rms, sizes, strict=True)]
    return float(max(least))
