"""The reported speed (606Ch) as evidence of the motion, beside the reported position (6064h).

The travel is the integral of the true speed by definition. A speed that is another function of it
than a delay and one lag (a mean over a time of its own, an observer, two filters) contradicts it:
no mechanics explain both. Then the position alone is used, and a speed is derived from it where one
is needed in time.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from backend.analysis.mechanics.identification.model_fit import Solution
from backend.analysis.response.frf import Frf
from backend.analysis.response.signal_path.sampling import (
    DIRECT_SHARE,
    SignalPath,
    lag_response,
)
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.signals.line_spectra import Record
from backend.analysis.thresholds import model_fit
from backend.analysis.thresholds import reported_speed as threshold

#: Corners of a lag between both signals that are tried: those that a fit may have.
_CORNERS_HZ = np.geomspace(100.0, 20_000.0, 40)


def with_position_speed(record: Record) -> Record:
    """Return the record with the derivative of its position as the speed.

    Raises:
        ValueError: the recording has no position.
    """
    if record.position is None:
        raise ValueError("the recording has no position")
    speed = derivative(record.position, record.excitation.sample_rate_hz)
    return replace(record, response=speed)


def derivative(place: FloatArray, rate_hz: float) -> FloatArray:
    """Return the derivative of a band-limited signal at its samples."""
    # The travel between both ends is not periodic and would fold into them.
    ends = np.linspace(place[0], place[-1], place.size)
    fine = scipy.signal.resample_poly(place - ends, threshold.FINER, 1, window=("kaiser", 8.0))
    slope = np.gradient(fine)[:: threshold.FINER] * threshold.FINER
    return np.asarray((slope + ends[1] - ends[0]) * rate_hz)


def without_weight(frf: Frf) -> Frf:
    """Return an estimate whose lines are stated as unknown, so that another estimate decides."""
    unknown = np.full(frf.frequency_hz.size, threshold.UNKNOWN_DB)
    return replace(frf, std_db=unknown, std_deg=unknown)


def signals_differ(velocity: Frf, position: Frf, path: SignalPath) -> bool:
    """Whether speed and position differ by clearly more than a delay and one lag, without a model.

    Images are neglected: it only decides what is tried first.
    """
    f = velocity.frequency_hz
    use = np.asarray(
        (f <= DIRECT_SHARE * path.sample_rate_hz)
        & (velocity.coherence > threshold.COHERENT)
        & (position.coherence > threshold.COHERENT)
    )
    if np.count_nonzero(use) < threshold.FEW:
        return False
    f, ratio = f[use], velocity.response[use] / position.response[use]
    # An estimate is free of a known filter of the speed.
    corners: list[float | None] = [None]
    if path.response_bandwidth_hz is None:
        corners += [float(hz) for hz in _CORNERS_HZ]
    left = min(_without_delay(ratio / lag_response(f, hz), f) for hz in corners)
    return left > threshold.UNEXPLAINED / threshold.CLEARLY


def _without_delay(ratio: ComplexArray, f: FloatArray) -> float:
    """Median size of the logarithm of a ratio [lines] without the delay that fits it best."""
    logs = np.log(np.abs(ratio)) + 1j * np.unwrap(np.angle(ratio))
    late = float(f @ logs.imag / (f @ f))
    return float(np.median(np.abs(logs - 1j * late * f)))


def surely_contradicts(both: Solution, alone: Solution) -> bool:
    """Whether `speed_contradicts` for any mechanics: ``both`` begun from those of ``alone``.

    The misfits of speed and position differ, line by line, by the ratio of the two signals, in
    which mechanics cancel but for their images. With any mechanics one of the two is therefore left
    with half of that difference at least, whichever it is.
    """
    values, _ = both.problem.logs(both.x)
    if len(values) < 2:
        return False
    use = np.min([view.weight for view in both.problem.views[:2]], axis=0) > 0.0
    if np.count_nonzero(use) < threshold.FEW:
        return False
    least = 0.5 * float(np.median(np.abs(values[0] - values[1])[use]))
    noise = _left(both)[0][1]
    by_place = _left(alone)[-1][0]
    unexplained = max(threshold.UNEXPLAINED, threshold.ABOVE_NOISE * noise)
    return least > unexplained and by_place < threshold.CLEARLY * least


def speed_suspect(solution: Solution) -> bool:
    """Whether mechanics that were fitted to speed and position leave one of them unexplained."""
    left = _left(solution)
    return len(left) > 1 and any(
        misfit > max(threshold.EXPLAINED, threshold.ABOVE_NOISE * noise) for misfit, noise in left
    )


def speed_contradicts(both: Solution, alone: Solution) -> bool:
    """Whether the position is explained much better ``alone`` than with the speed, or the speed not
    at all.

    What explains neither (backlash, friction) does not speak against the speed.
    """
    (by_speed, noise), (with_speed, _) = _left(both)[:2]
    by_place = _left(alone)[-1][0]
    unexplained = max(threshold.UNEXPLAINED, threshold.ABOVE_NOISE * noise)
    return by_place < threshold.CLEARLY * with_speed or (
        by_speed > unexplained and by_place < threshold.CLEARLY * by_speed
    )


def _left(solution: Solution) -> list[tuple[float, float]]:
    """Median misfit and median noise (relative) of each view, the position last."""
    values, _ = solution.problem.logs(solution.x)
    found = []
    for value, view in zip(values, solution.problem.views, strict=True):
        use = view.weight > 0.0
        if not np.any(use):
            found.append((np.inf, np.inf))
            continue
        # Weights are limited by a floor, which is no noise.
        variance = view.weight[use] ** -2.0 - model_fit.FLOOR**2
        noise = float(np.sqrt(np.median(np.maximum(variance, 0.0))))
        found.append((float(np.median(np.abs(value[use]))), noise))
    return found
