"""Putting back, once a drive answers again, what a tool could not restore when it ended."""

from __future__ import annotations

from backend.axis.axis import Axis
from backend.drive.identity import confirm_identity
from backend.tools.measuring.temporary import put_back_in_time
from backend.tools.thresholds import measuring_restore as threshold
from backend.work.jobs import JobResult
from drivers.cia402 import State
from drivers.errors import NotAllowed
from profiles.schema import Raw


async def settle(axis: Axis, *, asked: bool) -> JobResult:
    """Restore the pending values of a standing axis' drive.

    Where nobody ``asked``, only values that are still what a tool left there: what has changed
    since may be meant. Returns ``back`` (raw values by key) and ``left`` (why the others are not).

    Raises:
        NotAllowed: the axis is enabled or moves, or another drive answers here.
        RestoreFailed: naming what could not be restored; it stays pending.
    """
    drive = axis.drive
    if await axis.state() is State.OPERATION_ENABLED or not await axis.standstill(
        threshold.STANDS_S
    ):
        raise NotAllowed("measuring.values-put-back-axis", drive=drive.name)
    await confirm_identity(drive)
    back: dict[str, Raw] = {}
    left: dict[str, str] = {}
    for entry in drive.pending_restores.entries:
        now = (await drive.read(entry.key)).raw
        if now == entry.raw and not entry.unapplied:
            continue
        if asked or now == entry.raw or now in entry.left:
            back[entry.key] = entry.raw
        else:
            left[entry.key] = f"{now} now, which no measurement left there"
    with axis.granted("put back what a motion left"):
        await put_back_in_time(axis, back)
    return {"back": dict(back), "left": dict(left)}
