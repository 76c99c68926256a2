"""Restoring what a tool could not restore when it ended, once the drive responds again."""

from __future__ import annotations

from backend.axes.axis.axis import Axis
from backend.axes.drive.identity import confirm_identity
from backend.foundation.work.jobs import JobResult
from backend.tools.measuring.temporary import put_back_in_time
from backend.tools.thresholds import measuring_restore as threshold
from drivers.cia402 import State
from drivers.errors import NotAllowed
from drivers.texts.message import text
from profiles.schema import Raw


async def settle(axis: Axis, *, asked: bool) -> JobResult:
    """Restore the pending values of a drive whose axis is at standstill.

    Unless ``asked`` by a person, only values are restored that are still as a tool left them: a
    value changed since may be intended. Returns ``back`` (raw values by key) and ``left`` (why
    others were not restored).

    Raises:
        NotAllowed: the axis is enabled or moves, or another drive is connected here.
        RestoreFailed: states what could not be restored; it stays pending.
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
    with axis.granted(text("motion.purpose-restore")):
        await put_back_in_time(axis, back)
    return {"back": dict(back), "left": dict(left)}
