"""Routes of named scope set-ups and snapshots."""

from __future__ import annotations

import asyncio
from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response
from pydantic import ValidationError

from backend.api.messages import convert
from backend.api.messages.errors import NotFound
from backend.api.requests.context import TheBench
from backend.api.scope.models import NamedSetup, ScopeSetup, SnapshotHeader, SnapshotInfo
from backend.axes.scope.stored import (
    MAX_SNAPSHOT_BYTES,
    BadSnapshot,
    ScopeStore,
    StoredSnapshot,
    snapshot_header,
)
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts.validation import reason_of

router = APIRouter()


async def _store(bench: TheBench) -> ScopeStore:
    return ScopeStore(bench.state_folder / "scope")


TheStore = Annotated[ScopeStore, Depends(_store)]


@router.get("/scope/setups")
async def list_scope_setups(store: TheStore) -> list[NamedSetup]:
    """List named set-ups; those in the format of another version are left out."""
    found = []
    for each in await asyncio.to_thread(store.setups):
        try:
            setup = ScopeSetup.model_validate(each.content)
        except ValidationError:
            continue
        found.append(NamedSetup(name=each.name, saved=convert.moment(each.modified), setup=setup))
    return found


@router.put("/scope/setups/{name}", status_code=204)
async def save_scope_setup(store: TheStore, name: str, setup: ScopeSetup) -> Response:
    """Store a set-up under a name, replacing an earlier one of that name."""
    await asyncio.to_thread(store.save_setup, name, setup.model_dump())
    return Response(status_code=204)


@router.delete("/scope/setups/{name}", status_code=204)
async def delete_scope_setup(store: TheStore, name: str) -> Response:
    """Delete a set-up."""
    try:
        await asyncio.to_thread(store.delete_setup, name)
    except NotAllowed as error:
        raise NotFound(error.text, value=name, remedy=error.remedy_text) from error
    return Response(status_code=204)


def _info(stored: StoredSnapshot) -> SnapshotInfo:
    try:
        header = SnapshotHeader.model_validate(stored.header) if stored.header else None
    except ValidationError:
        header = None
    return SnapshotInfo(name=stored.name, bytes=stored.bytes, header=header)


@router.get("/scope/snapshots")
async def list_scope_snapshots(store: TheStore) -> list[SnapshotInfo]:
    """List snapshots, newest first."""
    return [_info(each) for each in await asyncio.to_thread(store.snapshots)]


@router.post("/scope/snapshots/{name}", status_code=201)
async def save_scope_snapshot(store: TheStore, name: str, request: Request) -> SnapshotInfo:
    """Store a snapshot; the body is the file (see docs/scope.md), at most 32 MiB."""
    data = bytearray()
    async for part in request.stream():
        data += part
        if len(data) > MAX_SNAPSHOT_BYTES:
            raise OutOfRange(
                "api-scope.snapshot-too-large",
                value=len(data),
                limit=f"{MAX_SNAPSHOT_BYTES >> 20} MiB",
            )
    content = bytes(data)
    header = await asyncio.to_thread(snapshot_header, content, name)
    try:
        SnapshotHeader.model_validate(header)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise BadSnapshot(
            "api-scope.no-snapshot-scope",
            value=name,
            first=".".join(str(part) for part in first["loc"]),
            other_first=reason_of(first),
        ) from error
    file = await asyncio.to_thread(store.save_snapshot, name, content)
    return SnapshotInfo(name=file, bytes=len(content), header=SnapshotHeader.model_validate(header))


@router.get("/scope/snapshots/{name}", response_class=Response)
async def read_scope_snapshot(store: TheStore, name: str) -> Response:
    """Download a snapshot file."""
    try:
        data = await asyncio.to_thread(store.snapshot, name)
    except NotAllowed as error:
        raise NotFound(error.text, value=name, remedy=error.remedy_text) from error
    return Response(
        data,
        media_type="application/octet-stream",
        headers={"Content-Disposition": "attachment", "Cache-Control": "no-cache"},
    )


@router.delete("/scope/snapshots/{name}", status_code=204)
async def delete_scope_snapshot(store: TheStore, name: str) -> Response:
    """Delete a snapshot."""
    try:
        await asyncio.to_thread(store.delete_snapshot, name)
    except NotAllowed as error:
        raise NotFound(error.text, value=name, remedy=error.remedy_text) from error
    return Response(status_code=204)
