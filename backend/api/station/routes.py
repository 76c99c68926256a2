"""Routes of the station: interfaces, buses, scan, drives, jobs, log, STOP."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query, Response

import backend
from backend.api.drive.convert_stop import stop_result
from backend.api.drive.models_axis import StopRequest, StopResult
from backend.api.messages import convert
from backend.api.messages.errors import NotFound, message_of, words_of
from backend.api.messages.models import JobInfo, LogEntry
from backend.api.requests.context import (
    Connection,
    Controlled,
    Me,
    TheBench,
    TheDrive,
    ThePeople,
    member_of,
)
from backend.api.security.gate import require_right
from backend.api.station.interfaces import list_interfaces
from backend.api.station.models import (
    Bus,
    ConnectRequest,
    CyclicRequest,
    DriveSummary,
    DriveUpdate,
    Health,
    Interfaces,
    PortRequest,
    ProfileInfo,
    ScanRequest,
)
from backend.foundation.people.rights import Right
from backend.foundation.work.jobs import Job, JobResult, Progress
from backend.records.audit import Fact
from backend.records.audit.asked import note_before
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.station.drives.second_port import require_same_drive
from drivers.errors import NotAllowed
from drivers.link import Found
from drivers.texts.message import Text, text
from drivers.texts.profile_errors import profile_error_text
from profiles import load_all
from profiles.loader import broken_profiles, is_own

router = APIRouter()


@router.get("/health")
async def health(bench: TheBench) -> Health:
    """Whether the server is alive."""
    now = convert.moment(backend.now())
    return Health(
        version=backend.__version__,
        time=now,
        demo=bool(bench.buses.wires),
        tour=bench.buses.cause_fault is not None,
    )


@router.get("/interfaces")
async def interfaces(bench: TheBench) -> Interfaces:
    """List the interfaces of this machine through which drives can be connected."""
    return list_interfaces(list(bench.buses.wires))


@router.get("/profiles")
async def profiles() -> list[ProfileInfo]:
    """List the profiles of servodeck and the user's own; broken ones with their problem."""
    return [
        ProfileInfo(
            profile=name,
            title=name,
            maker="",
            partial=True,
            links=[],
            parameters=0,
            own=True,
            problem=words_of(why),
            problem_message=message_of(why),
        )
        for name, why in _broken().items()
    ] + [
        ProfileInfo(
            profile=p.drive,
            title=p.title,
            maker=p.identity.maker,
            partial=p.partial,
            links=[spec.kind for spec in p.links],
            parameters=len(p.parameters),
            own=is_own(p.drive),
        )
        for p in load_all().values()
    ]


def _broken() -> dict[str, Text]:
    return {name: profile_error_text(error) for name, error in broken_profiles().items()}


@router.get("/buses")
async def buses(bench: TheBench) -> list[Bus]:
    """List opened buses with their counters."""
    return [convert.bus(bench, url, link) for url, link in bench.buses.opened.items()]


@router.post("/buses/cyclic")
async def start_cyclic(
    bench: TheBench, request: CyclicRequest, connection: Connection = None
) -> Bus:
    """Start to exchange process data with all drives of a bus."""
    require_bus(bench, request.url, connection)
    await bench.start_cyclic(request.url, request.cycle_us / 1e6)
    return convert.bus(bench, request.url, bench.buses.opened[request.url])


@router.delete("/buses/cyclic", status_code=204)
async def stop_cyclic(
    bench: TheBench, url: Annotated[str, Query()], connection: Connection = None
) -> Response:
    """End the cyclic exchange of a bus; moving axes are braked."""
    require_bus(bench, url, connection)
    await bench.stop_cyclic(url)
    return Response(status_code=204)


def require_bus(bench: Bench, url: str, connection: str | None) -> None:
    """Check that the connection may control every drive of a bus.

    Raises:
        Busy: another person has control of one.
    """
    for connected in bench.connected_drives.values():
        if any(bench.buses.url_of(port) == url for port in connected.drive.ports):
            bench.leases.require(connected.drive.id, connection)


@router.delete("/buses", status_code=204)
async def close_bus(bench: TheBench, url: Annotated[str, Query()]) -> Response:
    """Close a bus that no drive uses."""
    await bench.buses.close(url)
    return Response(status_code=204)


@router.post("/scan", status_code=202)
async def scan(bench: TheBench, request: ScanRequest, connection: Connection = None) -> JobInfo:
    """Search a bus for drives; the job's result is ``{"found": [FoundDrive]}``."""
    require_bus(bench, request.url, connection)

    async def work(progress: Progress) -> JobResult:
        seen: list[Found] = await bench.buses.scan(
            request.url, request.stations, progress, stop_after_first=request.stop_after_first
        )
        kind = (await bench.buses.open(request.url)).kind
        drives = [convert.found_drive(bench, request.url, kind, found) for found in seen]
        return {"found": [drive.model_dump(mode="json") for drive in drives]}

    return convert.job(bench.jobs.start("scan", text("api-station.scan", url=request.url), work))


@router.get("/drives")
async def drives(bench: TheBench, connection: Connection = None) -> list[DriveSummary]:
    """List the drives of the bench."""
    return [convert.drive_summary(bench, m, connection) for m in bench.connected_drives.values()]


@router.post("/drives", status_code=201)
async def connect(
    bench: TheBench, request: ConnectRequest, connection: Connection = None
) -> DriveSummary:
    """Connect a station as a drive of the bench. Its identity is read first."""
    require_bus(bench, request.url, connection)
    seen = await bench.buses.scan(request.url, [request.station], lambda _fraction, _step: None)
    found = next((f for f in seen if f.station == request.station), None)
    connected = await bench.connect(
        request.url, request.station, request.profile, request.name, found=found
    )
    _log_connected(bench, connected, request.url, request.station)
    await connected.monitor.refresh()
    return convert.drive_summary(bench, connected)


def _log_connected(bench: Bench, connected: ConnectedDrive, url: str, station: int) -> None:
    where = f"{connected.drive.profile.drive}, {url}, station {station}"
    bench.audit.add(Fact("station", "connected", connected.drive.name, where))


@router.get("/drives/{drive_id}")
async def drive(
    bench: TheBench, connected: TheDrive, connection: Connection = None
) -> DriveSummary:
    """Read one drive."""
    return convert.drive_summary(bench, connected, connection)


@router.patch("/drives/{drive_id}")
async def update_drive(
    bench: TheBench, connected: Controlled, change: DriveUpdate, connection: Connection = None
) -> DriveSummary:
    """Change name or notes, or accept an exchanged drive."""
    note_before(name=connected.drive.name, notes=connected.drive.notes)
    bench.rename(connected.drive.id, change.name, change.notes)
    if change.accept_identity:
        await bench.accept_identity(connected.drive.id)
    return convert.drive_summary(bench, connected, connection)


@router.post("/drives/{drive_id}/ports")
async def add_port(
    bench: TheBench, connected: Controlled, request: PortRequest, connection: Connection = None
) -> DriveSummary:
    """Connect a drive over a second bus; each parameter then uses the bus that carries it.

    Refused if settings read there differ from the drive's, unless that is accepted.
    """
    check = None if request.accept_difference else require_same_drive
    await bench.add_port(connected.drive.id, request.url, request.station, check)
    _log_connected(bench, connected, request.url, request.station)
    return convert.drive_summary(bench, connected, connection)


@router.delete("/drives/{drive_id}", status_code=204)
async def remove_drive(bench: TheBench, drive_id: str) -> Response:
    """Remove a drive from the bench."""
    if bench.missing(drive_id) is None:
        await member_of(drive_id, bench)
    name = bench.name_of(drive_id)
    await bench.remove(drive_id)
    bench.audit.add(Fact("station", "taken off the bench", name))
    return Response(status_code=204)


@router.post("/drives/{drive_id}/training-fault", status_code=204)
async def training_fault(bench: TheBench, connected: Controlled) -> Response:
    """Cause an under-voltage fault in a virtual drive of the demo; refused for real drives."""
    port = connected.drive.ports[0]
    url = bench.buses.url_of(port)
    cause = bench.buses.cause_fault
    if cause is None or url not in bench.buses.wires:
        raise NotAllowed("api-station.training-fault-needs-demo", drive=connected.drive.name)
    await asyncio.to_thread(cause, url, port.station)
    bench.journal.add(text("station.training-fault"), level="warning", drive=connected.drive.id)
    await connected.monitor.refresh()
    return Response(status_code=204)


def _job(bench: TheBench, job_id: str) -> Job:
    job = bench.jobs.get(job_id)
    if job is None:
        raise NotFound("api-station.no-job", value=job_id)
    return job


@router.get("/jobs")
async def jobs(bench: TheBench) -> list[JobInfo]:
    """List the jobs of this session, oldest first."""
    return [convert.job(job) for job in bench.jobs.all()]


@router.get("/jobs/{job_id}")
async def job(bench: TheBench, job_id: str) -> JobInfo:
    """Read one job."""
    return convert.job(_job(bench, job_id))


@router.delete("/jobs/{job_id}")
async def cancel_job(
    bench: TheBench, people: ThePeople, me: Me, job_id: str, connection: Connection = None
) -> JobInfo:
    """Cancel a job and wait for its cleanup. Everybody may cancel a motion, as with STOP."""
    found = _job(bench, job_id)
    if not (found.motion and found.stoppable):
        require_right(people, me, Right.FILES, found.drive)
        if found.drive is not None:
            bench.leases.require(found.drive, connection)
    person = me.person
    why = text("work.cancelled-by", person=person) if person else text("work.cancelled-by-command")
    await bench.jobs.cancel(found, why)
    return convert.job(found)


@router.post("/stop")
async def stop(bench: TheBench, request: StopRequest | None = None) -> StopResult:
    """STOP: always permitted, to everybody; without a body, for every axis.

    The quick stop is sent at once. The answer follows when the axes are at standstill, or after the
    time that their ramps allow and the measures taken then.
    """
    request = request or StopRequest()
    wanted = [request.drive] if request.drive is not None else list(bench.connected_drives)
    known = [drive_id for drive_id in wanted if drive_id in bench.connected_drives]
    # On a machine with two axes, the other one is stopped as well.
    stopped = list(await bench.motion.stop(known))
    bench.journal.add(text("station.stop-pressed"), level="warning", drive=request.drive)
    return stop_result(bench, wanted, await bench.motion.standstill(stopped))


@router.get("/log")
async def log(bench: TheBench) -> list[LogEntry]:
    """Read the station's log, newest first."""
    return [convert.log_entry(entry) for entry in bench.journal.entries()]


@router.get("/drives/{drive_id}/log")
async def drive_log(bench: TheBench, connected: TheDrive) -> list[LogEntry]:
    """Read the log of one drive, newest first."""
    return [convert.log_entry(entry) for entry in bench.journal.entries(connected.drive.id)]
