"""A drive on a bus for the duration of one command, without a server."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import sys
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from typing import ParamSpec, TypeVar

import typer

from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.axes.restore.store import Pending
from backend.commands.base.printing import note
from backend.commands.base.restoring import recall
from backend.foundation.work.jobs import Progress
from backend.foundation.work.sleep_watch import SleepWatch
from backend.station.drives.matching import match_profiles, profile_for
from drivers.computer import signals
from drivers.errors import DriveError, NotAllowed
from drivers.link import Found, Link
from drivers.texts.message import Text, language, text
from drivers.texts.profile_errors import profile_error_text
from drivers.urls import link_for
from profiles.loader import ProfileError

P = ParamSpec("P")
T = TypeVar("T")


@contextmanager
def reported(code: int = 1) -> Iterator[None]:
    """Report errors that a user can correct as one message, and exit with this code."""
    try:
        yield
    except DriveError as error:
        spoken, advice = language(), error.advice_text
        remedy = None if advice is None else advice.words(spoken)
        raise _reported(error.text.words(spoken), remedy, code) from error
    except ProfileError as error:
        spoken, why = language(), profile_error_text(error)
        advice = why.remedy()
        remedy = None if advice is None else advice.words(spoken)
        raise _reported(why.words(spoken), remedy, code) from error
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        raise _reported(f"{place}{error.strerror or error}", None, code) from error


def _reported(message: str, remedy: str | None, code: int) -> typer.Exit:
    note("printed.error", message=message)
    if remedy:
        note("printed.remedy", remedy=remedy)
    return typer.Exit(code)


def run(work: Callable[[], Awaitable[T]], *, error_code: int = 1) -> T:
    """Run a command; see `reported`. Ctrl+C ends it with exit code 130."""
    try:
        return _run(work, error_code)
    except KeyboardInterrupt:
        note("printed.cancelled")
        raise typer.Exit(130) from None


def _run(work: Callable[[], Awaitable[T]], error_code: int = 1) -> T:
    async def body() -> T:
        return await work()

    with reported(error_code):
        return asyncio.run(body())


def run_in_order(work: Callable[[], Awaitable[T]]) -> T:
    """Run a command that moves an axis; Ctrl+C and SIGTERM restore values first, exit code 130.

    Values that a measurement has changed are restored while the work is cancelled.
    """
    # The event loop turns only SIGINT into a cancellation, and only where it is not ignored.
    with signals.interruptible():
        try:
            return _run(lambda: _unless_asleep(work))
        except KeyboardInterrupt:
            note("printed.cancelled-axis-disabled")
            raise typer.Exit(130) from None


async def _unless_asleep(work: Callable[[], Awaitable[T]]) -> T:
    """Cancel the work, which restores values and disables the axis, if the computer slept.

    Raises:
        NotAllowed: it slept, and the work has ended.
    """
    task, slept = asyncio.ensure_future(work()), list[float]()

    def awoke(gap_s: float) -> None:
        slept.append(gap_s)
        task.cancel()

    watch = asyncio.create_task(SleepWatch(awoke).run())
    try:
        return await task
    except asyncio.CancelledError:
        if slept:
            raise NotAllowed("station.computer-slept", gap_s=slept[0]) from None
        raise
    finally:
        watch.cancel()


def until_interrupted(work: Callable[[], Awaitable[None]]) -> None:
    """Run work until Ctrl+C or SIGTERM of a service manager, both of which end it cleanly."""
    signals.termination_interrupts()
    # uvicorn has already shut down when the interrupt arrives here.
    with contextlib.suppress(KeyboardInterrupt):
        _run(work)


def reporting_errors(command: Callable[P, T]) -> Callable[P, T]:
    """Decorator: the errors of a command are `reported`."""

    @functools.wraps(command)
    def body(*arguments: P.args, **named: P.kwargs) -> T:
        with reported():
            return command(*arguments, **named)

    return body


def show_progress(fraction: float, step: Text | str) -> None:
    """Show progress as a line that overwrites itself, on a terminal only."""
    if sys.stderr.isatty():
        end = "\n" if fraction >= 1 else ""
        shown = step if isinstance(step, str) else step.words(language())
        print(f"\r{fraction:5.0%}  {shown:60.60}", end=end, file=sys.stderr, flush=True)


def progress() -> Progress:
    """A job's progress, shown as `show_progress` does."""
    shown = Progress(lambda: show_progress(shown.fraction, shown.step_text))
    return shown


@asynccontextmanager
async def opened(url: str) -> AsyncIterator[Link]:
    """The opened bus; closed afterwards."""
    link = link_for(url)
    await link.open()
    try:
        yield link
    finally:
        await link.close()


@asynccontextmanager
async def drive_at(url: str, station: int, profile: str | None) -> AsyncIterator[Drive]:
    """A drive on a bus. Without ``profile`` its family is recognised.

    Restores that an earlier process left pending in it are reported on standard error.

    Raises:
        NotAllowed: no drive answers, or several families match; the message names them.
    """
    async with drive_and_pending(url, station, profile) as (drive, _pending):
        yield drive


@asynccontextmanager
async def drive_and_pending(
    url: str, station: int, profile: str | None
) -> AsyncIterator[tuple[Drive, Pending]]:
    """As `drive_at`, with the pending restores of the drive.

    Raises:
        NotAllowed: no drive answers, or several families match.
    """
    async with opened(url) as link:
        yield await drive_on(link, url, station, profile)


async def drive_on(
    link: Link, url: str, station: int, profile: str | None
) -> tuple[Drive, Pending]:
    """A drive on an open bus, with its pending restores.

    Raises:
        NotAllowed: no drive answers, or several families match.
    """
    seen = await link.scan(show_progress, [station])
    found = next((f for f in seen if f.station == station), None)
    if found is None:
        raise NotAllowed("command.nothing-answers-station-check-power", station=station, url=url)
    facts, spec = profile_for(link.kind, profile or _recognise(link, found))
    link.attach(station, facts)
    drive = Drive(
        f"{facts.drive}-{station}",
        text("link.drive-at", drive=facts.drive, station=station).words(language()),
        facts,
        [Port(link, station, spec)],
    )
    drive.found = found
    return drive, recall(drive, url, station)


def _recognise(link: Link, found: Found) -> str:
    matches = match_profiles(link.kind, found)
    sure = [m for m in matches if m.confidence != "possible"] or matches
    if len(sure) != 1:
        choices = ", ".join(match.profile.drive for match in matches) or "-"
        raise NotAllowed("command.drive-station", station=found.station, choices=choices)
    return sure[0].profile.drive
