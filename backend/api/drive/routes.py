"""Routes of one drive: state, parameters, procedures, motion."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Awaitable, Callable, Iterable

from fastapi import APIRouter

from backend.api.drive import convert_motion
from backend.api.drive.models_axis import (
    ActiveFault,
    AxisState,
    ProcedureInfo,
    ProcedureRequest,
    TransitionRequest,
)
from backend.api.drive.models_motion import (
    GenerateRequest,
    HomeRequest,
    HomingMethodInfo,
    MoveRequest,
    SequenceRequest,
)
from backend.api.drive.models_parameters import (
    MotionSettingWrite,
    ParameterRow,
    ParameterValue,
    ParameterWrite,
    ParameterWrites,
    ReadAllRequest,
    WriteResult,
)
from backend.api.messages import convert
from backend.api.messages.errors import NotFound, problem_of
from backend.api.messages.models import JobInfo
from backend.api.records.sets.models import LoadSetRequest
from backend.api.requests.context import Controlled, TheBench, TheDrive
from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.axes.functions.assign import assign
from backend.axes.motion.classes import held_still, motion_of
from backend.foundation.work.jobs import JobResult, Progress
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools import parameters
from backend.tools.moving.jog import cyclic as cyclic_motion
from backend.tools.moving.moves import homing, move, procedures
from drivers.cia402 import Mode, State
from drivers.errors import DriveError, NotAllowed, OutOfRange
from drivers.texts.message import Text, profile_text, text
from drivers.texts.states import state_text
from profiles.schema import Parameter, Raw

_DIGITS = re.compile(r"-?[0-9]{1,20}")
router = APIRouter(prefix="/drives/{drive_id}")


@router.get("/state")
async def state(bench: TheBench, connected: TheDrive) -> AxisState:
    """Read the state of the axis now."""
    return convert.axis_state(bench, connected, await connected.monitor.refresh())


@router.get("/faults")
async def faults(connected: TheDrive) -> list[ActiveFault]:
    """Read the faults and warnings that are active now."""
    return [convert.fault(fault) for fault in await connected.axis.active_faults()]


@router.post("/transition")
async def transition(
    bench: TheBench, connected: Controlled, request: TransitionRequest
) -> AxisState:
    """Drive the power state machine. Enabling sets the setpoint to the actual position first."""
    goal = State(request.goal)
    mode = None if request.mode is None else _mode(connected, request.mode)
    await _alone(bench, connected, state_text(goal), lambda: connected.axis.transition(goal, mode))
    bench.journal.add(
        text("journal.power-state", drive=connected.drive.name, state=state_text(goal)),
        drive=connected.drive.id,
    )
    return convert.axis_state(bench, connected, await connected.monitor.refresh())


async def _alone(
    bench: Bench, connected: ConnectedDrive, title: Text, work: Callable[[], Awaitable[object]]
) -> None:
    """Change the power state as a motion job: no other motion can begin, and STOP cancels it.

    Raises:
        Busy: the axis is moved by a job.
        NotAllowed: STOP was pressed.
        DriveError: the work failed.
    """

    async def run(_progress: Progress) -> JobResult | None:
        await work()
        return None

    drive = connected.drive
    job = bench.jobs.start(
        "power",
        text("work.of-drive", title=title, drive=drive.name),
        run,
        drive=drive.id,
        motion=True,
    )
    await job.wait()
    if job.state == "cancelled":
        why = job.cancel_cause or text("work.cancelled-by-command")
        raise NotAllowed(
            "api-drive.cancelled-during",
            drive=drive.name,
            title=title,
            why=why,
            remedy=why.remedy(),
        )
    if job.error is not None:
        raise job.error


def _mode(connected: ConnectedDrive, number: int) -> Mode:
    try:
        return Mode(number)
    except ValueError as error:
        raise OutOfRange(
            "api-drive.no-mode",
            drive=connected.drive.name,
            value=number,
            limit=", ".join(str(mode) for mode in connected.drive.modes),
        ) from error


@router.post("/fault-reset")
async def fault_reset(bench: TheBench, connected: Controlled) -> AxisState:
    """Reset faults whose cause is gone."""
    await _alone(bench, connected, text("api-drive.fault-reset"), connected.axis.reset_fault)
    bench.journal.add(
        text("journal.fault-reset", drive=connected.drive.name), drive=connected.drive.id
    )
    return convert.axis_state(bench, connected, await connected.monitor.refresh())


# --- parameters -----------------------------------------------------------------------


@router.get("/parameters")
async def list_parameters(connected: TheDrive) -> list[ParameterRow]:
    """List all parameters with their last readings; nothing is read from the drive."""
    drive = connected.drive
    last = convert.readings(drive, [p.key for p in drive.profile.parameters])
    return [
        convert.parameter_row(drive, parameter, value)
        for parameter, value in zip(drive.profile.parameters, last, strict=True)
    ]


@router.put("/parameters")
async def write_parameters(
    bench: TheBench, connected: Controlled, request: ParameterWrites
) -> list[WriteResult]:
    """Write several parameters, one after the other; a failure does not stop the rest."""
    results: list[WriteResult] = []
    for key, value in request.values.items():
        try:
            await _write(bench, connected, key, value)
            problem = None
        except DriveError as error:
            problem = problem_of(error)
        known = connected.drive.profile.parameter(key)
        last = convert.reading(connected.drive, known.key if known else key)
        results.append(WriteResult(key=key, ok=problem is None, reading=last, problem=problem))
    return results


@router.get("/parameters/{key}")
async def read_parameter(connected: TheDrive, key: str) -> ParameterValue:
    """Read one parameter from the drive."""
    _require_known(connected, key)
    reading = await connected.drive.read(key)
    return convert.reading(connected.drive, reading.key)


@router.put("/parameters/{key}")
async def write_parameter(
    bench: TheBench, connected: Controlled, key: str, request: ParameterWrite
) -> ParameterValue:
    """Write one parameter and read it back."""
    _require_known(connected, key)
    reading = await _write(bench, connected, key, request)
    return convert.reading(connected.drive, reading.key)


def _choose(known: Iterable[str]) -> Text:
    """Remedy for an unknown name: the names that exist."""
    there = ", ".join(known)
    return text("api-drive.choose-one", names=there) if there else text("api-drive.has-none")


def _require_known(connected: ConnectedDrive, key: str) -> None:
    if connected.drive.profile.parameter(key) is None:
        raise NotFound(
            "api-drive.no-parameter-search-parameters", drive=connected.drive.name, parameter=key
        )


async def _write(
    bench: TheBench, connected: ConnectedDrive, key: str, request: ParameterWrite
) -> Reading:
    drive = connected.drive
    if (request.raw is None) == (request.value is None):
        raise OutOfRange("api-drive.give-either-raw-value", drive=drive.name, parameter=key)
    parameter = drive.parameter(key)
    old = drive.readings.get(parameter.key)
    value, raw = request.value, request.raw is not None
    if request.raw is not None:
        value = _exact(parameter, request.raw)
    matters = drive.matters_to_motion(parameter.key) or held_still(parameter)
    # Objects that energise are refused in any case (by `write`), the others while something moves.
    still = matters and motion_of(parameter) != "energises"
    with bench.motion.keeping_still(connected) if still else contextlib.nullcontext():
        if still and drive.commands_motion(parameter.key):
            await _require_disabled(connected, parameter.key)
        reading = await drive.write(key, 0 if value is None else value, raw=raw)
    bench.journal.add(
        text(
            "journal.parameter-written",
            drive=drive.name,
            key=parameter.key,
            name=profile_text(drive.profile.drive, parameter.name),
            before=str(old.value) if old else text("journal.not-read"),
            after=f"{reading.value} {parameter.unit}".rstrip(),
        ),
        drive=drive.id,
    )
    if parameter.key in drive.profile.unit_keys:
        connected.axis.forget()
    return reading


@router.put("/motion-settings/{key}")
async def write_motion_setting(
    bench: TheBench, connected: Controlled, key: str, request: MotionSettingWrite
) -> ParameterValue:
    """Write a setting that can start a motion at once; only while the motor has no power.

    These are functions of terminals, control sources and the mapping of process data. The shaft is
    watched: if it begins to turn, the setting is restored and the axis is stopped. The grant is for
    this one write and ends with it; ``reason`` is in log and audit.
    """
    _require_known(connected, key)
    drive = connected.drive
    parameter = drive.parameter(key)
    raw = _raw_of(drive, parameter, request)
    old = drive.readings.get(parameter.key)
    bench.motion.require_stays(connected)
    reason = request.reason.strip()
    with bench.motion.keeping_still(connected):
        reading = await assign(connected.axis, parameter.key, raw, reason)
    bench.journal.add(
        text(
            "journal.parameter-written-because" if reason else "journal.parameter-written",
            drive=drive.name,
            key=parameter.key,
            name=profile_text(drive.profile.drive, parameter.name),
            before=str(old.value) if old else text("journal.not-read"),
            after=str(reading.value),
            reason=reason,
        ),
        level="warning",
        drive=drive.id,
    )
    return convert.reading(drive, reading.key)


def _exact(parameter: Parameter, raw: Raw) -> Raw:
    """A whole number that was given as its digits: a page has no exact number beyond 2^53."""
    digits = isinstance(raw, str) and parameter.is_integer and _DIGITS.fullmatch(raw)
    return int(raw) if digits else raw


def _raw_of(drive: Drive, parameter: Parameter, request: ParameterWrite) -> Raw:
    """Raw value of a request, which contains either a raw or a converted value."""
    if (request.raw is None) == (request.value is None):
        raise OutOfRange(
            "api-drive.give-either-raw-value", drive=drive.name, parameter=parameter.key
        )
    if request.raw is not None:
        return _exact(parameter, request.raw)
    value = 0 if request.value is None else request.value
    try:
        return value if isinstance(value, str) else parameter.to_raw(value)
    except OverflowError as error:
        raise OutOfRange(
            "api-drive.no-number", drive=drive.name, parameter=parameter.key, given=value
        ) from error


async def _require_disabled(connected: ConnectedDrive, key: str) -> None:
    """Check that the axis is not enabled: a write would move it without an envelope.

    Raises:
        NotAllowed: the axis is enabled.
    """
    if await connected.axis.state() is State.OPERATION_ENABLED:
        raise NotAllowed(
            "api-drive.commands-motion-axis-enabled", drive=connected.drive.name, parameter=key
        )


# --- procedures and jobs --------------------------------------------------------------


@router.get("/procedures")
async def list_procedures(connected: TheDrive) -> list[ProcedureInfo]:
    """List the procedures of this family."""
    return [convert.procedure(known) for known in connected.drive.profile.procedures]


@router.post("/procedures/{name}", status_code=202)
async def run_procedure(
    bench: TheBench, connected: Controlled, name: str, request: ProcedureRequest
) -> JobInfo:
    """Run a procedure."""
    known = connected.drive.profile.procedure(name)
    if known is None:
        raise NotFound(
            "api-drive.no-procedure",
            drive=connected.drive.name,
            value=name,
            remedy=_choose(p.name for p in connected.drive.profile.procedures),
        )
    bench.motion.require_idle(connected)
    job = bench.jobs.start(
        "procedure",
        text("work.of-drive", title=known.title, drive=connected.drive.name),
        lambda progress: procedures.run_procedure(
            connected.axis, known, request.confirmed, progress
        ),
        drive=connected.drive.id,
        motion=True,
    )
    bench.journal.add(job.title_text, drive=connected.drive.id)
    return convert.job(job)


@router.post("/jobs/read_all", status_code=202)
async def read_all(bench: TheBench, connected: TheDrive, request: ReadAllRequest) -> JobInfo:
    """Read parameters; the values are sent over the websocket as they arrive."""
    for key in request.keys or []:
        _require_known(connected, key)
    job = bench.jobs.start(
        "read_all",
        text("api-drive.read", member_drive=connected.drive.name),
        lambda progress: parameters.read_all(connected.drive, request.keys, progress),
        drive=connected.drive.id,
    )
    return convert.job(job)


@router.post("/jobs/load_set", status_code=202)
async def load_set(bench: TheBench, connected: Controlled, request: LoadSetRequest) -> JobInfo:
    """Write chosen rows of a parameter set, each read back."""
    content = await bench.records.store.call(bench.sets.load, request.file, request.version)
    job = bench.jobs.start(
        "load_set",
        text("api-drive.load", file=request.file, member_drive=connected.drive.name),
        lambda progress: parameters.load_set(
            connected.drive,
            content,
            request.keys,
            progress,
            library=bench.sets,
            accept_other_identity=request.accept_other_identity,
            accept_motor_individual=request.accept_motor_individual,
        ),
        drive=connected.drive.id,
        # Nothing may move while its settings change, and a set must not be left half written.
        motion=True,
        stoppable=False,
    )
    bench.journal.add(
        text(
            "journal.load-set-version" if request.version else "journal.load-set",
            drive=connected.drive.name,
            file=request.file,
            version=request.version,
        ),
        drive=connected.drive.id,
    )
    return convert.job(job)


@router.post("/jobs/move", status_code=202)
async def start_move(bench: TheBench, connected: Controlled, request: MoveRequest) -> JobInfo:
    """Start one move in a profile mode."""
    unit = await convert_motion.unit_of(bench, connected, request.unit)
    settings = convert_motion.move_settings(request, unit)
    job = bench.jobs.start(
        "move",
        text("api-drive.move", member_drive=connected.drive.name, mode=request.mode),
        lambda progress: move.move(connected.axis, settings, progress),
        drive=connected.drive.id,
        motion=True,
    )
    return convert.job(job)


@router.post("/jobs/sequence", status_code=202)
async def start_sequence(
    bench: TheBench, connected: Controlled, request: SequenceRequest
) -> JobInfo:
    """Start a reciprocating move between two positions."""
    unit = await convert_motion.unit_of(bench, connected, request.unit)
    settings = convert_motion.sequence_settings(request, unit)
    job = bench.jobs.start(
        "sequence",
        text("api-drive.back-forth", member_drive=connected.drive.name),
        lambda progress: move.sequence(connected.axis, settings, progress),
        drive=connected.drive.id,
        motion=True,
    )
    return convert.job(job)


@router.post("/jobs/generate", status_code=202)
async def start_generator(
    bench: TheBench, connected: Controlled, request: GenerateRequest
) -> JobInfo:
    """Output a test signal in a cyclic mode, one value per cycle."""
    session = connected.axis.session
    if session is None or not session.running:
        raise NotAllowed("api-drive.cyclic-exchange-not-run", drive=connected.drive.name)
    unit = await convert_motion.unit_of(bench, connected, request.unit)
    settings = convert_motion.generator_settings(request, unit)
    job = bench.jobs.start(
        "generate",
        text(
            "api-drive.detail",
            shape=request.shape,
            mode=request.mode,
            member_drive=connected.drive.name,
        ),
        lambda progress: cyclic_motion.generate(connected.axis, session, settings, progress),
        drive=connected.drive.id,
        motion=True,
    )
    return convert.job(job)


@router.get("/homing-methods")
async def homing_methods(connected: TheDrive) -> list[HomingMethodInfo]:
    """List the homing methods of this family."""
    return [
        HomingMethodInfo(**known.model_dump(exclude={"parameters"}))
        for known in connected.drive.profile.homing_methods
    ]


@router.post("/jobs/home", status_code=202)
async def start_homing(bench: TheBench, connected: Controlled, request: HomeRequest) -> JobInfo:
    """Home the axis."""
    unit = await convert_motion.unit_of(bench, connected, request.unit)
    settings = convert_motion.homing_settings(request, unit)
    if request.method not in {m.method for m in connected.drive.profile.homing_methods}:
        raise NotAllowed(
            "api-drive.no-homing-method",
            drive=connected.drive.name,
            value=request.method,
            remedy=_choose(str(m.method) for m in connected.drive.profile.homing_methods),
        )
    job = bench.jobs.start(
        "home",
        text("api-drive.home-method", member_drive=connected.drive.name, method=request.method),
        lambda progress: homing.home(connected.axis, settings, progress),
        drive=connected.drive.id,
        motion=True,
    )
    return convert.job(job)
