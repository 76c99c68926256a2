"""Routes of recordings and support bundles."""

from __future__ import annotations

import asyncio
import math
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.responses import FileResponse

from backend.api.messages import convert
from backend.api.messages.errors import NotFound, message_or_none, words_of
from backend.api.messages.models import JobInfo
from backend.api.scope.recording_models import (
    ArmRequest,
    BundleInfo,
    BundleList,
    BundleRequest,
    ChangeRecording,
    ExportKind,
    RecordedAxis,
    RecordedChannel,
    RecordedParameter,
    RecordedSamples,
    RecordedTrace,
    RecordingDetail,
    RecordingEvent,
    RecordingInfo,
    RecordingList,
    RetentionBounds,
    StartRecording,
)
from backend.foundation.people.identity import acting_person
from backend.foundation.store.free_space import RESERVE_BYTES
from backend.records.audit.asked import note_before
from backend.records.library.entries import Remarks, require_unchanged
from backend.records.recording.chunks import Samples
from backend.records.recording.library import Retention, Stored
from backend.records.recording.reader import Channel, RecordingReader
from backend.station.recording.capture import AFTER_S, BEFORE_S, FaultCapture
from backend.station.recording.recorder import Recorder, Settings, Trigger
from backend.station.recording.service import Recordings
from backend.station.recording.streams import describe_streams
from drivers.errors import NotAllowed
from drivers.texts.message import prose, text

router = APIRouter()

_TYPES = {
    "csv": "text/csv",
    "csv_raw": "text/csv",
    "rrd": "application/octet-stream",
    "mcap": "application/octet-stream",
}


async def recordings_of(request: Request) -> Recordings:
    """The recordings of this server."""
    recordings = request.app.state.recordings
    if not isinstance(recordings, Recordings):
        raise TypeError("the application was made without recordings")
    return recordings


TheRecordings = Annotated[Recordings, Depends(recordings_of)]


async def _capture(recordings: TheRecordings) -> FaultCapture:
    if recordings.capture is None:
        raise NotAllowed("api-scope.server-starting-ending")
    return recordings.capture


TheCapture = Annotated[FaultCapture, Depends(_capture)]


# --- conversion -------------------------------------------------------------------------


def _state(stored: Stored) -> Literal["complete", "interrupted", "failed", "unusable"]:
    return "unusable" if stored.summary is None else stored.summary.state


def _stored(stored: Stored) -> RecordingInfo:
    summary = stored.summary
    header: dict[str, Any] = summary.header if summary else {}
    remarks = stored.remarks
    problem = stored.problem or (summary.problem if summary else None)
    own_tags = [str(tag) for tag in header.get("tags", [])]
    return RecordingInfo(
        name=stored.name,
        state=_state(stored),
        created=convert.moment(float(header.get("created", stored.modified))),
        person=str(header.get("person", "")),
        notes=remarks.notes or str(header.get("notes", "")),
        tags=list(remarks.tags) or own_tags,
        kept=remarks.kept,
        channels=[
            RecordedChannel(
                drive=c.drive,
                drive_name=c.drive_name,
                key=c.key,
                name=c.name,
                unit=c.unit,
                shown_unit=c.shown_unit,
                shown_factor=c.shown_factor,
                synchronous=c.synchronous,
            )
            for c in (summary.channels if summary else ())
        ],
        axes=[_axis(axis) for axis in header.get("axes", [])],
        samples=summary.samples if summary else 0,
        lost=summary.lost if summary else 0,
        duration_s=summary.duration_s if summary else 0.0,
        bytes=stored.bytes,
        exports=[kind for kind in get_args(ExportKind) if kind in stored.exports],
        reason=summary.reason if summary else "",
        problem=words_of(problem),
        problem_message=message_or_none(problem),
    )


def _axis(axis: dict[str, Any]) -> RecordedAxis:
    serial = axis.get("serial")
    return RecordedAxis(
        drive=str(axis.get("drive", "")),
        name=str(axis.get("name", "")),
        profile=str(axis.get("profile", "")),
        title=str(axis.get("title", "")),
        serial=serial if isinstance(serial, int) else None,
        firmware=str(axis.get("firmware", "")),
        parameters=len(axis.get("parameters", [])),
    )


def _running(recordings: Recordings, recorder: Recorder) -> RecordingInfo:
    settings, written = recorder.settings, recorder.written()
    connected_drives = recordings.bench.connected_drives
    known = [c for c in settings.channels if c[0] in connected_drives]
    streams = describe_streams(recordings.bench, [(False, known)])
    synchronous = recorder.synchronous()
    duration = 0.0
    if written.first_s is not None and written.last_s is not None:
        duration = written.last_s - written.first_s
    return RecordingInfo(
        name=recorder.name,
        state="recording" if recorder.phase in ("recording", "ended") else "waiting",
        created=convert.moment(recorder.began),
        person=settings.person,
        notes=settings.notes,
        tags=list(settings.tags),
        kept=False,
        channels=[
            RecordedChannel(**c, synchronous=(c["drive"], c["key"]) in synchronous)
            for c in streams[0]["channels"]
        ],
        axes=[],
        samples=written.samples,
        lost=recorder.lost,
        duration_s=duration,
        bytes=written.bytes,
        exports=[],
        reason="",
        problem=words_of(recorder.problem),
        problem_message=message_or_none(recorder.problem),
    )


async def _info(recordings: Recordings, name: str) -> RecordingInfo:
    file = recordings.library.path(name).name
    if file in recordings.running:
        return _running(recordings, recordings.running[file])
    try:
        return _stored(await asyncio.to_thread(recordings.library.describe, name))
    except NotAllowed as error:
        raise NotFound(error.text, value=name, remedy=error.remedy_text) from error


def _existing(recordings: Recordings, name: str) -> Path:
    try:
        return recordings.library.existing(name)
    except NotAllowed as error:
        raise NotFound(error.text, value=name, remedy=error.remedy_text) from error


# --- recordings -------------------------------------------------------------------------


@router.get("/recordings")
async def list_recordings(
    recordings: TheRecordings, search: Annotated[str, Query(max_length=200)] = ""
) -> RecordingList:
    """List running and stored recordings that contain every word of ``search``."""
    running = list(recordings.running.values())
    stored = await asyncio.to_thread(
        recordings.library.entries, search, [recorder.name for recorder in running]
    )
    bounds = recordings.library.retention
    return RecordingList(
        recordings=[_running(recordings, r) for r in running] + [_stored(s) for s in stored],
        free_bytes=recordings.free(),
        reserve_bytes=RESERVE_BYTES,
        retention=RetentionBounds(
            max_total_bytes=bounds.max_total_bytes, keep_days=bounds.keep_days
        ),
    )


@router.post("/recordings", status_code=201)
async def start_recording(recordings: TheRecordings, request: StartRecording) -> RecordingInfo:
    """Start a recording, or start to wait for its trigger."""
    trigger = request.trigger
    recorder = await recordings.start(
        Settings(
            name=request.name,
            channels=tuple((c.drive, c.key) for c in request.channels),
            period_s=request.period_s,
            duration_s=request.duration_s,
            pre_s=request.pre_s,
            trigger=None
            if trigger is None
            else Trigger(trigger.kind, trigger.drive, trigger.key, trigger.level, trigger.mask),
            notes=request.notes,
            tags=tuple(request.tags),
            person=acting_person(),
        )
    )
    return _running(recordings, recorder)


@router.put("/recordings/retention")
async def set_retention(recordings: TheRecordings, request: RetentionBounds) -> RetentionBounds:
    """Set the limits above which the oldest recordings are deleted."""
    before = recordings.library.retention
    note_before(max_total_bytes=before.max_total_bytes, keep_days=before.keep_days)
    recordings.library.set_retention(
        Retention(max_total_bytes=request.max_total_bytes, keep_days=request.keep_days)
    )
    return request


@router.get("/recordings/{name}")
async def get_recording(recordings: TheRecordings, name: str) -> RecordingDetail:
    """Read a recording with its events and the parameter values of its axes at the start."""
    info = await _info(recordings, name)
    if info.state in ("waiting", "recording", "unusable"):
        return RecordingDetail(info=info, events=[], parameters={})
    return await asyncio.to_thread(_detail, recordings.library.existing(name), info)


def _detail(path: Path, info: RecordingInfo) -> RecordingDetail:
    with RecordingReader(path) as reader:
        first = reader.summary().first_s or reader.clock.sample_s
        events = [
            RecordingEvent(
                t_s=float(event.get("t_s", first)) - first,
                kind=str(event.get("kind", "")),
                level=str(event.get("level", "info")),
                drive=str(event.get("drive", "")),
                text=str(event.get("text", "")),
            )
            for event in reader.events()
        ]
        parameters = {
            str(axis.get("drive", "")): [
                RecordedParameter(**row) for row in axis.get("parameters", [])
            ]
            for axis in reader.header.get("axes", [])
        }
    return RecordingDetail(info=info, events=events, parameters=parameters)


@router.get("/recordings/{name}/samples")
async def get_samples(
    recordings: TheRecordings,
    name: str,
    from_s: Annotated[float, Query(ge=0.0, description="since the first sample")] = 0.0,
    duration_s: Annotated[float, Query(gt=0.0, le=60.0)] = 10.0,
) -> RecordedSamples:
    """Read a section of a stored recording as numbers; to get all of it, export it."""
    path = _existing(recordings, name)
    recordings.require_ended(name)
    return await asyncio.to_thread(_samples, path, from_s, from_s + duration_s)


def _samples(path: Path, from_s: float, until_s: float) -> RecordedSamples:
    with RecordingReader(path) as reader:
        refs = reader.index()
        first = min((ref.t0_s for ref in refs), default=reader.clock.sample_s)
        wanted = [r for r in refs if r.last_s - first >= from_s and r.t0_s - first < until_s]
        blocks = [reader.block(ref) for ref in wanted]
        traces = [_trace(channel, blocks, first, from_s, until_s) for channel in reader.channels]
        return RecordedSamples(
            start=convert.moment(reader.clock.epoch(first)),
            from_s=from_s,
            until_s=until_s,
            more=any(ref.last_s - first >= until_s for ref in refs),
            traces=traces,
        )


def _trace(
    channel: Channel, blocks: list[Samples], first_s: float, from_s: float, until_s: float
) -> RecordedTrace:
    """Samples of one signal within the section, in the unit that the scope shows."""
    times: list[float] = []
    values: list[float | None] = []
    for block in (each for each in blocks if each.stream == channel.stream):
        t_s = block.times_s - first_s
        inside = (t_s >= from_s) & (t_s < until_s)
        shown = block.values[inside, channel.column] * channel.shown_factor
        times += t_s[inside].tolist()
        values += [value if math.isfinite(value) else None for value in shown.tolist()]
    return RecordedTrace(
        drive=channel.drive,
        key=channel.key,
        name=channel.name,
        unit=channel.shown_unit,
        t_s=times,
        values=values,
    )


@router.patch("/recordings/{name}")
async def change_recording(
    recordings: TheRecordings, name: str, request: ChangeRecording
) -> RecordingInfo:
    """Change notes or tags of a stored recording, or protect it from retention."""
    _existing(recordings, name)
    recordings.require_ended(name)
    tags = None if request.tags is None else tuple(request.tags)
    base_tags = None if request.base_tags is None else tuple(request.base_tags)
    base = Remarks(request.base_notes, base_tags)

    def work() -> Stored:
        known = recordings.library.describe(name).remarks
        require_unchanged(Remarks(known.notes, known.tags), base, Remarks(request.notes, tags))
        return recordings.library.annotate(name, notes=request.notes, tags=tags, kept=request.kept)

    return _stored(await asyncio.to_thread(work))


@router.delete("/recordings/{name}", status_code=204)
async def delete_recording(recordings: TheRecordings, name: str) -> Response:
    """Delete a stored recording with its exports."""
    _existing(recordings, name)
    await recordings.delete(name)
    return Response(status_code=204)


@router.post("/recordings/{name}/stop")
async def stop_recording(recordings: TheRecordings, name: str) -> RecordingInfo | None:
    """End a recording; null if its trigger had not occurred, so that nothing was stored."""
    recorder = await recordings.stop(name)
    if not recorder.path.exists():
        return None
    return await _info(recordings, name)


@router.post("/recordings/{name}/trigger")
async def trigger_recording(recordings: TheRecordings, name: str) -> RecordingInfo:
    """Start a waiting recording although its trigger has not occurred."""
    recorder = recordings.active(name)
    recorder.trigger_now()
    return _running(recordings, recorder)


@router.get("/recordings/{name}/file", response_class=FileResponse)
async def download_recording(recordings: TheRecordings, name: str) -> FileResponse:
    """Download the recording file."""
    path = _existing(recordings, name)
    recordings.require_ended(name)
    return FileResponse(path, media_type="application/octet-stream", filename=path.name)


@router.post("/recordings/{name}/exports/{kind}")
async def export_recording(recordings: TheRecordings, name: str, kind: ExportKind) -> JobInfo:
    """Export a recording to another format, in a separate process."""
    _existing(recordings, name)
    return convert.job(recordings.export(name, kind))


@router.get("/recordings/{name}/exports/{kind}", response_class=FileResponse)
async def download_export(recordings: TheRecordings, name: str, kind: ExportKind) -> FileResponse:
    """Download a finished export."""
    path = recordings.library.export_path(name, kind)
    if not path.is_file():
        raise NotFound("api-scope.not-exported-yet", value=path.name)
    return FileResponse(path, media_type=_TYPES[kind], filename=path.name)


# --- support bundles --------------------------------------------------------------------


@router.get("/bundles")
async def list_bundles(capture: TheCapture) -> BundleList:
    """List support bundles made by faults or people."""
    rows = [
        BundleInfo(
            name=name,
            created=convert.moment(capture.path(name).stat().st_mtime),
            bytes=capture.path(name).stat().st_size,
        )
        for name in capture.names()
    ]
    return BundleList(bundles=rows, armed=capture.armed, before_s=BEFORE_S, after_s=AFTER_S)


@router.put("/bundles/armed")
async def arm_capture(capture: TheCapture, request: ArmRequest) -> ArmRequest:
    """Set whether a fault makes a support bundle of the last seconds."""
    note_before(armed=capture.armed)
    capture.armed = request.armed
    return request


@router.post("/bundles", status_code=201)
async def make_bundle(capture: TheCapture, request: BundleRequest) -> BundleInfo:
    """Make a support bundle of the last seconds now."""
    given = request.reason.strip()
    reason = prose(given) if given else text("bundle.by-hand")
    name = await capture.bundle(reason)
    status = capture.path(name).stat()
    return BundleInfo(name=name, created=convert.moment(status.st_mtime), bytes=status.st_size)


def _bundle(capture: FaultCapture, name: str) -> Path:
    try:
        return capture.path(name)
    except NotAllowed as error:
        raise NotFound(error.text, value=name, remedy=error.remedy_text) from error


@router.get("/bundles/{name}", response_class=FileResponse)
async def download_bundle(capture: TheCapture, name: str) -> FileResponse:
    """Download a support bundle (zip)."""
    path = _bundle(capture, name)
    return FileResponse(path, media_type="application/zip", filename=path.name)


@router.delete("/bundles/{name}", status_code=204)
async def delete_bundle(capture: TheCapture, name: str) -> Response:
    """Delete a support bundle."""
    _bundle(capture, name).unlink()
    return Response(status_code=204)
