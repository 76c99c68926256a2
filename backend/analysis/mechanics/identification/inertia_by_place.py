"""Detects an inertia that depends on the position, from realisations at different positions.

With J(θ) the torque is J·α + J'·ω²/2 (Lagrange). A crank, a cam or an eccentric load varies J once
per revolution: the part that no single response explains makes the realisations differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.response.frf import Frf
from backend.analysis.response.signal_path.sampling import SignalPath, reported_response
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.signals.line_spectra import (
    Quantity,
    Record,
    collect,
    continuous_input,
    good_periods,
    instrument_estimate,
    period_spectra,
)
from backend.analysis.thresholds import inertia_by_place as threshold


@dataclass(frozen=True)
class InertiaByPlace:
    """Variation of the inertia once per motor revolution, kg·m² (in units of the torque and rad):
    amplitude and standard deviation.
    """

    amplitude_kgm2: float
    std_kgm2: float

    def share(self, frf: Frf) -> FloatArray:
        """Return the relative change of each line of torque to speed, to one side."""
        turn = 2 * np.pi * frf.frequency_hz * np.abs(frf.response)
        return np.asarray(self.amplitude_kgm2 * turn)

    def charged(self, frf: Frf) -> Frf:
        """Return the band widened for other positions: two differ by up to twice the amplitude."""
        share = self.share(frf)
        return replace(
            frf,
            std_db=np.hypot(frf.std_db, 20 / np.log(10) * share),
            std_deg=np.hypot(frf.std_deg, np.degrees(share)),
        )


def inertia_by_place(
    records: tuple[Record, ...], path: SignalPath, quantity: Quantity, coulomb_nm: float
) -> InertiaByPlace | None:
    """Return the position-dependent part of the inertia; None where none is detected.

    ``coulomb_nm`` is the friction that is removed from the torque.
    """
    first = records[0].excitation
    if quantity == "closed_loop" or first.segments or not first.period_samples:
        return None
    reported = tuple(r for r in records if r.position is not None and good_periods(r)[0])
    if len(reported) < 2:
        return None
    s = collect(reported, path, quantity)
    inputs = continuous_input(s, path, quantity, coulomb_nm)
    g, _, s_ur = instrument_estimate(s, inputs)
    f = s.frequency_hz
    late = reported_response(f, path)
    sent = [r.mean(axis=0) for r in s.sent]
    means: list[ComplexArray] = [u.mean(axis=0) for u in inputs]
    left: list[ComplexArray] = [
        y.mean(axis=0) / g - u for y, u in zip(s.response, means, strict=True)
    ]

    def apart(rows: Sequence[ComplexArray]) -> list[ComplexArray]:
        """Return the part that one common response of all realisations does not explain."""
        own = sum(n * r.conj() for n, r in zip(rows, sent, strict=True)) / s_ur
        return [n - own * u for n, u in zip(rows, means, strict=True)]

    use = (f < threshold.SHARE * path.sample_rate_hz) & (np.abs(g) > 0)
    if np.count_nonzero(use) < threshold.FEW:
        return None
    columns = []
    for phase in (0.0, np.pi / 2):
        rows = [_torque(r, phase) / late for r in reported]
        columns.append(np.concatenate([c[use] for c in apart(rows)]))
    target = -np.concatenate([r[use] for r in left])
    # Weights by the residual torque of neighbouring lines: noise and friction dominate low lines.
    size = np.sqrt(np.mean([np.abs(r[use]) ** 2 for r in left], axis=0))
    weight = np.tile(1.0 / np.maximum(_around(size), 1e-12), len(reported))
    a = np.column_stack(columns) * weight[:, None]
    b = target * weight
    matrix, rhs = np.concatenate([a.real, a.imag]), np.concatenate([b.real, b.imag])
    x = np.linalg.lstsq(matrix, rhs, rcond=None)[0]
    rest = rhs - matrix @ x
    # Realisations share one response, so that a single one shows nothing.
    freedom = max(rest.size * (len(reported) - 1) / len(reported) - 2.0, 1.0)
    covariance = np.linalg.pinv(matrix.T @ matrix) * float(rest @ rest) / freedom
    amplitude = float(np.hypot(*x))
    if amplitude <= 0.0:
        return None
    along = x / amplitude
    std = float(np.sqrt(along @ covariance @ along))
    whole = 1.0 / float(np.median((2 * np.pi * f * np.abs(g))[use]))
    if amplitude < threshold.SURE * std or amplitude < threshold.LEAST * whole:
        return None
    return InertiaByPlace(amplitude, std)


def _torque(record: Record, phase: float) -> ComplexArray:
    """Torque [lines] of an inertia sin(θ + phase) of amplitude 1: by α, and by its slope."""
    assert record.position is not None
    e = record.excitation
    speed = record.response
    acceleration = np.gradient(speed) * e.sample_rate_hz
    at = record.position + phase
    torque = np.sin(at) * acceleration + 0.5 * np.cos(at) * speed**2
    good, _ = good_periods(record)
    return np.asarray(period_spectra(np.asarray(torque), e, good).mean(axis=0))


def _around(size: FloatArray) -> FloatArray:
    """RMS over the neighbouring lines."""
    padded = np.pad(size, 4, mode="edge")
    return np.asarray(np.sqrt(np.convolve(padded**2, np.full(9, 1 / 9), "valid")))
