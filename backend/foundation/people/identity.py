"""The person behind a request: set by the gate per request or message, read by log and audit."""

from __future__ import annotations

from contextvars import Context, ContextVar, copy_context
from dataclasses import dataclass
from typing import Literal

from backend.foundation.people.rights import RIGHTS, Right, Role

Kind = Literal["local", "session", "token", "guest"]


@dataclass(frozen=True, slots=True)
class Identity:
    """A person as authenticated by the gate.

    ``session`` is the id of their session, token or invitation; empty for the one user of a station
    without accounts. ``rights`` are those at the time of the request; a guest's change with grants,
    so an identity must not be kept for longer than one request or message.
    """

    person: str
    role: Role
    kind: Kind
    session: str
    rights: frozenset[Right]

    @property
    def is_guest(self) -> bool:
        """Whether the person came by invitation, and is therefore not at the machine."""
        return self.kind == "guest"


LOCAL = Identity("local user", Role.ADMINISTRATOR, "local", "", RIGHTS[Role.ADMINISTRATOR])


@dataclass(frozen=True, slots=True)
class Actor:
    """An identity and the live connection that it acts through, where it has one."""

    identity: Identity
    connection: str | None = None


#: Set by the gate; tasks that a request starts inherit it, so that a job knows who started it.
acting: ContextVar[Actor | None] = ContextVar("acting", default=None)


#: Arrival time of the request or message that is being carried out (`time.monotonic`);
#: None where the program acts by itself. A STOP pressed after it takes precedence, however
#: long the request waited.
arrived_s: ContextVar[float | None] = ContextVar("arrived_s", default=None)


def by_itself() -> Context:
    """Context, without a person, for work that outlives the request that began it.

    Otherwise the log would attribute what a drive does hours later to the person who connected it.
    """
    context = copy_context()
    context.run(acting.set, None)
    context.run(arrived_s.set, None)
    return context


def acting_person() -> str:
    """Name of the person who acts now; empty where the program acts by itself."""
    actor = acting.get()
    return "" if actor is None else actor.identity.person


def acting_session() -> str:
    """Id of the session, token or invitation of the person who acts now; empty without one."""
    actor = acting.get()
    return "" if actor is None else actor.identity.session
