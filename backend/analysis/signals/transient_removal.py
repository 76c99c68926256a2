"""Removes free oscillations that have not decayed when the evaluated periods begin.

A lightly damped axis takes longer to settle than one wants to wait. From one period to the next the
forced response is the same; the difference is the free oscillation, a few decaying sines. These are
identified in the difference and continued over all periods (Pintelon & Schoukens, *System
Identification*, 2012, section 2.2.3 on transients; the decay is that of the mechanics).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.signals.arrays import ComplexArray, FloatArray, IntArray
from backend.analysis.signals.excitation import Excitation
from backend.analysis.signals.line_spectra import Record
from backend.analysis.thresholds import transient_removal as threshold


@dataclass(frozen=True)
class _Difference:
    """Each signal one period later minus itself, over all evaluated periods but the last."""

    series: FloatArray
    """[samples]"""
    start: int
    period: int
    stop: int


def settled(records: tuple[Record, ...]) -> tuple[Record, ...]:
    """Return the records without free oscillations.

    A record is unchanged where none is found, or where evaluated periods are missing.
    """
    poles = _poles(records)
    if poles.size == 0:
        return records
    return tuple(_without(record, poles) for record in records)


def _difference(signal: FloatArray, e: Excitation) -> _Difference:
    n = e.period_samples
    start = e.first_sample + e.transient_periods * n
    stop = e.first_sample + e.periods * n
    series = signal[start + n : stop] - signal[start : stop - n]
    t = np.linspace(-1.0, 1.0, series.size)
    return _Difference(series - np.polynomial.Legendre.fit(t, series, 1)(t), start, n, stop)


def _whole(record: Record) -> bool:
    """Whether there are at least two evaluated periods, all of them good."""
    e = record.excitation
    if e.segments or e.periods - e.transient_periods < 2:
        return False
    start = e.first_sample + e.transient_periods * e.period_samples
    return record.valid is None or bool(np.all(record.valid[start:]))


def _poles(records: tuple[Record, ...]) -> ComplexArray:
    """Logarithms per sample of the decaying oscillations that the records have in common."""
    whole = [record for record in records if _whole(record)]
    if not whole:
        return np.empty(0, dtype=np.complex128)
    series = np.array([_difference(r.response, r.excitation).series for r in whole])
    spectra = np.fft.rfft(series, axis=1)
    e = whole[0].excitation
    m, lowest = (
        series.shape[1],
        max(3, int(0.8 * e.line_hz[0] * series.shape[1] / e.sample_rate_hz)),
    )
    found: list[complex] = []
    power = np.sum(np.abs(spectra) ** 2, axis=0)
    level = _surroundings(power)
    for _ in range(threshold.MOST):
        ratio = power / level
        ratio[:lowest], ratio[-threshold.NEAR :] = 0.0, 0.0
        k = int(np.argmax(ratio))
        if ratio[k] < threshold.ABOVE:
            break
        pole = _pole_at(spectra, k, m)
        shape = _shape(pole, np.arange(spectra.shape[1]), m)
        near = slice(max(k - threshold.NEAR, 0), k + threshold.NEAR + 1)
        size = (spectra[:, near] @ shape[near].conj()) / np.sum(np.abs(shape[near]) ** 2)
        spectra = spectra - size[:, None] * shape
        power = np.sum(np.abs(spectra) ** 2, axis=0)
        power[near] = np.minimum(power[near], level[near])
        if threshold.GONE < abs(np.exp(pole * e.period_samples)) < threshold.STEADY:
            found.append(pole)
    return np.array(found, dtype=np.complex128)


def _surroundings(power: FloatArray) -> FloatArray:
    """Running median."""
    padded = np.pad(power, threshold.AROUND, mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * threshold.AROUND + 1)
    return np.asarray(np.median(windows, axis=1) + 1e-300)


def _shape(pole: complex, bins: IntArray, m: int) -> ComplexArray:
    """Spectrum of e^(pole·n) over m samples, at these bins."""
    z = pole - 2j * np.pi * bins / m
    return np.asarray((1.0 - np.exp(pole * m)) / (1.0 - np.exp(z)), dtype=np.complex128)


def _pole_at(spectra: ComplexArray, k: int, m: int) -> complex:
    """The pole that explains most of the bins around a peak, from successively finer grids."""
    bins = np.arange(max(k - threshold.NEAR, 1), k + threshold.NEAR + 1)
    data = spectra[:, bins]
    place, step, decay, factor = float(k), 0.15, 1.0, 1.5
    for _ in range(4):
        places = place + step * np.arange(-7, 8)
        decays = decay * factor ** np.arange(-8.0, 9.0)
        poles = (-decays[:, None] + 2j * np.pi * places[None, :]).ravel() / m
        z = poles[:, None] - 2j * np.pi * bins[None, :] / m
        shapes = 1.0 / (1.0 - np.exp(z))
        explained = np.sum(np.abs(data @ shapes.conj().T) ** 2, axis=0)
        best = poles[int(np.argmax(explained / np.sum(np.abs(shapes) ** 2, axis=1)))] * m
        place, decay = float(best.imag) / (2 * np.pi), float(-best.real)
        step, factor = step / 4.0, factor**0.3
    return complex(-decay, 2 * np.pi * place) / m


def _without(record: Record, poles: ComplexArray) -> Record:
    """Every signal minus the oscillations found in its own differences."""
    if not _whole(record):
        return record
    e = record.excitation
    return replace(
        record,
        response=_cleaned(record.response, e, poles),
        torque=None if record.torque is None else _cleaned(record.torque, e, poles),
        position=None if record.position is None else _cleaned(record.position, e, poles),
    )


def _cleaned(signal: FloatArray, e: Excitation, poles: ComplexArray) -> FloatArray:
    d = _difference(signal, e)
    # One more sample: the interval from the last sample to the next belongs to the last period.
    stop = min(d.stop + 1, signal.size)
    n = np.arange(stop - d.start)
    swings = np.exp(poles[None, :] * n[:, None])
    basis = swings[: d.series.size]
    matrix = np.concatenate([basis.real, -basis.imag], axis=1)
    a, b = np.split(np.linalg.lstsq(matrix, d.series, rcond=None)[0], 2)
    size = (a + 1j * b) / (np.exp(poles * d.period) - 1.0)
    out = signal.copy()
    out[d.start : stop] -= (swings @ size).real
    return out
