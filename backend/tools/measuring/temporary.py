"""Temporary settings of a measurement: written, made effective, and restored on every exit."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager

from backend.axes.axis.axis import Axis
from backend.axes.axis.restoring import (
    CLEANUP_TIMEOUT_S,
    RestoreFailed,
    not_restored,
    shielded,
    value_before,
)
from backend.axes.axis.stop.quick_stop import quick_stop_keys, raise_quick_stop_from
from backend.axes.drive.optional import existing
from backend.foundation.work.jobs import Progress
from backend.tools.moving.moves.procedures import run_procedure
from drivers.cia402 import State
from drivers.errors import DriveError, LinkTimeout, NotAllowed
from drivers.texts.message import Text, joined, text
from profiles.schema import Raw


async def make_effective(axis: Axis) -> None:
    """Carry out "write settings" in families where changes take effect only after it.

    Raises:
        NotAllowed: the axis is enabled.
    """
    procedure = axis.drive.profile.procedure("write_settings")
    if axis.drive.profile.quirk("write_settings") is not None and procedure is not None:
        await run_procedure(axis, procedure, True, Progress(lambda: None))


async def write_settings(axis: Axis, values: Mapping[str, int]) -> dict[str, int]:
    """Write raw values that differ from the drive's, and make them effective.

    Returns the previous raw values of all keys. Nothing is changed unless every value can be
    written; a failure on the way restores what was written.

    Raises:
        NotAllowed, OutOfRange: nothing was sent.
        DriveError: the drive refused a value; the earlier ones are restored.
    """
    drive = axis.drive
    for key, raw in values.items():
        drive.check(drive.parameter(key), raw)
    if values and await axis.state() is State.OPERATION_ENABLED:
        raise NotAllowed("measuring.settings-changed-motor-not", drive=drive.name)
    before = {key: await drive.raw(key) for key in values}
    written: list[str] = []
    try:
        for key, raw in values.items():
            if before[key] != raw:
                written.append(key)
                await drive.write(key, raw)
        if written:
            await make_effective(axis)
    except BaseException:
        earlier = {key: before[key] for key in written}
        await put_back_in_time(axis, earlier)
        raise
    return before


async def put_back(axis: Axis, before: Mapping[str, Raw]) -> None:
    """Write these raw values back where they differ, and make them effective.

    Raises:
        RestoreFailed: states what could not be restored; it stays on the restore list.
    """
    drive = axis.drive
    failed: list[Text] = []
    left = dict(before)
    changed = drive.pending_restores.unapplied
    try:
        for key, raw in before.items():
            try:
                if (await drive.read(key)).raw != raw:
                    await drive.put_back(key, raw)
                    changed = True
                del left[key]
            except DriveError as error:
                failed.append(not_restored(drive, key, raw, error))
    finally:
        # Keeps the restore list complete where this is aborted, too.
        drive.pending_restores.add(left)
    back = {key: raw for key, raw in before.items() if key not in left}
    if changed or drive.pending:
        try:
            await make_effective(axis)
        except BaseException as error:
            drive.pending_restores.add(back, unapplied=True)
            back = {}
            if not isinstance(error, DriveError):
                raise
            failed.append(text("measuring.write-settings-failed", cause=error.text))
    drive.pending_restores.settle(back)
    if failed:
        raise RestoreFailed("measuring.not-restored", drive=drive.name, failed=joined(failed))


async def put_back_in_time(axis: Axis, before: Mapping[str, Raw]) -> None:
    """Complete `put_back` despite cancellation, within the time limit of a cleanup.

    Raises:
        RestoreFailed: states what could not be restored, also where a slow line left no time.
    """
    drive = axis.drive
    try:
        await shielded(lambda: put_back(axis, before), CLEANUP_TIMEOUT_S, drive.name)
    except LinkTimeout as error:
        pending = {entry.key: entry.raw for entry in drive.pending_restores.entries}
        left = joined((value_before(key, pending[key]) for key in before if key in pending), ", ")
        advice = (error.remedy_text, text("measuring.not-restored/remedy"))
        raise RestoreFailed(
            "measuring.not-restored-2",
            drive=drive.name,
            remedy=joined(part for part in advice if part is not None),
            cause=error.text,
            left=left,
        ) from error


@asynccontextmanager
async def temporary(axis: Axis, values: Mapping[str, int]) -> AsyncIterator[dict[str, int]]:
    """Apply these raw values inside the block; yields the values restored afterwards."""
    drive = axis.drive
    with drive.pending_restores.temporary({key: await drive.raw(key) for key in values}):
        before = await write_settings(axis, values)
        try:
            yield before
        finally:
            await put_back_in_time(axis, before)


@asynccontextmanager
async def stopping_hard(axis: Axis, speed_rpm: float) -> AsyncIterator[None]:
    """Let a quick stop from this speed brake as fast as setpoints are ramped down, in the block.

    Raises:
        ScaleUnknown: the scale of the speed is not certain: nothing may move.
        RestoreFailed: on leaving, where the drive's own deceleration could not be restored.
    """
    drive, units = axis.drive, await axis.require_certain_scales()
    async with axis.restoring(*await existing(drive, quick_stop_keys(drive))) as before:
        await raise_quick_stop_from(drive, units, speed_rpm, before)
        yield
