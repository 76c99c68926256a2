"""Frequency response from periodic recordings, with the excitation as instrument.

The loop around the axis is usually closed, so dividing the response by the torque is biased;
G = S_yr / S_ur is not (Pintelon & Schoukens, *System Identification*, 2012, sections 2.6, 7.2).
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import scipy

from backend.analysis.mechanics.friction import estimate_coulomb, scatter_left
from backend.analysis.response.signal_path.sampling import DIRECT_SHARE, MODEL_SHARE, SignalPath
from backend.analysis.signals.arrays import (
    BoolArray,
    ComplexArray,
    FloatArray,
    magnitude_db,
    neighbour_mean,
    phase_deg,
)
from backend.analysis.signals.line_spectra import (
    LineSpectra,
    Quantity,
    Record,
    collect,
    continuous_input,
    instrument_estimate,
)
from backend.analysis.thresholds import frf as threshold

__all__ = ["Frf", "Quantity", "Record", "estimate_lines", "estimate_periodic", "valid_band_hz"]


@dataclass(frozen=True)
class Frf:
    """A measured response, line by line.

    ``response`` [n] complex; ``std_db``, ``std_deg`` one standard deviation, of which ±1.96
    cover 95 %; NaN where a single period permits no estimate. ``noise`` and ``distortion``
    are amplitudes per line in units of the response signal. ``coulomb_nm`` is the friction whose
    torque was subtracted.
    """

    frequency_hz: FloatArray
    response: ComplexArray
    std_db: FloatArray
    std_deg: FloatArray
    coherence: FloatArray
    noise: FloatArray
    distortion: FloatArray
    sample_rate_hz: float
    valid_band_hz: tuple[float, float]
    periods_used: int
    periods_dropped: int
    coulomb_nm: float = 0.0
    scatter_left: float = 1.0
    """Share of the scatter between realisations that is left after subtracting that friction."""
    friction: ComplexArray | None = None
    """Possible common error of the logarithm of all lines by friction; None where there is none."""

    @property
    def magnitude_db(self) -> FloatArray:
        """Magnitude in dB."""
        return magnitude_db(self.response)

    @property
    def phase_deg(self) -> FloatArray:
        """Unwrapped phase in degrees."""
        return phase_deg(self.response)

    @property
    def in_band(self) -> BoolArray:
        """True for lines inside the valid band."""
        low, high = self.valid_band_hz
        return np.asarray((self.frequency_hz >= low) & (self.frequency_hz <= high))

    def cut(self, highest_hz: float) -> Frf:
        """Return the response without the lines above a frequency."""
        use = self.frequency_hz <= highest_hz
        lines = {
            f.name: getattr(self, f.name)[use]
            for f in fields(self)
            if isinstance(getattr(self, f.name), np.ndarray)
        }
        return replace(self, **lines)


def valid_band_hz(
    lowest_hz: float, sample_rate_hz: float, *, model: bool = False, jitter_s: float = 0.0
) -> tuple[float, float]:
    """Return the band in which the estimate is valid; an upper end below the lower one means
    "refuse".

    Sampling-time jitter of standard deviation s turns the phase by 2π·f·s; 0.05 rad of it (3°)
    is the limit on polled links.
    """
    upper = sample_rate_hz * (MODEL_SHARE if model else DIRECT_SHARE)
    if jitter_s > 0:
        upper = min(upper, 0.05 / (2 * np.pi * jitter_s))
    return lowest_hz, upper


def estimate_periodic(
    records: tuple[Record, ...],
    path: SignalPath,
    quantity: Quantity,
    *,
    jitter_s: float = 0.0,
    smooth_lines: int = 4,
    coulomb_nm: float | None = 0.0,
    position: bool = False,
) -> Frf:
    """Return the period-synchronous estimate over all realisations and periods.

    With ``position`` the velocity is derived from the records' position: it passes no speed filter,
    its images are weaker, and its noise is that of the encoder.

    ``coulomb_nm`` is friction whose torque is subtracted (units of the torque; the response must
    then be a velocity, for a closed loop that of the speed loop); None estimates it from the data.

    Scatter between periods is noise; scatter between realisations beyond that is nonlinear
    distortion (Pintelon & Schoukens section 4.3, "robust method"). Variances are pooled over
    ``smooth_lines`` neighbours on each side to gain degrees of freedom.
    """
    s = collect(records, path, quantity, position=position)
    if coulomb_nm is None:
        coulomb_nm = estimate_coulomb(s, path, quantity)
    reported = all(record.known_direction is not None for record in records)
    return estimate_lines(
        s,
        path,
        quantity,
        coulomb_nm,
        jitter_s=jitter_s,
        smooth_lines=smooth_lines,
        position=position,
        reported=reported,
    )


def estimate_lines(
    s: LineSpectra,
    path: SignalPath,
    quantity: Quantity,
    coulomb_nm: float,
    *,
    jitter_s: float = 0.0,
    smooth_lines: int = 4,
    position: bool = False,
    reported: bool = False,
) -> Frf:
    """Return the estimate of `estimate_periodic` from spectra.

    ``reported``: the direction of motion is known from the torque balance.
    """
    inputs = continuous_input(s, path, quantity, coulomb_nm, position=position)
    g, _, s_ur = instrument_estimate(s, inputs)
    # The effect of friction on the response is known only in part; that part is added to the band
    # (a larger one would give less weight to the lines that show the speed filter well).
    plain = instrument_estimate(s, continuous_input(s, path, quantity, position=position))[0]
    # Where friction takes most of the torque, a share of it is large relative to the rest.
    uncertainty = (
        threshold.BY_BALANCE * (g / plain - 1.0)
        if reported
        else threshold.BY_SPEED * np.log(g / plain)
    )
    size, turn = np.abs(uncertainty.real), np.abs(uncertainty.imag)
    if reported:
        # The error of the torque balance is not a share of the friction effect: it may also turn
        # a line.
        size = turn = threshold.EACH_BY_BALANCE * np.abs(g / plain - 1.0)
    power = np.asarray(sum(np.abs(r.mean(axis=0)) ** 2 for r in s.sent))
    noise_var, total_var, freedom = _variances(s, inputs, g, smooth_lines)
    relative = total_var * power / np.abs(g * s_ur) ** 2
    spread = (
        float(scipy.special.stdtrit(max(freedom, 1), 0.975) / 1.96) if freedom else float("nan")
    )
    one_sided = np.sqrt(relative / 2.0) * spread
    raw_power = np.asarray(sum(np.sum(np.abs(r) ** 2, axis=0) for r in s.sent))
    raw_response = np.asarray(sum(np.sum(np.abs(y) ** 2, axis=0) for y in s.response))
    cross = sum(np.sum(y * r.conj(), axis=0) for y, r in zip(s.response, s.sent, strict=True))
    count = len(s.sent)
    periods = s.used / count
    distortion = np.maximum(total_var - noise_var / periods, 0.0) if count > 1 else 0 * noise_var
    return Frf(
        frequency_hz=s.frequency_hz,
        response=g,
        std_db=20 / np.log(10) * np.hypot(one_sided, size),
        std_deg=np.degrees(np.hypot(one_sided, turn)),
        coherence=np.asarray(np.abs(cross) ** 2 / np.maximum(raw_power * raw_response, 1e-300)),
        noise=np.sqrt(noise_var) * 2.0 / s.samples,
        distortion=np.sqrt(distortion) * 2.0 / s.samples,
        sample_rate_hz=path.sample_rate_hz,
        valid_band_hz=valid_band_hz(
            float(s.frequency_hz[0]), path.sample_rate_hz, jitter_s=jitter_s
        ),
        periods_used=s.used,
        periods_dropped=s.dropped,
        coulomb_nm=coulomb_nm,
        scatter_left=scatter_left(s, path, quantity, coulomb_nm),
        friction=np.asarray(uncertainty),
    )


def _variances(
    s: LineSpectra, inputs: list[ComplexArray], g: ComplexArray, reach: int
) -> tuple[FloatArray, FloatArray, int]:
    """Noise variance of one period, total variance of one realisation, degrees of freedom."""
    errors = [y - g * u for y, u in zip(s.response, inputs, strict=True)]
    means = np.array([e.mean(axis=0) for e in errors])
    count = len(errors)
    noise_freedom = s.used - count
    nan = np.full(g.shape, np.nan)
    noise = nan
    if noise_freedom > 0:
        inner = sum(np.sum(np.abs(e - m) ** 2, axis=0) for e, m in zip(errors, means, strict=True))
        noise = neighbour_mean(np.asarray(inner) / noise_freedom, reach)
    width = min(2 * reach + 1, g.size)
    if count > 1:
        # A pair of opposite sign has the same phases and so the same odd distortion: it is one
        # draw.
        aligned = np.array(
            [m * r.mean(axis=0).conj() for m, r in zip(means, s.sent, strict=True)]
        ) / np.maximum([np.abs(r.mean(axis=0)) for r in s.sent], 1e-300)
        names = np.array(s.realisation)
        draws = np.unique(names) if np.unique(names).size > 1 else np.arange(count)
        rows = names if np.unique(names).size > 1 else draws
        groups = np.array([aligned[rows == d].mean(axis=0) for d in draws])
        scatter = np.sum(np.abs(groups) ** 2, axis=0) / (len(draws) - 1) * (count / len(draws))
        # With few draws the scatter may be below the noise between periods by chance.
        total = np.fmax(neighbour_mean(scatter, reach), noise * count / s.used)
        return noise, total, 2 * (len(draws) - 1) * width
    return noise, noise * count / s.used, 2 * noise_freedom * width
