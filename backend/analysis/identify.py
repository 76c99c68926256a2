"""From recordings to mechanics: direct estimate, delay, model, and estimate without images.

The steps of tuning.md section 2 in one call: a direct estimate; a continuous model fitted
through hold and sampling that also finds the delay; the direct estimate again, with the delay
and the folded images taken out. The corrected lines stay measurements: the model only supplies
the ratio between what sampling shows and what is there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.arrays import ComplexArray
from backend.analysis.frf import (
    Frf,
    Quantity,
    Record,
    estimate_periodic,
    loop_spectra,
    valid_band_hz,
)
from backend.analysis.sampled_model import (
    SampledFit,
    fit_loop,
    fit_sampled_model,
    loop_image_factor,
)
from backend.analysis.sampling import SignalPath, delay_response

#: One standard deviation of what hold, lag and delay leave unexplained however long one measures.
SYSTEMATIC_DB = 0.03
SYSTEMATIC_DEG = 0.15

#: A model whose median relative misfit is larger corrects nothing.
TRUSTED_ERROR = 0.03

#: At most this many rounds of refining loop and mechanics against each other.
LOOP_PASSES = 3


@dataclass(frozen=True)
class Identification:
    """Everything about one measurement of the mechanics.

    ``direct`` is the estimate with only hold, current loop and delay divided out and its honest
    band (0.25 of the sample rate); ``corrected`` has the folded images removed as well and holds
    to 0.4; ``fit`` is the model that did it. When no model fits (``trusted`` False), both are the
    plain estimate with a band of 0.1 of the sample rate.
    """

    direct: Frf
    corrected: Frf
    fit: SampledFit
    trusted: bool = True


def identify_mechanics(
    records: tuple[Record, ...],
    path: SignalPath,
    quantity: Quantity,
    *,
    coulomb_nm: float | None = None,
    max_modes: int = 4,
    jitter_s: float = 0.0,
) -> Identification:
    """Mechanics from torque to velocity out of periodic recordings.

    ``quantity`` is *torque_mode* or *torque_injection*; ``path`` holds the known delays, what is
    left is found by the fit. ``coulomb_nm`` as in :func:`estimate_periodic`, None estimates it.
    """
    if quantity == "closed_loop":
        raise ValueError("mechanics are identified from torque, not from a loop's reference")
    raw = estimate_periodic(records, path, quantity, coulomb_nm=coulomb_nm, jitter_s=jitter_s)
    if quantity == "torque_mode":
        fit = fit_sampled_model(raw, path, max_modes=max_modes)
    else:
        fit = _fit_with_loop(raw, records, path, max_modes)
    if fit.error > TRUSTED_ERROR:
        # No model explains what was sampled, so neither delay nor images are known.
        low, high = raw.valid_band_hz
        plain = replace(raw, valid_band_hz=(low, min(high, 0.1 * raw.sample_rate_hz)))
        return Identification(plain, plain, fit, trusted=False)
    late = delay_response(raw.frequency_hz, fit.delay_s)
    delay_deg = 360.0 * raw.frequency_hz * fit.delay_std_s
    direct = replace(
        raw,
        response=np.asarray(raw.response / late),
        std_deg=np.hypot(raw.std_deg, delay_deg),
    )
    factor: ComplexArray = fit.image_factor(raw.frequency_hz)
    # Images stay in the direct estimate: its band must contain them.
    return Identification(
        _widened(direct, factor, 1.0), _without_images(direct, factor, jitter_s), fit
    )


def _fit_with_loop(
    raw: Frf, records: tuple[Record, ...], path: SignalPath, max_modes: int
) -> SampledFit:
    """Loop and mechanics in turn: each is needed to take the images out of the other."""
    own, velocity = loop_spectra(records, path)
    fit = fit_sampled_model(
        raw, path, loop=fit_loop(raw.frequency_hz, own, velocity, path), max_modes=max_modes
    )
    for _ in range(LOOP_PASSES):
        clean = own / loop_image_factor(raw.frequency_hz, fit)
        loop = fit_loop(raw.frequency_hz, clean, velocity, path)
        change = abs(loop.c0 / fit.loop.c0 - 1.0)
        if change < 0.003:
            break
        fit = fit_sampled_model(raw, path, loop=loop, max_modes=max_modes)
    return fit


def _widened(frf: Frf, factor: ComplexArray, share: float) -> Frf:
    """Charge a share of the image factor, and what no estimate is better than, to the band."""
    doubt_db = np.hypot(np.abs(20 * np.log10(np.abs(factor))) * share, SYSTEMATIC_DB)
    doubt_deg = np.hypot(np.abs(np.degrees(np.angle(factor))) * share, SYSTEMATIC_DEG)
    return replace(
        frf, std_db=np.hypot(frf.std_db, doubt_db), std_deg=np.hypot(frf.std_deg, doubt_deg)
    )


def _without_images(direct: Frf, factor: ComplexArray, jitter_s: float) -> Frf:
    # The correction is as uncertain as the model: a fifth of it stays in the band.
    return replace(
        _widened(direct, factor, 0.2),
        response=np.asarray(direct.response / factor),
        valid_band_hz=valid_band_hz(
            float(direct.frequency_hz[0]), direct.sample_rate_hz, model=True, jitter_s=jitter_s
        ),
    )
