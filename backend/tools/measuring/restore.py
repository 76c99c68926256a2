"""Putting back, once a drive answers again, what a tool could not put back when it ended."""

from __future__ import annotations

from backend.axis.axis import Axis
from backend.drive.identity import confirm_identity
from backend.tools.measuring.temporary import put_back_in_time
from backend.work.jobs import JobResult
from drivers.cia402 import State
from drivers.errors import NotAllowed
from profiles.schema import Raw

_STANDS_S = 0.5


async def settle(axis: Axis, *, asked: bool) -> JobResult:
    """Put back what is owed to the drive of a standing axis.

    Where nobody ``asked``, only values that are still what a tool left there: what has changed
    since may be meant. Returns ``back`` (raw values by key) and ``left`` (why the others are not).

    Raises:
        NotAllowed: the axis is enabled or moves, or another drive answers here.
        RestoreFailed: naming what could not be put back; it stays owed.
    """
    drive = axis.drive
    if await axis.state() is State.OPERATION_ENABLED or not await axis.standstill(_STANDS_S):
        raise NotAllowed("measuring.values-put-back-axis", drive=drive.name)
    await confirm_identity(drive)
    back: dict[str, Raw] = {}
    left: dict[str, str] = {}
    for debt in drive.owed.debts:
        now = (await drive.read(debt.key)).raw
        if now == debt.raw and not debt.unapplied:
            continue
        if asked or now == debt.raw or now in debt.left:
            back[debt.key] = debt.raw
        else:
            left[debt.key] = f"{now} now, which no measurement left there"
    with axis.granted("put back what a motion left"):
        await put_back_in_time(axis, back)
    return {"back": dict(back), "left": dict(left)}
