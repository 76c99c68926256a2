"""Routes of the restore list: values that a motion changed temporarily and could not restore."""

from __future__ import annotations

from fastapi import APIRouter

from backend.api.messages import convert
from backend.api.messages.models import JobInfo
from backend.api.requests.context import Controlled, Me, TheBench, ThePeople
from backend.api.security.gate import require_right
from backend.api.station.models import DriveSummary
from backend.axes.motion.classes import motion_of
from backend.foundation.people.rights import Right
from drivers.errors import NotAllowed
from drivers.texts.message import text

router = APIRouter(prefix="/drives/{drive_id}")


@router.post("/jobs/put-back", status_code=202)
async def put_back(bench: TheBench, people: ThePeople, me: Me, connected: Controlled) -> JobInfo:
    """Restore every pending value of the drive, while its axis is at standstill.

    If one of them can energise the motor (a mode, the function of a terminal), the right
    to move is also required.
    """
    drive = connected.drive
    if not drive.pending_restores:
        raise NotAllowed("api-drive.nothing-put-back", drive=drive.name)
    entries = drive.pending_restores.entries
    if any(motion_of(drive.parameter(entry.key)) == "energises" for entry in entries):
        require_right(people, me, Right.MOTION, drive.id)
    return convert.job(bench.reconnection.start(connected, asked=True))


@router.delete("/pending-restores")
async def keep_as_it_is(bench: TheBench, connected: Controlled) -> DriveSummary:
    """Leave the values as they are and clear the restore list; nothing is written."""
    entries = connected.drive.pending_restores.entries
    connected.drive.pending_restores.settle([entry.key for entry in entries])
    for entry in entries:
        bench.tell(
            text(
                "journal.stays-as-it-is",
                drive=connected.drive.name,
                key=entry.key,
                before=str(entry.raw),
            ),
            connected,
        )
    return convert.drive_summary(bench, connected)
