"""Jobs: long work that is started, watched and cancelled; at most one motion job per axis."""

from __future__ import annotations

import asyncio
import itertools
import secrets
import time
from collections.abc import Awaitable, Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from typing import Literal

from backend.foundation.people.identity import Actor, acting, acting_person
from drivers.errors import Busy, DriveError
from drivers.texts.message import Text, as_text, prose, text

JobState = Literal["running", "done", "failed", "cancelled"]
JobResult = dict[str, object]

_BY_COMMAND = text("work.cancelled-by-command")
_SERVER_ENDS = text("work.server-ends")


class Progress:
    """Progress of a job, reported by its work and shown unchanged."""

    def __init__(self, changed: Callable[[], None]) -> None:
        self.fraction = 0.0
        self.step_text: Text = prose("")
        self._changed = changed

    @property
    def step(self) -> str:
        """The current step, in English."""
        return self.step_text.words()

    def __call__(self, fraction: float, step: Text | str) -> None:
        """Report progress: ``fraction`` 0…1, and ``step``, the current step."""
        self.fraction = min(1.0, max(0.0, fraction))
        self.step_text = as_text(step)
        self._changed()


@dataclass(slots=True, eq=False)
class Job:
    """One piece of work. Times are seconds since the epoch.

    ``motion``: the job occupies its axis, so that no other motion job can begin. ``stoppable``:
    STOP cancels the job; False for work that holds the axis at standstill and must not be left half
    done. ``partner`` is the second axis that the job moves and occupies, on a machine with two.
    ``actor`` is the person who began the job and their live connection; None if the program did.
    ``cancel_cause`` is the first cause of cancellation; it is valid only if ``state`` is cancelled,
    as work that ends at that moment stays done.
    """

    id: str
    kind: str
    title_text: Text
    drive: str | None
    motion: bool
    progress: Progress
    stoppable: bool = True
    state: JobState = "running"
    started: float = field(default_factory=time.time)
    ended: float | None = None
    result: JobResult | None = None
    error: Exception | None = None
    person: str = ""
    actor: Actor | None = None
    task: asyncio.Task[None] | None = None
    partner: str | None = None
    cancel_cause: Text | None = None

    @property
    def moved(self) -> tuple[str, ...]:
        """The axes that the job moves or holds still; none if it is not a motion job."""
        if not self.motion:
            return ()
        return tuple(each for each in (self.drive, self.partner) if each is not None)

    @property
    def title(self) -> str:
        """Title of the job, in English."""
        return self.title_text.words()

    def cancel(self, why: Text) -> None:
        """Cancel the work, which then runs its cleanup; only the first ``why`` is kept."""
        if self.task is None or not _runs(self):
            return
        if self.cancel_cause is None:
            self.cancel_cause = why
        self.task.cancel()

    async def wait(self) -> None:
        """Wait until the job has ended, with any outcome."""
        if self.task is not None:
            await asyncio.wait([self.task])


Work = Callable[[Progress], Awaitable[JobResult | None]]


class JobRunner:
    """Starts jobs and keeps the last hundred that ended.

    ``permit`` is called with a drive's id when a motion job begins, and may refuse by raising.
    ``granted`` returns the context that a job holds while it runs: its grant to move the axis.
    """

    KEEP = 100
    #: Limits of jobs without motion: of one kind for one drive (or for none), and in total.
    MOST_OF_A_KIND, MOST = 4, 32

    def __init__(
        self,
        changed: Callable[[Job], None] = lambda _job: None,
        permit: Callable[[str], None] = lambda _drive: None,
        granted: Callable[[Job], AbstractContextManager[object]] = lambda _job: nullcontext(),
    ) -> None:
        self._permit = permit
        self._granted = granted
        self._jobs: dict[str, Job] = {}
        self._numbers = itertools.count(1)
        # A page outlives a restart of the server: its old jobs must not be mistaken for new ones.
        self._run_mark = secrets.token_hex(3)
        self._changed = changed
        self._last_reported: dict[str, float] = {}

    def all(self) -> list[Job]:
        """All jobs, oldest first."""
        return list(self._jobs.values())

    def get(self, job_id: str) -> Job | None:
        """The job of this id, or None."""
        return self._jobs.get(job_id)

    def moving(self, drive: str) -> Job | None:
        """The running motion job of a drive, or None."""
        return next((j for j in self._jobs.values() if drive in j.moved and _runs(j)), None)

    def _require_room(self, kind: str, drive: str | None) -> None:
        """Check the number of running jobs, so that they leave processor time for STOP and motion.

        Raises:
            Busy: too many jobs run.
        """
        running = [job for job in self._jobs.values() if _runs(job) and not job.motion]
        same = sum(job.kind == kind and job.drive == drive for job in running)
        if same >= self.MOST_OF_A_KIND or len(running) >= self.MOST:
            if same >= self.MOST_OF_A_KIND:
                raise Busy("work.run-already-of-kind", drive=drive, limit=str(self.MOST_OF_A_KIND))
            raise Busy("work.run-already", drive=drive, limit=str(self.MOST))

    def start(
        self,
        kind: str,
        title: Text | str,
        work: Work,
        *,
        drive: str | None = None,
        partner: str | None = None,
        motion: bool = False,
        person: str = "",
        stoppable: bool = True,
        by_person: bool = True,
    ) -> Job:
        """Start a job.

        A motion job that is not begun ``by_person`` skips ``permit``: it does not cancel an earlier
        STOP, so it must leave the axis where it is.

        Raises:
            Busy: a motion job already holds this axis, its bus is being
            changed, or too many jobs run.
        """
        moved = [each for each in (drive, partner) if motion and each is not None]
        for each in moved:
            if (other := self.moving(each)) is not None:
                raise Busy("work.axis-already-moved", drive=each, other_title=other.title_text)
        if not motion and by_person:
            self._require_room(kind, drive)
        for each in moved if by_person else ():
            self._permit(each)
        job = Job(
            id=f"{kind}-{self._run_mark}-{next(self._numbers)}",
            kind=kind,
            title_text=as_text(title),
            drive=drive,
            motion=motion,
            progress=Progress(lambda: self._notify(job)),
            person=person or acting_person(),
            actor=acting.get(),
            stoppable=stoppable,
            partner=partner,
        )
        self._jobs[job.id] = job
        job.task = asyncio.create_task(self._run(job, work), name=job.id)
        job.task.add_done_callback(lambda _task: self._settle(job))
        self._changed(job)
        self._drop_old()
        return job

    async def cancel(self, job: Job, why: Text = _BY_COMMAND) -> None:
        """Cancel a job because of ``why``, and wait for its cleanup."""
        if job.task is not None and _runs(job):
            job.cancel(why)
            await job.wait()

    async def close(self) -> None:
        """Cancel all jobs and wait for their cleanups."""
        await asyncio.gather(*(self.cancel(job, _SERVER_ENDS) for job in self.all()))

    async def _run(self, job: Job, work: Work) -> None:
        try:
            with self._granted(job):
                job.result = await work(job.progress)
            job.state = "done"
            job.progress.fraction = 1.0
        except asyncio.CancelledError:
            job.state = "cancelled"
        except DriveError as error:
            job.state, job.error = "failed", error
        except Exception as error:
            # Shown to the user as an internal error; a job must never disappear without a message.
            job.state, job.error = "failed", error
        finally:
            job.ended = time.time()
            self._changed(job)

    def _settle(self, job: Job) -> None:
        """End a job whose task was cancelled before its first step, and so never entered `_run`."""
        if _runs(job):
            job.state, job.ended = "cancelled", time.time()
            self._changed(job)

    def _notify(self, job: Job) -> None:
        """Report progress at 10 Hz at most; `_run` always reports the end."""
        now = time.monotonic()
        if now - self._last_reported.get(job.id, 0.0) >= 0.1:
            self._last_reported[job.id] = now
            self._changed(job)

    def _drop_old(self) -> None:
        ended = [job for job in self._jobs.values() if not _runs(job)]
        for job in ended[: max(0, len(ended) - self.KEEP)]:
            del self._jobs[job.id]
            self._last_reported.pop(job.id, None)


def _runs(job: Job) -> bool:
    return job.state == "running"
