"""Conversion of motion requests to tool settings: the only place that converts travel units."""

from __future__ import annotations

from backend.api.drive.models_motion import (
    GenerateRequest,
    HomeRequest,
    MoveRequest,
    SequenceRequest,
)
from backend.api.live.messages import JogStart
from backend.axes.axis.axis import Envelope
from backend.axes.motion.travel_unit import REVOLUTIONS, TravelUnit
from backend.axes.scales.travel_units import travel_unit
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.moving.jog.cyclic import GeneratorSettings
from backend.tools.moving.jog.run import JogSettings
from backend.tools.moving.moves.homing import HomingSettings
from backend.tools.moving.moves.move import MoveSettings, SequenceSettings

#: Speed limit [rpm] of an envelope without a requested speed, above the drive's own limits.
_SPEED_UNLIMITED_RPM = 20_000.0
_SEQUENCE_MOVE_S = 60.0


async def unit_of(bench: Bench, connected: ConnectedDrive, name: str) -> TravelUnit:
    """The travel unit that a request names.

    Raises:
        NotAllowed: this axis has no such unit.
        DriveError: its gearing cannot be read.
    """
    if name == REVOLUTIONS.name:
        return REVOLUTIONS
    mechanics = bench.axis_records.get(connected.drive.id).mechanics
    return travel_unit(connected.drive.name, name, mechanics, await connected.axis.units())


def _envelope(
    unit: TravelUnit, travel: float, rpm: float, torque_percent: float, time_s: float
) -> Envelope:
    return Envelope(
        unit.rev(travel),
        rpm,
        torque_percent,
        time_s,
        travel_unit=unit.name,
        travel_per_rev=unit.per_rev,
    )


def _rpm(unit: TravelUnit, speed: float | None) -> float | None:
    return None if speed is None else unit.rpm(speed)


def move_settings(request: MoveRequest, unit: TravelUnit) -> MoveSettings:
    """Settings of one move; a torque target has no travel unit."""
    target = {"PP": unit.rev, "PV": unit.rpm}.get(request.mode, float)(request.target)
    speed = _rpm(unit, request.speed)
    greatest = speed or (abs(target) if request.mode == "PV" else None)
    return MoveSettings(
        mode=request.mode,
        target=target,
        envelope=_envelope(
            unit,
            request.travel_limit,
            greatest or _SPEED_UNLIMITED_RPM,
            request.torque_limit,
            request.timeout_s,
        ),
        relative=request.relative,
        speed_rpm=speed,
        acceleration_rpm_s=_rpm(unit, request.acceleration),
        deceleration_rpm_s=_rpm(unit, request.deceleration),
        consent=request.consent,
    )


def sequence_settings(request: SequenceRequest, unit: TravelUnit) -> SequenceSettings:
    """Settings of a reciprocating move between two positions."""
    speed = unit.rpm(request.speed)
    return SequenceSettings(
        first=unit.rev(request.first),
        second=unit.rev(request.second),
        speed_rpm=speed,
        acceleration_rpm_s=unit.rpm(request.acceleration),
        dwell_s=request.dwell_s,
        count=request.count,
        envelope=_envelope(
            unit, request.travel_limit, speed, request.torque_limit, _SEQUENCE_MOVE_S
        ),
    )


def generator_settings(request: GenerateRequest, unit: TravelUnit) -> GeneratorSettings:
    """Settings of a test signal; amplitude and slope are in the unit of the mode's quantity."""
    convert = {"CSP": unit.rev, "CSV": unit.rpm}.get(request.mode, float)
    return GeneratorSettings(
        mode=request.mode,
        shape=request.shape,
        amplitude=convert(request.amplitude),
        duration_s=request.duration_s,
        envelope=_envelope(
            unit,
            request.travel_limit,
            unit.rpm(request.speed_limit),
            request.torque_limit,
            request.duration_s,
        ),
        frequency_hz=request.frequency_hz,
        frequency_end_hz=request.frequency_end_hz,
        acceleration=convert(request.acceleration),
    )


def homing_settings(request: HomeRequest, unit: TravelUnit) -> HomingSettings:
    """Settings of homing; values that are not given stay as they are in the drive."""
    switch = _rpm(unit, request.speed_switch)
    return HomingSettings(
        method=request.method,
        envelope=_envelope(
            unit,
            request.travel_limit,
            switch or _SPEED_UNLIMITED_RPM,
            request.torque_limit,
            request.timeout_s,
        ),
        speed_switch_rpm=switch,
        speed_zero_rpm=_rpm(unit, request.speed_zero),
        acceleration_rpm_s=_rpm(unit, request.acceleration),
        offset_rev=None if request.offset is None else unit.rev(request.offset),
    )


def jog_settings(request: JogStart, unit: TravelUnit) -> JogSettings:
    """Settings of a jog (hold-to-run)."""
    return JogSettings(
        direction=request.direction,
        speed_rpm=unit.rpm(request.speed),
        acceleration_rpm_s=unit.rpm(request.acceleration),
        travel_rev=unit.rev(request.travel_limit),
        torque_percent=request.torque_limit,
        shown=unit,
    )
