"""Slow mode, shapers for it, and their effect, from recordings of moves. Pure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import scipy

from backend.analysis.signals import shaper as shapers
from backend.analysis.signals.arrays import FloatArray
from backend.analysis.signals.ring_down import (
    CommonMode,
    Mode,
    RingDown,
    about_creep,
    common_mode,
    settling_s,
)
from backend.analysis.signals.shaper import Band, Kind, Shaper
from backend.tools.measuring.recording import Recording
from backend.tools.moving.jog.cyclic import run_up
from backend.tools.thresholds import shaping_evaluate as threshold
from backend.tools.tool import Arrays, Interval, Meta
from backend.tools.tuning.shaping.result import (
    DesignedShaper,
    DriveFilter,
    ShaperImpulse,
    ShapingComparison,
    ShapingDriveValue,
    ShapingFinding,
    ShapingMode,
    ShapingResidual,
    ShapingResult,
    Signal,
    Verdict,
)
from backend.tools.tuning.shaping.settings import ShapingSettings

_Traces = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
_TURN = 2 * np.pi
_POINTS = 300
SIGNALS: tuple[Signal, ...] = ("position_error", "speed", "torque")
UNITS: Mapping[Signal, str] = {"position_error": "rev", "speed": "rpm", "torque": "%"}


@dataclass(frozen=True)
class Moves:
    """Played pairs of moves out and back, each after the same lead; ``kind`` of the shaper."""

    rate: float
    rated_torque_nm: float
    free: tuple[Recording, ...]
    shaped: tuple[Recording, ...] = ()
    kind: Kind | None = None
    filter: DriveFilter = field(default_factory=DriveFilter)

    def arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """The samples as arrays for storage; rows are pairs."""
        found: dict[str, npt.NDArray[np.generic]] = {}
        for name, pairs in (("free", self.free), ("shaped", self.shaped)):
            for key in self.free[0].arrays() if pairs else ():
                found[f"{name}_{key}"] = np.stack([each.arrays()[key] for each in pairs])
        return found

    def meta(self, settings: ShapingSettings) -> dict[str, object]:
        """Settings and facts for storage, with the arrays."""
        return {
            "tool": "shaping",
            "settings": settings.model_dump(mode="json"),
            "sample_rate_hz": self.rate,
            "rated_torque_nm": self.rated_torque_nm,
            "kind": self.kind,
            "filter": self.filter.model_dump(mode="json"),
        }


def reevaluate(arrays: Arrays, meta: Meta) -> ShapingResult:
    """Evaluate stored raw data again.

    Raises:
        ValueError: not the raw data of this tool.
    """
    given, own = meta.get("settings"), meta.get("filter")
    if not isinstance(given, dict) or not isinstance(own, dict) or "free_valid" not in arrays:
        raise ValueError("not the raw data of command shaping")
    rate = float(str(meta["sample_rate_hz"]))

    def pair(name: str, number: int) -> Recording:
        def column(key: str) -> npt.NDArray[np.float64]:
            return np.asarray(arrays[f"{name}_{key}"][number], np.float64)

        return Recording(
            rate,
            column("position_rad"),
            column("velocity_rad_s"),
            column("torque_nm"),
            column("sent"),
            column("offset"),
            np.asarray(arrays[f"{name}_valid"][number], np.bool_),
        )

    def pairs(name: str) -> tuple[Recording, ...]:
        count = len(arrays[f"{name}_valid"]) if f"{name}_valid" in arrays else 0
        return tuple(pair(name, number) for number in range(count))

    kind = next((each for each in shapers.KINDS if each == meta.get("kind")), None)
    own_filter = DriveFilter.model_validate(own)
    rated = float(str(meta["rated_torque_nm"]))
    moves = Moves(rate, rated, pairs("free"), pairs("shaped"), kind, own_filter)
    asked = ShapingSettings.model_validate(given)
    return evaluate(moves, asked, see(moves, asked))


@dataclass(frozen=True)
class Seen:
    """The mode as identified from the unshaped moves."""

    signal: int
    found: ShapingMode
    mode: Mode


def see(moves: Moves, settings: ShapingSettings) -> Seen | None:
    """Mode of the ring-downs of the unshaped moves; None where they show none."""
    demand = demand_of(settings, moves.rate)
    ways = _ways(moves, moves.free, settings, demand, 0)
    low, high = settings.lowest_hz, settings.highest_hz
    if settings.frequency_hz is not None:
        near = threshold.NEAR
        low, high = settings.frequency_hz * (1.0 - near), settings.frequency_hz * (1.0 + near)
    skip = round(threshold.SKIP_S * moves.rate)
    best: tuple[int, CommonMode] | None = None
    for column in range(len(SIGNALS)):
        rings = [
            RingDown(way.signals[skip:, [column]], way.valid[skip:], moves.rate) for way in ways
        ]
        one = common_mode(rings, low, high)
        if one is not None and (best is None or one.explained > best[1].explained):
            best = column, one
    if best is None:
        return None
    column, common = best
    mode = common.mode
    frequencies = [each.frequency_hz for each in common.fits]
    dampings = [each.damping for each in common.fits]
    (f_low, f_high), (z_low, z_high) = mode.frequency_ci95_hz, mode.damping_ci95
    found = ShapingMode(
        frequency_hz=mode.frequency_hz,
        frequency_ci95_hz=mode.frequency_ci95_hz,
        damping=mode.damping,
        damping_ci95=mode.damping_ci95,
        range_hz=(min(f_low, *frequencies), max(f_high, *frequencies)),
        range_damping=(min(z_low, *dampings), max(z_high, *dampings)),
        ring_downs=len(common.fits),
        explained=common.explained,
    )
    return Seen(column, found, mode)


def designs(seen: Seen | None, settings: ShapingSettings) -> tuple[list[Shaper], Band | None]:
    """Shapers for the identified mode, else for the stated one, and the range of that mode."""
    if seen is not None:
        f, z = seen.found.frequency_hz, seen.found.damping
        band = Band(seen.found.range_hz, seen.found.range_damping)
    elif settings.frequency_hz is not None:
        f, z = settings.frequency_hz, settings.damping or 0.0
        band = Band((f, f), (z, z))
    else:
        return [], None
    left = settings.tolerance_percent / 100.0
    return [shapers.design(kind, f, z, left) for kind in shapers.KINDS], band


def choose(made: list[Shaper], band: Band, settings: ShapingSettings) -> Shaper:
    """The requested shaper; else the shortest with no more residual than the tolerance."""
    if settings.shaper != "auto":
        return next(each for each in made if each.kind == settings.shaper)
    most = settings.tolerance_percent / 100.0 * (1.0 + threshold.ROUNDING)
    enough = [each for each in made if shapers.residual_range(each, band)[1] <= most]
    if enough:
        return min(enough, key=lambda each: each.delay_s)
    return min(made, key=lambda each: shapers.residual_range(each, band)[1])


def demand_of(settings: ShapingSettings, rate: float) -> FloatArray:
    """Setpoints of one unshaped move in rev from its start: a trapezoid of speed."""
    slope, speed = settings.acceleration / 60.0, settings.speed / 60.0
    return np.asarray(run_up(abs(settings.size), speed, slope, 1.0 / rate) * np.sign(settings.size))


def pair_of(demand: FloatArray, settings: ShapingSettings, rate: float) -> FloatArray:
    """A move out and back, each followed by its hold time; ``demand`` may be shaped."""
    lead, hold = np.zeros(round(threshold.LEAD_S * rate)), round(settings.hold_s * rate)
    out = np.concatenate([demand, np.full(hold, demand[-1])])
    return np.concatenate([lead, out, demand[-1] - out])


def _ways(
    moves: Moves,
    pairs: tuple[Recording, ...],
    settings: ShapingSettings,
    demand: FloatArray,
    extra: int,
) -> list[RingDown]:
    """Signals [n, 3] of each move of these pairs, from the end of the unshaped setpoints on.

    Moves with many lost samples are left out.
    """
    hold, lead = round(settings.hold_s * moves.rate), round(threshold.LEAD_S * moves.rate)
    one = demand.size + extra + hold
    found: list[RingDown] = []
    for pair in pairs:
        rev = (pair.position_rad - pair.position_rad[0]) / _TURN
        for number, goal in enumerate((float(demand[-1]), 0.0)):
            begin = lead + number * one + demand.size
            part = slice(begin, begin + hold)
            signals = np.column_stack(
                [
                    goal - rev[part],
                    pair.velocity_rad_s[part] * 60.0 / _TURN,
                    pair.torque_nm[part] / moves.rated_torque_nm * 100.0,
                ]
            )
            valid = pair.valid[part]
            if valid.size == hold and np.mean(valid) >= threshold.SEEN:
                found.append(RingDown(signals, valid, moves.rate))
    return found


def evaluate(moves: Moves, settings: ShapingSettings, seen: Seen | None) -> ShapingResult:
    """Shapers for the identified mode, the comparison, and the findings."""
    demand = demand_of(settings, moves.rate)
    made, band = designs(seen, settings)
    chosen = None if band is None else choose(made, band, settings)
    free = _ways(moves, moves.free, settings, demand, 0)
    comparison: ShapingComparison | None = None
    traces: _Traces = ((), (), ())
    lost = 2 * len(moves.free) - len(free)
    if seen is not None and chosen is not None and moves.kind == chosen.kind:
        extra = extra_samples(chosen, moves.rate)
        played = _ways(moves, moves.shaped, settings, demand, extra)
        lost += 2 * len(moves.shaped) - len(played)
        if len(played) > 1 and len(free) > 1:
            comparison, traces = _compared(seen, moves.rate, free, played, extra, settings)
    left = settings.tolerance_percent / 100.0
    result = ShapingResult(
        verdict=_verdict(seen, band, comparison),
        signal=None if seen is None else SIGNALS[seen.signal],
        unit=None if seen is None else UNITS[SIGNALS[seen.signal]],
        mode=None if seen is None else seen.found,
        shapers=() if band is None else tuple(_described(each, band, left) for each in made),
        chosen=None if chosen is None else chosen.kind,
        comparison=comparison,
        trace_s=traces[0],
        trace_unshaped=traces[1],
        trace_shaped=traces[2],
    )
    findings, values = _findings(result, moves, settings, lost)
    return result.model_copy(
        update={
            "findings": tuple(findings),
            "drive_values": tuple(values),
            "family": moves.filter.family,
        }
    )


def extra_samples(shaper: Shaper, rate: float) -> int:
    """Number of samples by which shaped setpoints are longer, as `shaper.shaped` makes them."""
    return math.ceil(shaper.delay_s * rate - 1e-9)


def _described(shaper: Shaper, band: Band, left: float) -> DesignedShaper:
    centre, damping = 0.5 * sum(band.frequency_hz), 0.5 * sum(band.damping)
    least, most = shapers.residual_range(shaper, band)
    return DesignedShaper(
        kind=shaper.kind,
        delay_s=shaper.delay_s,
        impulses=tuple(
            ShaperImpulse(share=share, time_s=time)
            for share, time in zip(shaper.amplitudes, shaper.times_s, strict=True)
        ),
        residual_percent=(100.0 * least, 100.0 * most),
        tolerated_hz=shapers.tolerated(shaper, centre, damping, left * (1.0 + threshold.ROUNDING)),
    )


def _compared(
    seen: Seen, rate: float, free: list[RingDown], played: list[RingDown], extra: int,
    settings: ShapingSettings,
) -> tuple[ShapingComparison, _Traces]:  # fmt: skip
    """Residuals over the same period of both, and settling times from the same moment on."""
    period = max(2, round(rate / seen.mode.frequency_hz))
    begin = extra + round(threshold.SKIP_S * rate)
    before = [about_creep(way, seen.mode, begin) for way in free]
    after = [about_creep(way, seen.mode, begin) for way in played]
    part = slice(begin, begin + period)

    def residuals(ways: list[FloatArray], column: int) -> FloatArray:
        return np.array([0.5 * float(np.ptp(each[part, column])) for each in ways])

    one, two = residuals(before, seen.signal), residuals(after, seen.signal)
    signal, window = _window(seen, before, rate, settings)
    last = period // 4
    settled = [settling_s(each[:, signal], window, last, rate) for each in before]
    quicker = [settling_s(each[:, signal], window, last, rate) for each in after]
    first_s, second_s = _mean_or_none(settled), _mean_or_none(quicker)
    ratio = None
    if second_s is not None:
        ratio = second_s / max(settings.hold_s if first_s is None else first_s, 1.0 / rate)
    step = max(1, before[0].shape[0] // _POINTS)
    thinned = slice(0, None, step)
    time = np.arange(before[0].shape[0])[thinned] / rate
    comparison = ShapingComparison(
        unit=UNITS[SIGNALS[seen.signal]], moves=len(after),
        unshaped=float(np.mean(one)), unshaped_ci95=_interval(one),
        shaped=float(np.mean(two)), shaped_ci95=_interval(two),
        watched_s=settings.hold_s, ratio=float(np.mean(two) / max(float(np.mean(one)), 1e-300)),
        settling_window=window, settling_unit=UNITS[SIGNALS[signal]],
        settling_unshaped_s=first_s, settling_shaped_s=second_s, settling_ratio=ratio,
        residuals=tuple(
            ShapingResidual(
                signal=name, unit=UNITS[name],
                unshaped=float(np.mean(residuals(before, column))),
                shaped=float(np.mean(residuals(after, column))),
            )
            for column, name in enumerate(SIGNALS)
        ),
    )  # fmt: skip
    traces = tuple(
        tuple(float(v) for v in values)
        for values in (time, before[0][thinned, seen.signal], after[0][thinned, seen.signal])
    )
    return comparison, (traces[0], traces[1], traces[2])


def _window(
    seen: Seen, before: list[FloatArray], rate: float, settings: ShapingSettings
) -> tuple[int, float]:
    """The signal for the settling time (column), and its settling window."""
    if settings.window_rev is not None:
        return 0, settings.window_rev
    period = max(2, round(rate / seen.mode.frequency_hz))
    begin = round(threshold.SKIP_S * rate)
    first = np.mean([0.5 * np.ptp(each[begin : begin + period, seen.signal]) for each in before])
    noise = np.mean([np.std(np.diff(each[-2 * period :, seen.signal])) for each in before])
    return seen.signal, float(max(threshold.SETTLED * first, threshold.NOISES * noise))


def _mean_or_none(values: list[float | None]) -> float | None:
    """The mean; None where a value is missing."""
    known = [each for each in values if each is not None]
    return float(np.mean(known)) if len(known) == len(values) else None


def _interval(values: FloatArray) -> Interval:
    if values.size < 2:
        return (None, None)
    factor = float(scipy.special.stdtrit(values.size - 1, 0.975))
    half = factor * float(np.std(values, ddof=1)) / math.sqrt(values.size)
    return (max(float(np.mean(values)) - half, 0.0), float(np.mean(values)) + half)


def _verdict(seen: Seen | None, band: Band | None, found: ShapingComparison | None) -> Verdict:
    if seen is None:
        return "not_seen" if band is None else "stated"
    if found is None:
        return "designed"
    half = threshold.HALVED
    quicker = found.settling_ratio is not None and found.settling_ratio <= half
    if found.ratio <= half or (quicker and found.ratio < 1.0):
        return "verified"
    high, low = found.shaped_ci95[1], found.unshaped_ci95[0]
    return "improved" if high is not None and low is not None and high < low else "no_better"


def _findings(
    result: ShapingResult, moves: Moves, settings: ShapingSettings, lost: int
) -> tuple[list[ShapingFinding], list[ShapingDriveValue]]:
    found: list[ShapingFinding] = [ShapingFinding(code="motor_side")]
    lowest = threshold.PERIODS / settings.hold_s
    if settings.frequency_hz is None and lowest > settings.lowest_hz:
        found.append(ShapingFinding(code="long_periods", value=lowest, unit="Hz"))
    if result.mode is None:
        found.append(ShapingFinding(code="not_excited"))
    if lost:
        found.append(ShapingFinding(code="samples_lost", value=float(lost)))
    own = next((each for each in result.shapers if each.kind == result.chosen), None)
    compared = result.comparison
    if (
        own is not None
        and own.residual_percent[1] > (1.0 + threshold.ROUNDING) * settings.tolerance_percent
    ):
        found.append(ShapingFinding(code="wide_mode", value=own.residual_percent[1], unit="%"))
    if compared is not None and own is not None:
        most = own.residual_percent[1] + settings.tolerance_percent
        if 100.0 * compared.ratio > most:
            found.append(
                ShapingFinding(code="beyond_prediction", value=100.0 * compared.ratio, unit="%")
            )
        if compared.settling_shaped_s is None:
            found.append(ShapingFinding(code="not_settled", value=settings.hold_s, unit="s"))
    if own is None:
        return found, []
    values = moves.filter.values_for(2.0 * own.impulses[1].time_s)
    slot = moves.filter.slot
    if values:
        found.append(ShapingFinding(code="drive_filter"))
        found += [
            ShapingFinding(code="drive_unstated", parameter=key) for key in moves.filter.unstated
        ]
    elif slot is not None:
        found.append(
            ShapingFinding(
                code="drive_filter_range",
                value=slot.highest_raw * slot.scale,
                unit=slot.unit,
                parameter=slot.parameter,
            )
        )
    found.append(ShapingFinding(code="in_controller"))
    return found, values
