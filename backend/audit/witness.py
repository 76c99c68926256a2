"""What happens on the bench, as the audit tells it. Each kind of event enters in one place."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from backend.access import Holder
from backend.audit.facts import Fact, Kind, Value
from backend.audit.log import AuditLog
from backend.drive import WriteRecord
from backend.jobs import Job

#: Jobs that only read what the pages show anyway.
_UNREMARKABLE = frozenset({"reread", "read_all"})
_KINDS: dict[str, Kind] = {"procedure": "procedure", "load_set": "job"}


class Witness:
    """Listens to drives, jobs and leases. ``name_of`` gives an axis's name for its id."""

    def __init__(self, audit: AuditLog, name_of: Callable[[str], str]) -> None:
        self._audit = audit
        self._name_of = name_of
        self._holders: dict[str, str] = {}
        self._running: set[str] = set()

    def wrote(self, record: WriteRecord) -> None:
        """A parameter was written, or may have been."""
        detail: dict[str, Value] = {"drive": record.drive, "parameter": record.parameter}
        new = record.after
        if record.after is None or record.after != record.wanted:
            detail["wanted"] = record.wanted
        outcome = record.problem
        if not outcome and record.after != record.wanted:
            outcome = "the drive keeps another value"
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

    def job_changed(self, job: Job) -> None:
        """A job began or ended; progress between is not kept."""
        if job.kind in _UNREMARKABLE:
            return
        if job.state == "running":
            if job.id in self._running:
                return
            self._running.add(job.id)
        elif job.id not in self._running:
            return
        else:
            self._running.discard(job.id)
        kind: Kind = _KINDS.get(job.kind, "motion" if job.motion else "job")
        action = "started" if job.state == "running" else job.state
        detail: dict[str, Value] = {"title": job.title}
        if job.drive is not None:
            detail["drive"] = job.drive
        self._audit.add(
            Fact(
                kind,
                action,
                axis=self._name_of(job.drive) if job.drive else "",
                target=job.id,
                outcome=str(job.error) if job.error else "",
                detail=detail,
            )
        )

    def lease_changed(self, drive: str, holder: Holder | None) -> None:
        """Control of an axis may have changed hands."""
        before, now = self._holders.get(drive, ""), holder.person if holder else ""
        if before == now:
            return
        self._holders[drive] = now
        action = "taken" if not before else ("given back" if not now else "passed on")
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
        """Somebody pressed STOP. Told when it is sent: nothing waits for this."""
        for drive in drives:
            self._audit.add(
                Fact("stop", "pressed", axis=self._name_of(drive), detail={"drive": drive})
            )
