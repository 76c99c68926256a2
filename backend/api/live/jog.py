"""Jogs of one page: each runs for as long as the page renews it."""

from __future__ import annotations

from collections.abc import Callable

from backend.api.drive.convert_motion import jog_settings, unit_of
from backend.api.live.messages import JogEnded, JogGap, JogRenew, JogStart, ToPage
from backend.api.messages.errors import message_or_none, problem_of, words_of
from backend.foundation.work.jobs import Job, JobResult, Progress
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.moving.jog.cyclic import jog_cyclic
from backend.tools.moving.jog.hold import Hold
from backend.tools.moving.jog.run import jog
from drivers.errors import DriveError
from drivers.texts.answers import message_in
from drivers.texts.message import Text, text


class Jogs:
    """Jogs of one live connection. ``send`` queues a message for its page."""

    def __init__(self, bench: Bench, connection: str, send: Callable[[ToPage], None]) -> None:
        self._bench, self._connection, self._send = bench, connection, send
        self._holds: dict[str, Hold] = {}

    def renew(self, sign: JogRenew) -> None:
        """Pass a renewal of a press, or its release, to the jog."""
        if (hold := self._holds.get(sign.drive)) is not None:
            hold.renew(
                sign.press,
                sign.sign,
                sent_s=None if sign.sent_ms is None else sign.sent_ms / 1e3,
                silent_s=sign.silent_ms / 1e3,
                pressed=sign.pressed,
            )

    def release(self, drive: str | None, reason: Text, press: int = 0) -> None:
        """End the jog of one axis, or of all; of one ``press``, or of any if 0."""
        for each, hold in self._holds.items():
            if drive in (None, each):
                hold.release(reason, press)

    def start(self, request: JogStart, person: str) -> None:
        """Begin a jog; takes control for its duration if nobody has it.

        Raises:
            DriveError: the axis may not move, or somebody else controls it.
        """
        bench, connected = self._bench, self._bench.connected(request.drive)
        held_before = bench.leases.holder(request.drive) is not None
        bench.leases.take(request.drive, self._connection, person)

        def gap(braking: bool, length_s: float) -> None:
            self._send(JogGap(drive=request.drive, braking=braking, gap_ms=1e3 * length_s))

        hold = Hold(request.press, paused=gap)
        try:
            job = bench.jobs.start(
                "jog",
                text("api-live.jog", member_drive=connected.drive.name),
                lambda progress: _jog_work(bench, connected, request, hold, progress),
                drive=request.drive,
                motion=True,
            )
        except DriveError:
            if not held_before:
                bench.leases.give(request.drive, self._connection)
            raise
        self._holds[request.drive] = hold
        connected.monitor.hurry()

        def ended(_task: object) -> None:
            if self._holds.get(request.drive) is hold:
                del self._holds[request.drive]
            if not held_before:
                bench.leases.give(request.drive, self._connection)
            self._send(_end_of(request.drive, job))

        if job.task is not None:
            job.task.add_done_callback(ended)


def _end_of(drive: str, job: Job) -> JogEnded:
    """Why a jog ended: its button, the cause of cancellation, or the problem of a failed one."""
    reason = (
        job.cancel_cause if job.state == "cancelled" else message_in(job.result or {}, "reason")
    )
    remedy = None if reason is None else reason.remedy()
    return JogEnded(
        drive=drive,
        reason=words_of(reason),
        reason_message=message_or_none(reason),
        remedy=words_of(remedy),
        remedy_message=message_or_none(remedy),
        problem=problem_of(job.error) if job.error else None,
    )


async def _jog_work(
    bench: Bench, connected: ConnectedDrive, request: JogStart, hold: Hold, progress: Progress
) -> JobResult:
    """Jog through the cyclic exchange if it runs, otherwise with a moving profile target."""
    axis = connected.axis
    settings = jog_settings(request, await unit_of(bench, connected, request.unit))
    if axis.session is not None and axis.session.running:
        return await jog_cyclic(axis, axis.session, settings, hold, progress)
    return await jog(axis, settings, hold, progress)
