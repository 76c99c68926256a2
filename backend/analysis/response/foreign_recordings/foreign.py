"""Response with its band from an input and an output recorded by another program."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from backend.analysis.response.foreign_recordings.excitation_found import (
    Excited,
    excited_lines,
    find_excitation,
    transient_periods,
)
from backend.analysis.response.foreign_recordings.local_polynomial import local_polynomial
from backend.analysis.response.foreign_recordings.modes_found import FoundMode, modes_of
from backend.analysis.response.foreign_recordings.product_model import ProductFit, fit_product
from backend.analysis.response.foreign_recordings.repeat_band import (
    RepeatBand,
    line_scatter,
    repeat_band,
)
from backend.analysis.signals.arrays import (
    BoolArray,
    ComplexArray,
    FloatArray,
    IntArray,
    magnitude_db,
    neighbour_mean,
    phase_deg,
    running_mean,
)
from backend.analysis.thresholds import foreign as threshold

Method = Literal["periods", "local polynomial"]

LEAST_LINES = threshold.LEAST_LINES
LEAST_SAMPLES = threshold.LEAST_SAMPLES


class NoResponse(ValueError):
    """Raised if no response can be estimated. ``code`` is the violated rule,
    ``facts`` its figures.
    """

    def __init__(self, code: str, **facts: float) -> None:
        super().__init__(code)
        self.code = code
        self.facts = facts


@dataclass(frozen=True)
class ForeignResponse:
    """Response [lines] with ``band``; ``noise``, ``distortion`` relative to the line, one sigma.

    ``excitation`` was detected in the input and determines ``method``. ``empty`` is the relative
    motion on even and on odd lines that are not excited, where there are any.
    """

    frequency_hz: FloatArray
    response: ComplexArray
    coherence: FloatArray
    noise: FloatArray
    distortion: FloatArray
    band: RepeatBand
    fit: ProductFit | None
    modes: tuple[FoundMode, ...]
    excitation: Excited
    method: Method
    period_s: float | None
    periods_used: int
    transient_periods: int
    valid_band_hz: tuple[float, float]
    clipped_share: float
    empty: tuple[float | None, float | None] = (None, None)

    @property
    def std_db(self) -> FloatArray:
        """One standard deviation in dB for a repeated run; the band is ±1.96 of it."""
        return np.asarray(20.0 / np.log(10.0) * self.band.real)

    @property
    def std_deg(self) -> FloatArray:
        """The same for the phase, in degrees."""
        return np.asarray(np.degrees(self.band.imag))

    @property
    def magnitude_db(self) -> FloatArray:
        """Magnitude in dB."""
        return magnitude_db(self.response)

    @property
    def phase_deg(self) -> FloatArray:
        """Unwrapped phase in degrees."""
        return phase_deg(self.response)


@dataclass(frozen=True)
class EmptyLines:
    """Motion on lines that are not excited, relative to the excited lines around it.

    ``number`` [lines] is the bin of each in a period, whose parity separates even from odd
    distortion; ``power`` [lines] is the squared ratio.
    """

    frequency_hz: FloatArray
    number: IntArray
    power: FloatArray

    def within(self, low_hz: float, high_hz: float) -> EmptyLines:
        """Return the lines between two frequencies."""
        use = (self.frequency_hz >= low_hz) & (self.frequency_hz <= high_hz)
        return EmptyLines(self.frequency_hz[use], self.number[use], self.power[use])

    def sizes(self) -> tuple[float | None, float | None]:
        """Return the RMS over all even and all odd lines; None where there are too few."""
        found: list[float | None] = []
        for parity in (0, 1):
            power = self.power[self.number % 2 == parity]
            enough = power.size >= threshold.FEWEST_EMPTY
            found.append(float(np.sqrt(np.mean(power))) if enough else None)
        return found[0], found[1]

    def scatter_at(self, f: FloatArray) -> FloatArray:
        """Return the scatter per component at the lines ``f``: that of nearby empty lines of the
        parity with the larger one.
        """
        out = np.zeros(f.size)
        for parity in (0, 1):
            use = self.number % 2 == parity
            if np.count_nonzero(use) < threshold.FEWEST_EMPTY:
                continue
            near = neighbour_mean(self.power[use], threshold.POOL_EMPTY)
            out = np.maximum(out, np.interp(f, self.frequency_hz[use], near))
        return np.asarray(np.sqrt(out / 2.0))


@dataclass(frozen=True)
class _Lines:
    """An estimate before its band is known: ``noise`` relative, per component."""

    frequency_hz: FloatArray
    response: ComplexArray
    coherence: FloatArray
    noise: FloatArray
    period_s: float | None = None
    used: int = 0
    dropped: int = 0
    empty: EmptyLines | None = None
    independent: bool = True


def evaluate(
    signal_in: FloatArray,
    signal_out: FloatArray,
    sample_rate_hz: float,
    band_hz: tuple[float, float] | None = None,
) -> ForeignResponse:
    """Return the response from input to output, both [n], evenly sampled.

    Raises:
        NoResponse: too short, constant, too small or large for floats, or not coherent.
    """
    n = signal_in.size
    if n < LEAST_SAMPLES:
        raise NoResponse("too-short", samples=n, least=LEAST_SAMPLES)
    for name, signal in (("input", signal_in), ("output", signal_out)):
        span = float(np.max(signal)) - float(np.min(signal))
        if span <= 1e-9 * (float(np.max(np.abs(signal))) + 1e-300):
            raise NoResponse(f"{name}-constant", value=float(signal[0]))
        # Beyond, its power or that over the other one's is zero or infinite as a float.
        if not threshold.LEAST_SPAN <= span <= threshold.MOST_SPAN:
            least, most = threshold.LEAST_SPAN, threshold.MOST_SPAN
            raise NoResponse(f"{name}-span", value=span, least=least, most=most)
    found = find_excitation(signal_in)
    if found.kind == "periodic":
        rows = (signal_in[found.stretch], signal_out[found.stretch])
        lines = _by_periods(*rows, sample_rate_hz, found.period_samples)
    else:
        lines = _by_window(signal_in, signal_out, sample_rate_hz)
    lines = _cut(lines, band_hz)
    result = _with_band(lines)
    return replace(
        result,
        excitation=found.kind,
        method="periods" if found.kind == "periodic" else "local polynomial",
        clipped_share=_clipped(signal_in),
    )


def _cut(lines: _Lines, band_hz: tuple[float, float] | None) -> _Lines:
    use = np.ones(lines.frequency_hz.size, dtype=bool)
    if band_hz is not None:
        use = (lines.frequency_hz >= band_hz[0]) & (lines.frequency_hz <= band_hz[1])
    count = int(np.count_nonzero(use))
    if count < LEAST_LINES:
        raise NoResponse("few-lines", lines=count, least=LEAST_LINES)
    kept = lines.frequency_hz[use]
    return replace(
        lines,
        frequency_hz=kept,
        response=lines.response[use],
        coherence=lines.coherence[use],
        noise=lines.noise[use],
        empty=lines.empty.within(kept[0], kept[-1]) if lines.empty is not None else None,
    )


def _by_periods(u: FloatArray, y: FloatArray, rate: float, period: int) -> _Lines:
    """Mean over the settled periods; noise from their differences.

    Periods that drift (a position moved by friction or a disturbance, a drifting speed) are
    evaluated once with a slope common to all and once each with its own; the evaluation whose
    periods differ less is kept.
    """
    count = u.size // period
    both = [x[x.size - count * period :] for x in (u, y)]
    found = []
    for slopes_of in (_common_slope, _slope_of_each):
        of_in, of_out = (_level(x.reshape(count, period), slopes_of(x, period)) for x in both)
        found.append(_mean_of_periods(of_in, of_out, rate))
    noise = [float(np.median(lines.noise)) for lines in found]
    return found[int(noise[1] < threshold.LESS_NOISE * noise[0])]


def _mean_of_periods(rows_u: FloatArray, rows_y: FloatArray, rate: float) -> _Lines:
    """Estimate from periods [periods, samples] without mean and slope."""
    count, period = rows_u.shape
    dropped = transient_periods(rows_u, rows_y)
    spectra_u, spectra_y = (np.fft.rfft(rows[dropped:], axis=1) for rows in (rows_u, rows_y))
    mean_u, mean_y = spectra_u.mean(axis=0), spectra_y.mean(axis=0)
    used = count - dropped
    deviation = np.std(spectra_u, axis=0, ddof=1) / np.sqrt(used)
    lines = excited_lines(np.abs(mean_u), deviation)
    if lines.size < LEAST_LINES:
        raise NoResponse("few-lines", lines=lines.size, least=LEAST_LINES)
    g = mean_y[lines] / mean_u[lines]
    error = spectra_y[:, lines] - g * spectra_u[:, lines]
    variance = np.sum(np.abs(error) ** 2, axis=0) / max(used - 1, 1) / used
    variance = variance * _alike_periods(error)
    relative = np.sqrt(neighbour_mean(variance / np.abs(mean_y[lines]) ** 2, 2) / 2.0)
    return _Lines(
        lines * (rate / period), np.asarray(g), np.ones(lines.size), np.asarray(relative),
        period / rate, used, dropped, _on_empty(mean_u, mean_y, lines, g, rate / period),
    )  # fmt: skip


def _alike_periods(error: ComplexArray) -> FloatArray:
    """Factor [lines] on the variance of a mean, from errors [periods, lines] of zero mean.

    Slow changes from period to period (samples of a recorder whose clock is not the drive's,
    warm-up) correlate the errors of successive periods, so that the periods count as fewer: (1 +
    r)/(1 - r) with the correlation r of neighbours (Bayley & Hammersley, 1946).
    """
    count = error.shape[0]
    if count < threshold.FEWEST_ALIKE:
        return np.ones(error.shape[1])
    power = neighbour_mean(np.sum(np.abs(error) ** 2, axis=0), threshold.POOL_EMPTY)
    products = np.sum((error[1:] * error[:-1].conj()).real, axis=0)
    # Uncorrelated errors have a correlation of -1/n about their own mean.
    r = neighbour_mean(products, threshold.POOL_EMPTY) / np.maximum(power, 1e-300) + 1.0 / count
    r = np.clip(r, 0.0, 1.0 - 2.0 / (count + 1))
    return np.asarray((1.0 + r) / (1.0 - r))


def _common_slope(x: FloatArray, period: int) -> FloatArray:
    """Change over a period [periods], the same for all: the drift, without the signal itself."""
    means = x.reshape(-1, period).mean(axis=1)
    return np.full(means.size, np.polyfit(np.arange(means.size), means, 1)[0])


def _slope_of_each(x: FloatArray, period: int) -> FloatArray:
    """Change over each period [periods], from samples one period apart around its beginning.

    The periodic part cancels in their difference; subtracting a straight line between both ends
    keeps the rest from leaking into all lines.
    """
    apart = x[period:] - x[:-period]
    width = max(period // threshold.ENDS, 1)
    first = np.arange(x.size // period) * period - width // 2
    first = np.clip(first, 0, apart.size - width)
    sums = np.concatenate([[0.0], np.cumsum(apart)])
    return np.asarray((sums[first + width] - sums[first]) / width)


def _level(rows: FloatArray, slopes: FloatArray) -> FloatArray:
    """Periods [periods, samples] without their mean and slope."""
    steps = np.linspace(-0.5, 0.5, rows.shape[1], endpoint=False)
    return np.asarray(rows - rows.mean(axis=1)[:, None] - slopes[:, None] * steps)


def _on_empty(
    mean_u: ComplexArray, mean_y: ComplexArray, lines: np.ndarray, g: ComplexArray, step_hz: float
) -> EmptyLines:
    """Motion on the empty bins between the lines, relative to that on the neighbouring lines."""
    empty = np.setdiff1d(np.arange(lines[0], lines[-1] + 1), lines)
    near = np.asarray(np.interp(empty, lines, g.real) + 1j * np.interp(empty, lines, g.imag))
    around = np.interp(empty, lines, np.abs(mean_y[lines]))
    left = np.abs(mean_y[empty] - near * mean_u[empty]) / around
    return EmptyLines(empty * step_hz, empty.astype(np.int64), np.asarray(left**2))


def _by_window(u: FloatArray, y: FloatArray, rate: float) -> _Lines:
    """Local polynomials on the spectrum of the whole record: no window, transient estimated."""
    n = u.size
    spectra = [np.fft.rfft(x - np.mean(x)) for x in (u, y)]
    power = np.abs(spectra[0]) ** 2
    reach = max(round(n / rate), 8)
    level = 10.0 * np.log10(np.maximum(running_mean(power, reach, 2 * reach + 1), 0.0) + 1e-300)
    usable = np.arange(8, power.size - 8)
    strong = usable[level[usable] > np.max(level[usable]) + threshold.EXCITED_DB]
    if strong.size < LEAST_LINES:
        raise NoResponse("few-lines", lines=strong.size, least=LEAST_LINES)
    step = max((strong[-1] - strong[0]) // threshold.LINES, 1)
    half = max(8, int(step))
    centres = np.arange(max(strong[0], half), strong[-1] + 1, step)
    centres = centres[np.isin(centres, strong)]
    if centres.size < LEAST_LINES:
        raise NoResponse("few-lines", lines=centres.size, least=LEAST_LINES)
    found = local_polynomial(spectra[0], spectra[1], np.asarray(centres), half)
    relative = np.sqrt(found.variance / 2.0) / np.maximum(np.abs(found.response), 1e-300)
    return _Lines(
        centres * (rate / n),
        found.response,
        found.coherence,
        np.asarray(relative),
        independent=False,
    )


def _with_band(lines: _Lines) -> ForeignResponse:
    f, g = lines.frequency_hz, lines.response
    fit = _fitted(lines)
    modes = modes_of(fit, f) if fit is not None else ()
    left = fit.residual if fit is not None else np.log(g / np.abs(g).max())
    if fit is None:
        left = np.asarray(np.log(np.abs(g)) + 1j * np.unwrap(np.angle(g)))
    scatter = line_scatter(left, lines.noise)
    if lines.empty is not None:
        # Distortion on the empty lines is also present on the excited lines near them.
        scatter = np.maximum(scatter, lines.empty.scatter_at(f))
    band = repeat_band(f, scatter, fit.model if fit is not None else None, modes)
    if not lines.independent:
        band = _with_feedback(band, lines.coherence)
    coherence = lines.coherence
    if lines.independent:
        # Composition of a line in one run: the linear part against noise and distortion.
        coherence = 1.0 / (1.0 + 2.0 * scatter**2)
    return ForeignResponse(
        f, g, np.asarray(coherence), lines.noise,
        np.sqrt(np.maximum(scatter**2 - lines.noise**2, 0.0)), band, fit, modes, "noise",
        "local polynomial", lines.period_s, lines.used, lines.dropped,
        _band_hz(lines, np.asarray(coherence)),
        0.0, lines.empty.sizes() if lines.empty is not None else (None, None),
    )  # fmt: skip


def _with_feedback(band: RepeatBand, coherence: FloatArray) -> RepeatBand:
    """Band widened by a possible feedback of the output's noise into a non-periodic input.

    Where the input contains the response to the output's noise v, cross spectra give G·(1 - T·x)
    with the closed loop's T and the ratio x of noise to caused output (Söderström & Stoica, *System
    Identification*, 1989, section 10.3). One record does not show whether a loop was closed.
    """
    seen = neighbour_mean(coherence, threshold.POOL_EMPTY)
    noise = np.minimum(1.0 / np.maximum(seen, 1e-3) - 1.0, threshold.MOST_FEEDBACK)
    own = threshold.FEEDBACK * noise
    return replace(
        band,
        real=np.hypot(band.real, own),
        imag=np.hypot(band.imag, own),
        level=np.hypot(band.level, own),
    )


def _fitted(lines: _Lines) -> ProductFit | None:
    use = (
        (lines.coherence > threshold.COHERENT)
        & (lines.noise < 0.5)
        & (np.abs(lines.response) > 0)
        & _known(lines)
    )
    if np.count_nonzero(use) < LEAST_LINES:
        raise NoResponse("incoherent", coherence=float(np.median(lines.coherence)))
    weight = 1.0 / np.hypot(lines.noise, 0.03)
    fitted = np.flatnonzero(use)
    if lines.independent:
        fitted = _spread(lines.frequency_hz, fitted)
    found = fit_product(lines.frequency_hz[fitted], lines.response[fitted], weight[fitted])
    if found is None:
        return None
    model = found.model
    left = np.log(lines.response / model.response(lines.frequency_hz))
    return replace(found, residual=np.asarray(left))


def _spread(f: FloatArray, use: IntArray) -> IntArray:
    """Of the lines ``use``, as many as tell a model apart: half evenly spaced, half by octaves.

    A long period has tens of thousands of lines, and the fit takes time for each.
    """
    if use.size <= threshold.LINES:
        return use
    half = threshold.LINES // 2
    even = np.linspace(0, use.size - 1, half).round().astype(np.int64)
    octaves = np.searchsorted(f[use], np.geomspace(f[use[0]], f[use[-1]], half))
    return np.asarray(use[np.unique(np.concatenate([even, np.clip(octaves, 0, use.size - 1)]))])


def _known(lines: _Lines) -> BoolArray:
    """Lines [lines] near which the output follows the input.

    Where it does not, the square of each line over its variance is of the size of 1 (exponentially
    distributed), and exceeds the limit by chance on some of several hundred lines. The mean over
    neighbours does not. Lines of a repeated period have their noise from the periods instead.
    """
    if lines.independent:
        return np.ones(lines.frequency_hz.size, dtype=np.bool_)
    squared = np.minimum(0.5 / np.maximum(lines.noise, 1e-6) ** 2, threshold.MOST_OF_A_LINE)
    return np.asarray(neighbour_mean(squared, threshold.POOL_EMPTY) > threshold.KNOWN)


def _band_hz(lines: _Lines, coherence: FloatArray) -> tuple[float, float]:
    """First and last coherent line among those that are known, Hz."""
    f = lines.frequency_hz
    good = np.flatnonzero((coherence > threshold.COHERENT) & _known(lines))
    if good.size < LEAST_LINES:
        raise NoResponse("incoherent", coherence=float(np.median(coherence)))
    return float(f[good[0]]), float(f[good[-1]])


def _clipped(u: FloatArray) -> float:
    """Share of samples at the highest or lowest value of the input."""
    low, high = float(np.min(u)), float(np.max(u))
    near = 1e-6 * (high - low)
    return float(np.mean((u >= high - near) | (u <= low + near)))
