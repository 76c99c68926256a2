"""Figures of a step or a move from its recording, and the files that store it. Pure."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from backend.analysis.signals.step import MoveMetrics, StepMetrics, move_metrics, step_metrics
from backend.axes.axis.axis import Envelope
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.figures import figures_of
from backend.tools.measuring.recording import Recording
from backend.tools.moving.step.result import MoveNumbers, StepAnswer, StepNumbers
from backend.tools.thresholds import step_evaluate as threshold
from backend.tools.tool import Arrays, Meta

_TURN = 2 * np.pi
LEAD_S = threshold.LEAD_S


@dataclass(frozen=True, slots=True)
class StepSettings:
    """``size`` in rpm (speed) or rev (move); ``speed_rpm`` and ``acceleration_rpm_s`` of a move."""

    envelope: Envelope
    kind: Literal["speed", "move"] = "speed"
    size: float = 100.0
    hold_s: float = 0.25
    speed_rpm: float = 300.0
    acceleration_rpm_s: float = 6000.0
    window: float | None = None
    """Settling window in rpm or rev; 2 % of the size where None."""
    rated_torque_nm: float | None = None


@dataclass(frozen=True)
class StepResult:
    """Curves [n] in rpm or rev and % of rated torque, and the figures read from them.

    A figure is NaN where it depends on samples that were not received.
    """

    kind: Literal["speed", "move"]
    time_s: npt.NDArray[np.float64]
    demand: npt.NDArray[np.float64]
    actual: npt.NDArray[np.float64]
    torque_percent: npt.NDArray[np.float64]
    step: StepMetrics | None
    move: MoveMetrics | None
    torque_peak_percent: float
    torque_rms_percent: float
    noise: float = 0.0
    """Standard deviation about the trend, of a held speed [rpm] or a final position [rev]."""
    window: float | None = None
    """The settling window, in rpm or rev."""
    widened: bool = False
    """Whether noise exceeds a tenth of the usual window, so that a wider one was used."""
    valid: npt.NDArray[np.bool_] | None = None
    """Which samples were received [n]; the others are interpolated. None where all were."""


def evaluate(
    recording: Recording,
    demand: npt.NDArray[np.float64],
    settings: StepSettings,
    rated_torque_nm: float,
) -> StepResult:
    """Read the figures from a recording."""
    rate = recording.sample_rate_hz
    time = np.arange(demand.size) / rate
    torque = recording.torque_nm / rated_torque_nm * 100.0
    begin = round(LEAD_S * rate)
    step = move = None
    noise, widened, window = 0.0, False, settings.window
    if settings.kind == "speed":
        actual = recording.velocity_rad_s * 60.0 / _TURN
        end = begin + round(settings.hold_s * rate)
        noise = _noise(actual[begin + (end - begin) // 2 : end])
        if window is None:
            usual = 0.02 * abs(settings.size)
            window, widened = max(usual, threshold.NOISES * noise), threshold.NOISES * noise > usual
        step = step_metrics(
            time[begin:end], actual[begin:end], target=settings.size, initial=0.0, window=window
        )
        step = _known_step(
            step, actual[begin:end], settings.size, window, recording.valid[begin:end], rate
        )
    else:
        actual = (recording.position_rad - recording.position_rad[0]) / _TURN
        noise = _noise(actual[-round(0.5 * settings.hold_s * rate) :])
        if window is None:
            usual = 0.02 * abs(settings.size)
            window, widened = max(usual, threshold.NOISES * noise), threshold.NOISES * noise > usual
        move = move_metrics(time, demand, actual, window=window, torque=torque)
        valid = recording.valid[: time.size]
        move = _known_move(move, actual - demand[-1], window, valid, rate)
    return StepResult(
        settings.kind, time, demand, actual, torque, step, move,
        float(np.max(np.abs(torque))), float(np.sqrt(np.mean(torque**2))),
        noise, window, widened, recording.valid[: time.size],
    )  # fmt: skip


def _gaps(valid: npt.NDArray[np.bool_], rate: float) -> npt.NDArray[np.bool_]:
    """Samples [n] in gaps longer than `threshold.GAP_S`."""
    edges = np.diff(np.concatenate([[False], ~valid, [False]]).astype(np.int8))
    long = np.zeros(valid.size, np.bool_)
    for first, end in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        long[first:end] = end - first > threshold.GAP_S * rate
    return long


def _settled_unseen(
    deviation: npt.NDArray[np.float64], window: float, valid: npt.NDArray[np.bool_], rate: float
) -> bool:
    """Whether a gap may hide when the signal [n] entered the window for the last time."""
    outside = np.flatnonzero(valid & (np.abs(deviation) > window))
    after = int(outside[-1]) + 1 if outside.size else 0
    return bool(np.any(_gaps(valid, rate)[after:]))


def _known_step(
    found: StepMetrics,
    actual: npt.NDArray[np.float64],
    size: float,
    window: float,
    valid: npt.NDArray[np.bool_],
    rate: float,
) -> StepMetrics:
    """The figures of a step, NaN where they depend on samples that were not received."""
    if np.all(valid):
        return found
    nan, gaps = float("nan"), bool(np.any(_gaps(valid, rate)))
    if found.rise_s is not None:
        progress = actual / size
        low, high = (int(np.argmax(progress >= level)) for level in (0.1, 0.9))
        if not np.all(valid[max(low - 1, 0) : high + 1]):
            found = replace(found, rise_s=nan)
    elif gaps:
        found = replace(found, rise_s=nan)
    if _settled_unseen(actual - size, window, valid, rate):
        found = replace(found, settling_s=nan)
    return replace(found, overshoot_percent=nan, peak_time_s=nan) if gaps else found


def _known_move(
    found: MoveMetrics,
    deviation: npt.NDArray[np.float64],
    window: float,
    valid: npt.NDArray[np.bool_],
    rate: float,
) -> MoveMetrics:
    """The figures of a move, NaN where they depend on samples that were not received.

    Following error and torque are then those of the samples that were.
    """
    if _settled_unseen(deviation, window, valid, rate):
        found = replace(found, settling_s=float("nan"))
    return replace(found, overshoot=float("nan")) if np.any(_gaps(valid, rate)) else found


def _noise(part: npt.NDArray[np.float64]) -> float:
    """Standard deviation about a parabola, in the unit of the signal; 0 with too few samples."""
    if part.size < 8:
        return 0.0
    x = np.linspace(-1.0, 1.0, part.size)
    return float(np.std(part - np.polynomial.Legendre.fit(x, part, 2)(x)))


def unknown_figures(found: StepMetrics | MoveMetrics) -> tuple[str, ...]:
    """Names of the figures that depend on samples that were not received."""
    return tuple(
        name
        for name, value in asdict(found).items()
        if isinstance(value, float) and math.isnan(value)
    )


def significant_size(result: StepResult) -> float:
    """Size [rpm] whose usual settling window is ten times the noise of this step."""
    return threshold.NOISES * result.noise / 0.02


def raw_of(
    recording: Recording, demand: npt.NDArray[np.float64], settings: StepSettings, facts: AxisFacts
) -> tuple[dict[str, npt.NDArray[np.generic]], dict[str, object]]:
    """Arrays and facts from which `reevaluate` reproduces the result."""
    return {**recording.arrays(), "demand": demand}, {
        "tool": "step",
        "sample_rate_hz": recording.sample_rate_hz,
        "facts": asdict(facts),
        "settings": asdict(settings),
    }


def reevaluate(arrays: Arrays, meta: Meta) -> StepAnswer:
    """Evaluate stored raw data again.

    Raises:
        ValueError: not the raw data of a step.
    """
    given, reported = meta.get("settings"), meta.get("facts")
    if not isinstance(given, dict) or not isinstance(reported, dict) or "demand" not in arrays:
        raise ValueError("not the raw data of a step")
    settings = StepSettings(**{**given, "envelope": Envelope(**given["envelope"])})
    columns = {
        name: np.asarray(values, np.float64)
        for name, values in arrays.items()
        if name not in ("demand", "valid")
    }
    recording = Recording(
        float(str(meta["sample_rate_hz"])), **columns, valid=np.asarray(arrays["valid"], np.bool_)
    )
    demand = np.asarray(arrays["demand"], np.float64)
    return answer_of(evaluate(recording, demand, settings, float(reported["rated_torque_nm"])))


def answer_of(result: StepResult) -> StepAnswer:
    """The result in the form that page, report, files and command line use."""
    numbers = result.step or result.move
    unknown = () if numbers is None else unknown_figures(numbers)
    return StepAnswer(
        kind=result.kind,
        unit="rpm" if result.kind == "speed" else "rev",
        time_s=tuple(result.time_s.tolist()),
        demand=tuple(result.demand.tolist()),
        actual=tuple(result.actual.tolist()),
        torque_percent=tuple(result.torque_percent.tolist()),
        step=StepNumbers(**figures_of(result.step)) if result.step else None,
        move=MoveNumbers(**figures_of(result.move)) if result.move else None,
        noise=result.noise,
        window=result.window,
        widened=result.widened,
        torque_peak_percent=result.torque_peak_percent,
        torque_rms_percent=result.torque_rms_percent,
        unknown=unknown,
        lost_percent=0.0 if result.valid is None else 100.0 * float(np.mean(~result.valid)),
    )
