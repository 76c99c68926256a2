"""Routes of the scales of one axis: values, origin, and scales stated by a person."""

from __future__ import annotations

from fastapi import APIRouter

from backend.api.drive.models_scales import (
    ScaleInfo,
    ScalesInfo,
    ScalesUpdate,
    SmallMoveRequest,
    SmallMovesInfo,
    TurnedUpdate,
)
from backend.api.messages import convert
from backend.api.messages.errors import words_of
from backend.api.messages.models import JobInfo
from backend.api.requests.context import Controlled, TheBench, TheDrive
from backend.axes.axis import teaching
from backend.axes.axis.restoring import shielded
from backend.axes.drive.identity import read_serial
from backend.axes.scales.scale import Origin, Quantity, Scale, what_to_do
from backend.axes.scales.taught import Taught
from backend.axes.scales.units import AxisUnits
from backend.foundation.work.jobs import JobResult, Progress
from backend.records.audit.asked import note_before
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.station.measuring import EXCHANGE_ENDS_S, exchange_for
from backend.tools.moving.moves.small_move import SmallMoveSettings, longest_allowed, small_move
from drivers.errors import DriveError
from drivers.texts.message import Text, joined, text

router = APIRouter(prefix="/drives/{drive_id}")
_QUANTITIES = {
    Quantity.POSITION: text("journal.position"),
    Quantity.VELOCITY: text("journal.velocity"),
    Quantity.ACCELERATION: text("journal.acceleration"),
}
_ORIGINS = {
    Origin.MANUAL: text("journal.origin-manual"),
    Origin.MAKERS_FILE: text("journal.origin-makers-file"),
    Origin.DRIVE: text("journal.origin-drive"),
    Origin.USER: text("journal.origin-user"),
    Origin.MEASURED: text("journal.origin-measured"),
    Origin.UNKNOWN: text("journal.origin-unknown"),
}
_UNITS = {"position": "rev", "velocity": "rpm", "acceleration": "rpm/s"}


@router.get("/scales")
async def read_scales(connected: TheDrive) -> ScalesInfo:
    """Read the scales from the drive now."""
    connected.axis.forget_scales()
    return _info(connected, await connected.axis.units())


@router.put("/scales")
async def state_scales(bench: TheBench, connected: Controlled, request: ScalesUpdate) -> ScalesInfo:
    """Store scales from a data sheet, as stated by a person. Nothing is written to the drive."""
    taught = await teaching.stated(
        connected.axis, request.counts_per_rev, request.raw_per_rpm, request.raw_per_rpm_s
    )
    return await _keep(bench, connected, taught)


@router.post("/scales/confirm")
async def confirm_scales(
    bench: TheBench, connected: Controlled, request: TurnedUpdate
) -> ScalesInfo:
    """State how far the shaft turned in the last small move.

    The resolution and the unit of 606Ch follow from it.
    """
    return await _keep(
        bench, connected, await teaching.confirmed(connected.axis, request.turned_rev)
    )


@router.delete("/scales")
async def forget_taught(bench: TheBench, connected: Controlled) -> ScalesInfo:
    """Delete scales stated by a person; those of the drive, its file and its manual apply again."""
    return await _keep(bench, connected, None)


@router.post("/jobs/small_move", status_code=202)
async def start_small_move(
    bench: TheBench, connected: Controlled, request: SmallMoveRequest
) -> JobInfo:
    """Move by some increments, slowly and with low torque, to observe how far the shaft turns."""
    exchange = await exchange_for(bench, connected, request.cycle_ms / 1e3)
    session = exchange.session
    settings = SmallMoveSettings(request.increments, request.torque_limit)

    async def work(progress: Progress) -> JobResult:
        exchange.taken = True
        try:
            return await small_move(connected.axis, session, settings, progress)
        finally:
            await shielded(exchange.end, EXCHANGE_ENDS_S, connected.drive.name)

    try:
        job = bench.jobs.start(
            "small_move",
            text("api-drive.small-move", increments=request.increments, drive=connected.drive.name),
            work,
            drive=connected.drive.id,
            motion=True,
        )
    except DriveError:
        await exchange.end()
        raise
    exchange.ends_with(job)
    line = text(
        "journal.small-move", drive=connected.drive.name, increments=str(request.increments)
    )
    bench.journal.add(line, drive=connected.drive.id)
    return convert.job(job)


async def _keep(bench: Bench, connected: ConnectedDrive, taught: Taught | None) -> ScalesInfo:
    drive, store = connected.drive, bench.axis_records
    old = store.get(drive.id)
    note_before(scales=None if old.scales is None else old.scales.model_dump())
    if taught is not None:
        found = bench.taught_drive(drive)
        if found.serial is None:
            found = bench.taught_drive(drive, await read_serial(drive))
        taught = taught.model_copy(update={"drive": found})
    with bench.motion.keeping_still(connected):
        store.put(drive.id, old.model_copy(update={"scales": taught}))
        connected.axis.teach(taught)
        units = await connected.axis.units()
    scales = joined(_line(scale) for scale in units.scales.all)
    bench.journal.add(text("journal.scales", drive=drive.name, scales=scales), drive=drive.id)
    bench.drives_changed()
    return _info(connected, units)


def _line(scale: Scale) -> Text:
    known = scale.raw_per_unit is not None
    return text(
        "journal.scale" if known else "journal.scale-not-certain",
        quantity=_QUANTITIES[scale.quantity],
        raw=f"{scale.raw_per_unit:.6g}" if known else "",
        unit=_UNITS[scale.quantity],
        origin=_ORIGINS[scale.origin],
    )


def _info(connected: ConnectedDrive, units: AxisUnits) -> ScalesInfo:
    axis, scales = connected.axis, units.scales
    moves = axis.small_moves
    return ScalesInfo(
        certain=scales.position.certain and scales.velocity.certain,
        scales=[_one(scale, units) for scale in scales.all],
        taught=any(scale.origin in ("user", "measured") for scale in scales.all),
        kept=axis.taught is not None,
        cyclic=any(port.link.cyclic is not None for port in connected.drive.ports),
        small_moves=None
        if moves is None
        else SmallMovesInfo(
            moved=moves.moved, raw_per_inc_s=moves.raw_per_inc_s, next_most=longest_allowed(axis)
        ),
    )


def _one(scale: Scale, units: AxisUnits) -> ScaleInfo:
    is_time = scale.quantity.value == "acceleration" and units.ramps_are_times
    return ScaleInfo(
        quantity=scale.quantity,
        unit=_UNITS[scale.quantity],
        raw_unit=scale.raw_unit,
        raw_per_unit=None if is_time else scale.raw_per_unit,
        is_time=is_time,
        origin=scale.origin,
        source=scale.source,
        uncertainty=scale.uncertainty,
        why=words_of(scale.why),
        remedy=words_of(None if scale.certain else what_to_do(scale)),
    )
