"""Frequency response from recordings, with the excitation as instrument.

The loop around the axis is usually closed, so dividing the response by the torque is biased;
G = S_yr / S_ur is not (Pintelon & Schoukens, *System Identification*, 2012, sections 2.6, 7.2).
What the torque really was between two bus cycles is reconstructed from the sent sequence, see
:mod:`backend.analysis.sampling`. Periods with a lost cycle are left out, never interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import t as student_t

from backend.analysis.arrays import (
    BoolArray,
    ComplexArray,
    FloatArray,
    IntArray,
    magnitude_db,
    phase_deg,
)
from backend.analysis.excitation import Excitation, Segment
from backend.analysis.sampling import (
    DIRECT_SHARE,
    MODEL_SHARE,
    SignalPath,
    command_response,
    delay_response,
    hold_response,
    reported_response,
    sampled_command,
)

#: *torque_mode*: nothing but the injection makes torque. *torque_injection*: a speed or position
#: loop adds its own torque. *closed_loop*: from the loop's reference to the response.
Quantity = Literal["torque_mode", "torque_injection", "closed_loop"]


#: No line is weighed as if its noise were less than this share of an ordinary line's.
_LEAST_NOISE = 0.1
#: Friction is taken out where that leaves less than this share of the scatter.
_WORTH_TAKING = 0.9


@dataclass(frozen=True)
class Record:
    """One played excitation: ``excitation.samples`` are the sent values in units of the injection.

    ``response`` [n] is velocity or position, ``torque`` [n] the reported torque (needed for
    *torque_injection*), ``valid`` [n] False where a cycle was lost or late, ``position`` [n] the
    integral of a velocity ``response`` as the drive reports it.
    """

    excitation: Excitation
    response: FloatArray
    torque: FloatArray | None = None
    valid: BoolArray | None = None
    position: FloatArray | None = None

    def __post_init__(self) -> None:
        n = self.excitation.samples.size
        for signal in (self.response, self.torque, self.valid, self.position):
            if signal is not None and signal.shape != (n,):
                raise ValueError(f"signals must have {n} samples, as the excitation has")


@dataclass(frozen=True)
class Frf:
    """A measured response, line by line.

    ``response`` [n] complex; ``std_db``, ``std_deg`` one standard deviation such that ±1.96 of
    it covers 95 %; NaN where a single period allows no statement. ``noise`` and ``distortion``
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
        """Lines inside the valid band."""
        low, high = self.valid_band_hz
        return np.asarray((self.frequency_hz >= low) & (self.frequency_hz <= high))


def valid_band_hz(
    lowest_hz: float, sample_rate_hz: float, *, model: bool = False, jitter_s: float = 0.0
) -> tuple[float, float]:
    """Band in which an answer holds; an upper end below the lower one means "refuse".

    Sampling-time jitter of standard deviation s turns the phase by 2π·f·s; 0.05 rad of it (3°)
    is the limit on polled links.
    """
    upper = sample_rate_hz * (MODEL_SHARE if model else DIRECT_SHARE)
    if jitter_s > 0:
        upper = min(upper, 0.05 / (2 * np.pi * jitter_s))
    return lowest_hz, upper


@dataclass(frozen=True)
class _Spectra:
    """Line spectra of all good periods: arrays [m realisations][p periods, lines].

    ``torque`` is the loop's own torque, ``direction`` the direction of motion (-1 to 1) that
    Coulomb friction follows.
    """

    frequency_hz: FloatArray
    lines: IntArray
    sent: tuple[ComplexArray, ...]
    response: tuple[ComplexArray, ...]
    torque: tuple[ComplexArray, ...]
    direction: tuple[ComplexArray, ...]
    realisation: tuple[int, ...]
    samples: int
    used: int
    dropped: int


def _good_periods(record: Record) -> tuple[list[int], int]:
    """Numbers of the usable periods, and how many had to be dropped.

    A gap spoils its own period; the one after it is kept, since the axis itself saw nothing.
    """
    e = record.excitation
    if e.segments:
        return _good_halves(record)
    numbers = range(e.transient_periods, e.periods)
    if record.valid is None:
        return list(numbers), 0
    good = [
        p
        for p in numbers
        if np.all(record.valid[e.first_sample + p * e.period_samples :][: e.period_samples])
    ]
    return good, len(numbers) - len(good)


def _good_halves(record: Record) -> tuple[list[int], int]:
    """The two halves of all tones of a stepped sine count as two periods.

    A gap in one tone spoils its half for all of them: a spectrum needs every line.
    """
    if record.valid is None:
        return [0, 1], 0
    valid = record.valid
    spoiled = {
        half
        for segment in record.excitation.segments
        for half in (0, 1)
        if not np.all(valid[_half_of(segment, half)])
    }
    return [half for half in (0, 1) if half not in spoiled], len(spoiled)


def _half_of(segment: Segment, half: int) -> slice:
    length = segment.samples // 2
    return slice(segment.start + half * length, segment.start + (half + 1) * length)


def _tone_amplitudes(signal: FloatArray, e: Excitation, halves: list[int]) -> ComplexArray:
    """Amplitudes [halves, tones] of a stepped sine, least squares beside mean and drift."""
    found = np.zeros((len(halves), len(e.segments)), dtype=np.complex128)
    for i, segment in enumerate(e.segments):
        for j, half in enumerate(halves):
            cut = _half_of(segment, half)
            n = np.arange(cut.start, cut.stop)
            turn = 2 * np.pi * segment.frequency_hz * n / e.sample_rate_hz
            basis = np.column_stack([np.cos(turn), -np.sin(turn), np.ones(n.size), n - n.mean()])
            c = np.linalg.lstsq(basis, signal[n], rcond=None)[0]
            found[j, i] = c[0] + 1j * c[1]
    return found


def _period_spectra(signal: FloatArray, e: Excitation, periods: list[int]) -> ComplexArray:
    """Spectra [periods, lines], with the drift between the periods taken out.

    A drift of s per sample would leak onto every line; the difference of the means of two
    periods is exactly s·N for a periodic signal plus drift, whatever the signal is.
    """
    if e.segments:
        return _tone_amplitudes(signal, e, periods)
    n = e.period_samples
    blocks = np.array([signal[e.first_sample + p * n :][:n] for p in periods])
    if len(periods) > 1:
        means = blocks.mean(axis=1)
        drift = np.gradient(means, np.array(periods, dtype=np.float64)) / n
        blocks = blocks - drift[:, None] * np.arange(n)[None, :]
    return np.asarray(np.fft.rfft(blocks, axis=1)[:, e.lines])


def _velocity_from_position(
    record: Record, e: Excitation, periods: list[int], rate: float
) -> ComplexArray:
    """Spectra [periods, lines] of the velocity by way of the reported position.

    An axis that gains speed makes a parabola, whose curvature the velocity tells; the rest of the
    drift is the difference between two periods.
    """
    if record.position is None:
        raise ValueError("the recording has no position")
    if e.segments:
        return _tone_amplitudes(record.position, e, periods) * (2j * np.pi * e.line_hz)
    n = e.period_samples
    curvature = 0.0
    if len(periods) > 1:
        means = [float(record.response[e.first_sample + p * n :][:n].mean()) for p in periods]
        curvature = (means[-1] - means[0]) / ((periods[-1] - periods[0]) * n) / rate
    t = np.arange(record.position.size) - e.first_sample
    straight = record.position - 0.5 * curvature * t**2
    spectra = _period_spectra(np.asarray(straight), e, periods)
    return np.asarray(spectra * (2j * np.pi * e.line_hz))


def _collect(
    records: tuple[Record, ...], path: SignalPath, quantity: Quantity, *, position: bool = False
) -> _Spectra:
    first = records[0].excitation
    if first.period_samples == 0 and not first.segments:
        raise ValueError("period-synchronous estimation needs a periodic excitation, or tones")
    sent, response, torque, direction = [], [], [], []
    realisation: list[int] = []
    used = dropped = 0
    for record in records:
        e = record.excitation
        if e.period_samples != first.period_samples or not np.array_equal(e.lines, first.lines):
            raise ValueError("all realisations must share period length and lines")
        good, lost = _good_periods(record)
        used, dropped = used + len(good), dropped + lost
        if not good:
            continue
        realisation.append(e.realisation)
        sent.append(_period_spectra(e.samples, e, good))
        response.append(
            _velocity_from_position(record, e, good, path.sample_rate_hz)
            if position
            else _period_spectra(record.response, e, good)
        )
        direction.append(
            _period_spectra(_direction(record.response), e, good)
            * _centre_of_interval(e.line_hz, path.sample_rate_hz)
        )
        if quantity == "torque_injection":
            torque.append(_period_spectra(_own_torque(record, path), e, good))
    if not sent:
        raise ValueError("every period has a gap; nothing is left to evaluate")
    return _Spectra(
        first.line_hz, first.lines, tuple(sent), tuple(response), tuple(torque),
        tuple(direction), tuple(realisation), first.period_samples or 2, used, dropped,
    )  # fmt: skip


def _own_torque(record: Record, path: SignalPath) -> FloatArray:
    """The sampled torque without what the injection contributes to it: the loop's own part."""
    if record.torque is None:
        raise ValueError("torque_injection needs the reported torque")
    return record.torque - sampled_command(record.excitation.samples, path)


def _direction(velocity: FloatArray) -> FloatArray:
    """Mean sign of the velocity between each sample and the next, linear in between."""
    after = np.append(velocity[1:], velocity[-1])
    rise = after - velocity
    moving = np.abs(rise) > 1e-12
    safe = np.where(moving, rise, 1.0)
    return np.where(moving, (np.abs(after) - np.abs(velocity)) / safe, np.sign(velocity))


def _centre_of_interval(frequency_hz: FloatArray, sample_rate_hz: float) -> ComplexArray:
    """Turns a spectrum of interval means into that of the signal at the interval's start."""
    x = frequency_hz / sample_rate_hz
    return np.asarray(np.exp(-1j * np.pi * x) / np.sinc(x), dtype=np.complex128)


def _continuous_input(
    s: _Spectra, path: SignalPath, quantity: Quantity, coulomb_nm: float = 0.0,
    *, position: bool = False,
) -> list[ComplexArray]:  # fmt: skip
    """What really drove the measured quantity, per realisation [periods, lines]."""
    f = s.frequency_hz
    if quantity == "closed_loop":
        whole = hold_response(f, path.sample_rate_hz, path.hold) * delay_response(
            f, path.command_delay_s + path.response_delay_s
        )
        return [r * whole for r in s.sent]
    late = reported_response(f, path)
    if position:
        late = delay_response(f, path.response_delay_s)
    direct = command_response(f, path)
    inputs: list[ComplexArray] = [r * direct * late for r in s.sent]
    if quantity == "torque_injection":
        inputs = [u + own * late for u, own in zip(inputs, s.torque, strict=True)]
    if coulomb_nm:
        # The direction comes from the reported velocity and is late already.
        ahead = late / reported_response(f, path)
        inputs = [u - coulomb_nm * ahead * d for u, d in zip(inputs, s.direction, strict=True)]
    return inputs


def _instrument_estimate(
    s: _Spectra, inputs: list[ComplexArray]
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """S_yr / S_ur with both cross spectra, from the means over periods."""
    r_mean = [r.mean(axis=0) for r in s.sent]
    pairs = zip(s.response, r_mean, strict=True)
    s_yr = np.asarray(sum(y.mean(axis=0) * r.conj() for y, r in pairs))
    s_ur = np.asarray(sum(u.mean(axis=0) * r.conj() for u, r in zip(inputs, r_mean, strict=True)))
    return np.asarray(s_yr / s_ur), s_yr, s_ur


def _estimate_coulomb(s: _Spectra, path: SignalPath, quantity: Quantity) -> float:
    """Coulomb friction that best explains the scatter between realisations.

    Friction is the one nonlinearity every axis has. Subtracting Tc·sign(v) from the torque
    leaves the linear mechanics; Tc is where the error, as torque, summed over all lines is
    smallest. Zero where realisations do not suffice or nothing is gained.
    """
    if len(s.sent) < 2:
        return 0.0
    plain = _continuous_input(s, path, quantity)
    limit = float(
        max(np.median(np.abs(u)) for u in plain) / s.samples * 2.0 * np.sqrt(s.lines.size)
    )
    # Alike first, since friction shows best where its lines are many; behind a coarse encoder
    # the upper lines are mostly noise, and drown it.
    for weight in (np.ones(s.frequency_hz.size), _torque_weight(s, plain)):
        found = minimize_scalar(
            _scatter, bounds=(0.0, limit), method="bounded", args=(s, plain, weight)
        )
        if found.fun < _WORTH_TAKING * _scatter(0.0, s, plain, weight):
            return float(found.x)
    return 0.0


def _scatter(
    coulomb_nm: float, s: _Spectra, plain: list[ComplexArray], weight: FloatArray
) -> float:
    """What no linear mechanics explain with this friction taken out, as torque."""
    inputs = [u - coulomb_nm * d for u, d in zip(plain, s.direction, strict=True)]
    g, _, _ = _instrument_estimate(s, inputs)
    errors = np.array(
        [y.mean(axis=0) / g - u.mean(axis=0) for y, u in zip(s.response, inputs, strict=True)]
    )
    return float(np.sum(np.abs(errors) ** 2 * weight))


def _torque_weight(s: _Spectra, inputs: list[ComplexArray]) -> FloatArray:
    """One over the noise variance of each line as a torque; alike where one period tells none."""
    g, _, _ = _instrument_estimate(s, inputs)
    errors = [y / g - u for y, u in zip(s.response, inputs, strict=True)]
    freedom = s.used - len(errors)
    if freedom == 0:
        return np.ones(g.size)
    noise = np.sum([np.sum(np.abs(e - e.mean(axis=0)) ** 2, axis=0) for e in errors], axis=0)
    noise = _neighbour_mean(noise / freedom, 3)
    return np.asarray(1.0 / (noise + _LEAST_NOISE * np.median(noise)))


def _neighbour_mean(x: FloatArray, reach: int) -> FloatArray:
    """Mean over a line and ``reach`` lines on each side (fewer at the ends)."""
    width = 2 * reach + 1
    kernel = np.ones(width)
    return np.asarray(
        np.convolve(x, kernel, "same")[: x.size]
        / np.convolve(np.ones(x.size), kernel, "same")[: x.size]
        if x.size >= width
        else np.full(x.size, np.mean(x))
    )


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
    """Period-synchronous estimate over all realisations and periods.

    With ``position`` the velocity is taken from the records' position: no speed filter lies in
    the way, images arrive weaker, and the noise is that of the encoder.

    ``coulomb_nm`` is friction whose torque is subtracted (units of the torque; the response must
    then be a velocity); None estimates it from the data.

    Scatter between periods is noise; scatter between realisations beyond that is nonlinear
    distortion (Pintelon & Schoukens section 4.3, "robust method"). Variances are pooled over
    ``smooth_lines`` neighbours on each side to gain degrees of freedom.
    """
    s = _collect(records, path, quantity, position=position)
    if coulomb_nm is None:
        coulomb_nm = 0.0 if quantity == "closed_loop" else _estimate_coulomb(s, path, quantity)
    inputs = _continuous_input(s, path, quantity, coulomb_nm, position=position)
    g, _, s_ur = _instrument_estimate(s, inputs)
    # What friction did to the answer is known to about a third only; that is charged to the band.
    plain = _instrument_estimate(s, _continuous_input(s, path, quantity, position=position))[0]
    doubt = 0.35 * np.log(g / plain)
    power = np.asarray(sum(np.abs(r.mean(axis=0)) ** 2 for r in s.sent))
    noise_var, total_var, freedom = _variances(s, inputs, g, smooth_lines)
    relative = total_var * power / np.abs(g * s_ur) ** 2
    spread = float(student_t.ppf(0.975, max(freedom, 1)) / 1.96) if freedom else float("nan")
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
        std_db=20 / np.log(10) * np.hypot(one_sided, np.abs(doubt.real)),
        std_deg=np.degrees(np.hypot(one_sided, np.abs(doubt.imag))),
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
    )


def _variances(
    s: _Spectra, inputs: list[ComplexArray], g: ComplexArray, reach: int
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
        noise = _neighbour_mean(np.asarray(inner) / noise_freedom, reach)
    width = min(2 * reach + 1, g.size)
    if count > 1:
        # A pair of opposite sign shares its phases and so its odd distortion: it is one draw.
        aligned = np.array(
            [m * r.mean(axis=0).conj() for m, r in zip(means, s.sent, strict=True)]
        ) / np.maximum([np.abs(r.mean(axis=0)) for r in s.sent], 1e-300)
        names = np.array(s.realisation)
        draws = np.unique(names) if np.unique(names).size > 1 else np.arange(count)
        rows = names if np.unique(names).size > 1 else draws
        groups = np.array([aligned[rows == d].mean(axis=0) for d in draws])
        scatter = np.sum(np.abs(groups) ** 2, axis=0) / (len(draws) - 1) * (count / len(draws))
        # Few draws can look quieter than the noise between periods says they are.
        total = np.fmax(_neighbour_mean(scatter, reach), noise * count / s.used)
        return noise, total, 2 * (len(draws) - 1) * width
    return noise, noise * count / s.used, 2 * noise_freedom * width


def estimate_aperiodic(
    records: tuple[Record, ...],
    path: SignalPath,
    quantity: Quantity,
    *,
    segment_samples: int,
    f_min_hz: float,
    f_max_hz: float,
    jitter_s: float = 0.0,
) -> Frf:
    """Welch's averaged cross spectra (IEEE Trans. AU-15 (1967) 70) with the same instrument.

    For chirps and anything without periods; Hann windows with half overlap. Segments with a gap
    are left out.
    """
    window = np.hanning(segment_samples + 1)[:-1]
    f = np.fft.rfftfreq(segment_samples, 1.0 / path.sample_rate_hz)
    keep = (f >= f_min_hz) & (f <= f_max_hz) & (f > 0)
    if not np.any(keep):
        raise ValueError("no frequency of the segments lies in the wanted band")
    sent: list[ComplexArray] = []
    response: list[ComplexArray] = []
    torque: list[ComplexArray] = []
    dropped = 0
    for record in records:
        own = np.zeros_like(record.response)
        if quantity == "torque_injection":
            own = _own_torque(record, path)
        last = record.response.size - segment_samples
        for start in range(0, last + 1, segment_samples // 2):
            piece = slice(start, start + segment_samples)
            if record.valid is not None and not np.all(record.valid[piece]):
                dropped += 1
                continue
            for store, signal in (
                (sent, record.excitation.samples),
                (response, record.response),
                (torque, own),
            ):
                store.append(np.fft.rfft(window * (signal[piece] - signal[piece].mean()))[keep])
    if not sent:
        raise ValueError("no whole segment without a gap; record longer or shorten the segments")
    f = f[keep]
    lines = np.flatnonzero(keep).astype(np.int64)
    r, y = np.array(sent), np.array(response)
    spectra = _Spectra(
        f, lines, (r,), (y,), (np.array(torque),), (), (0,), segment_samples, len(sent), dropped
    )
    u = _continuous_input(spectra, path, quantity)[0]
    s_yr = np.sum(y * r.conj(), axis=0)
    s_ur = np.sum(u * r.conj(), axis=0)
    coherence = np.abs(s_yr) ** 2 / np.maximum(
        np.sum(np.abs(r) ** 2, axis=0) * np.sum(np.abs(y) ** 2, axis=0), 1e-300
    )
    # Bendat & Piersol, table 9.6; Hann segments with half overlap count 0.53 each (Welch).
    averages = max(1.0, 0.53 * len(sent))
    one_sided = np.sqrt(np.maximum(1 - coherence, 1e-12) / (2 * coherence * averages))
    error = y - (s_yr / s_ur) * u
    return Frf(
        frequency_hz=f,
        response=np.asarray(s_yr / s_ur, dtype=np.complex128),
        std_db=np.asarray(20 / np.log(10) * one_sided),
        std_deg=np.asarray(np.degrees(one_sided)),
        coherence=np.asarray(coherence),
        noise=np.sqrt(np.mean(np.abs(error) ** 2, axis=0)) * 2 / np.sum(window),
        distortion=np.full(f.shape, np.nan),
        sample_rate_hz=path.sample_rate_hz,
        valid_band_hz=valid_band_hz(float(f[0]), path.sample_rate_hz, jitter_s=jitter_s),
        periods_used=len(sent),
        periods_dropped=dropped,
    )


def estimate_stepped(record: Record, path: SignalPath, quantity: Quantity) -> Frf:
    """One complex amplitude per tone of a stepped sine; the halves of a tone give the spread."""
    e = record.excitation
    f = np.array([segment.frequency_hz for segment in e.segments])
    if f.size == 0:
        raise ValueError("the excitation has no tones")
    own = np.zeros_like(record.response)
    if quantity == "torque_injection":
        own = _own_torque(record, path)
    r, y, t = (_tone_amplitudes(x, e, [0, 1]) for x in (e.samples, record.response, own))
    spectra = _Spectra(f, np.arange(f.size), (r,), (y,), (t,), (), (0,), 2, 2, 0)
    u = _continuous_input(spectra, path, quantity)[0]
    g = np.asarray(y.sum(axis=0) / u.sum(axis=0))
    relative = np.abs(y[0] / u[0] - y[1] / u[1]) / (2 * np.abs(g))
    spread = float(student_t.ppf(0.975, 2) / 1.96) / np.sqrt(2)
    cross = np.abs(np.sum(y * r.conj(), axis=0)) ** 2
    powers = np.sum(np.abs(y) ** 2, axis=0) * np.sum(np.abs(r) ** 2, axis=0)
    return Frf(
        frequency_hz=f,
        response=g,
        std_db=20 / np.log(10) * relative * spread,
        std_deg=np.degrees(relative * spread),
        coherence=np.asarray(cross / np.maximum(powers, 1e-300)),
        noise=np.abs(y[0] - y[1]) / 2,
        distortion=np.full(f.shape, np.nan),
        sample_rate_hz=path.sample_rate_hz,
        valid_band_hz=valid_band_hz(float(f.min()), path.sample_rate_hz),
        periods_used=f.size,
        periods_dropped=0,
    )


def empty_line_levels(record: Record) -> tuple[float, float]:
    """RMS amplitude on the empty even and the empty odd bins between the excited lines.

    With an odd-only multisine these are even- and odd-order distortion plus noise, in units of
    the response signal (Pintelon & Schoukens section 4.4). NaN where there are no such bins.
    """
    e = record.excitation
    good, _ = _good_periods(record)
    bins = np.arange(e.lines[0], e.lines[-1] + 1)
    empty = np.setdiff1d(bins, np.append(e.lines, e.base_line))
    spectrum = _period_spectra(record.response, replace(e, lines=empty), good)
    level = np.abs(spectrum.mean(axis=0)) * 2.0 / e.period_samples

    def rms(selected: FloatArray) -> float:
        return float(np.sqrt(np.mean(selected**2))) if selected.size else float("nan")

    return rms(level[empty % 2 == 0]), rms(level[empty % 2 == 1])


def mean_spectra(
    records: tuple[Record, ...],
) -> tuple[FloatArray, FloatArray, ComplexArray, ComplexArray]:
    """Lines in Hz, and cross spectra with the injection of itself, the torque and the velocity.

    Sums over the records' means; torque as reported, nothing taken from it.
    """
    parts = []
    for record in records:
        e = record.excitation
        good, _ = _good_periods(record)
        if not good or record.torque is None:
            continue
        r, t, v = (
            _period_spectra(signal, e, good).mean(axis=0)
            for signal in (e.samples, record.torque, record.response)
        )
        parts.append(np.array([r, t, v]) * r.conj())
    if not parts:
        raise ValueError("every period has a gap; nothing is left to evaluate")
    r, t, v = np.sum(parts, axis=0)
    return records[0].excitation.line_hz, np.asarray(r.real), np.asarray(t), np.asarray(v)


def loop_spectra(
    records: tuple[Record, ...], path: SignalPath
) -> tuple[ComplexArray, ComplexArray]:
    """Cross spectra with the injection of the loop's own torque and of the velocity, per line."""
    s = _collect(records, path, "torque_injection")
    sent = [r.mean(axis=0).conj() for r in s.sent]
    own = sum(t.mean(axis=0) * r for t, r in zip(s.torque, sent, strict=True))
    velocity = sum(y.mean(axis=0) * r for y, r in zip(s.response, sent, strict=True))
    return np.asarray(own), np.asarray(velocity)
