"""Excitation signals as pure data: arrays and what an estimator must know about them.

Amplitudes are dimensionless (1.0 is the peak of the exciting part); the player scales them to
torque, speed or position. Every signal starts and ends at zero. With ``integrations`` the
ramps carry a small correction, so that an ideal axis (torque: two integrations, velocity: one,
position: none) comes to rest at the place where it began and does not drift meanwhile.

Sources: Pintelon & Schoukens, *System Identification: A Frequency Domain Approach* (2012),
ch. 2 (multisines, crest factor) and ch. 4 (odd lines); Guillaume et al., IEEE Trans.
Instrum. Meas. 40 (1991) 982 (crest factor); Novak et al., JAES 63 (2015) 786
(logarithmic chirp).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Literal

import numpy as np
from scipy.optimize import minimize

from backend.analysis.arrays import FloatArray, IntArray

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
    """A signal to be played, sample by sample, and its structure.

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
    """A slow sine below the measured band that keeps the axis moving and so defeats stiction.

    ``amplitude`` is relative to the exciting part's peak of 1; the frequency is moved to the
    nearest whole number of cycles per period.
    """

    amplitude: float
    frequency_hz: float = 1.0


def crest_factor(signal: FloatArray) -> float:
    """Peak over RMS of a signal without its mean."""
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
    """Excited bins between two frequencies, at most ``count`` of them.

    ``odd_only`` takes odd bins alone: even-order distortion then falls on the empty even bins
    and odd-order distortion on the odd bins that were left out.
    """
    first = max(1, int(np.ceil(f_min_hz / resolution_hz - 1e-9)))
    last = int(np.floor(f_max_hz / resolution_hz + 1e-9))
    if last < first:
        raise ValueError(f"no line between {f_min_hz} and {f_max_hz} Hz at {resolution_hz} Hz")
    allowed = np.arange(first, last + 1)
    if odd_only:
        allowed = allowed[allowed % 2 == 1]
    if count is None or count >= allowed.size:
        return allowed.astype(np.int64)
    if spacing == "linear":
        wanted = np.linspace(allowed[0], allowed[-1], count)
    else:
        wanted = np.geomspace(allowed[0], allowed[-1], count)
    nearest = np.searchsorted((allowed[:-1] + allowed[1:]) / 2, wanted)
    return np.unique(allowed[nearest]).astype(np.int64)


def falling_amplitude(frequency_hz: FloatArray, corner_hz: float, order: float = 1.0) -> FloatArray:
    """Line amplitudes flat to a corner and falling with ``order`` (1 is 20 dB/decade) above."""
    return np.asarray((1.0 + (frequency_hz / corner_hz) ** 2) ** (-order / 2.0), dtype=np.float64)


def _low_crest_period(
    n: int, lines: IntArray, amplitude: FloatArray, seed: int, iterations: int
) -> FloatArray:
    """As `_optimised_period`, which searches only once for realisations that share their phases."""
    whole = (lines.astype(np.int64).tobytes(), amplitude.astype(np.float64).tobytes())
    return _optimised_period(n, *whole, seed, iterations).copy()


@lru_cache(maxsize=32)
def _optimised_period(
    n: int, lines_bytes: bytes, amplitude_bytes: bytes, seed: int, iterations: int
) -> FloatArray:
    """One period with the given line amplitudes, peak 1, phases chosen for a low crest factor.

    Minimises the 2p-norm of the signal for growing p (Guillaume et al., IEEE Trans. Instrum.
    Meas. 40 (1991) 982). The search starts at random phases, so different seeds stay
    independent realisations.
    """
    lines = np.frombuffer(lines_bytes, np.int64)
    amplitude = np.frombuffer(amplitude_bytes, np.float64)
    rng = np.random.default_rng(seed)
    scale = n * amplitude / (2.0 * np.sqrt(np.sum(amplitude**2) / 2.0))

    def signal_of(phases: FloatArray) -> FloatArray:
        spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
        spectrum[lines] = scale * np.exp(1j * phases)
        return np.fft.irfft(spectrum, n)

    def norm(phases: FloatArray, power: int) -> tuple[float, FloatArray]:
        signal = signal_of(phases)
        peak = float(np.max(np.abs(signal)))
        ratio = signal / peak
        total = float(np.mean(ratio**power))
        pull = np.fft.rfft(ratio ** (power - 1))[lines] / n
        slope = 2.0 / n * np.imag(pull * np.conj(scale * np.exp(1j * phases)))
        # log of the norm: its scale does not depend on p, which keeps the line search easy
        return float(np.log(peak) + np.log(total) / power), slope / (peak * total)

    best = rng.uniform(0, 2 * np.pi, lines.size)
    for power in (4, 8, 16, 40):
        best = minimize(
            norm, best, (power,), "L-BFGS-B", jac=True, options={"maxiter": iterations // 4}
        ).x
    signal = signal_of(best)
    return np.asarray(signal / np.max(np.abs(signal)), dtype=np.float64)


def _cosine_ramp(n: int) -> FloatArray:
    """Rises from 0 to 1 within n samples, both ends flat."""
    return 0.5 - 0.5 * np.cos(np.pi * (np.arange(n) + 0.5) / n)


def _settle(ramp: FloatArray, integrations: int, targets: tuple[float, float]) -> FloatArray:
    """Add smooth bumps so that the running sum and double sum end at ``targets``."""
    if integrations == 0:
        return ramp
    t = (np.arange(ramp.size) + 0.5) / ramp.size
    bumps = [np.sin(np.pi * t) ** 2, np.sin(np.pi * t) ** 2 * (1 - 2 * t)][:integrations]

    def ends(x: FloatArray) -> list[float]:
        first = np.cumsum(x)
        return [float(first[-1]), float(np.sum(first))][:integrations]

    matrix = np.array([ends(b) for b in bumps]).T
    missing = np.array(targets[:integrations]) - np.array(ends(ramp))
    weights = np.linalg.solve(matrix, missing)
    return np.asarray(ramp + sum(w * b for w, b in zip(weights, bumps, strict=True)))


def _play_periodic(
    period: FloatArray, periods: int, ramp_samples: int, integrations: int
) -> FloatArray:
    """Ramp in, ``periods`` repetitions, ramp out; the axis ends at rest where it began."""
    n = period.size
    if ramp_samples == 0:
        return np.tile(period, periods)
    lead: FloatArray = period[np.arange(-ramp_samples, 0) % n] * _cosine_ramp(ramp_samples)
    tail: FloatArray = period[np.arange(ramp_samples) % n] * _cosine_ramp(ramp_samples)[::-1]
    # The steady state the ramp must lead into: zero-mean velocity and position.
    velocity: FloatArray = np.cumsum(period)
    velocity -= np.mean(velocity)
    position: FloatArray = np.cumsum(velocity)
    position -= np.mean(position)
    if integrations == 1:
        lead = _settle(lead, 1, (float(velocity[-1]), 0.0))
        tail = _settle(tail, 1, (-float(velocity[-1]), 0.0))
    elif integrations == 2:
        v_end, x_end = float(velocity[-1]), float(position[-1])
        lead = _settle(lead, 2, (v_end, x_end))
        # During the tail the double sum starts from the steady state, not from zero.
        tail = _settle(tail, 2, (-v_end, -x_end - v_end * ramp_samples))
    return np.concatenate([lead, np.tile(period, periods), tail])


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
    """Random-phase multisine with optimised crest factor.

    ``amplitude`` [len(lines)] shapes the lines; None is flat. ``realisation`` seeds the phases.
    ``invert`` turns the exciting part's sign and leaves the base motion: the friction that the
    base motion causes then cancels between such a pair. ``ramp_samples`` defaults to half a
    period.
    """
    lines = np.asarray(lines, dtype=np.int64)
    if lines.size == 0 or lines[0] < 1 or 2 * lines[-1] >= period_samples:
        raise ValueError("lines must lie above zero and below half the sample rate")
    if periods <= transient_periods:
        raise ValueError(f"{periods} periods leave none after {transient_periods} of settling")
    weights = np.ones(lines.size) if amplitude is None else np.asarray(amplitude, dtype=np.float64)
    if weights.shape != lines.shape or np.any(weights < 0) or not np.any(weights > 0):
        raise ValueError("one amplitude of at least 0 is needed for each line")
    period = _low_crest_period(period_samples, lines, weights, realisation, iterations)
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
    """Any period, played again and again; ``lines`` are its bins that are evaluated.

    Base motion, ramps and ``invert`` as for :func:`multisine`.
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
        samples=_play_periodic(period, periods, ramp, integrations),
        sample_rate_hz=sample_rate_hz,
        first_sample=ramp,
        period_samples=n,
        periods=periods,
        transient_periods=transient_periods,
        lines=lines,
        base_line=base_line,
        realisation=realisation,
    )


def chirp_period(
    sample_rate_hz: float, period_samples: int, f_min_hz: float, f_max_hz: float, realisation: int
) -> FloatArray:
    """One period of a logarithmic chirp that is repeated without a pause.

    Realisations differ in direction (up, down) and in where the period begins.
    """
    t = np.arange(period_samples) / sample_rate_hz
    rate = np.log(f_max_hz / f_min_hz) * sample_rate_hz / period_samples
    signal = np.sin(2 * np.pi * f_min_hz / rate * np.expm1(rate * t))
    if realisation % 2:
        signal = signal[::-1]
    return np.asarray(np.roll(signal, (realisation // 2) * period_samples // 3))


def band_limited(period: FloatArray, lines: IntArray, amplitude: FloatArray) -> FloatArray:
    """A period without its bins below the first and above the last line, peak 1.

    ``amplitude`` [len(lines)] weighs the rest, interpolated between the lines.
    """
    spectrum = np.fft.rfft(period)
    bins = np.arange(spectrum.size)
    weight = np.interp(bins, lines, amplitude)
    spectrum *= np.where((bins >= lines[0]) & (bins <= lines[-1]), weight, 0.0)
    signal = np.fft.irfft(spectrum, period.size)
    return np.asarray(signal / np.max(np.abs(signal)), dtype=np.float64)


def chirp(
    *,
    sample_rate_hz: float,
    f_min_hz: float,
    f_max_hz: float,
    duration_s: float,
    ramp_s: float = 0.1,
    falloff_corner_hz: float | None = None,
    integrations: int = 0,
) -> Excitation:
    """Logarithmic chirp: the same time per octave, amplitude falling on request.

    The correction that brings the axis back to rest is spread over the whole signal, where it
    stays far below the measured band.
    """
    n = round(duration_s * sample_rate_hz)
    ramp = min(round(ramp_s * sample_rate_hz), n // 4)
    if n < 16 or not 0 < f_min_hz < f_max_hz < sample_rate_hz / 2:
        raise ValueError("a chirp needs 0 < f_min < f_max < half the sample rate and some length")
    t = np.arange(n) / sample_rate_hz
    rate = np.log(f_max_hz / f_min_hz) / duration_s
    signal = np.sin(2 * np.pi * f_min_hz / rate * np.expm1(rate * t))
    if falloff_corner_hz is not None:
        signal *= falling_amplitude(f_min_hz * np.exp(rate * t), falloff_corner_hz)
    signal[:ramp] *= _cosine_ramp(ramp)
    signal[-ramp:] *= _cosine_ramp(ramp)[::-1]
    signal = _settle(signal, integrations, (0.0, 0.0))
    return Excitation(
        kind="chirp", samples=signal / np.max(np.abs(signal)), sample_rate_hz=sample_rate_hz
    )


#: Feedback taps of maximum-length shift registers (Xilinx XAPP052, table 3).
_PRBS_TAPS: dict[int, tuple[int, ...]] = {
    7: (7, 6), 8: (8, 6, 5, 4), 9: (9, 5), 10: (10, 7), 11: (11, 9), 12: (12, 6, 4, 1),
    13: (13, 4, 3, 1), 14: (14, 5, 3, 1), 15: (15, 14),
}  # fmt: skip


def prbs_period(order: int, samples_per_bit: int = 1, realisation: int = 0) -> FloatArray:
    """One period of a maximum-length binary sequence without its mean, peak 1."""
    if order not in _PRBS_TAPS:
        raise ValueError(f"PRBS order {order} is outside 7 to 15")
    length = 2**order - 1
    state = 1 + (realisation * 7919) % length
    bits = np.empty(length)
    for i in range(length):
        bits[i] = 1.0 if state & 1 else -1.0
        feedback = 0
        for tap in _PRBS_TAPS[order]:
            feedback ^= state >> (order - tap)
        state = (state >> 1) | ((feedback & 1) << (order - 1))
    period = np.repeat(bits, samples_per_bit)
    period -= np.mean(period)
    return np.asarray(period / np.max(np.abs(period)))


def prbs(
    *,
    sample_rate_hz: float,
    order: int = 11,
    samples_per_bit: int = 1,
    periods: int = 3,
    transient_periods: int = 1,
    f_min_hz: float = 0.0,
    f_max_hz: float | None = None,
    realisation: int = 0,
    ramp_samples: int | None = None,
    integrations: int = 0,
) -> Excitation:
    """Maximum-length binary sequence of 2^order - 1 bits, without its mean, peak 1.

    ``realisation`` picks the starting state, that is a cyclic shift. Lines are the bins between
    ``f_min_hz`` and ``f_max_hz`` (default 0.4 of the bit rate, where the power is half).
    """
    if periods <= transient_periods:
        raise ValueError(f"{periods} periods leave none after {transient_periods} of settling")
    period = prbs_period(order, samples_per_bit, realisation)
    resolution = sample_rate_hz / period.size
    upper = 0.4 * sample_rate_hz / samples_per_bit if f_max_hz is None else f_max_hz
    ramp = period.size // 2 if ramp_samples is None else ramp_samples
    return Excitation(
        kind="prbs",
        samples=_play_periodic(period, periods, ramp, integrations),
        sample_rate_hz=sample_rate_hz,
        first_sample=ramp,
        period_samples=period.size,
        periods=periods,
        transient_periods=transient_periods,
        lines=choose_lines(max(f_min_hz, resolution), upper, resolution),
        realisation=realisation,
    )


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
    """One tone after another, each ramped in and out, for a closer look at a peak.

    Every frequency is moved slightly so that its cycles fill a whole number of samples:
    ``measure_cycles``, or more where these take less than ``measure_s``. ``segments`` say which
    samples to evaluate. ``amplitude`` weighs the tones; None is 1 for all.
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
        tone[:ramp] *= _cosine_ramp(ramp)
        tone[-ramp:] *= _cosine_ramp(ramp)[::-1]
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


def scaled(excitation: Excitation, amplitude: float, step: float = 0.0) -> Excitation:
    """The signal in units of the injection, rounded to ``step`` as the bus object will be.

    Estimators must be given what was really sent, that is this rounded signal.
    """
    samples = excitation.samples * amplitude
    if step > 0:
        samples = np.round(samples / step) * step
    return replace(excitation, samples=np.asarray(samples, dtype=np.float64))
