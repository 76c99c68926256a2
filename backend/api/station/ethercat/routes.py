"""Routes of EtherCAT segments: survey, error counters, alias, firmware."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from backend.api.messages import convert
from backend.api.messages.errors import NotFound, message_of, message_or_none, words_of
from backend.api.messages.models import JobInfo
from backend.api.requests.context import Connection, Controlled, TheBench
from backend.api.station.ethercat.models import (
    AliasRequest,
    CountersRequest,
    EthercatPermissions,
    EthercatSegment,
    LateBin,
    SegmentExchange,
    SegmentPort,
    SegmentStation,
)
from backend.axes.drive.identity import confirm_identity
from backend.foundation.work.jobs import JobResult, Progress
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.adapters import require_ethercat_adapter
from drivers.cia402 import State
from drivers.computer import permissions
from drivers.errors import DriveError, NotAllowed, OutOfRange
from drivers.ethercat.link import EthercatLink, segment_of
from drivers.ethercat.process.stations import firmware
from drivers.ethercat.process.survey import ExchangeFigures, Survey, SurveyedStation
from drivers.ethercat.wire.al_status import AlState
from drivers.texts import limits
from drivers.texts.message import Text, language, text

router = APIRouter()

_SCHEME = "ethercat://"
_MAX_FIRMWARE_BYTES = 32 << 20
_FIRMWARE_WARNING = "api-station.firmware-warning"
_ALIAS_WARNING = "api-station.alias-warning"
_FIRMWARE_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string"}}},
    }
}


@router.get("/ethercat/segment")
async def ethercat_segment(bench: TheBench, url: Annotated[str, Query()]) -> EthercatSegment:
    """Survey an opened segment: stations in the order of the cable, ports, clocks, cycle timing.

    It also answers while the stations cannot be read; ``problem`` then states the reason.
    """
    link = opened_segment(bench, url)
    survey: Survey = Survey((), ())
    problem: Text | None = None
    try:
        survey = await link.survey()
    except DriveError as error:
        problem = error.text
    quality = link.quality()
    figures = link.exchange
    report = None if link.private_network else _permissions(link.permissions())
    return EthercatSegment(
        url=url,
        connected=quality.connected,
        state=words_of(quality.state),
        problem=words_of(problem),
        problem_message=message_or_none(problem),
        stations=[
            _station(bench, url, seen, survey, clocks=figures is not None and figures.dc)
            for seen in survey.stations
        ],
        late_frames=int(quality.details["late_frames"]),
        host_restarts=int(quality.details["host_restarts"]),
        real_time=[note.words(language()) for note in link.real_time],
        real_time_messages=[message_of(note) for note in link.real_time],
        private_network=link.private_network,
        exchange=None if figures is None else _exchange(figures),
        permissions=report,
    )


@router.get("/ethercat/permissions")
async def ethercat_permissions(url: Annotated[str, Query()]) -> EthercatPermissions:
    """List the permissions that are missing to use an interface; it need not be open."""
    if not url.startswith(_SCHEME):
        raise OutOfRange("api-station.no-ethercat-bus", value=url, limit=f"{_SCHEME}INTERFACE")
    interface = url.removeprefix(_SCHEME)
    # It becomes part of commands that a person copies into a terminal.
    require_ethercat_adapter(interface)
    return _permissions(permissions.check(interface))


@router.post("/ethercat/counters/clear", status_code=204)
async def clear_counters(
    bench: TheBench, request: CountersRequest, connection: Connection = None
) -> Response:
    """Clear the port error counters of one station or of all."""
    link = opened_segment(bench, request.url)
    for connected in _members(bench, link):
        if request.station in (None, _station_of(connected, link)):
            bench.leases.require(connected.drive.id, connection)
    seen = (await link.survey()).stations
    chosen = [s.station for s in seen if request.station in (None, s.station) and not s.lost]
    if request.station is not None and not chosen:
        raise NotAllowed("api-station.station-not-answer", value=request.station, url=request.url)
    for station in chosen:
        await link.clear_port_counters(station)
    bench.journal.add(text("journal.counters-cleared", url=request.url, count=len(chosen)))
    return Response(status_code=204)


@router.post("/ethercat/alias", status_code=204)
async def write_alias(
    bench: TheBench, request: AliasRequest, connection: Connection = None
) -> Response:
    """Write a station alias; the EEPROM takes time, so nothing may move on this bus."""
    link = opened_segment(bench, request.url)
    calm_segment(bench, link, connection)
    require_confirmed(request.confirmed, _ALIAS_WARNING)
    for connected in _members(bench, link):
        if _station_of(connected, link) == request.station:
            await confirm_identity(connected.drive)
    await link.set_alias(request.station, request.alias)
    bench.journal.add(
        text(
            "journal.alias-written",
            url=request.url,
            alias=str(request.alias),
            station=request.station,
        )
    )
    return Response(status_code=204)


@router.post("/drives/{drive_id}/jobs/firmware", status_code=202, openapi_extra=_FIRMWARE_BODY)
async def load_firmware(
    bench: TheBench,
    connected: Controlled,
    request: Request,
    file: Annotated[str, Query(min_length=1, max_length=100, description="name for the drive")],
    password: Annotated[int, Query(ge=0, le=0xFFFFFFFF)] = 0,
    state: Annotated[
        firmware.Where, Query(description="auto: in BOOT where the drive has it, else in PREOP")
    ] = "auto",
    confirmed: Annotated[bool, Query()] = False,
    connection: Connection = None,
) -> JobInfo:
    """Send firmware by FoE to a drive whose profile states that it accepts it.

    The job cannot be cancelled: a download that breaks off may leave the drive without firmware.
    """
    link, station = _firmware_port(connected)
    calm_segment(bench, link, connection)
    require_confirmed(confirmed, _FIRMWARE_WARNING)
    data = await _body(request, file)
    await _require_loadable(connected, link, station)

    async def work(progress: Progress) -> JobResult:
        def load(tell: Callable[[float, Text], None]) -> Coroutine[None, None, str]:
            return link.load_firmware(station, file, data, tell, password=password, where=state)

        where = await _to_the_end(load, progress)
        line = text("journal.firmware-loaded", drive=connected.drive.name, file=file)
        bench.journal.add(line, drive=connected.drive.id)
        return {"bytes": len(data), "file": file, "state": where}

    title = text("api-station.load-firmware", file=file, drive=connected.drive.name)
    job = bench.jobs.start(
        "firmware", title, work, drive=connected.drive.id, motion=True, stoppable=False
    )
    bench.journal.add(title, level="warning", drive=connected.drive.id)
    return convert.job(job)


async def _require_loadable(connected: ConnectedDrive, link: EthercatLink, station: int) -> None:
    """Check that the drive is the one that was connected, and is not enabled.

    A drive without valid firmware stays in INIT or BOOT: it cannot be enabled, and only
    its EEPROM identifies it.

    Raises:
        NotAllowed: another drive answers, or it is enabled.
    """
    drive = connected.drive
    seen = next((s for s in (await link.survey()).stations if s.station == station), None)
    if seen is not None and seen.al & 0x0F in (AlState.INIT, AlState.BOOT):
        known = drive.found
        reported = (seen.vendor_id, seen.product_code)
        expected = (known.vendor_id, known.product_code) if known else reported
        if reported != expected and None not in expected:
            raise NotAllowed(
                "api-station.another-drive-answers-station", drive=drive.name, station=station
            )
        return
    await confirm_identity(drive)
    if await connected.axis.state() in (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE):
        raise NotAllowed("api-station.enabled", drive=drive.name)


async def _to_the_end(
    load: Callable[[Callable[[float, Text], None]], Coroutine[None, None, str]], progress: Progress
) -> str:
    """Load firmware; a cancellation must not leave the drive with half a file."""
    kept = False

    def tell(share: float, step: Text) -> None:
        progress(share, text("api-station.not-cancelled", step=step) if kept else step)

    loading = asyncio.ensure_future(load(tell))
    while not loading.done():
        try:
            await asyncio.shield(loading)
        except asyncio.CancelledError:
            if loading.cancelled():
                raise
            kept = True
            waiting = text("api-station.not-cancelled", step=text("api-station.wait-for-end"))
            progress(progress.fraction, waiting)
    return loading.result()


async def _body(request: Request, file: str) -> bytes:
    data = bytearray()
    async for chunk in request.stream():
        data += chunk
        if len(data) > _MAX_FIRMWARE_BYTES:
            raise OutOfRange(
                "api-station.larger-mib-right-file",
                limit=limits.size(_MAX_FIRMWARE_BYTES),
                file=file,
                max_firmware_mib=_MAX_FIRMWARE_BYTES >> 20,
            )
    if not data:
        raise OutOfRange("api-station.empty-choose-maker", file=file)
    return bytes(data)


def opened_segment(bench: Bench, url: str) -> EthercatLink:
    """The opened segment with this URL.

    Raises:
        NotFound: no such bus is open.
    """
    link = segment_of(bench.buses.opened.get(url))
    if link is None:
        raise NotFound("api-station.no-opened-ethercat-bus", value=url)
    return link


def _members(bench: Bench, link: EthercatLink) -> list[ConnectedDrive]:
    return [m for m in bench.connected_drives.values() if _station_of(m, link) is not None]


def _station_of(connected: ConnectedDrive, link: EthercatLink) -> int | None:
    return next((port.station for port in connected.drive.ports if port.link is link), None)


def calm_segment(bench: Bench, link: EthercatLink, connection: str | None) -> None:
    """Check that the connection may control every drive of the segment and nothing moves.

    The operation that follows keeps the bus busy or resets a drive; neither may happen
    while another axis moves.

    Raises:
        Busy: another person has control of a drive, or an axis moves.
    """
    for connected in _members(bench, link):
        bench.leases.require(connected.drive.id, connection)
        bench.motion.require_idle(connected)


def require_confirmed(confirmed: bool, warning: str) -> None:
    """Check that a person has confirmed the warning.

    Raises:
        NotAllowed: not yet.
    """
    if not confirmed:
        raise NotAllowed(warning, remedy="api-station.send-confirmed")


def _firmware_port(connected: ConnectedDrive) -> tuple[EthercatLink, int]:
    for port in connected.drive.ports:
        link = segment_of(port.link)
        if link is not None and port.spec is not None and port.spec.foe:
            return link, port.station
    raise NotAllowed("api-station.profile-not-say-takes", drive=connected.drive.name)


def _station(
    bench: Bench, url: str, seen: SurveyedStation, survey: Survey, *, clocks: bool
) -> SegmentStation:
    connected = next(
        (
            m
            for m in bench.connected_drives.values()
            for port in m.drive.ports
            if bench.buses.url_of(port) == url and port.station == seen.station
        ),
        None,
    )
    spec = connected.drive.profile.link("ethercat") if connected else None
    own = [f for f in survey.findings if f.station == seen.station]
    why = seen.al_text
    # SOEM takes the first slave with a distributed clock as reference; its own
    # deviation is not written.
    reference = seen.station == next(
        (s.station for s in survey.stations if s.distributed_clock), None
    )
    remedy = why.remedy() if why else None
    return SegmentStation(
        station=seen.station,
        name=seen.name,
        drive=connected.drive.id if connected else None,
        vendor_id=seen.vendor_id,
        product_code=seen.product_code,
        revision=seen.revision,
        serial=seen.serial,
        alias=seen.alias,
        firmware=seen.firmware,
        answers=not seen.lost,
        state=seen.state,
        error=why.words(language()) if why else "",
        remedy=remedy.words(language()) if remedy else "",
        behind_station=seen.parent,
        behind_port=seen.parent_port,
        distributed_clock=seen.distributed_clock,
        reference_clock=reference,
        clock_ahead_ns=seen.clock_ahead_ns if clocks and not reference and not seen.lost else None,
        ports=[
            SegmentPort(
                number=number,
                link=port.link,
                communicating=port.communicating,
                lost_links=port.lost_links,
                rx_errors=port.rx_errors,
                invalid_frames=port.invalid_frames,
                forwarded_errors=port.forwarded_errors,
                findings=[f.text.words(language()) for f in own if f.port == number],
            )
            for number, port in enumerate(seen.ports)
        ],
        findings=[f.text.words(language()) for f in own if f.port is None],
        notes=[note.words(language()) for note in seen.notes],
        note_messages=[message_of(note) for note in seen.notes],
        foe=bool(spec and spec.foe),
    )


def _exchange(figures: ExchangeFigures) -> SegmentExchange:
    last = len(figures.late) - 1
    return SegmentExchange(
        cycles=figures.cycles,
        overruns=figures.overruns,
        lost_frames=figures.lost_frames,
        wkc_errors=figures.wkc_errors,
        expected_wkc=figures.expected_wkc,
        last_wkc=figures.last_wkc,
        late_p50_us=figures.late_p50_us,
        late_p99_us=figures.late_p99_us,
        late_max_us=figures.late_max_us,
        late=[
            LateBin(below_us=None if place == last else 2**place, count=count)
            for place, count in enumerate(figures.late)
        ],
        dc=figures.dc,
        dc_deviation_ns=figures.dc_deviation_ns,
        dc_deviation_max_ns=figures.dc_deviation_max_ns,
    )


def _permissions(report: permissions.Permissions) -> EthercatPermissions:
    return EthercatPermissions(
        interface=report.interface,
        ready=report.ready,
        text=words_of(report.text),
        text_message=message_of(report.text),
        missing=list(report.missing),
        advised=list(report.advised),
        commands=list(report.commands),
    )
