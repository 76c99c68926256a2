"""What every route gets: the bench, who asks, and the permission to change an axis.

All are coroutines although none waits: FastAPI runs plain functions in a thread each, and every
answer would wait for its turn twice more.
"""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Header, Request

from backend.api.errors import NotFound
from backend.people.errors import NotLoggedIn
from backend.people.identity import Identity, acting
from backend.people.station import People
from backend.station.bench import Bench
from backend.station.connected_drive import ConnectedDrive
from drivers.errors import NotAllowed

#: Sent by the page with every change: the id of its live connection, which may hold a lease. The
#: gate takes away one that is not of the same session, so a route may trust it.
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
    """The people of this server."""
    people = request.app.state.people
    if not isinstance(people, People):
        raise TypeError("the application was made without people")
    return people


async def identity_now() -> Identity:
    """Who asks.

    Raises:
        NotLoggedIn: nobody.
    """
    actor = acting.get()
    if actor is None:
        raise NotLoggedIn("api.nobody-logged")
    return actor.identity


ThePeople = Annotated[People, Depends(people_of)]
Me = Annotated[Identity, Depends(identity_now)]


async def member_of(drive_id: str, bench: TheBench) -> ConnectedDrive:
    """The drive that a path names.

    Raises:
        NotFound: there is none.
    """
    try:
        return bench.connected(drive_id)
    except NotAllowed as error:
        raise NotFound(error.text, drive=drive_id, remedy=error.remedy_text) from error


TheDrive = Annotated[ConnectedDrive, Depends(member_of)]


#: The drive that a path names, for a route that changes it. The gate has made sure that nobody
#: else has control (backend.api.security.rights).
Controlled = TheDrive
