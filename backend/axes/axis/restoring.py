"""Restoring parameters, and cleanups that cancellation does not interrupt."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from backend.axes.drive.drive import Drive
from backend.axes.drive.identity import confirm_identity
from drivers.errors import DriveError, LinkTimeout
from drivers.texts.message import Text, joined, parts_of, text
from profiles.schema import Raw

#: Deadline of a cleanup [s].
CLEANUP_TIMEOUT_S = 5.0


class RestoreFailed(DriveError):
    """A cleanup could not restore everything; the message lists what is left."""

    kind = "restore-failed"


@asynccontextmanager
async def restoring(drive: Drive, *keys: str) -> AsyncIterator[dict[str, Raw]]:
    """Restore these parameters to their present values on every exit.

    Raises:
        RestoreFailed: on exit; the message names what could not be restored.
    """
    before: dict[str, Raw] = {}
    for key in keys:
        reading = await drive.read(key)
        if reading.raw is not None:
            before[key] = reading.raw
    with drive.pending_restores.temporary(before):
        try:
            yield before
        except BaseException as error:
            await _put_back(drive, before, error)
            raise
        else:
            await _put_back(drive, before, None)


async def _put_back(drive: Drive, before: dict[str, Raw], earlier: BaseException | None) -> None:
    """Restore; an ``earlier`` error, which may be an inner restore, is reported as well."""
    name = drive.name
    try:
        await _to_its_end(lambda: _restore(drive, before), CLEANUP_TIMEOUT_S, name)
    except DriveError as error:
        if not isinstance(error, RestoreFailed):
            was = {key: drive.pending_restores.original(key, raw) for key, raw in before.items()}
            values = joined((value_before(key, raw) for key, raw in was.items()), ", ")
            error = RestoreFailed(
                "axis.perhaps-not-restored", drive=name, values=values, cause=error.text
            )
        _put_first_error_first(earlier, error)
        raise error from earlier


async def _restore(drive: Drive, before: dict[str, Raw]) -> None:
    failed: list[Text] = []
    left = dict(before)
    same = False
    try:
        for key, raw in before.items():
            try:
                if (await drive.read(key)).raw != raw:
                    if not same:
                        # The link may have been lost meanwhile, and another drive may answer now.
                        await confirm_identity(drive)
                        same = True
                    await drive.put_back(key, raw)
                del left[key]
            except DriveError as error:
                failed.append(not_restored(drive, key, raw, error))
    finally:
        drive.pending_restores.add(left)
    if failed:
        raise RestoreFailed(
            "axis.not-restored-running-server", drive=drive.name, failed=joined(failed)
        )


def value_before(key: str, raw: Raw) -> Text:
    """Text of a parameter with its earlier raw value."""
    return text("axis.value-before", parameter=key, before=raw)


def not_restored(drive: Drive, key: str, raw: Raw, cause: DriveError) -> Text:
    """Text of a parameter that was not restored: its original raw value and the cause."""
    before = drive.pending_restores.original(key, raw)
    return text("axis.parameter-not-restored", parameter=key, before=before, cause=cause.text)


def _put_first_error_first(earlier: BaseException | None, late: DriveError) -> None:
    """Put the earlier error first in the text of ``late``.

    A cleanup that fails must not hide the error that made it necessary.
    """
    if not isinstance(earlier, DriveError) or earlier is late:
        return
    # Each remedy once, however many cleanups failed one after the other.
    known = (*parts_of(earlier.remedy_text), *parts_of(late.remedy_text))
    advice = list({each.words(): each for each in known}.values())
    late.text = joined((earlier.text, late.text))
    late.own_remedy = joined(advice) if advice else None


async def shielded(cleanup: Callable[[], Awaitable[None]], timeout_s: float, drive: str) -> None:
    """Run a cleanup to its end even when the surrounding task is cancelled again.

    Where it runs because of an error (in ``finally`` or ``except``), an error of the cleanup itself
    reports that earlier error first.

    Raises:
        LinkTimeout: the cleanup itself took longer than ``timeout_s``.
        DriveError: the cleanup failed.
    """
    earlier = sys.exception()
    try:
        await _to_its_end(cleanup, timeout_s, drive)
    except DriveError as late:
        _put_first_error_first(earlier, late)
        raise


async def _to_its_end(cleanup: Callable[[], Awaitable[None]], timeout_s: float, drive: str) -> None:

    async def bounded() -> None:
        try:
            async with asyncio.timeout(timeout_s):
                await cleanup()
        except TimeoutError as error:
            raise LinkTimeout(
                "axis.restoring-took-longer-given", drive=drive, timeout_s=timeout_s
            ) from error

    task = asyncio.create_task(bounded())
    cancelled: asyncio.CancelledError | None = None
    while not task.done():
        try:
            await asyncio.shield(task)
        except asyncio.CancelledError as error:
            cancelled = error
        except DriveError:
            break
    if cancelled is not None and task.exception() is None:
        raise cancelled
    task.result()
