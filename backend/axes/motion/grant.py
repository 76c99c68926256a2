"""Permission to put energy into a motor, a value that is passed to the code that writes."""

from __future__ import annotations

from dataclasses import dataclass

from backend.axes.motion.envelope import Envelope
from drivers.errors import NotAllowed
from drivers.texts.message import Text


@dataclass(frozen=True, slots=True, eq=False)
class Grant:
    """Permission for one motion: person, axis, purpose, time limit and envelope.

    Only grants issued by `backend.axes.motion.authority.MotionAuthority` are live; one constructed
    elsewhere is not. Two grants are equal only if they are the same object.

    ``drive`` is the drive's id. ``actor`` is the person, empty where the program acts by itself.
    ``until`` is in `time.monotonic` seconds, infinite where something else ends the grant: the job
    that holds it, the page, the control lease. ``envelope`` is None where none is known yet, or
    where nothing is moved (enabling, a procedure). ``keys`` limits the grant to these objects; None
    means the whole axis. ``standing``: a person left the axis enabled; such a grant bounds no
    other. ``session`` is the log-in, token or invitation by which the person asked; the grant ends
    with it.
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
        """Whether the grant permits writing this object."""
        return self.keys is None or key in self.keys


class NotGranted(NotAllowed):
    """Raised when something could put energy into a motor without a grant of the motion authority.

    ``page`` and ``route`` are where it can be done (`backend.axes.motion.alternatives`), or empty.
    """

    kind = "not-granted"
    page: str = ""
    route: str = ""
