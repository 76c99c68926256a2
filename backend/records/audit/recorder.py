"""Audit recorder: converts events of the bench to audit facts, each kind in one method."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from backend.axes.drive.readings import CommandRecord, Refusal, WriteRecord
from backend.foundation.people.lease import Holder
from backend.foundation.work.jobs import Job
from backend.records.audit.asked import settings_now
from backend.records.audit.facts import Action, Fact, Kind, Value
from backend.records.audit.log import AuditLog
from drivers.errors import why_of
from drivers.texts.answers import message_in
from drivers.texts.message import Text, text

#: Jobs that are not recorded, as they only read values that the pages show anyway.
_UNREMARKABLE = frozenset({"reread", "read_all"})
_KINDS: dict[str, Kind] = {"procedure": "procedure", "load_set": "job", "put-back": "job"}


@dataclass(slots=True)
class _Sent:
    """Commands of one parameter during a motion: their number, the first and the last."""

    first: int
    last: int
    count: int = 1
    problem: Text | None = None

    def __str__(self) -> str:
        span = str(self.first) if self.count == 1 else f"{self.first} → {self.last}"
        times = "" if self.count == 1 else f" ({self.count}×)"
        return f"{span}{times}{f', {self.problem}' if self.problem else ''}"


@dataclass(slots=True)
class _Running:
    """A job whose beginning was recorded, with the axes that it moves."""

    drives: tuple[str, ...]
    sent: dict[str, _Sent] = field(default_factory=dict)


class AuditRecorder:
    """Records events of drives, jobs and leases. ``name_of`` returns the name of an axis id."""

    def __init__(self, audit: AuditLog, name_of: Callable[[str], str]) -> None:
        self._audit = audit
        self._name_of = name_of
        self._holders: dict[str, str] = {}
        self._running: dict[str, _Running] = {}
        #: Last command outside of a motion, by drive and parameter.
        self._commanded: dict[tuple[str, str], tuple[int, Text | None]] = {}

    def wrote(self, record: WriteRecord) -> None:
        """Record a write of a parameter, also one whose outcome is unknown."""
        detail: dict[str, Value] = {"drive": record.drive, "parameter": record.parameter}
        new = record.after
        if record.after is None or record.after != record.wanted:
            detail["wanted"] = record.wanted
        # The reason that a person gave for a setting that can start a motion.
        if isinstance(reason := settings_now().get("reason"), str) and reason:
            detail["reason"] = reason
        outcome = record.problem
        if outcome is None and record.after != record.wanted:
            outcome = text("audit.another-value-kept", wanted=record.wanted, kept=record.after)
        self._audit.add(
            Fact(
                "write",
                "written",
                axis=record.name,
                target=record.key,
                old=record.before,
                new=new,
                outcome=outcome,
                detail=detail,
            )
        )

    def refused(self, refusal: Refusal) -> None:
        """Record a refused write of a parameter that can move the axis."""
        detail: dict[str, Value] = {"drive": refusal.drive, "wanted": refusal.wanted}
        self._audit.add(
            Fact(
                "write",
                "refused",
                axis=refusal.name,
                target=refusal.key,
                outcome=refusal.why,
                detail=detail,
            )
        )

    def commanded(self, record: CommandRecord) -> None:
        """Record a control word or setpoint, also one whose outcome is unknown.

        The many commands of a motion are recorded together at its end. Others are recorded at once,
        and again only when they change, so that control words repeated by STOP are one event.
        """
        motion = next((j for j in self._running.values() if record.drive in j.drives), None)
        if motion is not None:
            sent = motion.sent.get(record.key)
            if sent is None:
                motion.sent[record.key] = _Sent(record.raw, record.raw, problem=record.problem)
            else:
                sent.last, sent.count = record.raw, sent.count + 1
                sent.problem = record.problem or sent.problem
            return
        place, what = (record.drive, record.key), (record.raw, record.problem)
        before = self._commanded.get(place)
        if before == what:
            return
        self._commanded[place] = what
        self._audit.add(
            Fact(
                "motion",
                "commanded",
                axis=record.name,
                target=record.key,
                old=None if before is None else before[0],
                new=record.raw,
                outcome=record.problem,
                detail={"drive": record.drive, "parameter": record.parameter},
            )
        )

    def job_changed(self, job: Job) -> None:
        """Record the beginning or end of a job; its progress is not recorded."""
        if job.kind in _UNREMARKABLE:
            return
        detail: dict[str, Value] = {}
        reason: Text | None = None
        if job.drive is not None:
            detail["drive"] = job.drive
        if job.partner is not None:
            detail["partner"] = job.partner
        if job.state == "running":
            if job.id in self._running:
                return
            self._running[job.id] = _Running(job.moved)
            detail = settings_now() | detail
        elif (ended := self._running.pop(job.id, None)) is None:
            return
        else:
            detail |= {key: str(sent) for key, sent in sorted(ended.sent.items())}
            reason = message_in(job.result or {}, "reason")
            self._forget_commands(job.moved or (job.drive,))
        self._audit.add(
            Fact(
                _KINDS.get(job.kind, "motion" if job.motion else "job"),
                "started" if job.state == "running" else job.state,
                axis=self._name_of(job.drive) if job.drive else "",
                target=job.id,
                outcome=_outcome(job),
                detail=detail,
                title=job.title_text,
                reason=reason,
            )
        )

    def _forget_commands(self, drives: Sequence[str | None]) -> None:
        """Discard the last commands of these drives, as a motion has sent others since."""
        for place in [place for place in self._commanded if place[0] in drives]:
            del self._commanded[place]

    def lease_changed(self, drive: str, holder: Holder | None) -> None:
        """Record a change of the person who controls an axis."""
        before, now = self._holders.get(drive, ""), holder.person if holder else ""
        if before == now:
            return
        self._holders[drive] = now
        action: Action = "taken" if not before else ("given back" if not now else "passed on")
        self._audit.add(
            Fact(
                "lease",
                action,
                axis=self._name_of(drive),
                target=now or before,
                old=before,
                new=now,
                detail={"drive": drive},
            )
        )

    def stopped(self, drives: Sequence[str]) -> None:
        """Record that STOP was pressed; called when STOP is sent, which does not wait for it."""
        for drive in drives:
            self._audit.add(
                Fact("stop", "pressed", axis=self._name_of(drive), detail={"drive": drive})
            )


def _outcome(job: Job) -> Text | None:
    """Why a job failed or was cancelled; None where it runs or is done."""
    if job.error is not None:
        return why_of(job.error)
    return job.cancel_cause if job.state == "cancelled" else None
