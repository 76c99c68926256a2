"""Routes of the station's name and network ports."""

from __future__ import annotations

import asyncio

from fastapi import APIRouter, Request

from backend.api.requests.context import Me, TheBench
from backend.api.station.box.models import BoxChange, BoxInfo, BoxPort
from backend.station.install.box.kept import Box, keep, read
from backend.station.install.box.roles import addresses_of, checked, port_of
from drivers.computer.network.interfaces import network_interfaces
from drivers.texts.message import text

router = APIRouter()


@router.get("/box")
async def box(request: Request, bench: TheBench) -> BoxInfo:
    """Read the station's name, the use of its network ports, and the possible choices."""
    return _info(read(bench.state_folder), _came_by(request))


@router.put("/box")
async def set_box(request: Request, bench: TheBench, me: Me, body: BoxChange) -> BoxInfo:
    """Set the station's name, and which ports are for EtherCAT and for the office network."""
    wanted = Box(body.name, body.ethercat, body.office)
    used = _came_by(request)
    made = checked(wanted, network_interfaces(), used)
    await asyncio.to_thread(keep, bench.state_folder, made)
    bench.journal.add(
        text(
            "journal.box-set",
            person=me.person,
            name=made.name,
            ethercat=made.ethercat or "-",
            office=made.office or "-",
        ),
        person=me.person,
    )
    return _info(made, used)


def _came_by(request: Request) -> str:
    server = request.scope.get("server")
    return port_of(str(server[0])) if server else ""


def _info(known: Box | None, used: str) -> BoxInfo:
    return BoxInfo(
        configured=known is not None,
        name=known.name if known else "",
        ethercat=known.ethercat if known else "",
        office=known.office if known else "",
        ports=[
            BoxPort(
                name=one.name,
                up=one.up,
                wired=one.is_wired,
                addresses=addresses_of(one.name),
                here=one.name == used,
            )
            for one in network_interfaces()
            if not one.is_can and one.name != "lo"
        ],
    )
