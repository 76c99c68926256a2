"""A person's standing permission to run the health check of an axis unattended.

It is stored in the station's own folder, also where the database is shared, so that nobody with
write access to that server can move axes here. It refers to a baseline, and permits that baseline's
settings only.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable
from datetime import UTC, datetime, time, timedelta
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from backend.foundation.store.files import write_atomically
from backend.tools.thresholds import trend_permission as threshold
from drivers.errors import DriveError, NotAllowed
from drivers.texts.message import Text, text

#: Longest term of a permission.
LONGEST = timedelta(days=366)
#: A due run begins within this time or counts as missed, as nobody expects motion later.
WINDOW = timedelta(minutes=10)

Cause = Literal["schedule", "trigger"]
Outcome = Literal["running", "done", "not_made", "missed", "cancelled", "failed"]
Weekday = Annotated[int, Field(ge=0, le=6)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Attempt(_Part):
    """One run that was due or requested, and its outcome; ``why``: a message in wire form.

    ``not_made``: nothing moved. ``missed``: servodeck did not run at the time.
    """

    at: datetime
    cause: Cause
    outcome: Outcome
    why: dict[str, object] | None = None


class Permission(_Part):
    """A permission: person, axis, term, schedule and trigger.

    ``account``: number of the person's account, None on a station without accounts. A run is due on
    ``days`` (0 is Monday) at ``at`` by the station's clock; without days there is no schedule.
    ``trigger``: a controller may request a run. ``pause_s``: shortest time between two runs.
    ``handled``: newest due time that has been processed. ``begun``: time of the newest run.
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
        """Session under which grants of its runs are requested, so that they end with it."""
        return f"health-permission-{self.id}"

    def noted(self, attempt: Attempt) -> Permission:
        """The permission with one more attempt; the end of a run replaces its beginning."""
        kept = tuple(
            each for each in self.attempts if (each.outcome, each.at) != ("running", attempt.at)
        )
        begun = attempt.at if attempt.outcome == "running" else self.begun
        return self.model_copy(
            update={"attempts": (*kept, attempt)[-threshold.KEPT :], "begun": begun}
        )


def due(permission: Permission, now: datetime) -> datetime | None:
    """The newest due time at or before ``now`` that is not processed yet, in UTC; None without one.

    A day without this local time (beginning of summer time) has none; a day on which it occurs
    twice has the first.
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
    """The next due time after ``now``, in UTC; None without a schedule or after its end.

    A day without this local time (beginning of summer time) has none, as in `due`.
    """
    local = now.astimezone()
    for ahead in range(16):
        day = local.date() + timedelta(days=ahead)
        found = datetime.combine(day, permission.at).astimezone(UTC)
        exists = found.astimezone().time() == permission.at
        if day.weekday() in permission.days and exists and found > now:
            return found if found < permission.until else None
    return None


def require_term(given: datetime, until: datetime) -> None:
    """Check that a permission ends after it begins, and within `LONGEST`.

    Raises:
        NotAllowed: it does not.
    """
    if not given < until <= given + LONGEST:
        raise NotAllowed(
            "health.permission-term",
            value=until.isoformat(timespec="minutes"),
            limit=text("health.permission-longest", days=LONGEST.days),
        )


def why_of(error: DriveError) -> dict[str, object]:
    """The text of an error in wire form, as it is stored and sent."""
    found: Text = error.text
    return found.to_wire()


class _Kept(_Part):
    permissions: tuple[Permission, ...] = ()


class Permissions:
    """The permissions of a station, at most one for each drive, stored across restarts."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._known: dict[str, Permission] = {}

    def load(self) -> None:
        """Read the stored permissions; runs ended by a crash or a power cut are marked as failed.

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
        """All permissions, in the order in which they were given."""
        return list(self._known.values())

    def of(self, drive: str) -> Permission | None:
        """The permission of a drive; None without one."""
        return self._known.get(drive)

    def put(self, permission: Permission) -> Permission:
        """Store a permission, in place of another one of the drive. Blocks for a write.

        Raises:
            StorageFailed: it cannot be written; the earlier one stays in force.
        """
        self._store({**self._known, permission.drive: permission})
        return permission

    def take_back(self, drive: str) -> Permission | None:
        """Remove the permission of a drive and return it. It is withdrawn in any case.

        Raises:
            StorageFailed: the removal cannot be stored; the permission returns after a restart.
        """
        gone = self._known.pop(drive, None)
        if gone is not None:
            self._store(dict(self._known))
        return gone

    def change(self, permission: Permission, how: Callable[[Permission], Permission]) -> None:
        """Change a permission, provided that it still is the one of its drive.

        Raises:
            StorageFailed: as `put`.
        """
        now = self._known.get(permission.drive)
        if now is not None and now.id == permission.id:
            self.put(how(now))

    def skip(self, permission: Permission) -> None:
        """Like `put`, but until the next start only, for when nothing can be written."""
        self._known[permission.drive] = permission

    def _store(self, known: dict[str, Permission]) -> None:
        kept = _Kept(permissions=tuple(known.values()))
        write_atomically(self._file, kept.model_dump_json(indent=1).encode())
        self._known = known
