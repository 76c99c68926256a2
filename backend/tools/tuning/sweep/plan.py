"""Planning of a sweep: checks of its settings, the loop to close, and the possible size."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from typing import Literal

import numpy as np

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.optional import existing
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.load_position import recorded_load_position
from backend.tools.measuring.recording import cycle_s
from backend.tools.mechanics.inertia.probe import Probed
from backend.tools.tuning.autotune.design.gains import read_gains
from backend.tools.tuning.sweep import speed_injection
from backend.tools.tuning.sweep.evaluation import Loop, SweepSettings
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts import limits
from drivers.texts.message import reason_of

_TURN = 2 * np.pi


@dataclass(frozen=True)
class Setup:
    """Everything that is determined before the excitation is designed."""

    rate: float
    facts: AxisFacts
    loop: Literal["none", "speed", "position"]
    room: excite.Room
    rigid: excite.Rigid
    torque_step_nm: float
    by_speed: bool = False
    """Mechanics by the speed loop's reference, where a closed loop accepts no torque offset."""
    integral_hz: float | None = None
    also: tuple[str, ...] = ()
    """Key of the second encoder's position, which is recorded as well where the drive has one."""


def check(settings: SweepSettings) -> None:
    """Check settings for impossible values.

    Raises:
        OutOfRange: states the value and its limit.
    """
    if not 0.01 <= settings.share <= 0.9:
        raise OutOfRange(
            "sweep.excitation-takes-90-permitted", value=settings.share, limit="0.01…0.9"
        )
    if not 1 <= settings.realisations <= 8:
        raise OutOfRange("sweep.realisations-possible", value=settings.realisations, limit="1…8")
    if settings.excitation == "stepped" and settings.loop == "none":
        raise OutOfRange("sweep.stepped-sine-lasts-too")
    if settings.odd_lines and (settings.excitation != "multisine" or settings.kind != "mechanics"):
        raise OutOfRange("sweep.odd-lines-need-multisine", parameter="odd_lines", value=True)
    if settings.f_min_hz < 3.0:
        raise OutOfRange("sweep.lowest-line-must-lie", value=settings.f_min_hz, limit="3 Hz")
    if settings.f_max_hz is not None and settings.f_max_hz < 4 * settings.f_min_hz:
        raise OutOfRange(
            "sweep.band-must-span-least",
            value=settings.f_max_hz,
            limit=limits.at_least(4 * settings.f_min_hz, "Hz"),
        )


def chosen_loop(axis: Axis, settings: SweepSettings, probed: Probed) -> Literal["none", "speed"]:
    """No loop on an axis that does not drift and whose inertia dominates, else the speed loop.

    Where friction takes more of the base motion's torque than inertia, a small error of the torque
    causes a large error of the speed.
    """
    drifts = abs(probed.gravity_nm) > max(0.5 * probed.coulomb_nm, 0.01 * probed.rated_nm)
    if drifts:
        return held_by_loop(axis, settings.loop, probed.gravity_nm)
    momentum_nm = excite.base_torque_nm(probed.inertia_kgm2, settings.envelope.speed_rpm)
    light = 4 / np.pi * probed.coulomb_nm > momentum_nm
    return "speed" if light and settings.loop == "auto" else "none"


def _can_offset(axis: Axis, session: CyclicSession) -> bool:
    """Whether a torque offset can be added with a closed loop."""
    key = axis.drive.key("torque_offset")
    return key is not None and session.carries(axis.drive, key)


def held_by_loop(axis: Axis, wanted: Loop, pull_nm: float) -> Literal["speed"]:
    """The loop that holds an axis with a static load torque.

    Raises:
        NotAllowed: the user chose no loop.
    """
    if wanted == "none":
        raise NotAllowed(
            "sweep.load-nm-pulls-axis",
            drive=axis.drive.name,
            value=round(pull_nm, 4),
            pull_nm=pull_nm,
        )
    return "speed"


async def setup_of(
    axis: Axis,
    session: CyclicSession,
    settings: SweepSettings,
    facts: AxisFacts,
    loop: str,
    probed: Probed | None,
) -> Setup:
    """Data that the excitation needs, from the envelope and the drive.

    Raises:
        DriveError: a parameter cannot be read.
    """
    units, envelope = await axis.units(), settings.envelope
    rated = facts.rated_torque_nm
    step = units.torque(1.0) / 100.0 * rated
    torque_percent = min(envelope.torque_percent, await drive_limit_percent(axis))
    room = excite.Room(
        torque_nm=torque_percent / 100.0 * rated,
        speed_rad_s=envelope.speed_rpm * _TURN / 60.0,
        travel_rad=envelope.travel_rev * _TURN,
    )
    inertia = settings.inertia_kgm2 or (probed.inertia_kgm2 if probed else None)
    rigid = excite.Rigid(
        inertia or facts.drive_inertia_kgm2 or 1e-4,
        probed.coulomb_nm if probed else 0.0,
        probed.gravity_nm if probed else 0.0,
    )
    kind: Literal["none", "speed", "position"] = (
        "none" if loop == "none" else "position" if loop == "position" else "speed"
    )
    by_speed = settings.kind == "mechanics" and kind == "speed" and not _can_offset(axis, session)
    integral_hz = None
    if by_speed:
        with contextlib.suppress(NotAllowed):
            integral_hz = (await read_gains(axis, facts)).integral_hz
    # Its scale shows where the base motion moves the axis.
    mechanics = settings.kind == "mechanics" and settings.base_motion
    also = await recorded_load_position(axis, session) if mechanics else ()
    rate = 1.0 / cycle_s(session)
    return Setup(rate, facts, kind, room, rigid, step, by_speed, integral_hz, also)


async def drive_limit_percent(axis: Axis) -> float:
    """The drive's own torque limit, at which commands are clipped [% of rated]; inf if none."""
    drive, units = axis.drive, await axis.units()
    roles = ("torque_limit_positive", "torque_limit_negative", "max_torque")
    found = await existing(drive, [drive.key(role) for role in roles])
    raws = [reading.raw for reading in found.values() if isinstance(reading.raw, (int, float))]
    return float(min([np.inf, *(abs(units.torque(raw)) for raw in raws)]))


def sequences_of(setup: Setup, settings: SweepSettings) -> tuple[excite.Sequence, ...]:
    """Design the excitation.

    Raises:
        OutOfRange: the envelope does not suffice for it.
    """
    band = excite.band_for(
        setup.rate, settings.f_min_hz, settings.f_max_hz, odd_only=settings.odd_lines
    )
    try:
        if settings.kind != "mechanics":
            position = settings.kind == "position_loop"
            amplitude = settings.reference_rad_s or _reference_size(setup, position)
            return excite.loop_reference(
                setup.rate, band, setup.room, 0.0, amplitude=amplitude,
                realisations=settings.realisations, position=position, base=settings.base_motion,
                waveform=settings.excitation, corner_hz=settings.reference_corner_hz,
                first=settings.pairs_before,
            )  # fmt: skip
        if setup.loop == "none":
            return excite.torque_mode(
                setup.rate, band, setup.room, setup.rigid, setup.torque_step_nm,
                share=settings.share, realisations=settings.realisations,
                base=settings.base_motion, waveform=settings.excitation,
            )  # fmt: skip
        if setup.by_speed:
            return speed_injection.sequences(
                setup.rate,
                band,
                setup.room,
                speed_injection.FIRST_RAD_S,
                settings.realisations,
                settings.excitation,
                base=settings.base_motion,
            )
        return excite.torque_injection(
            setup.rate, band, setup.room, setup.torque_step_nm, share=settings.share,
            realisations=settings.realisations, position=setup.loop == "position",
            base=settings.base_motion, waveform=settings.excitation,
        )  # fmt: skip
    except ValueError as error:
        raise OutOfRange("sweep.envelope-not-allow-measurement", cause=reason_of(error)) from error


def _reference_size(setup: Setup, position: bool) -> float:
    """Amplitude of a loop's reference (rad/s or rad)."""
    corner = excite.POSITION_CORNER_HZ if position else excite.SPEED_CORNER_HZ
    speed = reference_speed(setup.room, setup.rigid.inertia_kgm2, corner)
    return speed / (_TURN * corner) if position else speed


def reference_speed(
    room: excite.Room, inertia_kgm2: float, corner_hz: float = excite.SPEED_CORNER_HZ
) -> float:
    """Amplitude of a loop's reference as a speed [rad/s], without a prediction of the loop."""
    # The torque for the acceleration at the corner must stay far below the limit, since lines and
    # resonances add up.
    speed = 0.15 * room.speed_rad_s
    return min(speed, room.torque_nm / 8.0 / inertia_kgm2 / (_TURN * corner_hz), 8.0)
