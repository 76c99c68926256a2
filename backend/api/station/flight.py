"""Routes of recorded bus traffic: the last minute of frames of a bus."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response

from backend.api.messages.errors import NotFound
from backend.api.requests.context import TheBench
from backend.records.recording.flight import file_name
from drivers.errors import NotAllowed

router = APIRouter()

_FILE = {
    200: {"content": {"application/octet-stream": {"schema": {"type": "string"}}}},
}


@router.get("/buses/flight", response_class=Response, responses=_FILE)  # type: ignore[arg-type]
async def bus_flight(
    bench: TheBench,
    url: Annotated[str, Query()],
    station: Annotated[int | None, Query(ge=0, le=0xFFFF)] = None,
) -> Response:
    """Download the last 60 s of frames of an opened bus as pcapng, of one station or of all.

    Wireshark reads it: EtherCAT as Ethernet, CAN as SocketCAN, serial lines as LINKTYPE_USER0.
    """
    link = bench.buses.opened.get(url)
    if link is None:
        raise NotFound("api-station.no-opened-bus", value=url)
    if link.frames is None:
        raise NotAllowed("api-station.frames-not-recorded", value=url)
    data = await link.frames.flight(station)
    headers = {"content-disposition": f'attachment; filename="{file_name(url)}"'}
    return Response(data, media_type="application/octet-stream", headers=headers)
