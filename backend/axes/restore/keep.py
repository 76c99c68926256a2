"""The restore list of a connected drive: loaded once, and written after every change."""

from __future__ import annotations

from collections.abc import Callable

from backend.axes.drive.drive import Drive
from backend.axes.restore.identity import identity_of
from backend.axes.restore.store import RestoreList
from backend.foundation.store.files import StorageFailed
from drivers.texts.message import text


def keep_list(
    drive: Drive,
    known: RestoreList,
    *,
    in_motion: Callable[[], bool],
    failed: Callable[[StorageFailed], None],
) -> None:
    """Load the pending restores of a drive; write its list at every temporary change or restore.

    ``in_motion`` returns whether the next process has to stop the axis. Where the list cannot be
    written before a value changes, `PendingRestores.temporary` raises, and nothing is changed. At
    any other time ``failed`` is called, once per failure of the disk, and does not end a motion.
    """
    drive.pending_restores.recall(known.pending.values)
    well = True

    def note(*, durable: bool = False) -> None:
        nonlocal well
        try:
            known.write(
                drive.pending_restores.outstanding,
                in_motion=in_motion(),
                identity=identity_of(drive),
                durable=durable,
            )
        except StorageFailed as error:
            if durable:
                raise StorageFailed(
                    "restore.not-kept",
                    drive=drive.name,
                    cause=error.text,
                    remedy=text("restore.free-the-disk"),
                ) from error
            if well:
                failed(error)
            well = False
        else:
            well = True

    drive.pending_restores.keep(note)
