"""Motion of an axis between the excited lines: by friction, and what friction does not explain.

On a linear axis the empty bins of a multisine contain only noise. Coulomb friction causes motion
there, which is calculated from its torque by the direction of motion; the rest is backlash, or
friction of another kind (Pintelon & Schoukens, *System Identification*, 2012, section 4.4). The two
differ in time: friction other than Coulomb's (sticking, bristle deflection) acts where the speed
reverses, backlash where the torque in the coupling reverses.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backend.analysis.response.frf import Frf
from backend.analysis.response.signal_path.sampling import (
    SignalPath,
    delay_response,
    reported_response,
)
from backend.analysis.signals.arrays import (
    BoolArray,
    ComplexArray,
    FloatArray,
    IntArray,
    neighbour_mean,
)
from backend.analysis.signals.excitation import Excitation
from backend.analysis.signals.line_spectra import (
    Quantity,
    Record,
    friction_direction,
    good_periods,
    own_torque,
    period_spectra,
    speed_lag_s,
    velocity_from_position,
)
from backend.analysis.thresholds import distortion as threshold


@dataclass(frozen=True)
class Detected:
    """Median motion on empty lines between odd ones, relative to that on the neighbouring lines.

    Even or odd nonlinearities excited by odd lines cause motion on even or on odd ones (Pintelon &
    Schoukens, section 4.3). ``even`` and ``odd`` exclude the ``noise`` that is left in the mean
    over the periods, but include friction.
    """

    even: float
    odd: float
    noise: float


@dataclass(frozen=True)
class Distortion:
    """Motion on empty bins relative to that on the neighbouring lines, without noise.

    ``share`` [lines] is what friction does not explain; ``level`` its median in the upper band,
    ``before`` the same with friction. ``at_reversals`` is the share of its power, as torque, that
    falls on reversals of the speed, over their share of the time. All zero where there are no empty
    bins.
    """

    share: FloatArray
    level: float = 0.0
    before: float = 0.0
    at_reversals: float = 0.0
    detected: Detected | None = None

    @property
    def play(self) -> bool:
        """Whether the axis is nonlinear beyond friction, as with backlash."""
        if self.at_reversals > threshold.AT_REVERSALS:
            return False
        left = self.level > threshold.UNEXPLAINED * self.before
        return self.level > threshold.MUCH or (self.level > threshold.SOME and left)


def distortion(
    records: tuple[Record, ...], path: SignalPath, quantity: Quantity, frf: Frf
) -> Distortion:
    """Evaluate the recordings with a direct estimate of the velocity and its friction."""
    none = Distortion(np.zeros(frf.frequency_hz.size))
    e = records[0].excitation
    if e.segments or quantity == "closed_loop":
        return none
    bins = np.arange(e.lines[0], e.lines[-1] + 1)
    empty = np.setdiff1d(bins, np.append(e.lines, e.base_line))
    # A chirp and a PRBS also excite bins that are not evaluated.
    played = np.abs(np.fft.rfft(e.one_period))
    empty = empty[played[empty] < threshold.SILENT * np.median(played[e.lines])]
    if empty.size < threshold.FEWEST:
        return none
    f = empty * (e.sample_rate_hz / e.period_samples)
    plant = np.exp(
        np.interp(f, frf.frequency_hz, np.log(np.abs(frf.response)))
        + 1j * np.interp(f, frf.frequency_hz, np.unwrap(np.angle(frf.response)))
    )
    lag_s = speed_lag_s(records, path)
    ways = [_Way(reported_response(f, path), False)]
    if all(record.position is not None for record in records):
        ways.append(_Way(delay_response(f, path.response_delay_s), True))
    rest, before, noise, lines, falls = [], [], [], [], []
    for record in records:
        good, _ = good_periods(record)
        if len(good) < 2:
            continue
        between = replace(record.excitation, lines=empty)
        own = 0.0
        if quantity == "torque_injection":
            own = plant * period_spectra(own_torque(record, path), between, good)
        friction = frf.coulomb_nm * plant * friction_direction(record, between, good, path, lag_s)
        seen = [way.seen(record, between, good, path, own, friction) for way in ways]
        sizes = [float(np.median(np.abs(one.left))) for one in seen]
        least = seen[-1] if sizes[-1] < threshold.CONTRADICTED * sizes[0] else seen[0]
        noise.append(least.noise)
        before.append(np.abs(least.plain) ** 2)
        rest.append(np.abs(least.left) ** 2)
        falls.append(_at_reversals(record, good, empty, least.left / plant))
        lines.append(np.abs(period_spectra(record.response, record.excitation, good).mean(axis=0)))
    if not rest:
        return none
    around = np.interp(f, frf.frequency_hz, neighbour_mean(np.mean(lines, axis=0), threshold.REACH))

    def relative(power: list[FloatArray]) -> FloatArray:
        pure = neighbour_mean(np.mean(power, axis=0) - np.mean(noise, axis=0), threshold.REACH)
        return np.asarray(np.sqrt(np.maximum(pure, 0.0)) / around)

    share, plain = relative(rest), relative(before)
    detected = None
    if np.all(e.lines % 2 == 1):
        powers = (np.mean(before, axis=0), np.mean(noise, axis=0))
        detected = _detected(empty, powers[0], powers[1], around)
    upper = f >= threshold.LOWEST * path.sample_rate_hz
    if np.count_nonzero(upper) < threshold.FEWEST:
        return none
    # Where noise dominates, the residual after subtracting it is noise, too.
    highest = f >= threshold.HIGHEST * path.sample_rate_hz
    if not _stands_out(rest, noise, upper, threshold.ABOVE_NOISE):
        if not _stands_out(rest, noise, highest, threshold.FAR_ABOVE_NOISE):
            quiet = np.asarray(np.interp(frf.frequency_hz, f, share))
            return Distortion(quiet, detected=detected)
        upper = highest
    return Distortion(
        # Below the first empty bins use the median of all: a single one may lie next to a valley.
        np.asarray(np.interp(frf.frequency_hz, f, share, left=float(np.median(share)))),
        float(np.median(share[upper])),
        float(np.median(plain[upper])),
        _ratio(falls),
        detected,
    )


def _detected(
    empty: IntArray, power: FloatArray, noise: FloatArray, around: FloatArray
) -> Detected | None:
    """Detect from powers [bins]; None where too few bins of either parity are empty."""
    shares = []
    for parity in (0, 1):
        use = empty % 2 == parity
        if np.count_nonzero(use) < threshold.FEWEST:
            return None
        # The power of single bins has two degrees of freedom, so its median is not its mean.
        pure = neighbour_mean(power[use] - noise[use], threshold.REACH) / around[use] ** 2
        shares.append(float(np.sqrt(max(float(np.median(pure)), 0.0))))
    return Detected(shares[0], shares[1], float(np.sqrt(np.median(noise / around**2))))


def _stands_out(
    rest: list[FloatArray], noise: list[FloatArray], use: BoolArray, factor: float
) -> bool:
    """Whether the residual on these bins exceeds the noise."""
    if np.count_nonzero(use) < threshold.FEWEST:
        return False
    power, of_noise = (float(np.median(np.mean(p, axis=0)[use])) for p in (rest, noise))
    return power >= factor * of_noise


@dataclass(frozen=True)
class _Seen:
    """One record on the empty bins: without the loop's torque, and without friction as well."""

    plain: ComplexArray
    left: ComplexArray
    noise: FloatArray


@dataclass(frozen=True)
class _Way:
    """Signal that the motion is read from: reported speed or position.

    A motion appears in both; what appears in only one of them is noise of that signal. Behind a
    coarse encoder the reported speed is far noisier than the travel per cycle, and a position that
    is reported in coarse units noisier than the speed.
    """

    late: ComplexArray
    placed: bool

    def seen(
        self,
        record: Record,
        between: Excitation,
        good: list[int],
        path: SignalPath,
        own: ComplexArray | float,
        friction: ComplexArray,
    ) -> _Seen:
        """Return the spectra; ``own`` [periods, bins]: motion by the loop's torque, ``friction``:
        motion by friction.
        """
        if self.placed:
            moved = velocity_from_position(record, between, good, path.sample_rate_hz)
        else:
            moved = period_spectra(record.response, between, good)
        moved = moved - self.late * own
        mean = moved.mean(axis=0)
        scatter = np.sum(np.abs(moved - mean) ** 2, axis=0) / (len(good) * (len(good) - 1))
        if self.placed:
            # A periodic motion repeats its quantisation errors, so that they do not appear as
            # scatter.
            scatter = np.maximum(scatter, _steps(record, between.line_hz))
        left = mean + self.late * friction.mean(axis=0)
        return _Seen(np.asarray(mean), np.asarray(left), np.asarray(scatter))


def _steps(record: Record, f: FloatArray) -> FloatArray:
    """Power [lines] of the encoder's quantisation in a velocity derived from the position.

    As independent errors of 1/12 of a squared step (Widrow & Kollár, *Quantization Noise*, 2008,
    chapter 4).
    """
    assert record.position is not None
    e = record.excitation
    places = np.diff(np.unique(record.position))
    # Smaller differences are rounding of the numbers, not steps of the encoder.
    places = places[places > threshold.ROUNDING * float(np.ptp(record.position))]
    if not places.size:
        return np.zeros(f.size)
    x = f / e.sample_rate_hz
    slope = 2.0 * e.sample_rate_hz * np.sin(np.pi * x) / np.sinc(x)
    return np.asarray(e.period_samples * float(np.min(places)) ** 2 / 12.0 * slope**2)


def _at_reversals(
    record: Record, good: list[int], bins: IntArray, torque: ComplexArray
) -> tuple[float, float]:
    """Shares of a torque's power on these bins, and of the time, near reversals of speed."""
    e = record.excitation
    n = e.period_samples
    speed = np.mean([record.response[e.first_sample + p * n :][:n] for p in good], axis=0)
    reach = 2 * round(threshold.ABOUT_S * e.sample_rate_hz) + 1
    slow = np.abs(speed) < threshold.SLOW * np.std(speed)
    # The period is cyclic.
    about = np.convolve(np.pad(slow, reach // 2, mode="wrap"), np.ones(reach), "valid") > 0.5
    spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
    spectrum[bins] = torque
    power = np.fft.irfft(spectrum, n) ** 2
    return float(np.sum(power[about]) / max(float(np.sum(power)), 1e-300)), float(np.mean(about))


def _ratio(falls: list[tuple[float, float]]) -> float:
    """Ratio of power to time, over all records; zero where the speed hardly ever reverses."""
    power, time = np.mean(falls, axis=0)
    return float(power / time) if time > threshold.LEAST_TIME else 0.0
