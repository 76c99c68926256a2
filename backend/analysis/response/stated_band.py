"""Contributions to the stated band of an estimate beyond its scatter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from backend.analysis.mechanics.identification.model_fit import Solution
from backend.analysis.response.frf import Frf, valid_band_hz
from backend.analysis.response.signal_path.sampling import DIRECT_SHARE, hold_response
from backend.analysis.signals.arrays import ComplexArray, FloatArray, neighbour_mean
from backend.analysis.thresholds import stated_band as threshold

SYSTEMATIC_DB = threshold.SYSTEMATIC_DB
SYSTEMATIC_DEG = threshold.SYSTEMATIC_DEG


_CI95 = 1.96


def unexplained(raw: Frf, solution: Solution, view: int) -> Frf:
    """Return lines that no model explains, for which neither hold and delay nor images are known.

    The residual of the best model in this ``view`` is added to their band, and the possibility that
    the other hold is the right one.
    """
    f, rate = raw.frequency_hz, raw.sample_rate_hz
    misfit = solution.problem.logs(solution.x)[0][view]
    hold = np.log(hold_response(f, rate, "zero"))
    size, turn = (
        np.hypot(neighbour_mean(np.abs(left), threshold.AROUND), known)
        for left, known in ((misfit.real, hold.real), (misfit.imag, hold.imag))
    )
    low, high = raw.valid_band_hz
    return replace(
        raw,
        std_db=np.hypot(raw.std_db, 20 / np.log(10) * size),
        std_deg=np.hypot(raw.std_deg, np.degrees(turn)),
        valid_band_hz=(low, min(high, threshold.UNTRUSTED_SHARE * rate)),
    )


def ended_where_unknown(frf: Frf) -> Frf:
    """Return the response with the band ended where lines depend on the model and are too
    uncertain.

    A resonance beyond half the sample rate may fold back more than the axis itself does there.
    Uncertain lines below accurate ones, as next to an antiresonance, do not end the band.
    """
    f, (low, high) = frf.frequency_hz, frf.valid_band_hz
    direct_hz = DIRECT_SHARE * frf.sample_rate_hz
    above = (f > direct_hz) & (f <= high)
    if not np.any(above):
        return frf
    rough = (
        np.maximum(frf.std_db / threshold.KNOWN_DB, frf.std_deg / threshold.KNOWN_DEG)[above]
        * _CI95
    )
    known = f[above][
        scipy.ndimage.median_filter(rough, 2 * threshold.AROUND + 1, mode="nearest") <= 1.0
    ]
    if known.size and known[-1] == f[above][-1]:
        return frf
    return replace(frf, valid_band_hz=(low, float(np.max(known, initial=direct_hz))))


def distorted(frf: Frf, share: FloatArray) -> Frf:
    """Return the response with the motion that friction does not explain added to its band."""
    return replace(
        frf,
        std_db=np.hypot(frf.std_db, 20 / np.log(10) * share),
        std_deg=np.hypot(frf.std_deg, np.degrees(share)),
    )


def pooled(parts: list[Frf]) -> Frf:
    """Combine estimates line by line by accuracy; the errors of two views may be the same.

    Where both disagree, one of them is wrong: what the other's share does to the mean is added to
    the band, around each line. A third view is a combination of the other two, and used where it is
    better than their mean.
    """
    if len(parts) == 1:
        return parts[0]
    first, second = parts[:2]
    a, b = (np.maximum(np.nan_to_num(p.std_db, nan=1.0), 1e-6) ** -2 for p in (first, second))
    share = a / (a + b)
    size, turn = _apart(first, second, np.minimum(share, 1.0 - share))
    response = first.response * share + second.response * (1.0 - share)
    mean = replace(
        first,
        response=np.asarray(response),
        std_db=np.hypot(first.std_db * share + second.std_db * (1.0 - share), size),
        std_deg=np.hypot(first.std_deg * share + second.std_deg * (1.0 - share), turn),
        coherence=np.maximum(first.coherence, second.coherence),
        noise=first.noise * share + second.noise * (1.0 - share),
        distortion=first.distortion * share + second.distortion * (1.0 - share),
    )
    if len(parts) == 2:
        return mean
    size, turn = _apart(parts[2], second, np.ones(share.size))
    third = replace(
        parts[2],
        std_db=np.hypot(parts[2].std_db, size),
        std_deg=np.hypot(parts[2].std_deg, turn),
    )
    return _better(mean, third)


def _apart(one: Frf, other: Frf, share: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A share of what two estimates differ by beyond their scatter, in dB and degrees."""
    apart = np.log(one.response / other.response)
    found = []
    for part, unit, names in (
        (apart.real, 20.0 / np.log(10.0), "std_db"),
        (apart.imag, np.degrees(1.0), "std_deg"),
    ):
        scatter = np.hypot(getattr(one, names), getattr(other, names))
        beyond = np.maximum((unit * part) ** 2 - scatter**2, 0.0)
        found.append(share * np.sqrt(neighbour_mean(beyond, threshold.AROUND)))
    return found[0], found[1]


def _better(one: Frf, other: Frf) -> Frf:
    """Each line from the estimate whose band is smaller there."""
    sizes = [np.hypot(np.radians(p.std_deg), p.std_db * np.log(10) / 20) for p in (one, other)]
    take = sizes[1] < sizes[0]
    names = ("response", "std_db", "std_deg", "coherence", "noise", "distortion")
    return replace(
        one, **{name: np.where(take, getattr(other, name), getattr(one, name)) for name in names}
    )


def widened(frf: Frf, factor: ComplexArray, share: float, uncertainty: ComplexArray) -> Frf:
    """Return the response with its band widened by a share of the image factor, the uncertainty and
    the smallest error.
    """
    image = np.log(factor)
    uncertainty_db = 20 / np.log(10) * np.hypot(image.real * share, uncertainty.real)
    uncertainty_deg = np.degrees(np.hypot(image.imag * share, uncertainty.imag))
    return replace(
        frf,
        std_db=np.hypot(frf.std_db, np.hypot(uncertainty_db, SYSTEMATIC_DB)),
        std_deg=np.hypot(frf.std_deg, np.hypot(uncertainty_deg, SYSTEMATIC_DEG)),
    )


def without_images(
    direct: Frf, factor: ComplexArray, jitter_s: float, uncertainty: ComplexArray
) -> Frf:
    """Return the lines without the folded images, and with the band that then remains."""
    # The correction is as uncertain as the model: a part of it stays in the band.
    return replace(
        widened(direct, factor, threshold.IMAGES_LEFT, uncertainty),
        response=np.asarray(direct.response / factor),
        valid_band_hz=valid_band_hz(
            float(direct.frequency_hz[0]), direct.sample_rate_hz, model=True, jitter_s=jitter_s
        ),
    )
