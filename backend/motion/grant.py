"""The permission to put energy into a motor, as a value that is handed to whoever writes."""

from __future__ import annotations

from dataclasses import dataclass

from backend.motion.envelope import Envelope
from drivers.errors import NotAllowed
from drivers.texts.message import Text


@dataclass(frozen=True, slots=True, eq=False)
class Grant:
    """Who may move one axis, what for, until when and within what envelope.

    Only `backend.motion.authority.MotionAuthority` issues grants that count: one that was made by
    hand is not live, however it looks. Two grants are the same only if they are one object.

    ``drive`` is the drive's id. ``actor`` is the person, empty where the program acts by itself.
    ``until`` is in `time.monotonic` seconds, infinite where the end comes from elsewhere: the job
    that holds it, the page, the control lease. ``envelope`` is None where none is known yet, or
    where nothing is moved (enabling, a procedure). ``keys`` limits it to these objects; None is
    the whole axis. ``standing``: the axis was left enabled by a person; it bounds no other grant.
    ``session`` names the log-in, token or invitation by which the person asked; it ends with that.
    """

    drive: str
    actor: str
    purpose: str | Text
    until: float
    envelope: Envelope | None = None
    keys: frozenset[str] | None = None
    standing: bool = False
    session: str = ""

    def covers(self, key: str) -> bool:
        """Whether this object may be written with it."""
        return self.keys is None or key in self.keys


class NotGranted(NotAllowed):
    """Something that can put energy into a motor, without a grant of the motion authority.

    ``page`` and ``route`` are where it can be done (`backend.motion.alternatives`), or empty.
    """

    kind = "not-granted"
    page: str = ""
    route: str = ""
