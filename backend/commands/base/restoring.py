"""Values that an earlier process left in a drive, reported and restored by a command."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from datetime import datetime

from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.axes.restore.identity import identity_of
from backend.axes.restore.keep import keep_list
from backend.axes.restore.store import Pending, RestoreStore
from backend.commands.base.printing import note
from backend.commands.base.state import state_folder
from backend.foundation.store.files import StorageFailed
from backend.tools.measuring.restore import settle
from drivers.errors import Busy, NotAllowed


def recall(drive: Drive, url: str, station: int) -> Pending:
    """Load and report the pending restores of this drive, and keep its list from now on."""
    command = f"`{_name()}`"
    known = RestoreStore(state_folder(None), command).list_of(identity_of(drive), drive.id)

    def failed(error: StorageFailed) -> None:
        note("printed.list-not-kept", error=error.text)

    keep_list(drive, known, in_motion=lambda: drive.pending_restores.in_motion, failed=failed)
    if drive.pending_restores:
        pending = known.pending
        since = datetime.fromtimestamp(pending.since).astimezone()
        note(
            "printed.cut-off" if pending.by else "printed.server-cut-off",
            drive=drive.name,
            by=pending.by,
            since=f"{since:%Y-%m-%d %H:%M:%S}",
            values=_values(drive),
            url=url,
            station=station,
        )
    for file in known.pending.unreadable:
        note("restore.list-damaged", drive=drive.name, file=str(file))
    if known.pending.held_by:
        note("printed.moves-it-now", drive=drive.name, held_by=known.pending.held_by)
    return known.pending


async def restore_first(axis: Axis, pending: Pending) -> None:
    """Restore pending values that nobody has changed since, before a motion, as a server does.

    Raises:
        Busy: another process moves this drive now.
        NotAllowed: the axis is enabled or moves.
        RestoreFailed: a value could not be restored; it stays on the list.
    """
    drive = axis.drive
    if pending.held_by:
        raise Busy("command.moves-now", drive=drive.name, held_by=pending.held_by)
    if not drive.pending_restores:
        return
    await stop_what_was_moved(axis, pending)
    show_restored(drive.name, await settle(axis, asked=False))


async def stop_what_was_moved(axis: Axis, pending: Pending) -> None:
    """Send a quick stop where the axis was moved by a process that was killed a moment ago."""
    if pending.moved:
        axis.stop_pending = True
        await axis.require_stop_delivered()


def require_own_values(drive: Drive) -> None:
    """Check that no restore is pending, as temporary values must not be saved in the drive.

    Raises:
        NotAllowed: a restore is pending.
    """
    if drive.pending_restores:
        raise NotAllowed("command.values-motion-cut-off", drive=drive.name, values=_values(drive))


def show_restored(name: str, found: Mapping[str, object]) -> None:
    """Print the result of `settle`, one line per value."""
    for what, code in (("back", "printed.restored"), ("left", "printed.not-restored")):
        values = found[what]
        for key, value in values.items() if isinstance(values, dict) else ():
            note(code, name=name, key=key, value=str(value))


def _values(drive: Drive) -> str:
    return ", ".join(f"{value.key} (was {value.raw})" for value in drive.pending_restores.entries)


def _name() -> str:
    """Name of this command as it was called, without its arguments."""
    words = [word for word in sys.argv[1:3] if not word.startswith("-") and word.isidentifier()]
    return " ".join(("servodeck", *words[:2]))
