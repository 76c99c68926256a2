"""Routes of parameter sets by name, and of comparisons with a drive."""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Iterable
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from backend.api.messages import convert
from backend.api.messages.errors import NotFound, message_of, words_of
from backend.api.records.library import convert as convert_library
from backend.api.records.library.models import StoredSet, ThreeWay
from backend.api.records.sets.models import Diff, SaveSetRequest
from backend.api.requests.context import Controlled, TheBench, TheDrive
from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.axes.parameters import set_file as parameter_set
from backend.axes.parameters.set_file import MAX_BYTES, BadSet, ParameterSet, Row
from backend.foundation.people.identity import acting_person
from backend.foundation.work.apart import SMALL_BYTES, read_apart
from backend.records.library.identity import differences
from backend.records.library.three_way import three_way as compare_three
from backend.station.bench import Bench
from backend.tools import parameters
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts.message import Text, text

router = APIRouter()


def _listed(bench: Bench) -> list[StoredSet]:
    """All sets and the unusable files of the folder. Blocks."""
    problems = bench.sets.take_in()
    known = [convert_library.stored_set(entry) for entry in bench.sets.entries()]
    return known + [convert_library.unusable_set(*problem) for problem in problems.items()]


async def _info(bench: Bench, name: str) -> StoredSet:
    entry = await bench.records.store.call(bench.sets.entry, name)
    return convert_library.stored_set(entry)


@router.get("/sets")
async def list_sets(bench: TheBench) -> list[StoredSet]:
    """List stored parameter sets, newest first; unusable files come last, with their problem."""
    return await bench.records.store.call(_listed, bench)


@router.post("/drives/{drive_id}/sets", status_code=201)
async def save_set(bench: TheBench, connected: Controlled, request: SaveSetRequest) -> StoredSet:
    """Read the drive's settings and store them; ``overwrite`` makes a new version."""
    name = await parameters.save_set(
        connected.drive,
        bench.sets,
        request.file,
        author=request.author or acting_person(),
        notes=request.notes,
        motor_individual=request.include_motor_individual,
        overwrite=request.overwrite,
    )
    missing = parameters.without((await _parsed(bench, name, None)).not_read)
    bench.journal.add(
        text("journal.set-saved", drive=connected.drive.name, file=name, missing=missing),
        level="warning" if missing else "info",
        drive=connected.drive.id,
    )
    return await _info(bench, name)


async def _existing(bench: Bench, file: str, version: int | None = None) -> bytes:
    try:
        return await bench.records.store.call(bench.sets.read, file, version)
    except (BadSet, NotFound):
        raise
    except NotAllowed as error:
        if error.kind not in ("not-allowed", "not-found"):
            raise
        raise NotFound(error.text, value=file, remedy=error.remedy_text) from error


async def _parsed(bench: Bench, file: str, version: int | None) -> ParameterSet:
    return await asyncio.to_thread(parameter_set.parse, await _existing(bench, file, version), file)


@router.get("/sets/{file}", response_class=Response)
async def download_set(
    bench: TheBench, file: str, version: Annotated[int | None, Query(ge=1)] = None
) -> Response:
    """Download the file, by default the latest version."""
    return Response(await _existing(bench, file, version), media_type="application/toml")


@router.put("/sets/{file}")
async def upload_set(
    bench: TheBench, file: str, request: Request, overwrite: bool = False
) -> StoredSet:
    """Store an uploaded file; one that is not a usable parameter set is refused."""
    data = bytearray()
    async for chunk in request.stream():
        data += chunk
        if len(data) > MAX_BYTES:
            raise BadSet("api-sets.larger-bytes", file=file, max_bytes=MAX_BYTES)
    if len(data) > SMALL_BYTES:
        # A large file that is not a set is refused before a thread of this process reads it.
        await read_apart(len(data), parameter_set.parse, bytes(data), file)
    store = bench.records.store
    name = await store.call(bench.sets.store, file, bytes(data), overwrite=overwrite)
    return await _info(bench, name)


@router.delete("/sets/{file}", status_code=204)
async def delete_set(bench: TheBench, file: str) -> Response:
    """Archive a set; it can be restored on the Files page."""
    await _existing(bench, file)
    await bench.records.store.call(bench.sets.delete, file)
    return Response(status_code=204)


@router.get("/drives/{drive_id}/diff")
async def diff(
    bench: TheBench,
    connected: TheDrive,
    file: Annotated[str | None, Query()] = None,
    version: Annotated[int | None, Query(ge=1, description="of the file")] = None,
    against: Annotated[str | None, Query(pattern=r"^(defaults|drive:.+)$")] = None,
) -> Diff:
    """Compare a drive with a file, with the defaults or with another drive (``drive:ID``).

    The drive's values are read now.
    """
    drive = connected.drive
    if (file is None) == (against is None):
        raise OutOfRange("api-sets.give-either-file-against")
    if file is not None:
        content = await _parsed(bench, file, version)
        rows, label = list(content.rows), file
        same_profile, same_serial, warnings = _identity(content, drive)
    elif against == "defaults":
        warnings = []
        rows, label, same_profile, same_serial = _defaults(drive), "defaults", True, None
    else:
        other = bench.connected((against or "").removeprefix("drive:")).drive
        warnings = []
        rows, label = await _of_drive(other), other.name
        same_profile, same_serial = other.profile.drive == drive.profile.drive, False
        if not same_profile:
            warnings = [text("api-sets.other-family")]
    ours = await _read(drive, rows, full=file is not None)
    return Diff(
        file=label,
        version=version if file is not None else None,
        drive=drive.id,
        same_profile=same_profile,
        same_serial=same_serial,
        warnings=[words_of(each) for each in warnings],
        warning_messages=[message_of(each) for each in warnings],
        rows=[convert.difference(row) for row in parameter_set.compare(drive, rows, ours)],
    )


@router.get("/drives/{drive_id}/three-way")
async def three_way(
    bench: TheBench,
    connected: TheDrive,
    base: Annotated[str, Query(description="set that both sides come from")],
    theirs: Annotated[str, Query(description="set whose changes are to be taken over")],
    base_version: Annotated[int | None, Query(ge=1)] = None,
    theirs_version: Annotated[int | None, Query(ge=1)] = None,
) -> ThreeWay:
    """List what has changed since a common base, in another set and in the drive (read now)."""
    drive = connected.drive
    before = await _parsed(bench, base, base_version)
    content = await _parsed(bench, theirs, theirs_version)
    same_profile, same_serial, warnings = _identity(content, drive)
    if before.profile != content.profile:
        warnings.append(text("api-sets.base-other-family"))
    ours = await _read(drive, content.rows, full=True)
    return ThreeWay(
        base=base,
        base_version=base_version,
        theirs=theirs,
        theirs_version=theirs_version,
        drive=drive.id,
        same_profile=same_profile,
        same_serial=same_serial,
        warnings=[words_of(each) for each in warnings],
        warning_messages=[message_of(each) for each in warnings],
        rows=[
            convert_library.triple(row)
            for row in compare_three(drive, before.rows, content.rows, ours)
        ],
    )


def _identity(content: ParameterSet, drive: Drive) -> tuple[bool, bool | None, list[Text]]:
    """Whether family and drive are the same (drive None: unknown), and the warnings."""
    same_profile = content.profile == drive.profile.drive
    differing = differences(content, drive)
    serial = drive.found.serial if drive.found else None
    known = content.serial is not None and serial is not None
    same_drive = False if any(d.other_drive for d in differing) else (True if known else None)
    warnings = [] if same_profile else [text("api-sets.other-family")]
    return same_profile, same_drive, warnings + [difference.text for difference in differing]


def _defaults(drive: Drive) -> list[Row]:
    wanted = parameter_set.storable(drive.profile, motor_individual=False)
    return [Row(p.key, p.default_raw) for p in wanted if p.default_raw is not None]


async def _of_drive(other: Drive) -> list[Row]:
    wanted = parameter_set.storable(other.profile, motor_individual=True)
    readings = await other.read_many([p.key for p in wanted if not other.unreachable_why(p)])
    return [Row(r.key, r.raw) for r in readings.values() if r.raw is not None]


async def _read(drive: Drive, rows: Iterable[Row], *, full: bool) -> dict[str, Reading]:
    """Read the drive's values of these rows; with ``full`` all others of a set as well."""
    wanted: Collection[str] = set()
    if full:
        wanted = {p.key for p in parameter_set.storable(drive.profile, motor_individual=False)}
    wanted = {*wanted, *(row.key for row in rows if row.key in drive.profile.by_key)}
    keys = sorted(k for k in wanted if not drive.unreachable_why(drive.parameter(k)))
    return await drive.read_many(keys)
