"""Speed and position as two samples of one motion, with different aliasing.

Each gives an estimate of its own; both together give one without the nearest image.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.response.frf import Frf
from backend.analysis.response.signal_path.sampled_model import SampledFit
from backend.analysis.response.signal_path.sampling import SignalPath, delay_response, lag_response
from backend.analysis.response.uncertainty import Uncertainty
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.thresholds import two_signals as threshold


@dataclass(frozen=True)
class Way:
    """One estimate without delay and filter: its lines, image factor and uncertainties."""

    lines: Frf
    factor: ComplexArray
    corrected: ComplexArray
    direct: ComplexArray


def ways_of(
    velocity: Frf, position: Frf | None, path: SignalPath, fit: SampledFit, uncertainty: Uncertainty
) -> list[Way]:
    """Return estimates from the velocity, from the position where recorded, and from both together.

    ``path`` is the one that the estimates were made with: a speed filter that it does not state is
    taken from the fit.
    """
    f = velocity.frequency_hz
    late = delay_response(f, fit.delay_s)
    if path.response_bandwidth_hz is None:
        late = late * lag_response(f, fit.path.response_bandwidth_hz)
    lines = replace(velocity, response=np.asarray(velocity.response / late))
    by_speed = Way(lines, fit.image_factor(f), uncertainty.corrected[0], uncertainty.direct[0])
    if position is None:
        return [by_speed]
    late = delay_response(f, fit.position_delay_s)
    lines = replace(position, response=np.asarray(position.response / late))
    factor = fit.image_factor(f, integrated=True)
    by_place = Way(lines, factor, uncertainty.corrected[1], uncertainty.direct[1])
    return [by_speed, by_place, _without_first_image(by_speed, by_place, fit)]


def _without_first_image(velocity: Way, position: Way, fit: SampledFit) -> Way:
    """Combine both estimates with weights for which the nearest image cancels.

    Speed and position are samples of one motion with different aliasing: the image from
    f - fs is weaker in the position by f/(f - fs), in the speed by its filter. Two samples
    of one motion determine twice the band (Papoulis, IEEE Trans. Circuits Syst. 24 (1977) 652).
    """
    f = velocity.lines.frequency_hz
    folded = f - velocity.lines.sample_rate_hz
    corner = fit.path.response_bandwidth_hz
    by_speed = lag_response(folded, corner) / lag_response(f, corner)
    by_place = f / folded
    share = by_place / (by_place - by_speed)

    def mixed(a: ComplexArray, b: ComplexArray) -> ComplexArray:
        return np.asarray(share * a + (1.0 - share) * b)

    def both(a: FloatArray, b: FloatArray) -> FloatArray:
        return np.asarray(np.abs(share) * a + np.abs(1.0 - share) * b)

    one, other = velocity.lines, position.lines
    apart = threshold.NOT_QUITE * np.abs(velocity.factor - position.factor)

    def wider(a: ComplexArray, b: ComplexArray) -> ComplexArray:
        size, turn = both(a.real, b.real), both(a.imag, b.imag)
        return np.asarray(np.hypot(size, apart) + 1j * np.hypot(turn, apart))

    lines = replace(
        one,
        response=mixed(one.response, other.response),
        std_db=both(one.std_db, other.std_db),
        std_deg=both(one.std_deg, other.std_deg),
        coherence=np.maximum(one.coherence, other.coherence),
        noise=both(one.noise, other.noise),
        distortion=both(one.distortion, other.distortion),
    )
    return Way(
        lines,
        mixed(velocity.factor, position.factor),
        wider(velocity.corrected, position.corrected),
        wider(velocity.direct, position.direct),
    )
