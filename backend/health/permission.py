"""The standing permission of a person that the health check of an axis runs without them.

It lies in the station's own folder, also where the database is shared: nobody who can write to that
server gets to move axes here. It names a baseline, whose settings are all that it permits.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable
from datetime import UTC, datetime, time, timedelta
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from backend.store.files import write_atomically
from drivers.errors import DriveError, NotAllowed
from drivers.texts.message import Text, text

#: No permission is given for longer.
LONGEST = timedelta(days=366)
#: A run that is due is made within this time, or it is missed: nobody expects motion later.
WINDOW = timedelta(minutes=10)
#: Attempts that are kept of a permission.
KEPT = 50

Cause = Literal["schedule", "trigger"]
Outcome = Literal["running", "done", "not_made", "missed", "cancelled", "failed"]
Weekday = Annotated[int, Field(ge=0, le=6)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Attempt(_Part):
    """One run that was due or asked for, and what became of it; ``why`` is a message on the wire.

    ``not_made``: nothing moved. ``missed``: servodeck did not run at the time.
    """

    at: datetime
    cause: Cause
    outcome: Outcome
    why: dict[str, object] | None = None


class Permission(_Part):
    """Who permits what, until when.

    ``account`` is the number of the person's account, None on a station without accounts. The run
    is due on ``days`` (0 is Monday) at ``at`` of the station's clock; without days there is no
    schedule. ``trigger``: a controller may ask for a run. ``pause_s`` lies between two runs.
    ``handled`` is the newest due time that has been dealt with, ``begun`` when the newest run did.
    """

    id: str = Field(default_factory=lambda: secrets.token_hex(8))
    drive: str
    axis_key: str
    person: str
    account: int | None
    given: datetime
    until: datetime
    baseline: int
    days: tuple[Weekday, ...] = ()
    at: time = time(2, 0)
    trigger: bool = False
    pause_s: float = 3600.0
    handled: datetime
    begun: datetime | None = None
    attempts: tuple[Attempt, ...] = ()

    @property
    def session(self) -> str:
        """What grants of its runs are asked for by, so that they end with it."""
        return f"health-permission-{self.id}"

    def noted(self, attempt: Attempt) -> Permission:
        """With one more attempt; its end takes the place of its beginning."""
        kept = tuple(
            each for each in self.attempts if (each.outcome, each.at) != ("running", attempt.at)
        )
        begun = attempt.at if attempt.outcome == "running" else self.begun
        return self.model_copy(update={"attempts": (*kept, attempt)[-KEPT:], "begun": begun})


def due(permission: Permission, now: datetime) -> datetime | None:
    """The newest time at or before ``now`` that is due and not dealt with, in UTC.

    A day of the clock that has no such time (summer time begins) has none; one that has it twice
    has the first.
    """
    local = now.astimezone()
    for back in range(8):
        day = local.date() - timedelta(days=back)
        if day.weekday() not in permission.days:
            continue
        found = datetime.combine(day, permission.at).astimezone(UTC)
        if found.astimezone().time() != permission.at:
            continue
        if found <= now:
            return found if found > permission.handled else None
    return None


def next_due(permission: Permission, now: datetime) -> datetime | None:
    """The next time after ``now``, in UTC; None without a schedule or after its end."""
    local = now.astimezone()
    for ahead in range(9):
        day = local.date() + timedelta(days=ahead)
        found = datetime.combine(day, permission.at).astimezone(UTC)
        if day.weekday() in permission.days and found > now:
            return found if found < permission.until else None
    return None


def require_term(given: datetime, until: datetime) -> None:
    """A permission ends after it begins, and within a year.

    Raises:
        NotAllowed: otherwise.
    """
    if not given < until <= given + LONGEST:
        raise NotAllowed(
            "health.permission-term",
            value=until.isoformat(timespec="minutes"),
            limit=text("health.permission-longest", days=LONGEST.days),
        )


def why_of(error: DriveError) -> dict[str, object]:
    """What was in the way, as it is stored and sent."""
    found: Text = error.text
    return found.to_wire()


class _Kept(_Part):
    permissions: tuple[Permission, ...] = ()


class Permissions:
    """The permissions of a station, at most one for each drive, over restarts."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._known: dict[str, Permission] = {}

    def load(self) -> None:
        """Read what was kept. Runs that a crash or a power cut ended are marked as failed.

        A file that cannot be read permits nothing.
        """
        try:
            kept = _Kept.model_validate_json(self._file.read_text("utf-8"))
        except (OSError, ValidationError):
            return
        for each in kept.permissions:
            found = each
            for attempt in [a for a in each.attempts if a.outcome == "running"]:
                why = text("health.run-cut-off").to_wire()
                found = found.noted(attempt.model_copy(update={"outcome": "failed", "why": why}))
            self._known[each.drive] = found

    def all(self) -> list[Permission]:
        """In the order in which they were given."""
        return list(self._known.values())

    def of(self, drive: str) -> Permission | None:
        """That of a drive."""
        return self._known.get(drive)

    def put(self, permission: Permission) -> Permission:
        """Keep it, in place of another one of the drive. Blocks for a write.

        Raises:
            StorageFailed: it cannot be written, and what was there before counts.
        """
        self._store({**self._known, permission.drive: permission})
        return permission

    def take_back(self, drive: str) -> Permission | None:
        """The drive has none any more; that which it had. It counts no longer in any case.

        Raises:
            StorageFailed: it would be there again after a restart.
        """
        gone = self._known.pop(drive, None)
        if gone is not None:
            self._store(dict(self._known))
        return gone

    def change(self, permission: Permission, how: Callable[[Permission], Permission]) -> None:
        """Change it where it still is the one of its drive.

        Raises:
            StorageFailed: as `put`.
        """
        now = self._known.get(permission.drive)
        if now is not None and now.id == permission.id:
            self.put(how(now))

    def skip(self, permission: Permission) -> None:
        """Like `put`, until the next start: for when nothing can be written."""
        self._known[permission.drive] = permission

    def _store(self, known: dict[str, Permission]) -> None:
        kept = _Kept(permissions=tuple(known.values()))
        write_atomically(self._file, kept.model_dump_json(indent=1).encode())
        self._known = known
