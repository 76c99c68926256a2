"""Routes of parameter sets as CSV and DCF: export, and import of lists of other tools."""

from __future__ import annotations

import asyncio
from datetime import UTC, datetime
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response

from backend.api.messages.errors import NotFound, message_of, words_of
from backend.api.requests.context import TheBench
from backend.api.requests.named_profile import profile_named
from backend.api.station.models_description import ImportedList, RowNotExported
from backend.axes.parameters.csv_list import LeftOut
from backend.axes.parameters.lists import export_list, import_list
from backend.axes.parameters.set_file import MAX_BYTES, BadSet
from backend.foundation.work.apart import read_apart
from backend.station.bench import Bench
from drivers.errors import NotAllowed
from drivers.texts.message import language, text

router = APIRouter()


_MEDIA = {"csv": "text/csv; charset=utf-8", "dcf": "application/octet-stream"}


_Format = Annotated[Literal["csv", "dcf"], Query(alias="format", description="of the download")]


@router.get("/sets/{file}/list", response_class=Response)
async def export_set(bench: TheBench, file: str, kind: _Format = "csv") -> Response:
    """Export a stored parameter set as CSV for spreadsheets, or as DCF for CANopen tools.

    A DCF cannot hold all rows; those that are missing are at `/sets/{file}/list/left-out`.
    """
    name, data, _ = await _exported(bench, file, kind)
    return Response(
        data,
        media_type=_MEDIA[kind],
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


@router.get("/sets/{file}/list/left-out")
async def rows_not_exported(
    bench: TheBench, file: str, kind: _Format = "csv"
) -> list[RowNotExported]:
    """Rows of a stored parameter set that its export in this format does not have."""
    _, _, left_out = await _exported(bench, file, kind)
    return [
        RowNotExported(key=each.key, reason=words_of(each.why), reason_message=message_of(each.why))
        for each in left_out
    ]


async def _exported(
    bench: Bench, file: str, kind: Literal["csv", "dcf"]
) -> tuple[str, bytes, tuple[LeftOut, ...]]:
    try:
        content = await bench.records.store.call(bench.sets.load, file)
    except BadSet:
        raise
    except NotAllowed as error:
        raise NotFound(error.text, value=file) from error
    profile = profile_named(content.profile)
    stem = file.removesuffix(".sdset").encode("ascii", "replace").decode().replace("?", "_")
    name = f"{stem}.{kind}"
    data, left_out = await asyncio.to_thread(export_list, content, profile, name, datetime.now())
    return name, data, left_out


@router.post(
    "/sets/list",
    status_code=201,
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {"text/plain": {"schema": {"type": "string"}}},
        }
    },
)
async def store_list(
    bench: TheBench,
    request: Request,
    profile: Annotated[str, Query(description="drive family that the list is of")],
    file: Annotated[str, Query(pattern=r"^[\w][\w .\-]{0,100}$", description="of the new set")],
    overwrite: bool = False,
) -> ImportedList:
    """Store a CSV list or a DCF as a parameter set of a drive family.

    Nothing is written to a drive: compare it first, like any other set.
    """
    data = bytearray()
    async for chunk in request.stream():
        data += chunk
        if len(data) > MAX_BYTES:
            raise BadSet("api-sets.larger-bytes", file=file, max_bytes=MAX_BYTES)
    content, found = await read_apart(
        len(data), import_list, bytes(data), profile_named(profile), file, datetime.now(UTC)
    )
    stored = await bench.records.store.call(bench.sets.store, file, content, overwrite=overwrite)
    line = text("journal.set-imported", file=stored, count=len(found.readings))
    bench.journal.add(line)
    return ImportedList(
        file=stored,
        parameters=len(found.readings),
        problems=[each.words(language()) for each in found.problems[:200]],
        problem_messages=[message_of(each) for each in found.problems[:200]],
    )
