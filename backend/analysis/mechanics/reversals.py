"""Friction while the speed reverses, from the balance of torques.

Between two samples a reversing axis may stop, stick and start again: its sampled speed shows the
mean of the friction's sign there to within about a third only, and 50 such reversals a second leave
a tenth of the friction in the data. The torques show it better. The torque on the motor, minus that
of its own inertia and that taken by the mechanics behind it, is the friction. Where the speed does
not reverse, it must equal plus or minus the whole Coulomb torque; that shows the accuracy of the
balance, and removes its slow errors (gravity, errors of the mechanics).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from backend.analysis.response.signal_path.sampled_model import SampledFit
from backend.analysis.response.signal_path.sampling import (
    STEP_LEAD_S,
    SignalPath,
    delay_response,
    lag_response,
)
from backend.analysis.signals.arrays import BoolArray, ComplexArray, FloatArray
from backend.analysis.signals.line_spectra import Quantity, Record, own_torque
from backend.analysis.thresholds import reversals as threshold


def with_balanced_reversals(
    records: tuple[Record, ...],
    quantity: Quantity,
    fit: SampledFit,
    coulomb_nm: float,
    lag_s: float,
) -> tuple[Record, ...]:
    """Return the records with directions of motion from the balance of torques, by this fit.

    ``lag_s`` is the lag of the reported speed (:func:`line_spectra.speed_lag_s`). The records are
    unchanged where there is no friction or no inertia at the motor, where samples are missing, and
    where the balance is less accurate than the speed: behind a coarse encoder, or with mechanics
    that the fit does not describe well.
    """
    by_torque = sum(mode.residue for mode in fit.model.modes) + fit.model.gain
    missing = any(r.valid is not None and not np.all(r.valid) for r in records)
    if coulomb_nm <= 0 or by_torque <= 0 or missing:
        return records
    reported = []
    for record in records:
        direction = _reported(
            record, record.direction(lag_s), quantity, fit, coulomb_nm, 1.0 / by_torque
        )
        if direction is None:
            return records
        reported.append(replace(record, known_direction=direction))
    return tuple(reported)


def _reported(
    record: Record,
    by_speed: FloatArray,
    quantity: Quantity,
    fit: SampledFit,
    coulomb_nm: float,
    motor_kgm2: float,
) -> FloatArray | None:
    """Mean direction between each sample and the next [n]; None where the balance is too weak."""
    path, period_s = fit.path, 1.0 / fit.path.sample_rate_hz
    velocity, drawn_nm = _motion(record, quantity, fit, motor_kgm2)
    after = np.append(velocity[1:], velocity[-1])
    left_nm = _mean_injected(record, path) - motor_kgm2 * (after - velocity) / period_s - drawn_nm
    reverses = np.minimum(np.abs(velocity), np.abs(after)) < coulomb_nm / motor_kgm2 * period_s
    steady = ~(reverses | (velocity * after < 0))
    e = record.excitation
    known = steady.copy()
    known[: e.first_sample + e.transient_periods * e.period_samples] = False
    if np.count_nonzero(known) < threshold.FEWEST:
        return None
    sign = np.sign(velocity)
    off = left_nm / coulomb_nm - sign
    mean = float(np.mean(off[known]))
    wrong, spread = _between(np.where(known, off - mean, 0.0), known, ~steady)
    weight = 1.0 / (1.0 + (spread / threshold.ROUGH) ** 4)
    if weight < threshold.LEAST_WEIGHT:
        return None
    # Clipped only above one: otherwise noise would no longer cancel in the mean.
    most = 1.0 + spread
    reported = np.clip(left_nm / coulomb_nm - wrong - mean, -most, most)
    return np.where(steady, sign, weight * reported + (1.0 - weight) * by_speed)


def _between(off: FloatArray, known: BoolArray, wanted: BoolArray) -> tuple[FloatArray, float]:
    """Error of the balance at ``wanted`` [n], predicted from ``known``, and its standard deviation.

    By the correlation of the known errors, as in a Wiener filter: errors that are slow or oscillate
    at one frequency (mechanics that the fit describes inexactly) continue through a reversal.
    """
    count = known.astype(np.float64)
    size = scipy.fft.next_fast_len(off.size + 2 * threshold.SLOW, real=True)
    power = np.abs(np.fft.rfft(off * count, size)) ** 2
    pairs = np.fft.irfft(np.abs(np.fft.rfft(count, size)) ** 2, size)[: 4 * threshold.SLOW]
    alike = np.fft.irfft(power, size)[: 4 * threshold.SLOW] / np.maximum(pairs, 1.0)
    places = np.flatnonzero(wanted)
    out, rest = np.zeros(off.size), []
    for group in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1):
        if group.size == 0 or group.size > 2 * threshold.SLOW:
            continue
        near = np.arange(
            max(group[0] - threshold.SLOW, 0), min(group[-1] + threshold.SLOW + 1, off.size)
        )
        near = near[known[near]]
        if near.size < threshold.SLOW:
            continue
        within = alike[np.abs(near[:, None] - near[None, :])]
        within = within + np.eye(near.size) * threshold.JITTER * alike[0]
        across = alike[np.abs(group[:, None] - near[None, :])]
        share = np.linalg.solve(within, across.T).T
        out[group] = share @ off[near]
        rest.append(np.maximum(alike[0] - np.sum(share * across, axis=1), 0.0))
    left = float(np.mean(np.concatenate(rest))) if rest else float(alike[0])
    return out, float(np.sqrt(max(left, 0.0)))


def _motion(
    record: Record, quantity: Quantity, fit: SampledFit, motor_kgm2: float
) -> tuple[FloatArray, FloatArray]:
    """True velocity at the samples, and the mean torque that does not accelerate the motor.

    That is the torque taken by the load, minus the torque of the drive's own loop.
    """
    n, rate = record.response.size, fit.path.sample_rate_hz
    size = scipy.fft.next_fast_len(2 * n, real=True)
    f = np.fft.rfftfreq(size, 1.0 / rate)
    f[0] = 0.5 * f[1]
    inside, folded = _bands(record, fit, f, size)

    def mean(at_hz: FloatArray) -> ComplexArray:
        return np.asarray(np.sinc(at_hz / rate) * np.exp(1j * np.pi * at_hz / rate))

    def drawn(at_hz: FloatArray) -> ComplexArray:
        return np.asarray(1.0 / fit.model.response(at_hz) - 2j * np.pi * at_hz * motor_kgm2)

    torque = inside * drawn(f) * mean(f) + folded * drawn(f - rate) * mean(f - rate)
    if quantity == "torque_injection":
        # The loop's torque is sampled as well: its aliased part follows from the aliased velocity.
        own = np.fft.rfft(own_torque(record, fit.path), size)
        there = -_loop_response(fit, f - rate) * folded
        torque = torque - (own - there) * mean(f) - there * mean(f - rate)
    velocity = np.fft.irfft(inside + folded, size)[:n]
    return np.asarray(velocity), np.asarray(np.fft.irfft(torque, size)[:n])


def _bands(
    record: Record, fit: SampledFit, f: FloatArray, size: int
) -> tuple[ComplexArray, ComplexArray]:
    """Spectra [bins] of the true velocity at ``f`` and of the part folded there from f - fs.

    Speed and position are samples of one motion with different aliasing, so that both together
    determine twice the band (Papoulis, IEEE Trans. Circuits Syst. 24 (1977) 652). Without a
    position the folded part is unknown and taken as zero.
    """
    rate, corner = fit.path.sample_rate_hz, fit.path.response_bandwidth_hz
    reported_s = fit.path.response_delay_s
    late = delay_response(f, fit.delay_s + reported_s)
    seen = np.fft.rfft(record.response, size) / late
    if record.position is None:
        return np.asarray(seen / lag_response(f, corner)), np.zeros_like(seen)
    gone = np.diff(record.position, append=record.position[-1]) * rate
    mean = np.sinc(f / rate) * np.exp(1j * np.pi * f / rate)
    late = delay_response(f, fit.position_delay_s + reported_s)
    moved = np.fft.rfft(gone, size) / (mean * late)
    weaker = f / (f - rate)
    here, there = lag_response(f, corner), lag_response(f - rate, corner)
    folded = (seen - here * moved) / (there - here * weaker)
    return np.asarray(moved - weaker * folded), np.asarray(folded)


def _loop_response(fit: SampledFit, f: FloatArray) -> ComplexArray:
    """Response from the true velocity to the torque that the loop subtracts for it."""
    path = fit.path
    late = delay_response(f, path.loop_delay_s) * lag_response(f, path.current_bandwidth_hz)
    return np.asarray(fit.loop.response(f) * late * lag_response(f, path.response_bandwidth_hz))


def _mean_injected(record: Record, path: SignalPath) -> FloatArray:
    """Mean of the injected torque between each sample and the next [n]."""
    sent, period_s = record.excitation.samples, 1.0 / path.sample_rate_hz
    fine = max(round(period_s / (2 * STEP_LEAD_S)), 4)
    late_s = path.command_delay_s
    if path.hold == "linear":
        before = np.concatenate([[0.0], sent[:-1]])
        part = (np.arange(fine) + 1.0) / fine
        steps = (before[:, None] + part * (sent - before)[:, None]).ravel()
        # A step comes half of its length before the line segment that it represents.
        late_s += STEP_LEAD_S
    else:
        steps = np.repeat(sent, fine)
    whole, part_late = divmod(late_s * fine / period_s, 1.0)
    held = np.concatenate([np.zeros(int(whole) + 1), steps])
    steps = (1.0 - part_late) * held[1:][: steps.size] + part_late * held[: steps.size]
    if path.current_bandwidth_hz is not None:
        a = float(np.exp(-2 * np.pi * path.current_bandwidth_hz * period_s / fine))
        steps = np.asarray(scipy.signal.lfilter([1.0 - a], [1.0, -a], steps))
    return np.asarray(path.direct_gain * steps.reshape(-1, fine).mean(axis=1))
