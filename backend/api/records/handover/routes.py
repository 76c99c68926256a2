"""Routes of the hand-over: export, comparison with a controller's list, changes since then."""

from __future__ import annotations

import asyncio
import base64
import binascii
from collections.abc import Collection, Mapping, Sequence
from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Query, Request

from backend.api.messages.errors import NotFound
from backend.api.records.handover.models import (
    HandedOverInfo,
    HandoverChanges,
    HandoverChoice,
    HandoverComparison,
    HandoverConflict,
    HandoverDefect,
    HandoverFile,
    HandoverRequest,
    HandoverResult,
    LeftOutRow,
    SegmentAxis,
    SegmentHandoverRequest,
)
from backend.api.requests.context import TheBench, TheDrive, member_of
from backend.axes.drive.drive import Drive
from backend.axes.parameters import set_file as parameter_set
from backend.axes.parameters.set_file import BadSet, ParameterSet
from backend.foundation.people.identity import acting_person
from backend.foundation.work.apart import read_apart
from backend.records.handover.conflicts import Conflict, changed_since, compare
from backend.records.handover.esi import reported_controllers
from backend.records.handover.files import (
    digest,
    files_of,
    fitting,
    remarks,
    wanted_of,
    with_controllers,
)
from backend.records.handover.model import AxisHandover, hand_over
from backend.records.handover.read import MAX_BYTES, read_list
from backend.records.handover.record import HandedOver, HandoverLog
from backend.station.bench import Bench
from backend.station.drives.description import import_in_process
from drivers.errors import NotAllowed
from drivers.texts.message import language, text
from profiles.importer.esi.controller import ControllersTask
from profiles.schema import Profile, Raw

router = APIRouter()


def handover_log(bench: Bench) -> HandoverLog:
    """The log of hand-overs, by drive."""
    return HandoverLog(bench.state_folder / "handovers")


async def _set(bench: Bench, drive: Drive, file: str, version: int | None) -> ParameterSet:
    """Read a set of the library and check that it is of the drive's family.

    Raises:
        NotFound: there is no such set.
        NotAllowed: it is of another family.
        BadSet: it is not usable.
    """
    try:
        data = await bench.records.store.call(bench.sets.read, file, version)
    except BadSet:
        raise
    except NotAllowed as error:
        if error.kind not in ("not-allowed", "not-found"):
            raise
        raise NotFound(error.text, value=file, remedy=error.remedy_text) from error
    content = await asyncio.to_thread(parameter_set.parse, data, file)
    if content.profile != drive.profile.drive:
        raise NotAllowed(
            "api-handover.drive",
            drive=drive.name,
            value=file,
            profile=content.profile,
            profile_drive=drive.profile.drive,
        )
    return content


@router.post("/drives/{drive_id}/handover", status_code=201)
async def export_handover(
    bench: TheBench, connected: TheDrive, request: HandoverRequest
) -> HandoverResult:
    """Make the files for the machine's controller and record the hand-over for the report.

    Nothing is written to the drive.
    """
    given = SegmentAxis(
        drive_id=connected.drive.id, set_file=request.set_file, version=request.version
    )
    return await _export(bench, [given], request)


@router.post("/handover", status_code=201)
async def export_segment(bench: TheBench, request: SegmentHandoverRequest) -> HandoverResult:
    """Make one list for several drives of one bus, in the order of the cable."""
    return await _export(bench, request.axes, request)


async def _export(
    bench: Bench, given: Sequence[SegmentAxis], request: HandoverChoice
) -> HandoverResult:
    drives = [(await member_of(each.drive_id, bench)).drive for each in given]
    twice = next((drive for n, drive in enumerate(drives) if drive in drives[:n]), None)
    if twice is not None:
        raise NotAllowed("api-handover.drive-twice", drive=twice.name)
    contents = [
        await _set(bench, drive, each.set_file, each.version)
        for drive, each in zip(drives, given, strict=True)
    ]
    axes = await asyncio.to_thread(_axes, contents, drives, request)
    if request.esi:
        task = ControllersTask(await asyncio.to_thread(_sources, request), wanted_of(axes))
        axes = with_controllers(axes, reported_controllers(await import_in_process(task)))
    saved = contents[0].saved
    files = await asyncio.to_thread(files_of, axes, request.format, request.file, saved)
    name = next(iter(files))
    for drive, each, axis in zip(drives, given, axes, strict=True):
        made = HandedOver(
            datetime.now(UTC),
            acting_person(),
            request.format,
            name,
            digest(files[name]),
            each.set_file,
            {write.key: write.raw for write in axis.writes},
        )
        await asyncio.to_thread(handover_log(bench).add, drive.id, made)
        bench.journal.add(
            text(
                "journal.handed-over",
                drive=drive.name,
                file=each.set_file,
                format=request.format,
                name=name,
            ),
            drive=drive.id,
        )
    several = len(axes) > 1
    return HandoverResult(
        files=[
            HandoverFile(
                name=each, sha256=digest(data), content=base64.b64encode(data).decode("ascii")
            )
            for each, data in files.items()
        ],
        writes=sum(len(axis.writes) for axis in axes),
        left_out=[
            LeftOutRow(drive=axis.name, key=each.key, reason=each.reason.words(language()))
            for axis in axes
            for each in axis.left_out
        ],
        notes=[
            *(
                f"{axis.name}: {note.words(language())}" if several else note.words(language())
                for axis in axes
                for note in axis.notes
            ),
            *(remark.words(language()) for remark in remarks(axes, request.format)),
        ],
    )


def _axes(
    contents: Sequence[ParameterSet], drives: Sequence[Drive], request: HandoverChoice
) -> list[AxisHandover]:
    return [
        fitting(
            hand_over(
                content,
                drive.profile,
                choice=request.choice,
                only=request.only,
                motor_individual=request.include_motor_individual,
            ),
            request.format,
        )
        for content, drive in zip(contents, drives, strict=True)
    ]


def _sources(request: HandoverChoice) -> tuple[tuple[bytes, str], ...]:
    try:
        return tuple(
            (base64.b64decode(each, validate=True), f"ESI file {number}")
            for number, each in enumerate(request.esi, 1)
        )
    except binascii.Error as error:
        raise BadSet("api-handover.esi-file-not-base64") from error


@router.post(
    "/drives/{drive_id}/handover/compare",
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                "application/octet-stream": {"schema": {"type": "string", "format": "binary"}}
            },
        }
    },
)
async def compare_handover(
    bench: TheBench,
    connected: TheDrive,
    request: Request,
    file: Annotated[str, Query(max_length=200, description="name of the controller's list")],
    set_file: Annotated[str | None, Query(max_length=200, description="our set")] = None,
    version: Annotated[int | None, Query(ge=1, description="of the set")] = None,
    slave: Annotated[int | None, Query(ge=1, le=65535, description="of several")] = None,
) -> HandoverComparison:
    """Compare the drive now, our set and the controller's list. Nothing is changed."""
    drive = connected.drive
    data = bytearray()
    async for chunk in request.stream():
        data += chunk
        if len(data) > MAX_BYTES:
            raise BadSet("api-handover.larger-bytes", file=file, max_bytes=MAX_BYTES)
    listed = await read_apart(len(data), read_list, bytes(data), drive.profile, file, slave)
    content = None if set_file is None else await _set(bench, drive, set_file, version)
    ours = None if content is None else _raws(content)
    now = await _now(drive, {write.key for write in listed.writes})
    verdict = compare(drive.profile, listed, ours, now)
    return HandoverComparison(
        format=listed.format,
        conflicts=[_conflict(drive.profile, each) for each in verdict.conflicts],
        defects=[
            HandoverDefect(
                kind=each.kind,
                key=each.key,
                place=each.place.words(language()),
                text=each.text.words(language()),
            )
            for each in verdict.findings
        ],
        not_written=list(verdict.not_written),
        restored=list(verdict.restored),
        unknown_here=list(verdict.unknown_here),
        not_read=list(verdict.not_read),
        same=verdict.same,
    )


@router.get("/drives/{drive_id}/handovers")
async def list_handovers(bench: TheBench, connected: TheDrive) -> list[HandedOverInfo]:
    """List earlier hand-overs of a drive, newest first."""
    made = await asyncio.to_thread(handover_log(bench).read, connected.drive.id)
    found = [
        HandedOverInfo(
            number=number, time=each.time, person=each.person, format=each.format,
            file=each.file, sha256=each.sha256, set_file=each.set_file, values=len(each.values),
        )
        for number, each in enumerate(made, 1)
    ]  # fmt: skip
    return found[::-1]


@router.get("/drives/{drive_id}/handovers/{number}/changes")
async def changes_since(bench: TheBench, connected: TheDrive, number: int) -> HandoverChanges:
    """Read the drive and list the values that differ from those handed over."""
    drive = connected.drive
    made = await asyncio.to_thread(handover_log(bench).read, drive.id)
    if not 1 <= number <= len(made):
        raise NotFound("api-handover.no-hand-over", value=number, drive_name=drive.name)
    ours = made[number - 1].values
    now = await _now(drive, ours)
    changed = changed_since(drive.profile, ours, now)
    return HandoverChanges(
        changed=[_conflict(drive.profile, each) for each in changed],
        not_read=sorted(key for key in ours if now.get(key) is None),
        values=len(ours),
    )


def _raws(content: ParameterSet) -> dict[str, Raw]:
    return {row.key: row.raw for row in content.rows if row.raw is not None}


async def _now(drive: Drive, keys: Collection[str]) -> Mapping[str, Raw | None]:
    """Read these values from the drive; those that it does not have are left out."""
    known = [
        key
        for key in sorted(keys)
        if (parameter := drive.profile.by_key.get(key)) is not None
        and parameter.access != "wo"
        and not drive.unreachable_why(parameter)
    ]
    read = await drive.read_many(known) if known else {}
    return {key: reading.raw for key, reading in read.items()}


def _conflict(profile: Profile, each: Conflict) -> HandoverConflict:
    parameter = profile.by_key[each.key]

    def value(raw: Raw | None) -> Raw | None:
        return None if raw is None else parameter.to_value(raw)

    return HandoverConflict(
        key=each.key, name=each.name, unit=parameter.unit, controller=each.controller,
        ours=each.ours, drive=each.drive, controller_value=value(each.controller),
        ours_value=value(each.ours), drive_value=value(each.drive),
        consequence=each.consequence, sentence=each.sentence.words(language()),
    )  # fmt: skip
