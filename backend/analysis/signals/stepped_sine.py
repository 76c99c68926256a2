"""Stepped sine: one tone after another, for a detailed measurement of a peak."""

from __future__ import annotations

import numpy as np

from backend.analysis.signals.arrays import FloatArray
from backend.analysis.signals.excitation import Excitation, Segment
from backend.analysis.signals.ramps import cosine_ramp


def stepped_sine(
    *,
    sample_rate_hz: float,
    frequency_hz: FloatArray,
    settle_cycles: int = 5,
    measure_cycles: int = 10,
    measure_s: float = 0.0,
    settle_s: float = 0.05,
    ramp_s: float = 0.02,
    amplitude: FloatArray | None = None,
) -> Excitation:
    """Return one tone after another, each ramped in and out, for a detailed measurement of a peak.

    Every frequency is moved slightly so that its cycles fill a whole number of samples:
    ``measure_cycles``, or more where these take less than ``measure_s``. ``segments`` state which
    samples to evaluate. ``amplitude`` weights the tones; None is 1 for all.

    Raises:
        ValueError: no frequency, or one not below half the sample rate.
    """
    weights = np.ones(len(frequency_hz)) if amplitude is None else amplitude
    parts: list[FloatArray] = []
    segments: list[Segment] = []
    position = 0
    tones = np.asarray(frequency_hz, dtype=np.float64)
    for wanted, weight in zip(tones, weights, strict=True):
        if not 0 < wanted < sample_rate_hz / 2:
            raise ValueError(f"{wanted} Hz cannot be played at {sample_rate_hz} Hz")
        # Even, so that each half has whole cycles, too.
        cycles = max(measure_cycles, 2 * int(np.ceil(measure_s * wanted / 2.0)))
        measured = max(1, round(cycles * sample_rate_hz / wanted))
        actual = cycles * sample_rate_hz / measured
        settle = round(max(settle_cycles / wanted, settle_s) * sample_rate_hz)
        ramp = max(2, min(round(max(ramp_s, 1.0 / wanted) * sample_rate_hz), settle))
        n = settle + measured + ramp
        tone = weight * np.sin(2 * np.pi * actual * np.arange(n) / sample_rate_hz)
        tone[:ramp] *= cosine_ramp(ramp)
        tone[-ramp:] *= cosine_ramp(ramp)[::-1]
        segments.append(Segment(actual, position + settle, measured, cycles))
        parts.append(tone)
        position += n
    if not parts:
        raise ValueError("a stepped sine needs at least one frequency")
    return Excitation(
        kind="stepped_sine",
        samples=np.concatenate(parts),
        sample_rate_hz=sample_rate_hz,
        lines=np.arange(len(segments)),
        segments=tuple(segments),
    )
