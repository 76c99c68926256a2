"""What moves an axis between the excited lines: friction, and what friction does not explain.

On a linear axis nothing but noise lies on the empty bins of a multisine. Coulomb friction puts
some there, of which its torque by the direction of motion tells how much; what is left is play in
the mechanics, or friction of another kind (Pintelon & Schoukens, *System Identification*, 2012,
section 4.4). The two act at other times: friction that is not simply Coulomb's (sticking, a
bristle's bend) does so where the speed reverses, play where the torque in the coupling does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.arrays import ComplexArray, FloatArray, IntArray, neighbour_mean
from backend.analysis.excitation import Excitation
from backend.analysis.frf import Frf
from backend.analysis.line_spectra import (
    Quantity,
    Record,
    friction_direction,
    good_periods,
    own_torque,
    period_spectra,
    speed_lag_s,
    velocity_from_position,
)
from backend.analysis.sampling import SignalPath, delay_response, reported_response

#: Empty bins that a level is taken over, to each side, and the fewest that tell anything.
_REACH, _FEWEST = 6, 12
#: What a bin that is left out may hold of what an excited one does: rounding, and nothing else.
_SILENT = 1e-3
#: Steps of an encoder that make more than this share of the motion on a line are coarse.
_COARSE = 0.005
#: Places of the axis that differ by less, relative to its way, are the same.
_ROUNDING = 1e-9
#: Play is looked for above this share of the sample rate: below, friction rules.
_LOWEST = 0.1
#: So much of the motion is too much, in any case or where friction explains none of it.
_MUCH, _SOME, _UNEXPLAINED = 0.17, 0.1, 0.9
#: About standstill: speed below this share of its deviation, and so long before and after.
_SLOW, _ABOUT_S = 0.1, 0.002
#: What is so much stronger there than elsewhere is friction; so little of the time says nothing.
_AT_REVERSALS, _LEAST_TIME = 1.4, 0.01
#: Power on the empty bins over that of the noise in it, from which on it tells of play.
_ABOVE_NOISE = 4.0


@dataclass(frozen=True)
class Distortion:
    """Motion on empty bins relative to that on the lines around; noise is taken out.

    ``share`` [lines] is what friction does not explain; ``level`` its median in the upper band,
    ``before`` the same with friction. ``at_reversals`` is how much of it, as torque, falls on
    reversals of the speed, over their share of the time. All zero where there are no empty bins.
    """

    share: FloatArray
    level: float = 0.0
    before: float = 0.0
    at_reversals: float = 0.0

    @property
    def play(self) -> bool:
        """Whether the axis is no linear one, beyond friction: it seems to have play."""
        if self.at_reversals > _AT_REVERSALS:
            return False
        left = self.level > _UNEXPLAINED * self.before
        return self.level > _MUCH or (self.level > _SOME and left)


def distortion(
    records: tuple[Record, ...], path: SignalPath, quantity: Quantity, frf: Frf
) -> Distortion:
    """From the recordings and a direct estimate of the velocity with its friction."""
    none = Distortion(np.zeros(frf.frequency_hz.size))
    e = records[0].excitation
    if e.segments or quantity == "closed_loop":
        return none
    bins = np.arange(e.lines[0], e.lines[-1] + 1)
    empty = np.setdiff1d(bins, np.append(e.lines, e.base_line))
    # A chirp and a PRBS excite bins that are not evaluated, too.
    played = np.abs(np.fft.rfft(e.one_period))
    empty = empty[played[empty] < _SILENT * np.median(played[e.lines])]
    if empty.size < _FEWEST:
        return none
    f = empty * (e.sample_rate_hz / e.period_samples)
    plant = np.exp(
        np.interp(f, frf.frequency_hz, np.log(np.abs(frf.response)))
        + 1j * np.interp(f, frf.frequency_hz, np.unwrap(np.angle(frf.response)))
    )
    placed = _coarse(records, f)
    late = delay_response(f, path.response_delay_s) if placed else reported_response(f, path)
    lag_s = speed_lag_s(records, path)
    rest, before, noise, lines, falls = [], [], [], [], []
    for record in records:
        good, _ = good_periods(record)
        if len(good) < 2:
            continue
        between = replace(record.excitation, lines=empty)
        moved = _motion(record, between, good, path, placed)
        if quantity == "torque_injection":
            own = period_spectra(own_torque(record, path), between, good)
            moved = moved - plant * late * own
        mean = moved.mean(axis=0)
        direction = friction_direction(record, between, good, path, lag_s)
        by_friction = frf.coulomb_nm * plant * late * direction
        scatter = np.sum(np.abs(moved - mean) ** 2, axis=0) / (len(good) * (len(good) - 1))
        # A motion that repeats itself repeats the steps of its encoder: that is no scatter.
        noise.append(np.maximum(scatter, _steps(record, f) if placed else 0.0))
        before.append(np.abs(mean) ** 2)
        left = mean + by_friction.mean(axis=0)
        rest.append(np.abs(left) ** 2)
        falls.append(_at_reversals(record, good, empty, left / plant))
        lines.append(np.abs(_motion(record, record.excitation, good, path, placed).mean(axis=0)))
    if not rest:
        return none
    around = np.interp(f, frf.frequency_hz, neighbour_mean(np.mean(lines, axis=0), _REACH))

    def relative(power: list[FloatArray]) -> FloatArray:
        pure = neighbour_mean(np.mean(power, axis=0) - np.mean(noise, axis=0), _REACH)
        return np.asarray(np.sqrt(np.maximum(pure, 0.0)) / around)

    share, plain = relative(rest), relative(before)
    upper = f >= _LOWEST * path.sample_rate_hz
    if np.count_nonzero(upper) < _FEWEST:
        return none
    # Where noise rules, what is left after it is taken out is noise.
    power, of_noise = (float(np.median(np.mean(p, axis=0)[upper])) for p in (rest, noise))
    if power < _ABOVE_NOISE * of_noise:
        return none
    return Distortion(
        # What lies below the first empty bins is told by all of them, not by one beside a valley.
        np.asarray(np.interp(frf.frequency_hz, f, share, left=float(np.median(share)))),
        float(np.median(share[upper])), float(np.median(plain[upper])), _ratio(falls),
    )  # fmt: skip


def _coarse(records: tuple[Record, ...], f: FloatArray) -> bool:
    """Whether an encoder's steps show beside the motion.

    The reported speed is noisier then by far than the way of a cycle.
    """
    if any(record.position is None for record in records):
        return False
    shares = []
    for record in records:
        good, _ = good_periods(record)
        e = record.excitation
        if good:
            moved = velocity_from_position(record, e, good, e.sample_rate_hz).mean(axis=0)
            shares.append(np.sqrt(np.median(_steps(record, f))) / np.median(np.abs(moved)))
    return bool(shares) and float(np.mean(shares)) > _COARSE


def _motion(
    record: Record, e: Excitation, good: list[int], path: SignalPath, placed: bool
) -> ComplexArray:
    """Spectra [periods, lines] of the velocity, as reported or by the position."""
    if placed:
        return velocity_from_position(record, e, good, path.sample_rate_hz)
    return period_spectra(record.response, e, good)


def _steps(record: Record, f: FloatArray) -> FloatArray:
    """Power [lines] that the steps of the encoder have in a velocity by the position.

    As independent errors of 1/12 of a squared step (Widrow & Kollár, *Quantization Noise*, 2008,
    chapter 4).
    """
    assert record.position is not None
    e = record.excitation
    places = np.diff(np.unique(record.position))
    # What is no step is rounding of the numbers.
    places = places[places > _ROUNDING * float(np.ptp(record.position))]
    if not places.size:
        return np.zeros(f.size)
    x = f / e.sample_rate_hz
    slope = 2.0 * e.sample_rate_hz * np.sin(np.pi * x) / np.sinc(x)
    return np.asarray(e.period_samples * float(np.min(places)) ** 2 / 12.0 * slope**2)


def _at_reversals(
    record: Record, good: list[int], bins: IntArray, torque: ComplexArray
) -> tuple[float, float]:
    """Shares of the power of a torque on these bins, and of the time, about reversals of speed."""
    e = record.excitation
    n = e.period_samples
    speed = np.mean([record.response[e.first_sample + p * n :][:n] for p in good], axis=0)
    reach = 2 * round(_ABOUT_S * e.sample_rate_hz) + 1
    slow = np.abs(speed) < _SLOW * np.std(speed)
    # The period closes upon itself.
    about = np.convolve(np.pad(slow, reach // 2, mode="wrap"), np.ones(reach), "valid") > 0.5
    spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
    spectrum[bins] = torque
    power = np.fft.irfft(spectrum, n) ** 2
    return float(np.sum(power[about]) / max(float(np.sum(power)), 1e-300)), float(np.mean(about))


def _ratio(falls: list[tuple[float, float]]) -> float:
    """Of power to time, over all records; zero where the speed hardly ever reverses."""
    power, time = np.mean(falls, axis=0)
    return float(power / time) if time > _LEAST_TIME else 0.0
