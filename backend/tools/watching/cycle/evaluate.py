"""Load of a cycle from samples of torque and speed. Pure: also from stored raw data."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt

from backend.analysis.duty import heat, load
from backend.analysis.duty.load import Effective, Signals
from backend.tools.thresholds import cycle_evaluate as threshold
from backend.tools.tool import Arrays, Meta
from backend.tools.watching.cycle.result import (
    CycleHeat,
    CycleOverload,
    CyclePower,
    CycleResult,
    Finding,
    Verdict,
)
from backend.tools.watching.cycle.settings import CycleSettings
from drivers.errors import NotAllowed

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class CycleFacts:
    """Data of motor and drive; None where unknown."""

    rated_torque_nm: float | None
    rated_speed_rpm: float | None
    peak_percent: float | None


@dataclass(frozen=True)
class Samples:
    """Raw data: signals [n], DC bus voltage [m] in V and drive load [m] in % of rated."""

    signals: Signals
    dc_voltage: FloatArray
    drive_load: FloatArray

    def arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """The samples as arrays for storage."""
        return {
            "time_s": self.signals.time_s,
            "torque_percent": self.signals.torque_percent,
            "speed_rpm": self.signals.speed_rpm,
            "dc_voltage": self.dc_voltage,
            "drive_load": self.drive_load,
        }


def meta_of(settings: CycleSettings, facts: CycleFacts) -> dict[str, object]:
    """Settings and facts for storage, with the arrays."""
    return {
        "tool": "cycle",
        "settings": settings.model_dump(mode="json"),
        "facts": asdict(facts),
    }


def reevaluate(arrays: Arrays, meta: Meta) -> CycleResult:
    """Evaluate stored raw data again.

    Raises:
        ValueError: not the raw data of a cycle.
    """
    given, facts = meta.get("settings"), meta.get("facts")
    if not isinstance(given, dict) or not isinstance(facts, dict) or "time_s" not in arrays:
        raise ValueError("not the raw data of a cycle")

    def of(name: str) -> FloatArray:
        return np.asarray(arrays[name], np.float64)

    signals = Signals(of("time_s"), of("torque_percent"), of("speed_rpm"))
    samples = Samples(signals, of("dc_voltage"), of("drive_load"))
    return evaluate(samples, CycleSettings.model_validate(given), CycleFacts(**facts))


def evaluate(samples: Samples, settings: CycleSettings, facts: CycleFacts) -> CycleResult:
    """Load of the cycle, and the verdict.

    Raises:
        NotAllowed: too few samples arrived.
    """
    signals = samples.signals
    if signals.time_s.size < threshold.FEWEST or signals.duration_s <= 0.0:
        count = int(signals.time_s.size)
        raise NotAllowed("cycle.too-few-samples", value=count, limit=str(threshold.FEWEST))
    period = settings.period_s or load.period_of(signals)
    moments = load.whole_periods(signals, period)
    whole = period is not None and load.has_periods(signals, period)
    effective = load.effective_torque(signals, moments)
    peak = float(np.max(np.abs(signals.torque_percent)))
    fastest = float(np.max(np.abs(signals.speed_rpm)))
    idle = effective.value < threshold.IDLE_PERCENT and fastest < threshold.IDLE_RPM
    warm = None if idle else _heat(signals, settings, facts, effective)
    budget = None if idle else _overload(signals, settings)
    power = None
    if facts.rated_torque_nm is not None:
        power = CyclePower(**asdict(load.power_of(signals, facts.rated_torque_nm, moments)))
    drive_load = float(np.mean(samples.drive_load)) if samples.drive_load.size else None
    volts = samples.dc_voltage
    speed, torque = _cloud(signals)
    result = CycleResult(
        verdict=_verdict(idle, warm, budget), recording=settings.recording,
        duration_s=signals.duration_s, samples=int(signals.time_s.size),
        sample_rate_hz=1.0 / signals.spacing_s, longest_gap_s=signals.longest_gap_s,
        period_s=period, periods=int(moments.size - 1) if whole else 0,
        rated_torque_nm=facts.rated_torque_nm, rated_speed_rpm=facts.rated_speed_rpm,
        rms_percent=effective.value, rms_ci95_percent=effective.ci95, peak_percent=peak,
        peak_limit_percent=facts.peak_percent,
        peak_limit_stated=settings.peak_percent is not None,
        above_rated_share=load.share_above(signals, 100.0), highest_speed_rpm=fastest,
        mean_speed_rpm=load.mean_speed_rpm(signals, moments), drive_load_percent=drive_load,
        dc_voltage_v=(float(np.min(volts)), float(np.max(volts))) if volts.size else None,
        power=power, heat=warm, overload=budget, cloud_speed_rpm=speed,
        cloud_torque_percent=torque,
    )  # fmt: skip
    return result.model_copy(update={"findings": tuple(_findings(result, settings))})


def _heat(
    signals: Signals, settings: CycleSettings, facts: CycleFacts, effective: Effective
) -> CycleHeat | None:
    permitted = heat.permitted_rise(settings.ambient_c, settings.rise_k)
    if permitted is None:
        return None
    low, high = effective.ci95
    value = max(effective.value, 1e-9)
    scale = (1.0 if low is None else low / value, 1.0 if high is None else high / value)
    minutes, still = settings.thermal_time_min, settings.standstill_percent
    found = heat.heat_of(
        signals,
        facts.rated_speed_rpm,
        permitted=permitted,
        time_constant_s=None if minutes is None else 60.0 * minutes,
        scale=scale,
        standstill=None if still is None else still / 100.0,
    )
    return CycleHeat(
        ambient_c=settings.ambient_c,
        time_constant_min=minutes,
        rise_share=found.rise,
        trip_s=found.trip_s,
        about_s=found.about_s,
    )


def _overload(signals: Signals, settings: CycleSettings) -> CycleOverload | None:
    if settings.overload_percent is None or settings.overload_s is None:
        return None
    found = load.i2t(signals, settings.overload_percent, settings.overload_s)
    return CycleOverload(
        percent=settings.overload_percent,
        seconds=settings.overload_s,
        used_share=found.used,
        trip_s=found.trip_s,
    )


def _verdict(idle: bool, warm: CycleHeat | None, budget: CycleOverload | None) -> Verdict:
    """Verdict from the motor's temperature rise and from the stated overload."""
    if idle:
        return "idle"
    if budget is not None and budget.trip_s is not None:
        return "overloads"
    if warm is None:
        return "undecided"
    low, high = warm.rise_share
    if low >= 1.0:
        return "overloads"
    return "endures" if high < 1.0 else "undecided"


def _findings(result: CycleResult, settings: CycleSettings) -> list[Finding]:
    found: list[Finding] = []
    if result.period_s is None:
        found.append(Finding(code="no_period"))
    elif result.periods < 3:
        found.append(Finding(code="few_periods", value=result.periods))
    if result.sample_rate_hz < threshold.SLOW_HZ:
        found.append(Finding(code="slow_sampling", value=1e3 / result.sample_rate_hz, unit="ms"))
    if result.longest_gap_s > max(5.0 / result.sample_rate_hz, 0.25):
        found.append(Finding(code="gaps", value=result.longest_gap_s, unit="s"))
    limit = result.peak_limit_percent
    if limit is None:
        found.append(Finding(code="peak_unknown"))
    elif result.peak_percent > limit / threshold.AT_LIMIT:
        found.append(Finding(code="peak_beyond", value=limit, unit="%"))
    elif result.peak_percent > threshold.AT_LIMIT * limit:
        found.append(Finding(code="peak_reached", value=limit, unit="%"))
    rated = result.rated_speed_rpm
    if rated is None:
        found.append(Finding(code="rated_speed_unknown"))
    elif result.highest_speed_rpm > threshold.OVER_SPEED * rated:
        found.append(Finding(code="speed_beyond_rated", value=rated, unit="rpm"))
    if result.rated_torque_nm is None:
        found.append(Finding(code="rated_torque_unknown"))
    if result.verdict != "idle":
        found += _of_heat(result, settings)
    return found


def _of_heat(result: CycleResult, settings: CycleSettings) -> list[Finding]:
    found: list[Finding] = []
    if result.heat is None:
        found.append(Finding(code="ambient_needs_rise", value=settings.ambient_c, unit="°C"))
    elif result.heat.time_constant_min is None:
        found.append(Finding(code="time_constant_unknown"))
    if result.overload is None:
        found.append(Finding(code="overload_unknown"))
    elif result.overload.trip_s is not None:
        found.append(Finding(code="overload_exceeded", value=result.overload.trip_s, unit="s"))
    return found


def _cloud(signals: Signals) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """One sample of each cell of speed and torque, extremes included [n]."""
    speed, torque = signals.speed_rpm, signals.torque_percent

    def cells(values: FloatArray) -> npt.NDArray[np.int64]:
        low, wide = float(np.min(values)), float(np.ptp(values))
        return np.asarray((values - low) / (wide or 1.0) * (threshold.CELLS - 1e-9), np.int64)

    _, places = np.unique(cells(speed) * (threshold.CELLS + 1) + cells(torque), return_index=True)
    ends = [int(f(each)) for each in (speed, torque) for f in (np.argmin, np.argmax)]
    chosen = np.unique(np.concatenate([places, ends]))
    chosen = chosen[np.lexsort((torque[chosen], speed[chosen]))]
    # Plots need distinct speeds: equal ones are separated by an invisible amount.
    apart = 1e-9 * max(float(np.ptp(speed)), 1.0) * np.arange(chosen.size)
    return tuple(map(float, speed[chosen] + apart)), tuple(map(float, torque[chosen]))
