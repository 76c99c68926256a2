"""Routes of the library: search, versions, tags, contents."""

from __future__ import annotations

import mimetypes
from datetime import datetime
from typing import Annotated
from urllib.parse import quote

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse

from backend.api.messages.errors import NotFound, message_of, words_of
from backend.api.records.library import convert as convert_library
from backend.api.records.library.models import (
    LibraryChange,
    LibraryEntry,
    LibraryKind,
    LibraryPage,
    TagCount,
    VersionInfo,
)
from backend.api.requests.context import TheBench
from backend.api.requests.times import in_utc
from backend.api.scope.recordings import TheRecordings
from backend.records.library import NotInLibrary, sharing
from backend.records.library.entries import Entry, Remarks, require_unchanged
from backend.records.library.entries import Query as LibraryQuery
from backend.station.bench import Bench
from backend.station.recording.service import Recordings
from drivers.errors import NotAllowed

router = APIRouter(prefix="/library")


#: Highest id or version number that the database stores.
_MOST = 2**31 - 1


def _entry(bench: Bench, entry_id: int) -> Entry:
    """The entry of this id. Blocks.

    Raises:
        NotFound: there is none of this id.
    """
    if not 0 < entry_id <= _MOST:
        raise NotFound("api-library.no-thing-library", value=entry_id)
    try:
        return bench.records.library.entry(entry_id)
    except NotInLibrary as error:
        raise NotFound(error.text, value=entry_id, remedy=error.remedy_text) from error


def _page(bench: Bench, recordings: Recordings, query: LibraryQuery) -> LibraryPage:
    """Search the library. Blocks. Updated first: files are also added and removed by other ways."""
    records = bench.records
    problems = records.sets.take_in().values()
    records.index.refresh(recordings.running)
    entries, total = records.library.search(query)
    return LibraryPage(
        entries=[convert_library.entry(entry, records.station) for entry in entries],
        total=total,
        problems=[words_of(why) for why in problems],
        problem_messages=[message_of(why) for why in problems],
        # A database file belongs to one station; a database server may serve many.
        shared=records.store.sqlite_file is None,
    )


@router.get("")
async def search_library(
    bench: TheBench,
    recordings: TheRecordings,
    words: Annotated[str, Query(max_length=200, description="all must occur")] = "",
    kind: Annotated[list[LibraryKind] | None, Query()] = None,
    tag: Annotated[str, Query(max_length=60)] = "",
    without: Annotated[str, Query(max_length=60, description="tag of what to leave out")] = "",
    axis: Annotated[str, Query(max_length=200, description="its name")] = "",
    profile: Annotated[str, Query(max_length=100)] = "",
    serial: Annotated[int | None, Query(ge=0, lt=1 << 63)] = None,
    since: datetime | None = None,
    until: datetime | None = None,
    deleted: Annotated[bool, Query(description="only deleted entries")] = False,
    limit: Annotated[int, Query(ge=1, le=500)] = 100,
    offset: Annotated[int, Query(ge=0, le=1_000_000)] = 0,
) -> LibraryPage:
    """List entries, newest first."""
    query = LibraryQuery(
        words=words,
        kinds=tuple(kind or ()),
        tag=tag,
        without=without,
        axis=axis,
        profile=profile,
        serial=serial,
        since=in_utc(since),
        until=in_utc(until),
        deleted=deleted,
        limit=limit,
        offset=offset,
    )
    return await bench.records.store.call(_page, bench, recordings, query)


@router.get("/tags")
async def library_tags(bench: TheBench) -> list[TagCount]:
    """List tags in use, with counts."""
    found = await bench.records.store.call(bench.records.library.tags)
    return [TagCount(tag=tag, count=count) for tag, count in found.items()]


@router.get("/{entry_id}")
async def library_entry(bench: TheBench, entry_id: int) -> LibraryEntry:
    """Read one entry, also one that was archived."""
    entry = await bench.records.store.call(_entry, bench, entry_id)
    return convert_library.entry(entry, bench.records.station)


@router.get("/{entry_id}/versions")
async def library_versions(bench: TheBench, entry_id: int) -> list[VersionInfo]:
    """List all versions of an entry, newest first."""
    await bench.records.store.call(_entry, bench, entry_id)
    found = await bench.records.store.call(bench.records.library.versions, entry_id)
    return [convert_library.version(version) for version in found]


@router.get("/{entry_id}/content", response_class=Response)
async def library_content(
    bench: TheBench, entry_id: int, version: Annotated[int | None, Query(ge=1, le=_MOST)] = None
) -> Response:
    """Download the contents of a version, by default the latest."""
    records = bench.records
    entry = await records.store.call(_entry, bench, entry_id)
    kind = mimetypes.guess_type(entry.name)[0] or "application/octet-stream"
    # Never shown in the page's own origin: a report from elsewhere may contain scripts.
    headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(entry.name)}"}
    if entry.station == records.station:
        path = await records.store.call(records.index.path, entry.kind, entry.name)
        if path is None:
            raise NotFound("api-library.no-longer-folder", value=entry.name)
        return FileResponse(path, media_type=kind, headers=headers)
    try:
        data = await records.store.call(records.library.content, entry_id, version)
    except NotInLibrary as error:
        raise NotFound(error.text, value=version, remedy=error.remedy_text) from error
    return Response(data, media_type=kind, headers=headers)


@router.post("/{entry_id}/share", status_code=201)
async def share_library_entry(
    bench: TheBench, recordings: TheRecordings, entry_id: int
) -> LibraryEntry:
    """Copy a recording, measurement or report of this station into the shared library."""

    def work() -> Entry:
        records, entry = bench.records, _entry(bench, entry_id)
        if entry.station != records.station or entry.name in recordings.running:
            raise NotAllowed("api-library.no-finished-file-station", value=entry.name)
        return sharing.share(records.library, records.index, entry)

    return convert_library.entry(await bench.records.store.call(work), bench.records.station)


@router.post("/{entry_id}/fetch", status_code=201)
async def fetch_library_entry(
    bench: TheBench, recordings: TheRecordings, entry_id: int
) -> LibraryEntry:
    """Copy shared contents into this station's folder, where they can be opened like its own."""

    def work() -> Entry:
        records, entry = bench.records, _entry(bench, entry_id)
        name = sharing.fetch(records.library, records.index, entry)
        records.index.refresh(recordings.running)
        query = LibraryQuery(words=name, kinds=(entry.kind,))
        found = [
            each
            for each in records.library.search(query)[0]
            if (each.name, each.station) == (name, records.station)
        ]
        return found[0] if found else entry

    return convert_library.entry(await bench.records.store.call(work), bench.records.station)


@router.patch("/{entry_id}")
async def change_library_entry(
    bench: TheBench, recordings: TheRecordings, entry_id: int, change: LibraryChange
) -> LibraryEntry:
    """Change notes or tags, or restore an archived entry."""

    def work() -> Entry:
        records = bench.records
        entry = _entry(bench, entry_id)
        tags = tuple(change.tags) if change.tags is not None else None
        base_tags = tuple(change.base_tags) if change.base_tags is not None else None
        base = Remarks(change.base_notes, base_tags)
        require_unchanged(Remarks(entry.notes, entry.tags), base, Remarks(change.notes, tags))
        if entry.kind == "recording" and entry.station == records.station:
            # The remarks of a recording are stored next to its file, and belong to it.
            recordings.library.annotate(entry.name, notes=change.notes, tags=tags, kept=None)
        if change.deleted is False:
            entry = records.library.undelete(entry_id)
        if change.notes is not None or tags is not None:
            entry = records.library.annotate(entry_id, notes=change.notes, tags=tags, base=base)
        return entry

    entry = await bench.records.store.call(work)
    return convert_library.entry(entry, bench.records.station)


@router.delete("/{entry_id}", status_code=204)
async def delete_library_entry(
    bench: TheBench, recordings: TheRecordings, entry_id: int
) -> Response:
    """Archive a parameter set or a shared entry; delete a file of this station permanently."""
    entry = await bench.records.store.call(_entry, bench, entry_id)
    if entry.kind == "recording" and entry.station == bench.records.station:
        # Here, as it is refused while it is being recorded or exported.
        await recordings.delete(entry.name)

    def work() -> None:
        records = bench.records
        if entry.station not in ("", records.station):
            raise NotAllowed("api-library.lies-station", value=entry.name, station=entry.station)
        if entry.station == "":
            records.library.delete(entry_id)
            return
        path = records.index.path(entry.kind, entry.name)
        if entry.kind != "recording" and path is not None:
            path.unlink(missing_ok=True)
        records.library.reported_deleted(entry)
        records.index.refresh(recordings.running)

    await bench.records.store.call(work)
    return Response(status_code=204)
