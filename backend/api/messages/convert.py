"""Conversion of the server's own types to messages of the interface."""

from __future__ import annotations

from datetime import UTC, datetime

from backend.api.drive import models_axis, models_parameters
from backend.api.drive.convert_stop import turning
from backend.api.messages import models
from backend.api.messages.errors import message_of, message_or_none, problem_of, words_of
from backend.api.records.sets import models as models_sets
from backend.api.station import models as models_bench
from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.axes.motion.alternatives import alternative_of
from backend.axes.motion.classes import motion_of
from backend.axes.parameters.set_file import Difference
from backend.foundation.people.elapsed import moment_of
from backend.foundation.work.jobs import Job
from backend.foundation.work.journal import Entry
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.station.drives.matching import match_profiles
from backend.station.drives.monitor import Snapshot
from backend.tools.moving.moves.procedures import describe
from backend.tools.spoken import result_in_language
from drivers import cia402
from drivers.cia402 import Mode
from drivers.link import Found, Link, LinkQuality
from drivers.texts.message import language
from profiles.schema import ConfirmStep, Fault, Parameter, Procedure


def moment(seconds: float) -> datetime:
    """Convert epoch seconds to a time in UTC."""
    return datetime.fromtimestamp(seconds, UTC)


def quality(now: LinkQuality) -> models_bench.Quality:
    """Connection state and counters of a link."""
    return models_bench.Quality(
        connected=now.connected,
        state=words_of(now.state),
        state_message=message_or_none(now.state),
        transactions=now.transactions,
        timeouts=now.timeouts,
        crc_errors=now.crc_errors,
        framing_errors=now.framing_errors,
        retries=now.retries,
        lost_frames=now.lost_frames,
        wkc_errors=now.wkc_errors,
        round_trip_ms=now.round_trip_ms,
        details=now.details,
    )


def bus(bench: Bench, url: str, link: Link) -> models_bench.Bus:
    """An opened bus with its quality and cyclic exchange."""
    session = bench.sessions.get(url)
    info = None
    if session is not None and session.state is not None:
        info = models_bench.CyclicInfo(
            running=session.running,
            problem=words_of(session.trouble),
            problem_message=message_or_none(session.trouble),
            cycle_us=session.state.cycle_s * 1e6,
            dc=session.state.dc,
            channels=list(session.state.channels),
            left_over={channel: words_of(why) for channel, why in session.state.left_over},
            left_over_messages={
                channel: message_of(why) for channel, why in session.state.left_over
            },
        )
    return models_bench.Bus(
        url=url,
        kind=link.kind,
        quality=quality(link.quality()),
        cyclic_possible=link.cyclic is not None,
        cyclic=info,
    )


def lease(bench: Bench, drive: str, connection: str | None) -> models_bench.Lease:
    """Control of a drive, as seen from ``connection``."""
    holder = bench.leases.holder(drive)
    if holder is None:
        return models_bench.Lease(holder=None, since=None)
    asked = bench.leases.asked(drive)
    return models_bench.Lease(
        holder=holder.person,
        since=moment(holder.since),
        mine=holder.connection == connection,
        connection=holder.connection,
        until=None if holder.until is None else moment(moment_of(holder.until)),
        asked_by=None if asked is None else asked.person,
        asked_until=None if asked is None else moment(moment_of(asked.until)),
    )


def drive_summary(
    bench: Bench, connected: ConnectedDrive, connection: str | None = None
) -> models_bench.DriveSummary:
    """Summary of a drive of the bench."""
    drive, found = connected.drive, connected.drive.found
    return models_bench.DriveSummary(
        id=drive.id,
        name=drive.name,
        notes=drive.notes,
        profile=drive.profile.drive,
        title=drive.profile.title,
        maker=drive.profile.identity.maker,
        partial=drive.profile.partial,
        ports=[
            models_bench.PortInfo(
                url=bench.buses.url_of(port),
                kind=port.link.kind,
                station=port.station,
                watchdog=bool(port.spec and port.spec.watchdog.present),
                watchdog_help=port.spec.watchdog.help if port.spec else "",
            )
            for port in drive.ports
        ],
        connected=connected.monitor.snapshot.fresh,
        serial=found.serial if found else None,
        firmware=found.firmware if found else "",
        identity_warning=words_of(drive.identity_warning),
        identity_warning_message=message_or_none(drive.identity_warning),
        unsaved=len(drive.unsaved),
        pending=len(drive.pending),
        pending_restores=[
            models_bench.PendingRestoreValue(
                key=entry.key,
                name=drive.parameter(entry.key).name,
                raw=entry.raw,
                unapplied=entry.unapplied,
            )
            for entry in drive.pending_restores.entries
        ],
        lease=lease(bench, drive.id, connection),
        quality=quality(drive.quality()),
    )


def fault(known: Fault) -> models_axis.ActiveFault:
    """A fault with its causes and remedies."""
    return models_axis.ActiveFault(
        code=known.code,
        name=known.name,
        kind=known.kind,
        causes=list(known.causes),
        remedies=list(known.remedies),
        reset=known.reset,
        source=known.source,
    )


def axis_state(bench: Bench, connected: ConnectedDrive, now: Snapshot) -> models_axis.AxisState:
    """State of an axis from a snapshot of its monitor."""
    job = bench.jobs.moving(connected.drive.id)
    try:
        name = cia402.MODE_NAMES[Mode(now.mode or 0)]
    except ValueError:
        name = f"Mode {now.mode}"
    value = now.values.get
    return models_axis.AxisState(
        drive=connected.drive.id,
        time=moment(now.time),
        fresh=now.fresh,
        problem=words_of(now.problem),
        problem_message=message_or_none(now.problem),
        state=now.state.value,
        status_word=now.status_word,
        mode=now.mode,
        mode_name=name,
        modes=list(connected.drive.modes),
        goals=[goal.value for goal in cia402.allowed_goals(now.state)] if now.fresh else [],
        target_reached=now.target_reached,
        internal_limit=now.internal_limit,
        mode_bits=now.mode_bits,
        position=value("position"),
        velocity=value("velocity"),
        torque=value("torque"),
        following_error=value("following_error"),
        dc_voltage=value("dc_voltage"),
        temperature=value("temperature"),
        units=now.units,
        faults=[fault(known) for known in now.faults],
        blocked_by=[words_of(cause) for cause in now.blocked_by],
        blocked_by_messages=[message_of(cause) for cause in now.blocked_by],
        moving_job=job.id if job else None,
        turning=turning(now.turning),
    )


def reading(drive: Drive, key: str) -> models_parameters.ParameterValue:
    """Last reading of a parameter."""
    last = drive.readings.get(key) or Reading(key, None, None, None)
    return models_parameters.ParameterValue(
        key=key,
        raw=last.raw,
        value=last.value,
        time=moment(last.time) if last.time else None,
        error=words_of(last.problem),
        error_message=message_or_none(last.problem),
        unused=last.unused,
        unsaved=key in drive.unsaved,
        pending=drive.pending.get(key, ""),
    )


def readings(drive: Drive, keys: list[str]) -> list[models_parameters.ParameterValue]:
    """Like `reading` for many parameters, with unsaved and pending values looked up once."""
    unsaved, pending = drive.unsaved, drive.pending
    result = []
    for key in keys:
        last = drive.readings.get(key) or Reading(key, None, None, None)
        result.append(
            models_parameters.ParameterValue.model_construct(
                key=key,
                raw=last.raw,
                value=last.value,
                time=moment(last.time) if last.time else None,
                error=words_of(last.problem),
                error_message=message_or_none(last.problem),
                unused=last.unused,
                unsaved=key in unsaved,
                pending=pending.get(key, ""),
            )
        )
    return result


def parameter_row(
    drive: Drive, parameter: Parameter, last: models_parameters.ParameterValue
) -> models_parameters.ParameterRow:
    """Description and last reading of a parameter."""
    why = drive.unreachable_why(parameter)
    energises = motion_of(parameter) == "energises"
    door = alternative_of(drive.profile, parameter) if energises else None
    return models_parameters.ParameterRow.model_construct(
        key=parameter.key,
        number=parameter.number,
        name=parameter.name,
        group=parameter.group,
        type=parameter.type,
        access=parameter.access,
        pdo=parameter.pdo,
        unit=parameter.unit,
        scale=parameter.scale,
        offset=parameter.offset,
        min_raw=parameter.raw_limits[0],
        max_raw=parameter.raw_limits[1],
        default_raw=parameter.default_raw,
        enum=parameter.enum,
        bits=parameter.bits,
        effective=parameter.effective,
        settable=parameter.settable,
        motor_individual=parameter.motor_individual,
        motion=motion_of(parameter),
        safe_in_motion=parameter.safe_in_motion,
        motion_page="" if door is None else door.page,
        motion_how=words_of(None if door is None else door.how),
        motion_how_message=message_or_none(None if door is None else door.how),
        help=parameter.help,
        source=parameter.source,
        also_printed=list(parameter.also_printed),
        notes=parameter.notes,
        reachable=why is None,
        unreachable_why=words_of(why),
        unreachable_why_message=message_or_none(why),
        reading=last,
    )


def procedure(known: Procedure) -> models_axis.ProcedureInfo:
    """A procedure of the profile."""
    steps = describe(known)
    return models_axis.ProcedureInfo(
        name=known.name,
        title=known.title,
        help=known.help,
        warning=known.warning,
        requires_stop=known.requires_stop,
        confirm=[step.text for step in known.steps if isinstance(step, ConfirmStep)],
        steps=[step.words(language()) for step in steps],
        step_messages=[message_of(step) for step in steps],
        source=known.source,
        notes=known.notes,
    )


def job(known: Job) -> models.JobInfo:
    """State, progress and result of a job."""
    return models.JobInfo(
        id=known.id,
        kind=known.kind,
        drive=known.drive,
        title=known.title_text.words(language()),
        title_message=message_of(known.title_text),
        state=known.state,
        progress=known.progress.fraction,
        step=known.progress.step_text.words(language()),
        step_message=message_of(known.progress.step_text),
        started=moment(known.started),
        ended=moment(known.ended) if known.ended else None,
        motion=known.motion,
        result=known.result and result_in_language(known.result, language()),
        problem=problem_of(known.error) if known.error else None,
        cancellation=_cancellation(known),
    )


def _cancellation(known: Job) -> models.Cancellation | None:
    cause = known.cancel_cause
    if known.state != "cancelled" or cause is None:
        return None
    remedy = cause.remedy()
    return models.Cancellation(
        cause=cause.words(language()),
        cause_message=message_of(cause),
        remedy=None if remedy is None else remedy.words(language()),
        remedy_message=message_or_none(remedy),
    )


def found_drive(bench: Bench, url: str, kind: str, found: Found) -> models_bench.FoundDrive:
    """A drive found by a scan."""
    user = next(
        (
            connected.drive.id
            for connected in bench.connected_drives.values()
            for port in connected.drive.ports
            if bench.buses.url_of(port) == url and port.station == found.station
        ),
        None,
    )
    return models_bench.FoundDrive(
        url=url,
        station=found.station,
        vendor_id=found.vendor_id,
        product_code=found.product_code,
        revision=found.revision,
        serial=found.serial,
        name=found.name,
        alias=found.alias,
        hardware=found.hardware,
        firmware=found.firmware,
        state=words_of(found.state),
        state_message=message_or_none(found.state),
        notes=[note.words(language()) for note in found.notes],
        note_messages=[message_of(note) for note in found.notes],
        matches=matches(kind, found),
        connected_as=user,
    )


def matches(kind: str, found: Found) -> list[models_bench.ProfileMatch]:
    """Profiles that match a found drive, best match first."""
    return [
        models_bench.ProfileMatch(
            profile=match.profile.drive,
            title=match.profile.title,
            confidence=match.confidence,
            why=words_of(match.why),
            why_message=message_of(match.why),
        )
        for match in match_profiles(kind, found)
    ]


def difference(row: Difference) -> models_sets.DiffRow:
    """One row of a comparison."""
    known = row.parameter

    def value(raw: int | float | str | None) -> int | float | str | None:
        if raw is None or known is None:
            return raw
        return raw if isinstance(raw, str) else known.to_value(raw)

    default = known.default_raw if known else None
    return models_sets.DiffRow(
        key=row.key,
        name=known.name if known else "",
        group=known.group if known else "",
        unit=known.unit if known else "",
        file_raw=row.theirs,
        file_value=value(row.theirs),
        drive_raw=row.ours,
        drive_value=value(row.ours),
        default_raw=default,
        default_value=value(default),
        status=row.status,
        problem=words_of(row.problem),
        problem_message=message_or_none(row.problem),
        motor_individual=bool(known and known.motor_individual),
        selected=row.selected,
    )


def log_entry(entry: Entry) -> models.LogEntry:
    """A line of the log."""
    return models.LogEntry(
        time=moment(entry.time),
        level=entry.level,
        drive=entry.drive,
        person=entry.person,
        text=words_of(entry.message),
        message=message_of(entry.message),
    )
