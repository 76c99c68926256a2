"""Excitations for one axis, scaled to its limits. Pure: independent of the drive.

Every plan is a list of sequences in SI units at the motor, with the excitation for the estimator.
The torque acts on the axis directly, or as an offset added to a closed loop, whose reference then
makes the slow base motion that overcomes stiction.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from backend.analysis.signals.excitation import BaseMotion, Excitation, scaled
from backend.tools.measuring.waveform import Band, Waveform, grid, periodic, stepped, tones_hz
from backend.tools.thresholds import measuring_excite as threshold
from drivers.texts.message import Unsuitable, text

FloatArray = npt.NDArray[np.float64]
TURN = 2.0 * np.pi
SPEED_CORNER_HZ = threshold.SPEED_CORNER_HZ
POSITION_CORNER_HZ = threshold.POSITION_CORNER_HZ


@dataclass(frozen=True)
class Rigid:
    """Rough data of the axis before the measurement [kg·m², Nm, Nm]."""

    inertia_kgm2: float
    coulomb_nm: float = 0.0
    gravity_nm: float = 0.0


@dataclass(frozen=True)
class Room:
    """Limits of the motion: peak torque [Nm], speed [rad/s], travel to each side [rad]."""

    torque_nm: float
    speed_rad_s: float
    travel_rad: float


@dataclass(frozen=True)
class Sequence:
    """One realisation. ``base`` [n] is the loop's reference (rad/s or rad), None without one."""

    excitation: Excitation
    base: FloatArray | None = None


def band_for(
    sample_rate_hz: float, f_min_hz: float, f_max_hz: float | None, *, odd_only: bool = False
) -> Band:
    """Band up to 0.4 of the sample rate; above 1200 Hz only with an explicit ``f_max_hz``."""
    top = min(0.4 * sample_rate_hz, 1200.0) if f_max_hz is None else f_max_hz
    count = 200 if sample_rate_hz < 2000 else 300
    return Band(f_min_hz, min(top, 0.4 * sample_rate_hz), count, odd_only)


def _speed_of(samples: npt.NDArray[np.floating], rate: float, inertia: float) -> FloatArray:
    """Speed of a rigid axis under a periodic torque [rad/s]."""
    spectrum = np.fft.rfft(samples)
    f = np.fft.rfftfreq(samples.size, 1 / rate)
    spectrum[0] = 0.0
    spectrum[1:] /= 1j * TURN * f[1:] * inertia
    return np.asarray(np.fft.irfft(spectrum, samples.size))


def base_torque_nm(inertia_kgm2: float, speed_rpm: float) -> float:
    """Highest torque for the acceleration of the base motion in `torque_mode` [Nm]."""
    return inertia_kgm2 * TURN / threshold.PERIOD_S * threshold.BASE_SHARE * speed_rpm * TURN / 60.0


def torque_mode(
    rate: float,
    band: Band,
    room: Room,
    rigid: Rigid,
    step_nm: float,
    *,
    share: float,
    realisations: int,
    base: bool = True,
    waveform: Waveform = "multisine",
) -> tuple[Sequence, ...]:
    """Pairs of opposite sign on a freely turning axis without any loop.

    ``share`` of the permitted torque is used for the excitation, reduced where the speed would
    exceed its limit; the base motion uses what speed, travel and torque leave.

    Raises:
        ValueError: the limits do not suffice; states which one.
    """
    if waveform == "stepped":
        raise Unsuitable(text("measuring.stepped-sine-needs-loop"))
    of = grid(waveform, rate, band)
    slow = TURN * of.slow_hz

    # Inertia reduces the response at high frequency; friction needs its share at low frequency.
    shape = np.minimum(np.hypot(1.0, of.line_hz / threshold.RISE_HZ), threshold.RISE_MOST)

    def one(number: int, motion: BaseMotion | None) -> Excitation:
        return periodic(of, shape, number, base=motion, integrations=2, ramp_samples=of.period // 4)

    unit_speed = _speed_of(one(0, None).one_period, rate, rigid.inertia_kgm2)
    own_rms, own_peak = float(np.std(unit_speed)), float(np.max(np.abs(unit_speed)))
    peak_nm = min(share * room.torque_nm, 0.25 * room.speed_rad_s / own_peak)
    wanted = max(threshold.BASE_OVER_RMS * own_rms * peak_nm, threshold.BASE_LEAST_RAD_S)
    affordable = share * room.torque_nm / (rigid.inertia_kgm2 * slow)
    gladly = max(wanted, min(affordable, threshold.BASE_GLADLY * room.speed_rad_s))
    # The run-in overshoots the steady base motion by about its amplitude.
    travelled = 2.2 / slow
    base_speed = (
        min(gladly, threshold.BASE_SHARE * room.speed_rad_s, room.travel_rad / travelled)
        if base
        else 0.0
    )
    if base and base_speed < 1.0:
        raise Unsuitable(text("measuring.travel-too-little", travel_rev=room.travel_rad / TURN))
    # The excitation must not be faster than the base motion can cover.
    if base and base_speed < 2.0 * own_rms * peak_nm:
        peak_nm = base_speed / (2.0 * own_rms)
    base_nm = rigid.inertia_kgm2 * slow * base_speed + 4 / np.pi * rigid.coulomb_nm
    if not base:
        base_nm = 0.0
    if base_nm + peak_nm > room.torque_nm:
        base_nm = min(base_nm, 0.6 * room.torque_nm)
        peak_nm = min(peak_nm, room.torque_nm - base_nm)
    if base and base_nm < 4 / np.pi * 1.02 * rigid.coulomb_nm:
        raise Unsuitable(text("measuring.torque-too-little", torque_nm=room.torque_nm))
    motion = BaseMotion(base_nm / peak_nm, of.slow_hz) if base_nm > 0 else None
    shapes = [one(i, motion) for i in range(2 * realisations)]
    # The ramps lead into the steady motion and may need more torque than a period does.
    highest = max(float(np.max(np.abs(e.samples))) for e in shapes)
    peak_nm = min(peak_nm, 0.98 * room.torque_nm / highest)
    return tuple(Sequence(scaled(e, peak_nm, step_nm)) for e in shapes)


def torque_injection(
    rate: float,
    band: Band,
    room: Room,
    step_nm: float,
    *,
    share: float,
    realisations: int,
    position: bool,
    base: bool = True,
    waveform: Waveform = "multisine",
) -> tuple[Sequence, ...]:
    """Torque offsets with a closed speed or position loop, which makes the base motion.

    Raises:
        ValueError: the limits do not suffice.
    """

    def size(f: FloatArray) -> FloatArray:
        return np.asarray(f / np.hypot(f, threshold.LOOP_CORNER_HZ))

    sequences = []
    for e, reference in _referenced(
        rate, band, room, size, realisations, position, base, waveform, integrations=0
    ):
        sequences.append(Sequence(scaled(e, share * room.torque_nm, step_nm), reference))
    return tuple(sequences)


def _referenced(
    rate: float, band: Band, room: Room, size: Callable[[FloatArray], FloatArray],
    realisations: int, position: bool, base: bool, waveform: Waveform, *, integrations: int,
    first: int = 0,
) -> Iterator[tuple[Excitation, FloatArray]]:  # fmt: skip
    """Excitations of peak 1 with amplitudes ``size``, each with the loop's base motion.

    A stepped sine needs only one pair: it is long, and its tones need no other phases.
    """
    of = grid("multisine" if waveform == "stepped" else waveform, rate, band)
    reference = _slow_reference(rate, of.period, room, position) if base else None
    if waveform == "stepped":
        tones = tones_hz(band)
        for invert in (False, True):
            e = stepped(rate, tones, size(tones), invert=invert)
            yield e, _stretched(reference, e, of.period // 8, position)
        return
    for i in range(2 * first, 2 * (first + realisations)):
        e = periodic(
            of, size(of.line_hz), i, integrations=integrations, ramp_samples=of.period // 8
        )
        fade = e.samples.size - (e.first_sample + e.periods * e.period_samples)
        yield e, _stretched(reference, e, fade, position)


def _slow_reference(rate: float, period: int, room: Room, position: bool) -> FloatArray:
    """One period of the base motion as speed, or as a position that begins at zero."""
    slow = TURN * rate / period
    speed = min(20.0, 0.35 * room.speed_rad_s, room.travel_rad * slow / 2.2)
    if speed < 0.5:
        raise Unsuitable(text("measuring.travel-too-little", travel_rev=room.travel_rad / TURN))
    turn = slow * np.arange(period) / rate
    if position:
        return np.asarray(speed / slow * (1.0 - np.cos(turn)))
    return np.asarray(speed * np.sin(turn))


def _stretched(
    period_values: FloatArray | None, e: Excitation, fade: int, position: bool
) -> FloatArray:
    """The base motion over the whole excitation, faded out over its last ``fade`` samples."""
    n = e.samples.size
    if period_values is None:
        return np.zeros(n)
    values = np.tile(period_values, n // period_values.size + 1)[:n]
    if fade > 1 and not position:
        values[-fade:] *= 0.5 + 0.5 * np.cos(np.pi * np.arange(fade) / (fade - 1))
    elif fade > 1:
        # Positions: brake the remaining speed to zero over the tail.
        speed = np.diff(values)[-fade] * (0.5 + 0.5 * np.cos(np.pi * np.arange(fade) / (fade - 1)))
        values[-fade:] = values[-fade - 1] + np.cumsum(speed)
    return np.asarray(values)


def loop_reference(
    rate: float,
    band: Band,
    room: Room,
    step: float,
    *,
    amplitude: float,
    realisations: int,
    position: bool,
    base: bool = True,
    waveform: Waveform = "multisine",
    corner_hz: float | None = None,
    weight: npt.NDArray[np.floating] | None = None,
    first: int = 0,
) -> tuple[Sequence, ...]:
    """Excitations of the closed loop's reference, ``amplitude`` in rad/s or rad.

    Amplitudes fall with frequency above ``corner_hz``, which limits the torque that they cause.
    ``weight`` [lines] is applied in addition, except to a stepped sine. The first ``first`` pairs
    of realisations are skipped, so that the phases differ from theirs.

    Raises:
        ValueError: the limits do not suffice.
    """
    corner = corner_hz or (POSITION_CORNER_HZ if position else SPEED_CORNER_HZ)

    def size(f: FloatArray) -> FloatArray:
        falling = np.asarray(1.0 / np.hypot(1.0, f / corner))
        return falling if weight is None or waveform == "stepped" else falling * weight

    return tuple(
        Sequence(scaled(e, amplitude, step), reference)
        for e, reference in _referenced(
            rate, band, room, size, realisations, position, base, waveform,
            integrations=0 if position else 1, first=first,
        )
    )  # fmt: skip


def probe(rate: float, peak_nm: float, duration_s: float, step_nm: float) -> FloatArray:
    """Torque doublet s, -s, -s, s that returns a free rigid axis to standstill where it began."""
    n = max(8, round(duration_s * rate / 4))
    hump = np.sin(np.pi * (np.arange(n) + 0.5) / n)
    whole = np.concatenate([hump, -hump, -hump, hump, np.zeros(max(4, n // 2))]) * peak_nm
    return np.asarray(np.round(whole / step_nm) * step_nm)
