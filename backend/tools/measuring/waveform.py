"""The four excitation waveforms of the tools: multisine, chirp, PRBS, stepped sine.

The first three fill a period that is repeated, so that one evaluation applies to all of them
(Pintelon & Schoukens, *System Identification*, 2012, section 5.3: periodic chirp, maximum-length
sequences). The stepped sine plays one tone after the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from backend.analysis.signals.chirp import band_limited, chirp_period
from backend.analysis.signals.excitation import (
    BaseMotion,
    Excitation,
    choose_lines,
    multisine,
    repeated,
)
from backend.analysis.signals.prbs import prbs_period
from backend.analysis.signals.stepped_sine import stepped_sine
from backend.tools.thresholds import measuring_waveform as threshold
from drivers.texts.message import Unsuitable, text

Waveform = Literal["multisine", "chirp", "prbs", "stepped"]
FloatArray = npt.NDArray[np.float64]

#: Register lengths that `prbs_period` supports.
_ORDERS = range(7, 16)


@dataclass(frozen=True)
class Band:
    """Selection of lines: lowest and highest frequency, maximum count; ``odd_only``: odd lines."""

    f_min_hz: float
    f_max_hz: float
    count: int = 200
    odd_only: bool = False


@dataclass(frozen=True)
class Grid:
    """One period of a waveform: sample rate, samples per period, and the evaluated bins."""

    waveform: Waveform
    rate_hz: float
    period: int
    lines: npt.NDArray[np.int64]

    @property
    def line_hz(self) -> FloatArray:
        """Frequencies of the lines [Hz]."""
        return np.asarray(self.lines * (self.rate_hz / self.period))

    @property
    def slow_hz(self) -> float:
        """Frequency of the base motion [Hz]: one cycle per period."""
        return self.rate_hz / self.period


def grid(waveform: Waveform, rate_hz: float, band: Band) -> Grid:
    """Period and lines of a waveform; a PRBS has one bit per cycle of the bus.

    Raises:
        ValueError: no line lies in the band.
    """
    period = round(threshold.PERIOD_S * rate_hz)
    if waveform == "prbs":
        order = int(np.clip(np.log2(period + 1), _ORDERS[0], _ORDERS[-1]))
        period = 2**order - 1
    lines = choose_lines(
        band.f_min_hz, band.f_max_hz, rate_hz / period, count=band.count, odd_only=band.odd_only
    )
    # Bin 1 contains the base motion.
    return Grid(waveform, rate_hz, period, lines[lines > 1])


def periodic(
    of: Grid,
    amplitude: FloatArray,
    number: int,
    *,
    base: BaseMotion | None = None,
    integrations: int = 0,
    ramp_samples: int,
) -> Excitation:
    """Realisation ``number`` with these amplitudes of the lines; pairs have opposite signs."""
    realisation, invert = number // 2, bool(number % 2)
    if of.waveform == "multisine":
        return multisine(
            sample_rate_hz=of.rate_hz, period_samples=of.period, lines=of.lines,
            realisation=realisation, invert=invert, integrations=integrations, iterations=80,
            base=base, amplitude=amplitude, ramp_samples=ramp_samples,
        )  # fmt: skip
    if of.waveform == "prbs":
        order = int(np.log2(of.period + 1))
        raw = prbs_period(order, 1, realisation)
    else:
        hz = of.line_hz
        raw = chirp_period(of.rate_hz, of.period, float(hz[0]), float(hz[-1]), realisation)
    return repeated(
        band_limited(raw, of.lines, amplitude), kind="prbs" if of.waveform == "prbs" else "chirp",
        sample_rate_hz=of.rate_hz, lines=of.lines, realisation=realisation, base=base,
        ramp_samples=ramp_samples, integrations=integrations, invert=invert,
    )  # fmt: skip


def tones_hz(band: Band) -> FloatArray:
    """Tones of a stepped sine, spaced logarithmically, as many as the time allows [Hz].

    Raises:
        ValueError: even the fewest take too long.
    """
    for count in range(threshold.MOST_TONES, threshold.FEWEST_TONES - 1, -1):
        tones = np.geomspace(band.f_min_hz, band.f_max_hz, count)
        settle = np.maximum(threshold.SETTLE_CYCLES / tones, threshold.SETTLE_S)
        measure = np.maximum(threshold.CYCLES / tones, threshold.MEASURE_S)
        if (
            float(np.sum(settle + measure + np.maximum(threshold.TONE_RAMP_S, 1.0 / tones)))
            <= threshold.STEPPED_S
        ):
            return np.asarray(tones)
    raise Unsuitable(text("measuring.stepped-sine-too-long", f_min_hz=band.f_min_hz))


def stepped(
    rate_hz: float, tones: FloatArray, amplitude: FloatArray, *, invert: bool
) -> Excitation:
    """A stepped sine, or its negative with ``invert``; the largest tone has amplitude 1."""
    sign = -1.0 if invert else 1.0
    return stepped_sine(
        sample_rate_hz=rate_hz,
        frequency_hz=tones,
        settle_cycles=threshold.SETTLE_CYCLES,
        measure_cycles=threshold.CYCLES,
        measure_s=threshold.MEASURE_S,
        settle_s=threshold.SETTLE_S,
        ramp_s=threshold.TONE_RAMP_S,
        amplitude=np.asarray(sign * amplitude / np.max(np.abs(amplitude))),
    )
