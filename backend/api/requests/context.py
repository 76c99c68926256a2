"""Dependencies of all routes: the bench, the person, and control of the axis.

All are coroutines although none waits: FastAPI runs plain functions on threads, which would delay
every answer by two more thread switches.
"""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Header, Request

from backend.api.messages.errors import NotFound
from backend.foundation.people.errors import NotLoggedIn
from backend.foundation.people.identity import Identity, acting
from backend.foundation.people.station import People
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from drivers.errors import NotAllowed

#: Header that the page sends with every change: the id of its live connection, which
#: may hold control. The gate removes an id that does not belong to the same session,
#: so a route may trust it.
CONNECTION_HEADER = "X-Servodeck-Connection"


async def bench_of(request: Request) -> Bench:
    """The bench of this server."""
    bench = request.app.state.bench
    if not isinstance(bench, Bench):
        raise TypeError("the application was made without a bench")
    return bench


Connection = Annotated[str | None, Header(alias=CONNECTION_HEADER)]
TheBench = Annotated[Bench, Depends(bench_of)]


async def people_of(request: Request) -> People:
    """Accounts and guests of this server."""
    people = request.app.state.people
    if not isinstance(people, People):
        raise TypeError("the application was made without people")
    return people


async def identity_now() -> Identity:
    """Identity of the person behind this request.

    Raises:
        NotLoggedIn: there is none.
    """
    actor = acting.get()
    if actor is None:
        raise NotLoggedIn("api.nobody-logged")
    return actor.identity


ThePeople = Annotated[People, Depends(people_of)]
Me = Annotated[Identity, Depends(identity_now)]


async def member_of(drive_id: str, bench: TheBench) -> ConnectedDrive:
    """The connected drive whose id is in the path.

    Raises:
        NotFound: there is none.
    """
    try:
        return bench.connected(drive_id)
    except NotAllowed as error:
        raise NotFound(error.text, drive=drive_id, remedy=error.remedy_text) from error


TheDrive = Annotated[ConnectedDrive, Depends(member_of)]


#: The drive in the path, for a route that changes it. The gate has checked that nobody else
#: controls it (backend.api.security.rights).
Controlled = TheDrive
