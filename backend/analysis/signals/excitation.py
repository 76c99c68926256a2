"""Excitation signals as pure data: arrays, and the structure that an estimator needs.

Amplitudes are dimensionless (1.0 is the peak of the exciting part); the player scales them to
torque, speed or position. Every signal starts and ends at zero. With ``integrations`` the
ramps carry a small correction, so that an ideal axis (torque: two integrations, velocity: one,
position: none) stops where it began and does not drift during the measurement.

This module makes the multisine; :mod:`chirp`, :mod:`prbs` and :mod:`stepped_sine` the others.
Source: Pintelon & Schoukens, *System Identification: A Frequency Domain Approach* (2012),
ch. 2 (multisines, crest factor) and ch. 4 (odd lines).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from backend.analysis.signals.arrays import FloatArray, IntArray
from backend.analysis.signals.low_crest import low_crest_period
from backend.analysis.signals.ramps import ramped_periods
from backend.analysis.thresholds import excitation as threshold

Kind = Literal["multisine", "chirp", "prbs", "stepped_sine"]
Spacing = Literal["log", "linear"]


@dataclass(frozen=True)
class Segment:
    """One tone of a stepped sine: ``cycles`` whole cycles from sample ``start`` are evaluated."""

    frequency_hz: float
    start: int
    samples: int
    cycles: int


@dataclass(frozen=True)
class Excitation:
    """A signal to be sent sample by sample, and its structure.

    ``samples`` [n] contains ramps, base motion and all periods. Period ``p`` covers samples
    ``first_sample + p * period_samples`` onwards; the first ``transient_periods`` of the
    ``periods`` let the axis settle. ``lines`` are the excited bins of one period, bin ``k``
    lying at ``k * sample_rate_hz / period_samples``. Aperiodic signals have no periods.
    """

    kind: Kind
    samples: FloatArray
    sample_rate_hz: float
    first_sample: int = 0
    period_samples: int = 0
    periods: int = 0
    transient_periods: int = 0
    lines: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    base_line: int = 0
    realisation: int = 0
    segments: tuple[Segment, ...] = ()

    @property
    def duration_s(self) -> float:
        """Length of the whole signal in seconds."""
        return self.samples.size / self.sample_rate_hz

    @property
    def line_hz(self) -> FloatArray:
        """Frequencies of the excited lines, or of the tones, in Hz."""
        if self.segments:
            return np.array([segment.frequency_hz for segment in self.segments])
        if self.period_samples == 0:
            return np.empty(0)
        return self.lines * (self.sample_rate_hz / self.period_samples)

    @property
    def one_period(self) -> FloatArray:
        """The last whole period, base motion included."""
        start = self.first_sample + (self.periods - 1) * self.period_samples
        return self.samples[start : start + self.period_samples]


@dataclass(frozen=True)
class BaseMotion:
    """A slow sine below the measured band that keeps the axis moving and so avoids stiction.

    ``amplitude`` is relative to the exciting part's peak of 1; the frequency is moved to the
    nearest whole number of cycles per period.
    """

    amplitude: float
    frequency_hz: float = 1.0


def crest_factor(signal: FloatArray) -> float:
    """Return peak over RMS of a signal without its mean.

    Raises:
        ValueError: the signal is constant.
    """
    centred = signal - np.mean(signal)
    rms = float(np.sqrt(np.mean(centred**2)))
    if rms == 0.0:
        raise ValueError("the crest factor of a constant signal is not defined")
    return float(np.max(np.abs(centred))) / rms


def choose_lines(
    f_min_hz: float,
    f_max_hz: float,
    resolution_hz: float,
    *,
    spacing: Spacing = "log",
    count: int | None = None,
    odd_only: bool = False,
) -> IntArray:
    """Return the excited bins between two frequencies, at most ``count`` of them.

    ``odd_only`` selects odd bins only and leaves one in every four of them empty: even-order
    distortion then falls on the even bins and odd-order distortion on the empty odd ones. The empty
    one of each four is drawn at random with a fixed seed (random odd multisine).

    Raises:
        ValueError: no bin lies between the two frequencies.
    """
    first = max(1, int(np.ceil(f_min_hz / resolution_hz - 1e-9)))
    last = int(np.floor(f_max_hz / resolution_hz + 1e-9))
    if last < first:
        raise ValueError(f"no line between {f_min_hz} and {f_max_hz} Hz at {resolution_hz} Hz")
    allowed = np.arange(first, last + 1)
    if odd_only:
        allowed = allowed[allowed % 2 == 1]
        groups = -(-allowed.size // threshold.OF_ODD)
        left_out = np.random.default_rng(0).integers(0, threshold.OF_ODD, groups)
        places = threshold.OF_ODD * np.arange(groups) + left_out
        allowed = np.delete(allowed, places[places < allowed.size])
    if count is None or count >= allowed.size:
        return allowed.astype(np.int64)
    if spacing == "linear":
        wanted = np.linspace(allowed[0], allowed[-1], count)
    else:
        wanted = np.geomspace(allowed[0], allowed[-1], count)
    nearest = np.searchsorted((allowed[:-1] + allowed[1:]) / 2, wanted)
    return np.unique(allowed[nearest]).astype(np.int64)


def falling_amplitude(frequency_hz: FloatArray, corner_hz: float, order: float = 1.0) -> FloatArray:
    """Return line amplitudes, flat up to a corner and falling with ``order`` (1: 20 dB/decade)."""
    return np.asarray((1.0 + (frequency_hz / corner_hz) ** 2) ** (-order / 2.0), dtype=np.float64)


def multisine(
    *,
    sample_rate_hz: float,
    period_samples: int,
    lines: IntArray,
    periods: int = 3,
    transient_periods: int = 1,
    realisation: int = 0,
    amplitude: FloatArray | None = None,
    base: BaseMotion | None = None,
    ramp_samples: int | None = None,
    integrations: int = 0,
    iterations: int = 200,
    invert: bool = False,
) -> Excitation:
    """Return a random-phase multisine with optimised crest factor.

    ``amplitude`` [len(lines)] shapes the lines; None is flat. ``realisation`` seeds the phases.
    ``invert`` reverses the sign of the exciting part but not of the base motion: the friction that
    the base motion causes then cancels between such a pair. ``ramp_samples`` defaults to half a
    period.

    Raises:
        ValueError: a line outside the usable band, too few periods, or amplitudes that do not match
            the lines.
    """
    lines = np.asarray(lines, dtype=np.int64)
    if lines.size == 0 or lines[0] < 1 or 2 * lines[-1] >= period_samples:
        raise ValueError("lines must lie above zero and below half the sample rate")
    if periods <= transient_periods:
        raise ValueError(f"{periods} periods leave none after {transient_periods} of settling")
    weights = np.ones(lines.size) if amplitude is None else np.asarray(amplitude, dtype=np.float64)
    if weights.shape != lines.shape or np.any(weights < 0) or not np.any(weights > 0):
        raise ValueError("one amplitude of at least 0 is needed for each line")
    period = low_crest_period(period_samples, lines, weights, realisation, iterations)
    return repeated(
        period, kind="multisine", sample_rate_hz=sample_rate_hz, lines=lines, periods=periods,
        transient_periods=transient_periods, realisation=realisation, base=base,
        ramp_samples=ramp_samples, integrations=integrations, invert=invert,
    )  # fmt: skip


def repeated(
    period: FloatArray,
    *,
    kind: Kind,
    sample_rate_hz: float,
    lines: IntArray,
    periods: int = 3,
    transient_periods: int = 1,
    realisation: int = 0,
    base: BaseMotion | None = None,
    ramp_samples: int | None = None,
    integrations: int = 0,
    invert: bool = False,
) -> Excitation:
    """Return an excitation that repeats a given period; ``lines`` are its evaluated bins.

    Base motion, ramps and ``invert`` as for :func:`multisine`.

    Raises:
        ValueError: the base motion lies on an evaluated line.
    """
    n = period.size
    if invert:
        period = -period
    base_line = 0
    if base is not None and base.amplitude > 0:
        base_line = max(1, round(base.frequency_hz * n / sample_rate_hz))
        if base_line in lines:
            raise ValueError("the base motion lies on an excited line")
        turn = 2 * np.pi * base_line * np.arange(n) / n
        period = period + base.amplitude * np.sin(turn)
    ramp = n // 2 if ramp_samples is None else ramp_samples
    return Excitation(
        kind=kind,
        samples=ramped_periods(period, periods, ramp, integrations),
        sample_rate_hz=sample_rate_hz,
        first_sample=ramp,
        period_samples=n,
        periods=periods,
        transient_periods=transient_periods,
        lines=lines,
        base_line=base_line,
        realisation=realisation,
    )


def scaled(excitation: Excitation, amplitude: float, step: float = 0.0) -> Excitation:
    """Return the signal in units of the injection, rounded to ``step`` as the bus object will be.

    Estimators must be given the values as sent, that is this rounded signal.
    """
    samples = excitation.samples * amplitude
    if step > 0:
        samples = np.round(samples / step) * step
    return replace(excitation, samples=np.asarray(samples, dtype=np.float64))
