"""Response to the position of a second encoder at the load, on the lines of the motor's response.

The encoder is recorded with every sample of the sweep. Its response has the same input as that of
the motor's position, and the same excitation as instrument, so that only the output differs. Its
scale is that of the recording: while the base motion turns the axis to and fro, slower than every
line, the load follows the motor. The response is therefore that at the motor shaft, whatever gear
lies between, and whichever way the encoder counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from backend.analysis.response.frf import Frf, estimate_lines
from backend.analysis.response.signal_path.sampling import SignalPath, delay_response
from backend.analysis.signals.arrays import FloatArray
from backend.analysis.signals.line_spectra import (
    Quantity,
    Record,
    collect,
    good_periods,
    velocity_from_position,
)
from backend.analysis.thresholds import load_response as threshold


@dataclass(frozen=True)
class LoadScale:
    """``counts_per_rad`` of the motor, negative where the encoder counts backwards.

    ``deviation``: relative, by what of the encoder's motion the motor does not explain.
    """

    counts_per_rad: float
    deviation: float


def scale_of(records: Sequence[Record], counts: Sequence[FloatArray]) -> LoadScale | None:
    """Return the scale of the encoder by least squares; None where it does not follow the motor."""
    pairs = []
    for record, own in zip(records, counts, strict=True):
        place = record.position
        if place is None:
            return None
        use = np.ones(place.size, np.bool_) if record.valid is None else record.valid
        if np.count_nonzero(use) < threshold.FEWEST:
            continue
        pairs.append((place[use] - np.mean(place[use]), own[use] - np.mean(own[use])))
    if not pairs:
        return None
    motor, load = (np.concatenate(each) for each in zip(*pairs, strict=True))
    power, other = float(motor @ motor), float(load @ load)
    if not power or not other:
        return None
    slope = float(motor @ load) / power
    left = 1.0 - slope**2 * power / other
    if slope == 0.0 or left > threshold.LEFT:
        return None
    return LoadScale(slope, float(np.sqrt(max(left, 0.0))))


def load_response(
    records: tuple[Record, ...],
    places_rad: Sequence[FloatArray],
    path: SignalPath,
    quantity: Quantity,
    *,
    coulomb_nm: float,
    late_s: float,
    deviation: float,
    motor: Frf,
) -> Frf:
    """Return the response from torque to the load's speed, both at the motor shaft.

    ``places_rad`` are the load's positions [records][n] at the motor shaft, with this relative
    ``deviation`` of their scale; ``late_s`` is the delay of the motor's position. How late the
    drive reports the second encoder is not known: it remains in the phase. ``motor`` is the direct
    estimate of the motor's response. Its band contains what is uncertain of the torque and its
    path. That is common to neighbouring lines, so the narrowest of them shows it.

    Raises:
        ValueError: no period is complete.
    """
    s = collect(records, path, quantity, position=True)
    response = []
    for record, place in zip(records, places_rad, strict=True):
        good, _ = good_periods(record)
        if good:
            own = replace(record, position=place)
            e = record.excitation
            response.append(velocity_from_position(own, e, good, path.sample_rate_hz))
    found = estimate_lines(
        replace(s, response=tuple(response)), path, quantity, coulomb_nm, position=True
    )
    lines = found.frequency_hz
    found = replace(found, response=np.asarray(found.response / delay_response(lines, late_s)))
    size, turn = (
        np.interp(lines, motor.frequency_hz, scipy.ndimage.minimum_filter1d(std, threshold.NEAR))
        for std in (motor.std_db, motor.std_deg)
    )
    return replace(
        found,
        std_db=np.hypot(np.hypot(found.std_db, size), 20 / np.log(10) * deviation),
        std_deg=np.hypot(found.std_deg, turn),
    )
