"""Mechanics by the speed loop's reference, on a drive without torque offset in a closed loop.

Anything added to the reference becomes torque at once through the speed gain (and its integral), as
a torque offset would; the gain is identified from the recorded torque. After that the recording is
evaluated as if the torque had been injected.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from backend.analysis.response.frf import Record, estimate_periodic
from backend.analysis.response.signal_path.reference_gain import ReferenceLoop, reference_gain
from backend.analysis.response.signal_path.sampled_model import SampledFit
from backend.analysis.response.signal_path.sampling import (
    SignalPath,
    delay_response,
    rising_command,
)
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.analysis.signals.line_spectra import good_periods, period_spectra
from backend.tools.measuring import excite
from backend.tools.measuring.recording import Recording
from backend.tools.measuring.waveform import Band, Waveform
from backend.tools.thresholds import sweep_speed_injection as threshold

_TURN = 2 * np.pi
FIRST_RAD_S = threshold.FIRST_RAD_S
#: Possible delays of the torque against the reference [cycles].
_CYCLES = np.arange(0.0, 4.01, 0.125)


def sequences(
    rate: float, band: Band, room: excite.Room, amplitude_rad_s: float, realisations: int,
    waveform: Waveform, *, base: bool, weight: FloatArray | None = None,
) -> tuple[excite.Sequence, ...]:  # fmt: skip
    """Sequences with equal amplitudes of all lines, and so of the torque above the bandwidth.

    ``weight`` [lines] changes the amplitudes, as `informative_weight` finds it.

    Raises:
        ValueError: the limits do not suffice.
    """
    return excite.loop_reference(
        rate, band, room, 0.0, amplitude=amplitude_rad_s, realisations=realisations,
        position=False, base=base, waveform=waveform, corner_hz=np.inf, weight=weight,
    )  # fmt: skip


@dataclass(frozen=True)
class Size:
    """Peaks of the excitation and of the base motion [rad/s]."""

    peak_rad_s: float
    base_rad_s: float


def fitting_size(
    sequence: excite.Sequence,
    recording: Recording,
    room: excite.Room,
    torque_nm: float,
    *,
    watched: bool,
) -> Size:
    """Size of an excitation whose torque peaks at ``torque_nm``, estimated from a trial.

    A soft loop converts little of its reference into speed, so that the axis' own speed counts; the
    setpoints stay within a share of the limit, too. Such a loop may need much torque for the base
    motion, which lies near its resonance: the base motion gets what the excitation leaves.
    ``watched``: the drive ends a motion whose setpoints stop arriving.
    """
    speed_share = threshold.SPEED_SHARE if watched else threshold.UNWATCHED_SPEED_SHARE
    reference_share = threshold.REFERENCE_SHARE if watched else threshold.UNWATCHED_REFERENCE_SHARE
    record = _record(sequence, recording)
    gain = _rough_gain(record)
    by_torque = torque_nm / gain
    base = 0.0 if sequence.base is None else float(np.max(np.abs(sequence.base)))
    least = speed_share * room.speed_rad_s
    moves = _speed_over_peak(record, gain) if base else 1.0
    by_speed = least / (threshold.PEAK_OVER_RMS * moves)
    most = min(by_speed, reference_share * room.speed_rad_s - base)
    peak = min(by_torque, max(most, least))
    left_nm = threshold.TORQUE_SHARE * room.torque_nm - torque_nm * peak / by_torque
    taken_nm = float(np.max(np.abs(recording.torque_nm)))
    return Size(peak, base * float(np.clip(left_nm / taken_nm, threshold.LEAST_BASE, 1.0)))


def informative_weight(
    records: tuple[tuple[excite.Sequence, Recording], ...], rate: float
) -> FloatArray:
    """Weights of the lines [n] for further realisations: higher where the first ones show less.

    Where one amplitude has the deviation d, the sum of all variances is minimal with amplitudes of
    √d. Lines that cannot be resolved, and those that are known, keep a share.

    Raises:
        ValueError: every period has a gap.
    """
    taken = tuple(_record(s, r) for s, r in records)
    reported = estimate_periodic(taken, SignalPath(rate), "closed_loop", position=True)
    uncertainty = np.nan_to_num(reported.std_db, nan=1.0)
    relative = uncertainty / float(np.median(uncertainty))
    return np.asarray(np.clip(relative, *threshold.WEIGHTS) ** threshold.BY_DOUBT)


@dataclass(frozen=True)
class SpeedGain:
    """Response of a speed loop's torque to its reference.

    ``played`` are the records as if their torque had been injected, in Nm.
    """

    loop: ReferenceLoop
    played: tuple[tuple[excite.Sequence, Recording], ...]


def speed_gain(
    records: tuple[tuple[excite.Sequence, Recording], ...],
    path: SignalPath,
    integral_hz: float | None,
    *,
    hold_known: bool,
    motion: SampledFit | None = None,
) -> SpeedGain:
    """Identify the gain from the recorded torque; with ``integral_hz`` None the integral, too.

    ``motion`` is a fit of the mechanics, if there is one already.

    Raises:
        ValueError: no part of the torque follows the reference.
    """
    taken = tuple(_record(s, r) for s, r in records)
    corner = None if integral_hz is None else _TURN * integral_hz
    loop = reference_gain(taken, path, corner, hold_known=hold_known, motion=motion)
    return SpeedGain(loop, tuple(_as_torque(s, r, loop) for s, r in records))


def _as_torque(
    sequence: excite.Sequence, recording: Recording, loop: ReferenceLoop
) -> tuple[excite.Sequence, Recording]:
    """The record with the torque caused by the reference as its excitation.

    That torque is constant within a cycle but for the rise of the integral: its mean moves the
    axis, and what the samples show beyond the mean is removed from them.
    """
    e = sequence.excitation
    mean = np.concatenate([[0.0], np.cumsum(e.samples)[:-1]]) + 0.5 * e.samples
    gain, integral = loop.controller.c0, loop.controller.c1
    torque = gain * e.samples + integral / e.sample_rate_hz * mean
    shown = recording.torque_nm - integral * rising_command(e.samples, loop.path)
    return (
        replace(sequence, excitation=replace(e, samples=torque)),
        replace(recording, torque_nm=shown),
    )


def _record(sequence: excite.Sequence, recording: Recording) -> Record:
    return Record(
        sequence.excitation,
        recording.velocity_rad_s,
        recording.torque_nm,
        recording.valid,
        recording.position_rad,
    )


@dataclass(frozen=True)
class _Upper:
    """The upper lines of the last two periods: their samples, bins and frequencies."""

    cuts: tuple[slice, ...]
    bins: npt.NDArray[np.int64]
    f: FloatArray

    @staticmethod
    def of(record: Record) -> _Upper:
        e = record.excitation
        if e.segments:
            # From standstill to standstill: the whole is one period of a longer signal.
            length = e.samples.size
            ends = np.round(e.line_hz[[0, -1]] * (length / e.sample_rate_hz)).astype(np.int64)
            cuts, bins = [slice(0, length)], np.arange(ends[0], ends[1])
        else:
            length, bins = e.period_samples, e.lines
            begins = [e.first_sample + n * length for n in range(max(e.periods - 2, 0), e.periods)]
            cuts = [slice(first, first + length) for first in begins]
        upper = bins[int(threshold.UPPER * bins.size) :]
        return _Upper(
            tuple(cuts), upper, np.asarray(upper * (e.sample_rate_hz / length), np.float64)
        )

    def spectra(self, signal: FloatArray) -> ComplexArray:
        """Spectra at these lines [periods, lines]."""
        return np.array([np.fft.rfft(signal[cut])[self.bins] for cut in self.cuts])


def _rough_gain(record: Record) -> float:
    """Gain [Nm per rad/s] for scaling an amplitude; one deviation too high rather than too low.

    It is the part of the torque that follows the reference with some delay: the steps of a coarse
    encoder cause more torque than a small trial does.
    """
    assert record.torque is not None
    lines = _Upper.of(record)
    sent = lines.spectra(record.excitation.samples)[-1]
    torques = lines.spectra(record.torque)
    torque = np.mean(torques, axis=0)
    late = delay_response(lines.f, 1.0 / record.excitation.sample_rate_hz)
    follows = [torque @ (sent * late**cycles).conj() for cycles in _CYCLES]
    size = max(float(np.linalg.norm(sent)), 1e-12)
    noise = float(np.sqrt(np.mean(np.abs(torques - torque) ** 2)))
    return (float(max(part.real for part in follows)) / size + noise) / size


def _speed_over_peak(record: Record, gain_nms: float) -> float:
    """RMS of the excited speed over the peak of the excitation; 1 where it cannot be determined.

    The trial itself is too small for a coarse encoder. The base motion shows the inertia: friction
    torque is in phase with the speed, inertia torque leads it by 90 degrees.
    """
    e = record.excitation
    good, _ = good_periods(record)
    if record.torque is None or e.segments or not good:
        return 1.0
    base = replace(e, lines=np.array([1]))
    torque, speed = (
        period_spectra(signal, base, good).mean() for signal in (record.torque, record.response)
    )
    turning = _TURN * e.line_hz
    inertia = float((torque / speed).imag) / (_TURN * e.sample_rate_hz / e.period_samples)
    follows = 1.0 / np.hypot(1.0, turning * max(inertia, 0.0) / gain_nms)
    return threshold.RMS_OVER_PEAK * float(np.sqrt(np.mean(follows**2)))
