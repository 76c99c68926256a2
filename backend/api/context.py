"""What every route gets: the bench, who asks, and the permission to change an axis."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Header, Request

from backend.api.errors import NotFound
from backend.bench import Bench, Member
from drivers.errors import NotAllowed

#: Sent by the page with every change: the id of its live connection, which may hold a lease.
CONNECTION_HEADER = "X-Servodeck-Connection"


def bench_of(request: Request) -> Bench:
    """The bench of this server."""
    bench = request.app.state.bench
    if not isinstance(bench, Bench):
        raise TypeError("the application was made without a bench")
    return bench


Connection = Annotated[str | None, Header(alias=CONNECTION_HEADER)]
TheBench = Annotated[Bench, Depends(bench_of)]


def member_of(drive_id: str, bench: TheBench) -> Member:
    """The drive that a path names.

    Raises:
        NotFound: there is none.
    """
    try:
        return bench.member(drive_id)
    except NotAllowed as error:
        raise NotFound(error.message, drive=drive_id, remedy=error.remedy) from error


TheMember = Annotated[Member, Depends(member_of)]


def controlled(member: TheMember, bench: TheBench, connection: Connection = None) -> Member:
    """The drive that a path names, for a route that changes it.

    Raises:
        Busy: somebody else has control.
    """
    bench.leases.require(member.drive.id, connection)
    return member


Controlled = Annotated[Member, Depends(controlled)]
