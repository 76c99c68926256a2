"""Response to the excitation of a dwell, from its recording. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from backend.analysis.vibration.dwell import Followed, followed, used_blocks
from backend.tools.measuring.recording import Recording
from backend.tools.moving.dwell.result import (
    DwellEstimate,
    DwellFinding,
    DwellHarmonic,
    DwellResult,
)
from backend.tools.moving.dwell.settings import DwellSettings
from backend.tools.thresholds import dwell_evaluate as threshold
from backend.tools.tool import Arrays, Interval, Meta
from drivers.errors import NotAllowed

FloatArray = npt.NDArray[np.float64]
_TURN = 2 * np.pi
_RPM = 60.0 / _TURN


@dataclass(frozen=True)
class Dwelt:
    """Played signals [n]: the sine in rpm or % of rated torque, and which samples are evaluated."""

    recording: Recording
    sine: FloatArray
    counts: npt.NDArray[np.bool_]
    rated_torque_nm: float
    position_step_rad: float
    torque_step_percent: float

    def arrays(self) -> dict[str, npt.NDArray[np.generic]]:
        """The samples as arrays for storage."""
        return {**self.recording.arrays(), "sine": self.sine, "counts": self.counts}

    def meta(self, settings: DwellSettings) -> dict[str, object]:
        """Settings and facts for storage, with the arrays."""
        return {
            "tool": "dwell",
            "settings": settings.model_dump(mode="json"),
            "sample_rate_hz": self.recording.sample_rate_hz,
            "rated_torque_nm": self.rated_torque_nm,
            "position_step_rad": self.position_step_rad,
            "torque_step_percent": self.torque_step_percent,
        }


def reevaluate(arrays: Arrays, meta: Meta) -> DwellResult:
    """Evaluate stored raw data again.

    Raises:
        ValueError: not the raw data of this tool.
    """
    given = meta.get("settings")
    if meta.get("tool") != "dwell" or not isinstance(given, dict) or "sine" not in arrays:
        raise ValueError("not the raw data of a dwell")

    def column(name: str) -> FloatArray:
        return np.asarray(arrays[name], np.float64)

    recording = Recording(
        float(str(meta["sample_rate_hz"])),
        column("position_rad"),
        column("velocity_rad_s"),
        column("torque_nm"),
        column("sent"),
        column("offset"),
        np.asarray(arrays["valid"], np.bool_),
    )
    names = ("rated_torque_nm", "position_step_rad", "torque_step_percent")
    facts = (float(str(meta[name])) for name in names)
    dwelt = Dwelt(recording, column("sine"), np.asarray(arrays["counts"], np.bool_), *facts)
    return evaluate(dwelt, DwellSettings.model_validate(given))


def evaluate(dwelt: Dwelt, settings: DwellSettings) -> DwellResult:
    """Amplitudes, phase and harmonics over the samples to be evaluated.

    Raises:
        NotAllowed: too few samples arrived.
    """
    rate, frequency = dwelt.recording.sample_rate_hz, settings.frequency_hz
    within = np.flatnonzero(dwelt.counts)
    if not within.size:
        raise NotAllowed("dwell.few-samples")
    first, last = int(within[0]), int(within[-1]) + 1
    part = slice(first, last)
    good = dwelt.recording.valid[part] & dwelt.counts[part]
    count = harmonics_of(frequency, rate)
    angle = dwelt.recording.position_rad[part]
    torque = dwelt.recording.torque_nm[part] / dwelt.rated_torque_nm * 100.0
    sine, turned, twisted = (
        followed(signal, good, frequency, rate, first, harmonics)
        for signal, harmonics in ((dwelt.sine[part], 1), (angle, count), (torque, 1))
    )
    if len(turned.blocks) < threshold.FEWEST:
        raise NotAllowed("dwell.few-samples")
    # Speed amplitude from the position's: a difference of samples would act as a filter.
    multiples = np.arange(1, count + 1)
    turning = np.asarray(2j * np.pi * frequency * multiples * _RPM)
    speed = Followed(np.asarray(turned.blocks * turning), turned.middle_s)
    step = threshold.STEP * dwelt.position_step_rad
    step_rpm = step * 2 * np.pi * frequency * _RPM
    seen = abs(speed.mean()) > max(threshold.SEEN * speed.noise(), step_rpm)
    phase = None
    if seen:
        degrees = float(np.degrees(np.angle(speed.mean() / sine.mean())))
        half = speed.phase_half_deg() + float(np.degrees(step_rpm / abs(speed.mean())))
        phase = DwellEstimate(value=degrees, ci95=(degrees - half, degrees + half))
    harmonics = tuple(
        DwellHarmonic(
            multiple=int(k),
            speed_rpm=abs(speed.mean(k - 1)),
            speed_ci95_rpm=_ends(abs(speed.mean(k - 1)), speed.half(k - 1) + k * step_rpm),
        )
        for k in multiples[1:]
    )
    return DwellResult(
        frequency_hz=frequency,
        by=settings.by,
        excitation=abs(sine.mean()),
        seen=seen,
        speed_rpm=_estimate(speed, 1.0, step_rpm),
        position_deg=_estimate(turned, 360.0 / _TURN, step),
        torque_percent=_estimate(twisted, 1.0, threshold.STEP * dwelt.torque_step_percent),
        phase_deg=phase,
        harmonics=harmonics,
        over_s=float(np.count_nonzero(good)) / rate,
        trace_s=tuple(float(v) for v in turned.middle_s),
        trace_rpm=tuple(float(v) for v in np.abs(speed.blocks[:, 0])),
        findings=tuple(_findings(speed, seen, step_rpm, settings, rate, good)),
    )


def harmonics_of(frequency_hz: float, rate_hz: float) -> int:
    """Number of multiples of the frequency that are looked for, the first one included."""
    return max(1, min(threshold.HARMONICS, int(threshold.BAND * rate_hz / frequency_hz)))


def long_enough(counts: npt.NDArray[np.bool_], frequency_hz: float, rate_hz: float) -> bool:
    """Whether the samples [n] that are to count suffice for an evaluation when all arrive."""
    within = np.flatnonzero(counts)
    if not within.size:
        return False
    part = counts[within[0] : within[-1] + 1]
    harmonics = harmonics_of(frequency_hz, rate_hz)
    return len(used_blocks(part, frequency_hz, rate_hz, harmonics)) >= threshold.FEWEST


def _estimate(found: Followed, factor: float, step: float) -> DwellEstimate:
    value = factor * abs(found.mean())
    return DwellEstimate(value=value, ci95=_ends(value, factor * (found.half() + step)))


def _ends(value: float, half: float) -> Interval:
    return (max(value - half, 0.0), value + half) if np.isfinite(half) else (None, None)


def _findings(
    speed: Followed,
    seen: bool,
    step_rpm: float,
    settings: DwellSettings,
    rate: float,
    good: npt.NDArray[np.bool_],
) -> list[DwellFinding]:
    level = abs(speed.mean())
    if not seen:
        first = [DwellFinding(code="not_seen", value=level + speed.half() + step_rpm, unit="rpm")]
        if settings.turn_rpm == 0.0:
            first.append(DwellFinding(code="turn_slowly"))
    else:
        first = [DwellFinding(code="excited", value=level, unit="rpm")]
        first += _linear(speed, level, step_rpm)
        first += _changed(speed)
    if 2.0 * settings.frequency_hz > threshold.BAND * rate:
        first.append(
            DwellFinding(code="harmonics_beyond_band", value=threshold.BAND * rate, unit="Hz")
        )
    lost = 1.0 - float(np.mean(good))
    if settings.turn_rpm == 0.0 and lost > threshold.LOST:
        first.append(DwellFinding(code="blocks_lost", value=100.0 * lost, unit="%"))
    return [*first, DwellFinding(code="motor_side")]


def _linear(speed: Followed, level: float, step_rpm: float) -> list[DwellFinding]:
    """Finding whether harmonics exceed the limit; empty where neither can be stated."""
    harmonics = range(1, speed.blocks.shape[1])
    if not harmonics:
        return []
    bounds = [speed.half(k) + (k + 1) * step_rpm for k in harmonics]
    levels = [abs(speed.mean(k)) for k in harmonics]
    shown = [a / level for a, bound in zip(levels, bounds, strict=True) if a > bound]
    most = max(shown, default=0.0)
    if most >= threshold.NOT_LINEAR:
        return [DwellFinding(code="not_linear", value=100.0 * most, unit="%")]
    least = threshold.NOT_LINEAR * level
    if all(a + bound < least for a, bound in zip(levels, bounds, strict=True)):
        return [DwellFinding(code="linear", value=100.0 * threshold.NOT_LINEAR, unit="%")]
    return []


def _changed(speed: Followed) -> list[DwellFinding]:
    """Finding that the amplitude changed from begin to end by more than its scatter."""
    level = np.abs(speed.blocks[:, 0])
    third = level.size // 3
    if third < 2:
        return []
    begin, end = level[:third], level[-third:]
    change = float(np.mean(end) / np.mean(begin) - 1.0)
    scatter = float(np.hypot(np.std(begin, ddof=1), np.std(end, ddof=1)) / np.sqrt(third))
    clear = abs(float(np.mean(end) - np.mean(begin))) > threshold.CLEAR * scatter
    if not clear or abs(change) < threshold.CHANGED:
        return []
    return [DwellFinding(code="level_changed", value=100.0 * change, unit="%")]
