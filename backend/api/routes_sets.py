"""Routes of parameter-set files and comparisons."""

from __future__ import annotations

from datetime import UTC
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response

from backend import parameter_set
from backend.api import convert
from backend.api.context import Controlled, TheBench, TheMember
from backend.api.errors import NotFound
from backend.api.models import Diff, SaveSetRequest, SetFileInfo
from backend.bench import Bench
from backend.drive import Drive
from backend.parameter_set import MAX_BYTES, BadSet, Difference, Row
from backend.tools import parameters
from drivers.errors import NotAllowed, OutOfRange

router = APIRouter()


def _info(bench: Bench, name: str) -> SetFileInfo:
    try:
        content = bench.sets.load(name)
    except BadSet as error:
        return SetFileInfo(
            file=name,
            profile="",
            drive_name="",
            serial=None,
            firmware="",
            author="",
            saved=None,
            notes="",
            count=0,
            problem=error.message,
        )
    return SetFileInfo(
        file=name,
        profile=content.profile,
        drive_name=content.drive_name,
        serial=content.serial,
        firmware=content.firmware,
        author=content.author,
        saved=content.saved.astimezone(UTC) if content.saved else None,
        notes=content.notes,
        count=len(content.rows),
    )


@router.get("/sets")
async def list_sets(bench: TheBench) -> list[SetFileInfo]:
    """Stored parameter sets, newest first; unusable ones say why."""
    return [_info(bench, name) for name in bench.sets.names()]


@router.post("/drives/{drive_id}/sets", status_code=201)
async def save_set(bench: TheBench, member: Controlled, request: SaveSetRequest) -> SetFileInfo:
    """Read the drive's settings and store them."""
    name = await parameters.save_set(
        member.drive,
        bench.sets,
        request.file,
        author=request.author,
        notes=request.notes,
        motor_individual=request.include_motor_individual,
        overwrite=request.overwrite,
    )
    bench.journal.add(f"{member.drive.name}: saved {name}", drive=member.drive.id)
    return _info(bench, name)


def _existing(bench: Bench, file: str) -> bytes:
    try:
        return bench.sets.read(file)
    except NotAllowed as error:
        raise NotFound(error.message, value=file, remedy=error.remedy) from error


@router.get("/sets/{file}", response_class=Response)
async def download_set(bench: TheBench, file: str) -> Response:
    """The file itself."""
    return Response(_existing(bench, file), media_type="application/toml")


@router.put("/sets/{file}")
async def upload_set(
    bench: TheBench, file: str, request: Request, overwrite: bool = False
) -> SetFileInfo:
    """Store a file from elsewhere; what is no usable parameter set is refused."""
    data = bytearray()
    async for chunk in request.stream():
        data += chunk
        if len(data) > MAX_BYTES:
            raise BadSet(f"{file} is larger than {MAX_BYTES} bytes", remedy="choose another file")
    return _info(bench, bench.sets.store(file, bytes(data), overwrite=overwrite))


@router.delete("/sets/{file}", status_code=204)
async def delete_set(bench: TheBench, file: str) -> Response:
    """Delete a file."""
    _existing(bench, file)
    bench.sets.delete(file)
    return Response(status_code=204)


@router.get("/drives/{drive_id}/diff")
async def diff(
    bench: TheBench,
    member: TheMember,
    file: Annotated[str | None, Query()] = None,
    against: Annotated[str | None, Query(pattern=r"^(defaults|drive:.+)$")] = None,
) -> Diff:
    """Compare a drive with a file, with the defaults or with another drive (``drive:ID``).

    The drive's values are read now.
    """
    drive = member.drive
    if (file is None) == (against is None):
        raise OutOfRange("give either file or against", remedy="choose one thing to compare with")
    if file is not None:
        _existing(bench, file)
        content = bench.sets.load(file)
        rows, label = list(content.rows), file
        same_profile = content.profile == drive.profile.drive
        serial = drive.found.serial if drive.found else None
        known = content.serial is not None and serial is not None
        same_serial = content.serial == serial if known else None
    elif against == "defaults":
        rows, label, same_profile, same_serial = _defaults(drive), "defaults", True, None
    else:
        other = bench.member((against or "").removeprefix("drive:")).drive
        rows, label = await _of_drive(other), other.name
        same_profile, same_serial = other.profile.drive == drive.profile.drive, False
    return await _compare(drive, rows, label, same_profile, same_serial, full=file is not None)


def _defaults(drive: Drive) -> list[Row]:
    wanted = parameter_set.storable(drive.profile, motor_individual=False)
    return [Row(p.key, p.default_raw) for p in wanted if p.default_raw is not None]


async def _of_drive(other: Drive) -> list[Row]:
    wanted = parameter_set.storable(other.profile, motor_individual=True)
    readings = await other.read_many([p.key for p in wanted if not other.unreachable_why(p)])
    return [Row(r.key, r.raw) for r in readings.values() if r.raw is not None]


async def _compare(
    drive: Drive,
    rows: list[Row],
    label: str,
    same_profile: bool,
    same_serial: bool | None,
    *,
    full: bool,
) -> Diff:
    wanted = {p.key for p in parameter_set.storable(drive.profile, motor_individual=False)}
    wanted = wanted if full else set()
    wanted |= {row.key for row in rows if row.key in drive.profile.by_key}
    keys = sorted(k for k in wanted if not drive.unreachable_why(drive.parameter(k)))
    ours = await drive.read_many(keys)
    warnings = []
    if not same_profile:
        warnings.append("of another drive family: nothing of it can be written here")
    if same_serial is False:
        warnings.append("saved from another drive (serial number differs)")
    differences: list[Difference] = parameter_set.compare(drive, rows, ours)
    return Diff(
        file=label,
        drive=drive.id,
        same_profile=same_profile,
        same_serial=same_serial,
        warnings=warnings,
        rows=[convert.difference(row) for row in differences],
    )
