"""Preview of the excitation of a frequency response, before anything moves.

The real excitation is designed after a test of the axis; here, inertia and friction are those that
the drive reports. The real one is scaled by the test and stays within the same envelope.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from backend.analysis.signals.excitation import Excitation, crest_factor
from backend.axes.axis.axis import Axis
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.measuring.waveform import Band
from backend.tools.tuning.sweep.evaluation import SweepSettings
from drivers.errors import OutOfRange
from drivers.texts.message import reason_of

_TURN = 2 * np.pi
#: Points of the curve that a page draws: the extremes of each section.
_POINTS = 800


@dataclass(frozen=True)
class Preview:
    """One realisation of the excitation.

    ``value`` [m] over ``time_s`` [m] is thinned to the visible extremes, in ``unit``;
    ``frequency_hz`` [n] are its lines with ``amplitude`` [n] in the same unit. ``duration_s`` is
    that of all realisations together.
    """

    unit: str
    time_s: npt.NDArray[np.float64]
    value: npt.NDArray[np.float64]
    frequency_hz: npt.NDArray[np.float64]
    amplitude: npt.NDArray[np.float64]
    peak: float
    crest: float
    duration_s: float
    realisations: int
    inertia_kgm2: float


async def preview(axis: Axis, settings: SweepSettings, sample_rate_hz: float) -> Preview:
    """Design the excitation; reads data of the drive and moves nothing.

    Raises:
        OutOfRange: the envelope does not suffice; states what is too small.
    """
    facts = await read_facts(axis, settings.rated_torque_nm)
    rated = facts.rated_torque_nm
    envelope = settings.envelope
    room = excite.Room(
        torque_nm=envelope.torque_percent / 100.0 * rated,
        speed_rad_s=envelope.speed_rpm * _TURN / 60.0,
        travel_rad=envelope.travel_rev * _TURN,
    )
    inertia = settings.inertia_kgm2 or facts.drive_inertia_kgm2 or 1e-4
    band = excite.band_for(
        sample_rate_hz, settings.f_min_hz, settings.f_max_hz, odd_only=settings.odd_lines
    )
    try:
        sequences = await asyncio.to_thread(
            _sequences, settings, sample_rate_hz, band, room, inertia
        )
    except ValueError as error:
        raise OutOfRange(
            "sweep.envelope-not-allow-measurement-widen-travel",
            drive=axis.drive.name,
            cause=reason_of(error),
        ) from error
    factor = 100.0 / rated if settings.kind == "mechanics" else _SHOWN[settings.kind][1]
    unit = "% of rated torque" if settings.kind == "mechanics" else _SHOWN[settings.kind][0]
    return _seen(sequences, unit, factor, inertia)


#: Closed loops: unit of the reference, and the factor from SI to it.
_SHOWN = {"speed_loop": ("rpm", 60.0 / _TURN), "position_loop": ("rev", 1.0 / _TURN)}


def _sequences(
    settings: SweepSettings, rate: float, band: Band, room: excite.Room, inertia: float
) -> tuple[excite.Sequence, ...]:
    """Sequences as the tool makes them, with the data known before the axis was tested."""
    waveform = settings.excitation
    if settings.kind == "mechanics" and settings.loop in ("auto", "none") and waveform != "stepped":
        return excite.torque_mode(
            rate, band, room, excite.Rigid(inertia), 0.0, share=settings.share,
            realisations=settings.realisations, base=settings.base_motion, waveform=waveform,
        )  # fmt: skip
    position = "position" in (settings.loop, settings.kind.removesuffix("_loop"))
    if settings.kind == "mechanics":
        return excite.torque_injection(
            rate, band, room, 0.0, share=settings.share, realisations=settings.realisations,
            position=position, base=settings.base_motion, waveform=waveform,
        )  # fmt: skip
    corner = _TURN * (20.0 if position else 40.0)
    speed = min(0.15 * room.speed_rad_s, room.torque_nm / 8.0 / inertia / corner, 8.0)
    return excite.loop_reference(
        rate, band, room, 0.0, amplitude=speed / corner if position else speed,
        realisations=settings.realisations, position=position, base=settings.base_motion,
        waveform=waveform,
    )  # fmt: skip


def _seen(
    sequences: tuple[excite.Sequence, ...], unit: str, factor: float, inertia: float
) -> Preview:
    e = sequences[0].excitation
    samples = np.asarray(e.samples * factor, np.float64)
    time = np.arange(samples.size) / e.sample_rate_hz
    chosen = _extremes(samples, _POINTS)
    if e.segments:
        crest, amplitude = crest_factor(e.samples), _tone_peaks(samples, e)
    else:
        crest = crest_factor(e.one_period)
        spectrum = 2.0 * np.abs(np.fft.rfft(e.one_period * factor)) / e.period_samples
        amplitude = spectrum[e.lines]
    return Preview(
        unit=unit,
        time_s=time[chosen],
        value=samples[chosen],
        frequency_hz=np.asarray(e.line_hz, np.float64),
        amplitude=np.asarray(amplitude),
        peak=float(np.max(np.abs(samples))),
        crest=crest,
        duration_s=float(sum(s.excitation.duration_s for s in sequences)),
        realisations=len(sequences),
        inertia_kgm2=inertia,
    )


def _tone_peaks(samples: npt.NDArray[np.float64], e: Excitation) -> npt.NDArray[np.float64]:
    """Amplitude of each tone of a stepped sine."""
    return np.array([np.max(np.abs(samples[s.start : s.start + s.samples])) for s in e.segments])


def _extremes(samples: npt.NDArray[np.float64], points: int) -> npt.NDArray[np.int64]:
    """Ascending indices of the smallest and largest sample of every section."""
    if samples.size <= points:
        return np.arange(samples.size)
    stretch = -(-samples.size * 2 // points)
    found: list[int] = []
    for start in range(0, samples.size, stretch):
        piece = samples[start : start + stretch]
        found += sorted({start + int(np.argmin(piece)), start + int(np.argmax(piece))})
    return np.asarray(found, np.int64)
