"""Mechanics on a drive that takes no torque beside a closed loop: by the speed loop's reference.

Whatever is added to the reference becomes torque at once by the speed gain (and by the integral
of it), just as a torque offset would; the gain is read from the recorded torque. After that the
recording is evaluated as if the torque had been injected.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from backend.analysis.arrays import ComplexArray, FloatArray
from backend.analysis.frf import Record
from backend.analysis.path_fit import reference_gain
from backend.analysis.sampling import SignalPath
from backend.tools import excite
from backend.tools.recording import Recording
from backend.tools.speed_integral import integral_hz as found_integral_hz
from backend.tools.waveform import Band, Waveform

_TURN = 2 * np.pi
#: Peak of the first trial in rad/s: even a high gain makes little torque of it.
FIRST_RAD_S = 0.3
#: Share of the permitted speed for the excitation.
_SPEED_SHARE = 0.15
#: Only above this share of the lines does the reference alone make the torque.
_UPPER = 0.75


def sequences(
    rate: float, band: Band, room: excite.Room, amplitude_rad_s: float, realisations: int,
    waveform: Waveform, *, base: bool,
) -> tuple[excite.Sequence, ...]:  # fmt: skip
    """All lines alike: above the loop's bandwidth that is a torque that is alike, too.

    Raises:
        ValueError: the room does not suffice.
    """
    return excite.loop_reference(
        rate, band, room, 0.0, amplitude=amplitude_rad_s, realisations=realisations,
        position=False, base=base, waveform=waveform, corner_hz=np.inf,
    )  # fmt: skip


def fitting_amplitude(
    sequence: excite.Sequence, recording: Recording, room: excite.Room, torque_nm: float
) -> float:
    """Peak in rad/s whose torque peaks at ``torque_nm``, as far as the trial tells."""
    gain = _rough_gain(_record(sequence, recording))
    return float(min(torque_nm / gain, _SPEED_SHARE * room.speed_rad_s))


@dataclass(frozen=True)
class SpeedGain:
    """What a speed loop makes of its reference: ``gain_nms``·(1 + 2π·integral_hz/s), and the path
    between the reference and that torque. ``played`` are the records with the integral's part."""

    gain_nms: float
    integral_hz: float
    path: SignalPath
    played: tuple[tuple[excite.Sequence, Recording], ...]


def speed_gain(
    records: tuple[tuple[excite.Sequence, Recording], ...], path: SignalPath,
    integral_hz: float | None, *, hold_known: bool,
) -> SpeedGain:  # fmt: skip
    """The gain that the recorded torque shows; ``integral_hz`` None: the recording tells it, too.

    Raises:
        ValueError: nothing of the torque follows the reference.
    """
    if integral_hz is None:
        integral_hz = found_integral_hz(tuple(_record(s, r) for s, r in records), path)
    corner_hz = integral_hz or 0.0
    played = tuple((_with_integral(s, corner_hz), r) for s, r in records)
    taken = tuple(_record(s, r) for s, r in played)
    gain, found = reference_gain(taken, path, _TURN * corner_hz, hold_known=hold_known)
    return SpeedGain(gain, corner_hz, found, played)


def as_torque(
    records: tuple[tuple[excite.Sequence, Recording], ...], path: SignalPath,
    integral_hz: float | None, *, hold_known: bool,
) -> tuple[tuple[excite.Sequence, Recording], ...]:  # fmt: skip
    """The same recordings with the torque in Nm that the reference made in the excitation's place.

    ``integral_hz`` is the corner of the loop's integral; None: the recording tells.

    Raises:
        ValueError: nothing of the torque follows the reference.
    """
    found = speed_gain(records, path, integral_hz, hold_known=hold_known)
    return tuple((_scaled(s, found.gain_nms), r) for s, r in found.played)


def _with_integral(sequence: excite.Sequence, integral_hz: float) -> excite.Sequence:
    e = sequence.excitation
    if not integral_hz:
        return sequence
    steps = np.concatenate([[0.0], np.cumsum(e.samples)[:-1]]) + 0.5 * e.samples
    total = e.samples + _TURN * integral_hz / e.sample_rate_hz * steps
    return replace(sequence, excitation=replace(e, samples=total))


def _scaled(sequence: excite.Sequence, gain: float) -> excite.Sequence:
    e = sequence.excitation
    return replace(sequence, excitation=replace(e, samples=e.samples * gain))


def _record(sequence: excite.Sequence, recording: Recording) -> Record:
    return Record(
        sequence.excitation, recording.velocity_rad_s, recording.torque_nm, recording.valid
    )


@dataclass(frozen=True)
class _Upper:
    """The upper lines of the last period: bins, frequencies, and which samples."""

    cut: slice
    bins: npt.NDArray[np.int64]
    f: FloatArray

    @staticmethod
    def of(record: Record) -> _Upper:
        e = record.excitation
        if e.segments:
            # From rest to rest: the whole of it is one period of a longer signal.
            length = e.samples.size
            ends = np.round(e.line_hz[[0, -1]] * (length / e.sample_rate_hz)).astype(np.int64)
            cut, bins = slice(0, length), np.arange(ends[0], ends[1])
        else:
            first = e.first_sample + (e.periods - 1) * e.period_samples
            length, bins = e.period_samples, e.lines
            cut = slice(first, first + length)
        upper = bins[int(_UPPER * bins.size) :]
        return _Upper(cut, upper, np.asarray(upper * (e.sample_rate_hz / length), np.float64))

    def spectrum(self, signal: FloatArray) -> ComplexArray:
        """Of these lines."""
        return np.asarray(np.fft.rfft(signal[self.cut])[self.bins])


def _rough_gain(record: Record) -> float:
    """Nm per rad/s, for scaling an amplitude."""
    assert record.torque is not None
    lines = _Upper.of(record)
    sent, torque = lines.spectrum(record.excitation.samples), lines.spectrum(record.torque)
    return float(np.linalg.norm(torque) / max(float(np.linalg.norm(sent)), 1e-12))
