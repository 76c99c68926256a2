"""Sessions that override terminals: forced outputs, simulated inputs.

A session belongs to one person's page. It ends when that page no longer responds, when another
person takes control of the axis, on STOP, and on request. On every exit the parameters are
restored.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

from backend.axes.axis.axis import Axis
from backend.axes.axis.restoring import CLEANUP_TIMEOUT_S, shielded
from backend.axes.drive.catalog import functions_of
from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.axes.motion.grant import Grant
from backend.foundation.work.jobs import Job, JobResult, JobRunner, Progress
from drivers.cia402 import State
from drivers.errors import NotAllowed, OutOfRange, Rejected
from drivers.texts import limits
from drivers.texts.answers import sentence
from drivers.texts.message import Text, profile_text, text
from profiles.functions import Forcing, TerminalBits

#: A session ends when its page has not renewed it for this time [s].
SILENT_S = 5.0
_LOOK_S = 0.05
#: Pause after "write settings" [s], as in the procedure of the only family that has it.
_APPLY_S = 0.1
_ENDED = text("functions.end-by-page")


@dataclass(slots=True, eq=False)
class ForcingSession:
    """Terminals that a person overrides at present. ``values``: on or off, by terminal."""

    axis: Axis
    spec: Forcing
    connection: str | None
    job: Job | None = None
    values: dict[str, bool] = field(default_factory=dict)
    renewed: float = field(default_factory=time.monotonic)
    reason: Text | None = None
    before: dict[str, int] = field(default_factory=dict)
    over: bool = False
    grant: Grant | None = None
    lock: asyncio.Lock = field(default_factory=asyncio.Lock)

    def renew(self) -> None:
        """Record a sign of life of the page."""
        self.renewed = time.monotonic()

    async def set(self, wanted: Mapping[str, bool | None]) -> None:
        """Override terminals, or release them (None).

        Raises:
            OutOfRange: no such terminal.
            NotAllowed: the terminal must not be overridden, or its function does not permit it.
            Rejected: the drive does not keep the written value.
        """
        for name, value in wanted.items():
            self._require_known(name)
            if value is not None:
                await self._require_allowed(name)
        async with self.lock:
            self._require_open()
            await self._require_appliable()
            values = {**self.values, **{n: v for n, v in wanted.items() if v is not None}}
            for name in [n for n, v in wanted.items() if v is None]:
                values.pop(name, None)
            await self._write(values)
            self.values = values

    async def shut(self) -> None:
        """Permit no further override, and wait for a write that is under way."""
        self.over = True
        async with self.lock:
            pass

    def _require_open(self) -> None:
        """Raise NotAllowed where the session has ended, as its values are restored already."""
        if self.over:
            why = self.reason or text("functions.end-cancelled")
            raise NotAllowed(
                "functions.ended", drive=self.axis.drive.name, spec_title=self.spec.title, why=why
            )

    def _require_known(self, name: str) -> None:
        if name not in self.spec.value.bits:
            names = ", ".join(self.spec.value.bits)
            raise OutOfRange(
                "functions.cannot-overruled", drive=self.axis.drive.name, value=name, limit=names
            )

    async def _require_allowed(self, name: str) -> None:
        """Check that it is not a brake output, and that its function permits forcing."""
        drive = self.axis.drive
        facts = drive.profile.functions.terminals
        terminal = next((t for t in drive.profile.terminals if t.name == name), None)
        if terminal is None or terminal.function_key is None:
            return
        code = await drive.raw(terminal.function_key)
        if terminal.direction == "out" and code in facts.brake_functions:
            raise NotAllowed(
                "functions.function-brake-forcing-release",
                drive=drive.name,
                parameter=terminal.function_key,
                value=code,
                name=name,
            )
        needed = self.spec.needs_function
        if needed is not None and code != needed:
            label = next((f.name for f in terminal.functions if f.code == needed), str(needed))
            raise NotAllowed(
                "functions.function-lets-forced",
                drive=drive.name,
                parameter=terminal.function_key,
                value=code,
                limit=str(needed),
                name=name,
                needed=needed,
                label=label,
            )

    async def _write(self, values: Mapping[str, bool]) -> None:
        """Write overrides: release terminals first, then write values, then enable overrides."""
        enable = self.spec.enable
        if enable is not None:
            staying = dict.fromkeys(self.values.keys() & values.keys(), True)
            await self._write_bits(enable, staying)
        await self._write_bits(self.spec.value, values)
        if enable is not None:
            await self._write_bits(enable, dict.fromkeys(values, True))
        await apply_settings(self.axis, self.keys)

    @property
    def keys(self) -> tuple[str, ...]:
        """Parameters of this session; first the one that releases the terminals."""
        places = (self.spec.enable, self.spec.value)
        return tuple(place.key for place in places if place is not None)

    async def _require_appliable(self) -> None:
        """Check that "write settings", where needed, does not put other changes into effect.

        Raises:
            NotAllowed: other parameters wait for it, or the axis is enabled.
        """
        drive = self.axis.drive
        if not needs_settings(drive, self.keys):
            return
        waiting = drive.pending.items()
        others = [
            key for key, until in waiting if until == "write_settings" and key not in self.keys
        ]
        if others:
            raise NotAllowed(
                "functions.changed-parameters-begin-act",
                drive=drive.name,
                others=len(others),
                other_others=", ".join(others[:5]),
            )
        if await self.axis.state() is State.OPERATION_ENABLED:
            raise NotAllowed(
                "functions.needs-write-settings-possible",
                drive=drive.name,
                spec_title=self.spec.title,
            )

    async def _write_bits(self, place: TerminalBits, wanted: Mapping[str, bool]) -> None:
        drive = self.axis.drive
        raw = self.before[place.key]
        for name, value in wanted.items():
            bit = 1 << place.bits[name]
            raw = raw | bit if value else raw & ~bit
        if drive.readings[place.key].raw == raw:
            return
        kept = (await self._sent(place.key, raw)).raw
        if kept != raw:
            raise Rejected(
                (
                    text(
                        "functions.0x-written-0x-read",
                        drive_name=drive.name,
                        key=place.key,
                        raw=raw,
                        kept=kept,
                    )
                    if isinstance(kept, int)
                    else text("functions.cannot-read-back", drive_name=drive.name, key=place.key)
                ),
                abort_code=0,
                drive=drive.name,
                parameter=place.key,
                value=kept,
                remedy=text("functions.try-perhaps-process-data-running"),
            )

    async def _sent(self, key: str, raw: int) -> Reading:
        if self.grant is None:
            raise RuntimeError("terminals are overruled only in a session that runs")
        return await self.axis.drive.energise(key, raw, self.grant)


class ForcingSessions:
    """All sessions of a bench; one per drive and kind.

    ``taken_by`` returns the person who controls a drive from a connection other than the given.
    """

    def __init__(self, jobs: JobRunner, taken_by: Callable[[str, str | None], str | None]) -> None:
        self._jobs = jobs
        self._taken_by = taken_by
        self._sessions: dict[tuple[str, str], ForcingSession] = {}

    def get(self, drive: str, name: str) -> ForcingSession | None:
        """The running session, or None."""
        return self._sessions.get((drive, name))

    async def start(
        self, axis: Axis, name: str, *, confirmed: bool, connection: str | None
    ) -> ForcingSession:
        """Begin a session; no terminal is overridden yet.

        Raises:
            NotAllowed: the drive does not support it, a warning was not confirmed, or a session
                runs already.
        """
        drive = axis.drive
        spec = require_forcing(drive, name)
        if not confirmed:
            raise NotAllowed(
                "functions.needs-your-agreement",
                drive=drive.name,
                spec_title=spec.title,
                warning=spec.warning,
            )
        if (drive.id, name) in self._sessions:
            raise NotAllowed("functions.use-already", drive=drive.name, spec_title=spec.title)
        if spec.needs_cyclic and (axis.session is None or not axis.session.running):
            raise NotAllowed(
                "functions.acts-process-data-exchanged", drive=drive.name, spec_title=spec.title
            )
        session = ForcingSession(axis, spec, connection)
        ready: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._sessions[drive.id, name] = session
        session.job = self._jobs.start(
            "forcing",
            text("work.of-drive", title=spec.title, drive=drive.name),
            lambda progress: self._run(session, ready, progress),
            drive=drive.id,
        )
        if (task := session.job.task) is None:
            raise RuntimeError("a job that was started has a task")
        task.add_done_callback(lambda _task: self._ended(session))
        await asyncio.wait([ready, task], return_when="FIRST_COMPLETED")
        if session.job.error is not None:
            raise session.job.error
        return session

    async def end(self, drive: str, name: str, reason: Text = _ENDED) -> None:
        """End a session; returns when everything is restored.

        Raises:
            DriveError: not everything could be restored.
        """
        session = self.get(drive, name)
        if session is None or session.job is None:
            return
        session.reason = session.reason or reason
        await session.job.wait()
        if session.job.error is not None:
            raise session.job.error

    def _ended(self, session: ForcingSession) -> None:
        self._sessions.pop((session.axis.drive.id, session.spec.name), None)

    async def _run(
        self, session: ForcingSession, ready: asyncio.Future[None], progress: Progress
    ) -> JobResult:
        axis, keys = session.axis, session.keys
        held = axis.granted(
            profile_text(axis.drive.profile.drive, session.spec.title),
            keys=frozenset(keys),
            ended=partial(_end_for, session),
        )
        with held as session.grant:
            return await self._overruling(session, ready, progress)

    async def _overruling(
        self, session: ForcingSession, ready: asyncio.Future[None], progress: Progress
    ) -> JobResult:
        axis, keys = session.axis, session.keys
        try:
            async with axis.restoring(*keys) as before:
                session.before = {key: int(raw) for key, raw in before.items()}
                if missing := [key for key in keys if key not in session.before]:
                    raise NotAllowed(
                        "functions.cannot-read", drive=axis.drive.name, missing=", ".join(missing)
                    )
                ready.set_result(None)
                try:
                    await self._watch(session, progress)
                finally:
                    await shielded(session.shut, CLEANUP_TIMEOUT_S, axis.drive.name)
        finally:
            # The real terminals must be in effect again even if the axis was enabled meanwhile.
            await shielded(lambda: self._act(session), CLEANUP_TIMEOUT_S, axis.drive.name)
        return sentence("reason", session.reason)

    async def _act(self, session: ForcingSession) -> None:
        """Put restored values into effect; on failure they stay on the restore list."""
        drive = session.axis.drive
        try:
            await apply_settings(session.axis, session.keys)
        except BaseException:
            drive.pending_restores.add(session.before, unapplied=True)
            raise

    async def _watch(self, session: ForcingSession, progress: Progress) -> None:
        """Wait until there is a reason to end the session."""
        stopped = session.axis.stopped
        while session.reason is None:
            progress(0.0, _words(session))
            await asyncio.sleep(_LOOK_S)
            session.reason = session.reason or self._why_end(session, stopped)
            stopped = session.axis.stopped

    def _why_end(self, session: ForcingSession, was_stopped: bool) -> Text | None:
        if session.axis.stopped and not was_stopped:
            return text("motion.stop-was-pressed")
        if time.monotonic() - session.renewed > SILENT_S:
            return text("work.page-not-reachable", silent_s=SILENT_S)
        person = self._taken_by(session.axis.drive.id, session.connection)
        return None if person is None else text("work.control-taken", person=person)


def _end_for(session: ForcingSession, why: Text) -> None:
    session.reason = session.reason or why


def _words(session: ForcingSession) -> Text:
    if not session.values:
        return text("functions.nothing-overruled-yet")
    on = [name for name, value in sorted(session.values.items()) if value]
    off = [name for name, value in sorted(session.values.items()) if not value]
    return text("functions.overruled", on=", ".join(on) or "–", off=", ".join(off) or "–")


def needs_settings(drive: Drive, keys: tuple[str, ...]) -> bool:
    """Whether any of these parameters takes effect only after "write settings"."""
    return any(drive.parameter(key).effective == "write_settings" for key in keys)


async def apply_settings(axis: Axis, keys: tuple[str, ...]) -> None:
    """Put these parameters into effect, where the family needs a command for it."""
    drive = axis.drive
    quirk = drive.profile.quirk("write_settings")
    if quirk is None or quirk.key is None or quirk.raw is None or not needs_settings(drive, keys):
        return
    await drive.trigger(quirk.key, quirk.raw)
    await asyncio.sleep(_APPLY_S)
    drive.mark_applied("write_settings")


def require_forcing(drive: Drive, name: str) -> Forcing:
    """How this family overrides terminals.

    Raises:
        NotAllowed: it does not support it, or not over the connected port.
    """
    found = functions_of(drive.profile).terminals.forcing
    spec = next((each for each in found if each.name == name), None)
    if spec is None:
        raise NotAllowed(
            "functions.no-way-overrule-terminals",
            drive=drive.name,
            value=name,
            limit=limits.one_of(", ".join(each.name for each in found)),
            profile_title=drive.profile.title,
        )
    for place in (spec.enable, spec.value):
        if place is not None and (why := drive.unreachable_why(drive.parameter(place.key))):
            raise NotAllowed(
                "drive.object-cannot-be-reached",
                drive=drive.name,
                parameter=place.key,
                name=drive.parameter(place.key).name,
                why=why,
            )
    return spec
