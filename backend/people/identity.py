"""Who asks. Set once per request or message by the gate, read where something is written down."""

from __future__ import annotations

from contextvars import Context, ContextVar, copy_context
from dataclasses import dataclass
from typing import Literal

from backend.people.rights import RIGHTS, Right, Role

Kind = Literal["local", "session", "token", "guest"]


@dataclass(frozen=True, slots=True)
class Identity:
    """A person as the gate knows them.

    ``session`` names the session, token or invitation that they came by; empty for the one user
    of a station without accounts. ``rights`` are those of the moment; a guest's change with
    grants, so nobody keeps an identity for longer than one request or message.
    """

    person: str
    role: Role
    kind: Kind
    session: str
    rights: frozenset[Right]

    @property
    def is_guest(self) -> bool:
        """Somebody by invitation, who is not at the machine."""
        return self.kind == "guest"


LOCAL = Identity("local user", Role.ADMINISTRATOR, "local", "", RIGHTS[Role.ADMINISTRATOR])


@dataclass(frozen=True, slots=True)
class Actor:
    """An identity and the live connection that it acts through, where it has one."""

    identity: Identity
    connection: str | None = None


#: The gate sets it; tasks that a request starts inherit it, so a job knows whose it is.
acting: ContextVar[Actor | None] = ContextVar("acting", default=None)


def by_itself() -> Context:
    """A context of work that outlives the request that began it: nobody is named for what it does.

    Else what a drive does hours later is informed of the person who connected it.
    """
    context = copy_context()
    context.run(acting.set, None)
    return context


def acting_person() -> str:
    """Name of who acts now; empty where the program acts by itself."""
    actor = acting.get()
    return "" if actor is None else actor.identity.person


def acting_session() -> str:
    """The session, token or invitation of who acts now; empty without one."""
    actor = acting.get()
    return "" if actor is None else actor.identity.session
