"""Metrics of a commanded step or move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.analysis.signals.arrays import FloatArray


@dataclass(frozen=True)
class StepMetrics:
    """Metrics of a step response; times in s from the command, None if never reached.

    ``rise_s`` is the time from 10 % to 90 % of the step; ``overshoot_percent`` is relative to the
    step. ``settling_s`` is when the signal enters the window for the last time; None when it is
    outside at the end of the recording.
    """

    initial: float
    final: float
    overshoot_percent: float
    rise_s: float | None
    settling_s: float | None
    peak_time_s: float


@dataclass(frozen=True)
class MoveMetrics:
    """Metrics of a move; ``settling_s`` counts from the end of the commanded motion."""

    following_peak: float
    following_rms: float
    overshoot: float
    settling_s: float | None
    torque_peak: float | None
    torque_rms: float | None


def _first_reach(time_s: FloatArray, progress: FloatArray, level: float) -> float | None:
    """First time at which ``progress`` reaches ``level``, interpolated."""
    above = np.flatnonzero(progress >= level)
    if above.size == 0:
        return None
    i = int(above[0])
    if i == 0:
        return float(time_s[0])
    share = (level - progress[i - 1]) / (progress[i] - progress[i - 1])
    return float(time_s[i - 1] + share * (time_s[i] - time_s[i - 1]))


def _settling(time_s: FloatArray, deviation: FloatArray, window: float) -> float | None:
    """Time after which the deviation stays within the window."""
    outside = np.flatnonzero(np.abs(deviation) > window)
    if outside.size == 0:
        return 0.0
    last = int(outside[-1])
    if last == deviation.size - 1:
        return None
    return float(time_s[last + 1] - time_s[0])


def step_metrics(
    time_s: FloatArray,
    signal: FloatArray,
    *,
    target: float,
    initial: float | None = None,
    window: float | None = None,
) -> StepMetrics:
    """Return the metrics of a step commanded at ``time_s[0]``.

    ``initial`` defaults to the first sample, ``window`` (same unit as the signal) to 2 % of the
    step.

    Raises:
        ValueError: target and initial value are the same.
    """
    start = float(signal[0]) if initial is None else initial
    size = target - start
    if size == 0.0:
        raise ValueError("a step of size zero has no response")
    progress = (signal - start) / size
    peak = int(np.argmax(progress))
    low, high = _first_reach(time_s, progress, 0.1), _first_reach(time_s, progress, 0.9)
    allowed = 0.02 * abs(size) if window is None else window
    return StepMetrics(
        initial=start,
        final=float(np.mean(signal[-max(1, signal.size // 20) :])),
        overshoot_percent=max(0.0, (float(progress[peak]) - 1.0) * 100.0),
        rise_s=None if low is None or high is None else high - low,
        settling_s=_settling(time_s, signal - target, allowed),
        peak_time_s=float(time_s[peak] - time_s[0]),
    )


def move_metrics(
    time_s: FloatArray,
    demand: FloatArray,
    actual: FloatArray,
    *,
    window: float,
    torque: FloatArray | None = None,
) -> MoveMetrics:
    """Return the metrics of a move: ``demand`` is the position demand, ``window`` in its unit."""
    error = demand - actual
    target = float(demand[-1])
    direction = np.sign(target - float(demand[0])) or 1.0
    moving = np.flatnonzero(np.abs(demand - target) > 1e-9 * max(1.0, abs(target)))
    end = min(int(moving[-1]) + 1, demand.size - 1) if moving.size else 0
    return MoveMetrics(
        following_peak=float(np.max(np.abs(error))),
        following_rms=float(np.sqrt(np.mean(error**2))),
        overshoot=max(0.0, float(np.max((actual - target) * direction))),
        settling_s=_settling(time_s[end:], actual[end:] - target, window),
        torque_peak=None if torque is None else float(np.max(np.abs(torque))),
        torque_rms=None if torque is None else float(np.sqrt(np.mean(torque**2))),
    )
