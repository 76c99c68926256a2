"""Routes of the EEPROM of an EtherCAT slave: save, compare, plan a change, write it.

A change takes two confirmations: the digest of the plan that was shown, and ``confirmed``.
"""

from __future__ import annotations

import asyncio
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response

from backend.api.requests.context import Connection, TheBench
from backend.api.requests.named_profile import profile_named
from backend.api.station.ethercat.models import EepromComparison, EepromDifference, EepromPlan
from backend.api.station.ethercat.routes import calm_segment, opened_segment, require_confirmed
from backend.axes.drive.identity import confirm_identity
from backend.records.audit.asked import note_before
from backend.station.bench import Bench
from drivers.errors import OutOfRange
from drivers.ethercat.eeprom.expected import against_profile
from drivers.ethercat.eeprom.image import MOST_BYTES, Difference, Image, differences
from drivers.ethercat.eeprom.plan import Plan
from drivers.ethercat.link import EthercatLink
from drivers.texts.message import Text, language, text

router = APIRouter()

_WARNING = "api-station.eeprom-warning"
_BODY = {
    "requestBody": {
        "required": False,
        "content": {"application/octet-stream": {"schema": {"type": "string"}}},
    }
}
What = Annotated[
    Literal["restore", "identity"],
    Query(description="restore: the file in the body; identity: as the firmware says (1018h)"),
]
Url = Annotated[str, Query()]
StationNumber = Annotated[int, Query(ge=1)]
Size = Annotated[
    int | None,
    Query(ge=128, le=MOST_BYTES, multiple_of=128, description="of a damaged EEPROM, in bytes"),
]
UnknownAccepted = Annotated[
    bool, Query(description="the file is of this drive although the drive cannot say what it is")
]


@router.get("/ethercat/eeprom", response_class=Response)
async def read_eeprom(
    bench: TheBench, url: Url, station: StationNumber, size: Size = None
) -> Response:
    """Read the EEPROM and download it as a file. Refused while the cyclic exchange runs."""
    link = opened_segment(bench, url)
    image = await link.eeprom.read(station, _unheard, size)
    vendor, product, _revision = image.identity
    name = f"eeprom-{vendor:08x}-{product:08x}-{image.serial or 0}.bin"
    return Response(
        image.data,
        media_type="application/octet-stream",
        headers={"content-disposition": f'attachment; filename="{name}"'},
    )


@router.post("/ethercat/eeprom/compare", openapi_extra=_BODY)
async def compare_eeprom(
    bench: TheBench,
    request: Request,
    url: Url,
    station: StationNumber,
    profile: Annotated[
        str | None, Query(description="with a maker's file that was imported, in place of a body")
    ] = None,
) -> EepromComparison:
    """Compare the EEPROM with a saved file, or with the maker's file. Writes nothing."""
    link = opened_segment(bench, url)
    if profile is not None:
        image = await link.eeprom.read(station, _unheard)
        found = against_profile(image, profile_named(profile))
        return _comparison(image, found)
    saved = Image(await _body(request))
    problem = saved.problem()
    if problem is not None:
        raise OutOfRange("ethercat.eeprom-file-unsound", cause=problem)
    image = await link.eeprom.read(station, _unheard, len(saved.data))
    return _comparison(image, differences(image, saved))


@router.post("/ethercat/eeprom/plan", openapi_extra=_BODY)
async def plan_eeprom(
    bench: TheBench,
    request: Request,
    url: Url,
    station: StationNumber,
    what: What = "restore",
    unknown_accepted: UnknownAccepted = False,
) -> EepromPlan:
    """Plan a change: what it would write, with the digest that confirms it. Writes nothing."""
    link = opened_segment(bench, url)
    data = b"" if what == "identity" else await _body(request)
    plan = await _planned(link, station, what, data, unknown_accepted=unknown_accepted)
    return _plan(plan)


@router.post("/ethercat/eeprom/restore", openapi_extra=_BODY)
async def restore_eeprom(
    bench: TheBench,
    request: Request,
    url: Url,
    station: StationNumber,
    digest: Annotated[str, Query(max_length=64, description="of the plan that was looked at")],
    what: What = "restore",
    unknown_accepted: UnknownAccepted = False,
    confirmed: Annotated[bool, Query()] = False,
    connection: Connection = None,
) -> EepromPlan:
    """Write what was planned, read everything back, and return what was written.

    Refused while an axis of the segment moves or another person has control of one. The writing
    continues to its end even if the client disconnects.
    """
    link = opened_segment(bench, url)
    calm_segment(bench, link, connection)
    require_confirmed(confirmed, _WARNING)
    data = b"" if what == "identity" else await _body(request)
    if what == "restore":
        await _require_known(bench, link, station, unknown_accepted=unknown_accepted)
    plan = await _planned(link, station, what, data, unknown_accepted=unknown_accepted)
    note_before(changes=", ".join(each.field for each in plan.changes))
    calm_segment(bench, link, connection)
    await asyncio.shield(link.eeprom.carry_out(station, plan, digest, _unheard))
    bench.journal.add(
        text("journal.eeprom-written", url=url, station=station, words=plan.words),
        level="warning",
    )
    return _plan(plan)


async def _require_known(
    bench: Bench, link: EthercatLink, station: int, *, unknown_accepted: bool
) -> None:
    """Check that a connected drive that answers at this station is the one that was connected."""
    if unknown_accepted:
        return
    for connected in bench.connected_drives.values():
        if any(port.link is link and port.station == station for port in connected.drive.ports):
            await confirm_identity(connected.drive)


async def _planned(
    link: EthercatLink, station: int, what: str, data: bytes, *, unknown_accepted: bool
) -> Plan:
    if what == "identity":
        return await link.eeprom.plan_identity(station, _unheard)
    return await link.eeprom.plan_restore(
        station, data, _unheard, unknown_accepted=unknown_accepted
    )


async def _body(request: Request) -> bytes:
    data = bytearray()
    async for chunk in request.stream():
        data += chunk
        if len(data) > MOST_BYTES:
            raise OutOfRange("ethercat.eeprom-no-image", bytes=len(data))
    return bytes(data)


def _comparison(image: Image, found: tuple[Difference, ...]) -> EepromComparison:
    problem = image.problem()
    return EepromComparison(
        bytes=len(image.data),
        sound=problem is None,
        problem=None if problem is None else problem.words(language()),
        vendor_id=image.identity.vendor_id,
        product_code=image.identity.product_code,
        revision=image.identity.revision,
        serial=image.serial,
        alias=image.alias,
        differences=[_difference(each) for each in found],
    )


def _plan(plan: Plan) -> EepromPlan:
    return EepromPlan(
        digest=plan.digest,
        words=plan.words,
        keeps_serial=plan.keeps_serial,
        warning=_WARNING,
        changes=[_difference(each) for each in plan.changes],
    )


def _difference(each: Difference) -> EepromDifference:
    return EepromDifference(field=each.field, word=each.word, first=each.first, second=each.second)


def _unheard(_share: float, _step: Text) -> None:
    """Discard the progress of a request, which reports none."""
