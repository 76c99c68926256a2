"""What a motion changed for its own length and could not put back: put it back, or leave it."""

from __future__ import annotations

from fastapi import APIRouter

from backend.api import convert
from backend.api.context import Controlled, TheBench
from backend.api.models import JobInfo
from backend.api.station.models import DriveSummary
from drivers.errors import NotAllowed

router = APIRouter(prefix="/drives/{drive_id}")


@router.post("/jobs/put-back", status_code=202)
async def put_back(bench: TheBench, member: Controlled) -> JobInfo:
    """Put back every value that is owed to the drive, while its axis stands."""
    if not member.drive.owed:
        raise NotAllowed("api-drive.nothing-put-back", drive=member.drive.name)
    return convert.job(bench.returning.start(member, asked=True))


@router.delete("/owed")
async def keep_as_it_is(bench: TheBench, member: Controlled) -> DriveSummary:
    """The values shall stay as they are now; nothing is written."""
    debts = member.drive.owed.debts
    member.drive.owed.settle([debt.key for debt in debts])
    for debt in debts:
        bench.tell(f"{member.drive.name}: {debt.key} (was {debt.raw}) stays as it is", member)
    return convert.drive_summary(bench, member)
