"""An inertia J0 + A sin θ about several places, integrated with Lagrange's equation."""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np
import pytest

from backend.analysis.mechanics.identification.inertia_by_place import (
    InertiaByPlace,
    inertia_by_place,
)
from backend.analysis.response.signal_path.sampling import SignalPath
from backend.analysis.signals.excitation import BaseMotion, multisine
from backend.analysis.signals.line_spectra import Record

RATE_HZ, J0, VISCOUS = 1000.0, 4e-4, 2e-2
SUBSTEPS = 20


@numba.njit
def moved(torque: np.ndarray, by_place: float, start: float) -> np.ndarray:
    """Place and speed at each sample: J α + J' ω²/2 + d ω = torque, held over the cycle."""
    out = np.empty((2, torque.size))
    place, speed = start, 0.0
    step = 1.0 / RATE_HZ / SUBSTEPS
    for n in range(torque.size):
        out[0, n], out[1, n] = place, speed
        for _ in range(SUBSTEPS):
            inertia = J0 + by_place * np.sin(place)
            slope = by_place * np.cos(place)
            speed += step * (torque[n] - VISCOUS * speed - 0.5 * slope * speed**2) / inertia
            place += step * speed
    return out


def found(by_place: float, noise: float = 1e-3) -> InertiaByPlace | None:
    rng = np.random.default_rng(5)
    records = []
    for n in range(4):
        e = multisine(
            sample_rate_hz=RATE_HZ,
            period_samples=650,
            lines=np.arange(4, 160),
            realisation=n // 2,
            base=BaseMotion(0.5, 1.6),
            invert=bool(n % 2),
        )
        e = replace(e, samples=0.4 * e.samples)
        place, speed = moved(e.samples, by_place, 0.8 + 0.3 * n)
        speed = speed + noise * rng.normal(size=speed.size)
        records.append(Record(e, speed, position=place))
    path = SignalPath(RATE_HZ, hold="zero")
    return inertia_by_place(tuple(records), path, "torque_mode", 0.0)


@pytest.mark.long
@pytest.mark.parametrize("share", [0.03, 0.1])
def test_an_inertia_by_place_is_found_with_its_size(share: float) -> None:
    reported = found(share * J0)
    assert reported is not None
    assert reported.amplitude_kgm2 == pytest.approx(share * J0, rel=0.2)


@pytest.mark.parametrize("noise", [0.0, 1e-3, 1e-1])
def test_a_constant_inertia_is_not_taken_for_one(noise: float) -> None:
    assert found(0.0, noise) is None
