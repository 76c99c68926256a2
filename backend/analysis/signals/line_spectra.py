"""Recordings as spectra on the excited lines, and the input that actually drove the axis.

The torque between two bus cycles is reconstructed from the sent sequence, see
:mod:`backend.analysis.response.signal_path.sampling`. Periods with a lost cycle are left
out, never interpolated.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import scipy

from backend.analysis.response.signal_path.sampling import (
    SignalPath,
    command_response,
    delay_response,
    hold_response,
    reported_response,
    sampled_command,
)
from backend.analysis.signals.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from backend.analysis.signals.excitation import Excitation, Segment
from backend.analysis.thresholds import line_spectra as threshold

#: *torque_mode*: the injection is the only source of torque. *torque_injection*: a speed or
#: position loop adds its own torque. *closed_loop*: from the loop's reference to the response.
Quantity = Literal["torque_mode", "torque_injection", "closed_loop"]


@dataclass(frozen=True)
class Record:
    """One recorded excitation: ``excitation.samples`` are the sent values in units of the
    injection.

    ``response`` [n] is velocity or position, ``torque`` [n] the reported torque (needed for
    *torque_injection*), ``valid`` [n] False where a cycle was lost or late, ``position`` [n] the
    integral of a velocity ``response`` as the drive reports it. ``known_direction`` [n] is the mean
    true direction of motion between each sample and the next, where it is known better than from
    the speed.
    """

    excitation: Excitation
    response: FloatArray
    torque: FloatArray | None = None
    valid: BoolArray | None = None
    position: FloatArray | None = None
    known_direction: FloatArray | None = None
    _directions: dict[float, FloatArray] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        n = self.excitation.samples.size
        for signal in (
            self.response,
            self.torque,
            self.valid,
            self.position,
            self.known_direction,
        ):
            if signal is not None and signal.shape != (n,):
                raise ValueError(f"signals must have {n} samples, as the excitation has")

    def direction(self, lag_s: float) -> FloatArray:
        """Return the mean direction of motion between each sample and the next [n], -1 to 1.

        ``lag_s`` is the lag of the response, a velocity. Results are cached by lag.
        """
        key = round(lag_s, 7)
        if key not in self._directions:
            rate = self.excitation.sample_rate_hz
            self._directions[key] = _direction(self.response, key, rate)
        return self._directions[key]


@dataclass(frozen=True)
class LineSpectra:
    """Line spectra of all good periods: arrays [m realisations][p periods, lines].

    ``torque`` is the loop's own torque (for *closed_loop* the whole torque, where it was recorded),
    ``direction`` the true direction of motion (-1 to 1) that determines Coulomb friction; the
    reported speed lags behind it.
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


def good_periods(record: Record) -> tuple[list[int], int]:
    """Return the numbers of the usable periods, and how many had to be dropped.

    A gap spoils its own period only; the next one is kept, since the axis itself was not disturbed.
    A position is differenced from each sample to the next, so the sample after a period is needed
    too.
    """
    e = record.excitation
    if e.segments:
        return _good_halves(record)
    numbers = range(e.transient_periods, e.periods)
    if record.valid is None:
        return list(numbers), 0
    more = 0 if record.position is None else 1
    good = [
        p
        for p in numbers
        if np.all(record.valid[e.first_sample + p * e.period_samples :][: e.period_samples + more])
    ]
    return good, len(numbers) - len(good)


def _good_halves(record: Record) -> tuple[list[int], int]:
    """Usable halves: the two halves of all tones of a stepped sine count as two periods.

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


def tone_amplitudes(signal: FloatArray, e: Excitation, halves: list[int]) -> ComplexArray:
    """Return amplitudes [halves, tones] of a stepped sine, fitted together with mean and drift."""
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


def period_spectra(signal: FloatArray, e: Excitation, periods: list[int]) -> ComplexArray:
    """Return the spectra [periods, lines], with the drift between the periods removed.

    A drift of s per sample would leak onto every line; the difference of the means of two
    periods is exactly s·N for a periodic signal plus drift, whatever the signal is.
    """
    if e.segments:
        return tone_amplitudes(signal, e, periods)
    n = e.period_samples
    blocks = np.array([signal[e.first_sample + p * n :][:n] for p in periods])
    if len(periods) > 1:
        means = blocks.mean(axis=1)
        drift = np.gradient(means, np.array(periods, dtype=np.float64)) / n
        blocks = blocks - drift[:, None] * np.arange(n)[None, :]
    return np.asarray(np.fft.rfft(blocks, axis=1)[:, e.lines])


def velocity_from_position(
    record: Record, e: Excitation, periods: list[int], rate: float
) -> ComplexArray:
    """Return the spectra [periods, lines] of the velocity derived from the reported position.

    The transform is taken of the travel between successive samples, which is exactly the mean
    velocity between them. A position that ends elsewhere than it began would leak onto every line.

    Raises:
        ValueError: the recording has no position.
    """
    if record.position is None:
        raise ValueError("the recording has no position")
    if e.segments:
        return tone_amplitudes(record.position, e, periods) * (2j * np.pi * e.line_hz)
    mean = np.diff(record.position, append=record.position[-1]) * rate
    spectra = period_spectra(mean, e, periods)
    return np.asarray(spectra * _centre_of_interval(e.line_hz, rate))


def collect(
    records: tuple[Record, ...], path: SignalPath, quantity: Quantity, *, position: bool = False
) -> LineSpectra:
    """Return the spectra of all good periods; ``position``: with the velocity from the position.

    Raises:
        ValueError: no period is complete, or the records do not belong together.
    """
    first = records[0].excitation
    if first.period_samples == 0 and not first.segments:
        raise ValueError("period-synchronous estimation needs a periodic excitation, or tones")
    sent, response, torque, direction = [], [], [], []
    realisation: list[int] = []
    used = dropped = 0
    lag_s = speed_lag_s(records, path)
    for record in records:
        e = record.excitation
        if e.period_samples != first.period_samples or not np.array_equal(e.lines, first.lines):
            raise ValueError("all realisations must share period length and lines")
        good, lost = good_periods(record)
        used, dropped = used + len(good), dropped + lost
        if not good:
            continue
        realisation.append(e.realisation)
        sent.append(period_spectra(e.samples, e, good))
        response.append(
            velocity_from_position(record, e, good, path.sample_rate_hz)
            if position
            else period_spectra(record.response, e, good)
        )
        direction.append(friction_direction(record, e, good, path, lag_s))
        if quantity == "torque_injection":
            torque.append(period_spectra(own_torque(record, path), e, good))
        elif quantity == "closed_loop" and record.torque is not None:
            torque.append(period_spectra(record.torque, e, good))
    if not sent:
        raise ValueError("every period has a gap; nothing is left to evaluate")
    return LineSpectra(
        first.line_hz, first.lines, tuple(sent), tuple(response), tuple(torque),
        tuple(direction), tuple(realisation), first.period_samples or 2, used, dropped,
    )  # fmt: skip


def own_torque(record: Record, path: SignalPath) -> FloatArray:
    """Return the sampled torque without the contribution of the injection: the loop's own part.

    Raises:
        ValueError: the recording has no reported torque.
    """
    if record.torque is None:
        raise ValueError("torque_injection needs the reported torque")
    return record.torque - sampled_command(record.excitation.samples, path)


def speed_lag_s(records: tuple[Record, ...], path: SignalPath) -> float:
    """Return the lag of the reported speed behind the position, s: due to a filter, or averaging.

    Without positions it is the lag of the filter that ``path`` states.
    """
    reported = path.response_bandwidth_hz
    known = 0.0 if reported is None else 1.0 / (2 * np.pi * reported)
    if any(record.position is None for record in records):
        return known
    turned = weights = 0.0
    for record in records:
        e = record.excitation
        good, _ = good_periods(record)
        if not good:
            continue
        use = e.line_hz <= threshold.TELLING * path.sample_rate_hz
        w = 2 * np.pi * e.line_hz[use]
        seen = period_spectra(record.response, e, good).mean(axis=0)[use]
        moved = velocity_from_position(record, e, good, path.sample_rate_hz).mean(axis=0)[use]
        weight = np.abs(seen) * np.abs(moved)
        turned -= float(np.sum(weight * w * np.angle(seen * moved.conj())))
        weights += float(np.sum(weight * w**2))
    return float(np.clip(turned / weights, 0.0, threshold.LATEST_S)) if weights > 0 else known


def friction_direction(
    record: Record, e: Excitation, periods: list[int], path: SignalPath, lag_s: float
) -> ComplexArray:
    """Return the spectra [periods, lines] of the true direction of motion, on the lines of ``e``.

    ``lag_s`` as from :func:`speed_lag_s`.
    """
    centre = _centre_of_interval(e.line_hz, e.sample_rate_hz)
    if record.known_direction is not None:
        return np.asarray(period_spectra(record.known_direction, e, periods) * centre)
    spectra = period_spectra(record.direction(lag_s), e, periods)
    return np.asarray(spectra * centre / delay_response(e.line_hz, path.response_delay_s))


def _direction(velocity: FloatArray, lag_s: float, rate_hz: float) -> FloatArray:
    """Mean sign of the velocity between each sample and the next.

    A filtered speed changes its sign late and is then not the filtered sign of the true speed: its
    lag is removed first (as of a first-order filter). A component near half the sample rate is not
    a straight line from sample to sample, so the speed is interpolated within the band.
    """
    fine = scipy.signal.resample_poly(velocity, threshold.FINER, 1, window=("kaiser", 8.0))
    fine = fine + lag_s * rate_hz * threshold.FINER * np.gradient(fine)
    after = np.append(fine[1:], fine[-1])
    rise = after - fine
    moving = np.abs(rise) > 1e-12
    safe = np.where(moving, rise, 1.0)
    mean = np.where(moving, (np.abs(after) - np.abs(fine)) / safe, np.sign(fine))
    return np.asarray(mean.reshape(-1, threshold.FINER).mean(axis=1))


def _centre_of_interval(frequency_hz: FloatArray, sample_rate_hz: float) -> ComplexArray:
    """Factor from the spectrum of interval means to that of the signal at the interval's start."""
    x = frequency_hz / sample_rate_hz
    return np.asarray(np.exp(-1j * np.pi * x) / np.sinc(x), dtype=np.complex128)


def continuous_input(
    s: LineSpectra,
    path: SignalPath,
    quantity: Quantity,
    coulomb_nm: float = 0.0,
    *,
    position: bool = False,
) -> list[ComplexArray]:
    """Return the input that actually drove the quantity, per realisation [periods, lines]."""
    f = s.frequency_hz
    inputs: list[ComplexArray]
    if quantity == "closed_loop":
        whole = hold_response(f, path.sample_rate_hz, path.hold) * delay_response(
            f, path.command_delay_s + path.response_delay_s
        )
        inputs = [r * whole for r in s.sent]
    else:
        late = _late(s, path, position=position)
        direct = command_response(f, path)
        inputs = [r * direct * late for r in s.sent]
        if quantity == "torque_injection":
            inputs = [u + own * late for u, own in zip(inputs, s.torque, strict=True)]
    if coulomb_nm:
        taken = friction_input(s, path, quantity, inputs, position=position)
        inputs = [u - coulomb_nm * d for u, d in zip(inputs, taken, strict=True)]
    return inputs


def _late(s: LineSpectra, path: SignalPath, *, position: bool) -> ComplexArray:
    """Response from the true quantity to the reported one; a position passes no filter."""
    if position:
        return delay_response(s.frequency_hz, path.response_delay_s)
    return reported_response(s.frequency_hz, path)


def friction_input(
    s: LineSpectra,
    path: SignalPath,
    quantity: Quantity,
    inputs: list[ComplexArray],
    *,
    position: bool = False,
) -> list[ComplexArray]:
    """Return the effect of 1 Nm of Coulomb friction on the inputs, per realisation [periods,
    lines].

    Within a closed speed loop it is the part of the reference that would have caused that torque.
    Its controller is the recorded torque over the recorded error, which friction does not change:
    with speed y = P·(u - d) and torque u = C·(r - y) the response is y = T·(r - d/C). Zero where
    that torque was not recorded.
    """
    late = _late(s, path, position=position)
    if quantity != "closed_loop":
        return [late * d for d in s.direction]
    if not s.torque:
        return [0.0 * d for d in s.direction]
    sent = [r.mean(axis=0).conj() for r in s.sent]
    error, torque = (
        sum((part.mean(axis=0) * r for part, r in zip(parts, sent, strict=True)), np.zeros(1))
        for parts in ([u - y for u, y in zip(inputs, s.response, strict=True)], s.torque)
    )
    per_nm = np.asarray(error / np.where(torque == 0.0, np.inf, torque))
    return [per_nm * late * d for d in s.direction]


def instrument_estimate(
    s: LineSpectra, inputs: list[ComplexArray]
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return S_yr / S_ur and both cross spectra, from the means over periods."""
    r_mean = [r.mean(axis=0) for r in s.sent]
    pairs = zip(s.response, r_mean, strict=True)
    s_yr = np.asarray(sum(y.mean(axis=0) * r.conj() for y, r in pairs))
    s_ur = np.asarray(sum(u.mean(axis=0) * r.conj() for u, r in zip(inputs, r_mean, strict=True)))
    return np.asarray(s_yr / s_ur), s_yr, s_ur


def mean_spectra(
    records: tuple[Record, ...],
) -> tuple[FloatArray, FloatArray, ComplexArray, ComplexArray]:
    """Return lines in Hz, and the cross spectra of injection, torque and velocity with the
    injection.

    Sums over the records' means; torque as reported, nothing removed from it.

    Raises:
        ValueError: every period has a gap.
    """
    parts = []
    for record in records:
        e = record.excitation
        good, _ = good_periods(record)
        if not good or record.torque is None:
            continue
        r, t, v = (
            period_spectra(signal, e, good).mean(axis=0)
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
    """Return cross spectra of the loop's own torque and of the velocity with the injection."""
    s = collect(records, path, "torque_injection")
    sent = [r.mean(axis=0).conj() for r in s.sent]
    own = sum(t.mean(axis=0) * r for t, r in zip(s.torque, sent, strict=True))
    velocity = sum(y.mean(axis=0) * r for y, r in zip(s.response, sent, strict=True))
    return np.asarray(own), np.asarray(velocity)
