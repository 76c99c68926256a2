"""Routes of the functions of a drive family: fault history, gear, watch list, braking."""

from __future__ import annotations

import time
from typing import Annotated

from fastapi import APIRouter, Depends, Request

from backend.api.drive.models_functions import (
    AxisRecordInfo,
    BrakingInfo,
    BrakingRequest,
    FaultHistoryInfo,
    GearPlanInfo,
    GearValueInfo,
    GearWritten,
    IdentifyRequest,
    MechanicsUpdate,
    PastFaultInfo,
    WatchUpdate,
)
from backend.api.drive.models_parameters import ParameterValue
from backend.api.messages import convert
from backend.api.messages.errors import NotFound, message_of, message_or_none, words_of
from backend.api.messages.models import JobInfo
from backend.api.requests.context import Controlled, TheBench, TheDrive
from backend.axes.axis.axis import Envelope
from backend.axes.axis.fault_history import PastFault, history_of, read_history
from backend.axes.axis.remembered import AxisRecord, AxisStore
from backend.axes.drive.catalog import functions_of
from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.axes.functions import gear, regeneration
from backend.axes.scales.gear_calculator import GearPlan, Mechanics
from backend.axes.scales.units import gentlest_ramp_rpm_s
from backend.records.audit.asked import note_before
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.moving.moves import identification
from drivers.errors import DriveError
from drivers.texts.message import text
from profiles.functions import FaultHistory, Functions

router = APIRouter()
_DRIVE = "/drives/{drive_id}"
#: Speed limit [rpm] of an envelope that does not limit the speed.
_ANY_RPM = 20_000.0


async def store_of(request: Request) -> AxisStore:
    """The stored records of the axes of this bench."""
    store = request.app.state.axis_store
    if not isinstance(store, AxisStore):
        raise TypeError("the application was made without an axis store")
    return store


TheStore = Annotated[AxisStore, Depends(store_of)]


@router.get(f"{_DRIVE}/functions")
async def describe_functions(connected: TheDrive) -> Functions:
    """Describe the functions of this family beyond its parameters; the drive is not read."""
    return functions_of(connected.drive.profile)


# --- fault history ----------------------------------------------------------------------


@router.get(f"{_DRIVE}/fault-history")
async def fault_history(connected: TheDrive) -> FaultHistoryInfo:
    """Read the drive's fault record, unless that takes a write; then only describe the record."""
    history = history_of(connected.drive)
    if history is None or history.kind != "slots":
        return _history(connected.drive, history, None)
    return _history(connected.drive, history, await read_history(connected.axis))


@router.post(f"{_DRIVE}/fault-history/read")
async def read_fault_history(bench: TheBench, connected: Controlled) -> FaultHistoryInfo:
    """Read the drive's fault record; a selector is written and restored where needed."""
    entries = await read_history(connected.axis)
    bench.journal.add(
        text("journal.fault-history-read", drive=connected.drive.name), drive=connected.drive.id
    )
    return _history(connected.drive, history_of(connected.drive), entries)


def _history(
    drive: Drive, history: FaultHistory | None, entries: list[PastFault] | None
) -> FaultHistoryInfo:
    clear = drive.profile.procedure("clear_history")
    return FaultHistoryInfo(
        kind=history.kind if history else "unknown",
        size=history.size if history else 0,
        newest_first=history.newest_first if history else True,
        source=history.source if history else "",
        notes=history.notes if history else "",
        clear=clear.name if clear else "",
        read_at=None if entries is None else convert.moment(time.time()),
        entries=[_past(entry) for entry in entries or []],
    )


def _past(past: PastFault) -> PastFaultInfo:
    fault = past.fault
    return PastFaultInfo(
        name=words_of(past.name),
        name_message=message_of(past.name) if past.name.code else None,
        code=past.code_text,
        known=fault is not None,
        title=fault.name if fault else "",
        kind=fault.kind if fault else None,
        causes=list(fault.causes) if fault else [],
        remedies=list(fault.remedies) if fault else [],
        reset=fault.reset if fault else "",
        # Values frozen in the drive with this fault: a later read through the same selector
        # would return another record.
        values=[_frozen(reading) for reading in past.values],
        error=words_of(past.problem),
        error_message=message_or_none(past.problem),
    )


def _frozen(reading: Reading) -> ParameterValue:
    return ParameterValue(
        key=reading.key,
        raw=reading.raw,
        value=reading.value,
        time=convert.moment(reading.time) if reading.time else None,
        error=words_of(reading.problem),
        error_message=message_or_none(reading.problem),
    )


# --- identification by the drive --------------------------------------------------------


@router.post(f"{_DRIVE}/jobs/identify", status_code=202)
async def start_identification(
    bench: TheBench, connected: Controlled, request: IdentifyRequest
) -> JobInfo:
    """Start the drive's own identification of motor and load; the motor moves."""
    identification.require_identification(connected.axis)
    # The drive chooses the speed: only travel, torque and time are limited here.
    envelope = Envelope(request.travel_limit, _ANY_RPM, request.torque_limit, request.timeout_s)
    settings = identification.IdentifySettings(envelope, request.confirmed)
    job = bench.jobs.start(
        "identify",
        text("api-drive.identification-drive", member_drive=connected.drive.name),
        lambda progress: identification.identify(connected.axis, settings, progress),
        drive=connected.drive.id,
        motion=True,
    )
    bench.journal.add(
        text("journal.identification-by-drive", drive=connected.drive.name),
        drive=connected.drive.id,
    )
    return convert.job(job)


# --- mechanics and watch list -----------------------------------------------------------


@router.get(f"{_DRIVE}/record")
async def axis_record(connected: TheDrive, store: TheStore) -> AxisRecordInfo:
    """Read mechanics and watch list of an axis, and the gentlest ramp that its drive accepts."""
    return _record(connected, store.get(connected.drive.id))


@router.put(f"{_DRIVE}/mechanics")
async def keep_mechanics(
    connected: Controlled, store: TheStore, request: MechanicsUpdate
) -> AxisRecordInfo:
    """Store the mechanics, so that pages show travel. Nothing is written to the drive."""
    if request.mechanics is not None:
        request.mechanics.travel_per_load_turn()
    old = store.get(connected.drive.id)
    note_before(mechanics=None if old.mechanics is None else old.mechanics.model_dump())
    kept = old.model_copy(update={"mechanics": request.mechanics})
    return _record(connected, store.put(connected.drive.id, kept))


@router.put(f"{_DRIVE}/watch")
async def keep_watch(
    connected: Controlled, store: TheStore, request: WatchUpdate
) -> AxisRecordInfo:
    """Store the watch list.

    Raises:
        NotFound: a key is not a parameter of this drive.
    """
    keys: list[str] = []
    for key in request.keys:
        parameter = connected.drive.profile.parameter(key)
        if parameter is None:
            raise NotFound("api-drive.no-parameter", drive=connected.drive.name, key=key)
        if parameter.key not in keys:
            keys.append(parameter.key)
    old = store.get(connected.drive.id)
    note_before(keys=old.watch)
    kept = old.model_copy(update={"watch": tuple(keys)})
    return _record(connected, store.put(connected.drive.id, kept))


def _record(connected: ConnectedDrive, record: AxisRecord) -> AxisRecordInfo:
    mechanics = record.mechanics
    ramp = connected.drive.key("profile_acceleration")
    return AxisRecordInfo(
        mechanics=mechanics,
        gentlest_ramp_rpm_s=gentlest_ramp_rpm_s(connected.drive, ramp) if ramp else None,
        travel_unit=mechanics.unit if mechanics else "",
        travel_per_motor_turn=float(mechanics.travel_per_motor_turn()) if mechanics else None,
        watch=list(record.watch),
    )


@router.post(f"{_DRIVE}/gear/plan")
async def plan_gear(connected: TheDrive, request: Mechanics) -> GearPlanInfo:
    """Calculate the gear for these mechanics. Nothing is written."""
    plan = await gear.plan(connected.axis, request)
    readings = await connected.drive.read_many([value.parameter.key for value in plan.values])
    rpm = await _greatest_rpm(connected)
    limits = functions_of(connected.drive.profile).gear
    return GearPlanInfo(
        unit=plan.unit,
        values=[
            GearValueInfo(
                key=value.parameter.key,
                name=value.parameter.name,
                now=readings[value.parameter.key].raw,
                raw=value.raw,
            )
            for value in plan.values
        ],
        wanted=plan.wanted,
        reached=plan.reached,
        error_ppm=plan.error_ppm,
        travel_per_motor_turn=plan.travel_per_motor_turn,
        encoder_counts=plan.encoder_counts,
        encoder_travel=plan.encoder_travel,
        range_travel=plan.range_travel,
        max_speed=None if rpm is None else rpm / 60.0 * plan.travel_per_motor_turn,
        max_speed_rpm=rpm,
        acts=limits.acts,
        notes=limits.notes,
        source=limits.source,
        warnings=[words_of(each) for each in plan.warnings],
        warnings_messages=[message_of(each) for each in plan.warnings],
        counted=counted(connected, plan),
    )


def counted(connected: ConnectedDrive, plan: GearPlan) -> list[str]:
    """Parameters in user increments, whose meaning changes; none if the gear stays the same."""
    now = connected.drive.readings
    same = all(
        (reading := now.get(value.parameter.key)) is not None and reading.raw == value.raw
        for value in plan.values
    )
    return [] if same else gear.counted_in_increments(connected.axis)


async def _greatest_rpm(connected: ConnectedDrive) -> float | None:
    """Maximum motor speed, otherwise rated speed, if the drive reports it in rpm; else None."""
    for role in ("max_speed", "rated_speed"):
        parameter = connected.drive.profile.by_role.get(role)
        if parameter is None or parameter.unit != "rpm" or connected.drive.key(role) is None:
            continue
        try:
            value = (await connected.drive.read(parameter.key)).value
        except DriveError:
            continue  # only the speed in the preview is missing then
        if isinstance(value, (int, float)) and value > 0:
            return float(value)
    return None


@router.post(f"{_DRIVE}/gear/write")
async def write_gear(
    bench: TheBench, connected: Controlled, store: TheStore, request: Mechanics
) -> GearWritten:
    """Write the gear for these mechanics, all values or none, and store the mechanics."""
    with bench.motion.keeping_still(connected):
        plan = await gear.plan(connected.axis, request)
        change = await gear.write_gear(connected.axis, plan.values)
    old = store.get(connected.drive.id)
    store.put(connected.drive.id, old.model_copy(update={"mechanics": request}))
    for value in plan.values:
        key = value.parameter.key
        if key in change.before:
            bench.journal.add(
                text(
                    "journal.parameter-written",
                    drive=connected.drive.name,
                    key=key,
                    name=value.parameter.name,
                    before=str(change.before[key]),
                    after=str(value.raw),
                ),
                drive=connected.drive.id,
            )
    return GearWritten(before=change.before, waits=change.waits)


# --- braking ----------------------------------------------------------------------------


@router.post("/calculate/braking")
async def calculate_braking(request: BrakingRequest) -> BrakingInfo:
    """Calculate the energy of braking and the braking resistor that absorbs it."""
    built_in = None
    if request.built_in_ohm is not None and request.built_in_w is not None:
        built_in = regeneration.Resistor(request.built_in_ohm, request.built_in_w)
    result = regeneration.braking(
        regeneration.BrakingCycle(
            request.inertia_kgm2,
            request.speed_rpm,
            request.deceleration_s,
            request.cycle_s,
            request.stops_per_cycle,
            request.efficiency,
            request.fall_energy_j,
        ),
        regeneration.BrakingLimits(
            request.capacitor_j,
            built_in,
            request.min_external_ohm,
            request.max_external_w,
            request.on_voltage_v,
        ),
    )
    return BrakingInfo(
        kinetic_j=result.kinetic_j,
        returned_j=result.returned_j,
        excess_j=result.excess_j,
        average_w=result.average_w,
        peak_w=result.peak_w,
        verdict=result.verdict,
        external_w=result.external_w,
        min_ohm=result.min_ohm,
        max_ohm=result.max_ohm,
        possible=result.possible,
    )
