"""Requests from the command line to a running server, like those of a page.

The wires of the demo bench belong to the server that made them, and an EtherCAT interface has one
master, so a server that runs already is used. A drive is given by bus URL and station, as without a
server; where it is not in the server's axis list yet, it is connected.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import ssl
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import TypeVar

import httpx
from pydantic import BaseModel, TypeAdapter, ValidationError

from backend.api.messages.models import JobInfo, Problem
from backend.api.station.models import Bus, DriveSummary, FoundDrive
from backend.commands.base.session import show_progress
from drivers.errors import DriveError, LinkLost, NotAllowed, ProtocolError
from drivers.texts.message import Text, language
from drivers.urls import parse_url

T = TypeVar("T")

_TIMEOUT_S, _LOOK_S = 60.0, 0.1


class Remote:
    """One server. Its problems are raised as `DriveError` with the server's text."""

    def __init__(self, address: str, http: httpx.AsyncClient) -> None:
        self.address = address
        self._http = http

    async def ask(
        self, method: str, path: str, kind: type[T], *, body: object = None,
        content: bytes | None = None, query: dict[str, str] | None = None,
    ) -> T:  # fmt: skip
        """One request and its answer.

        Raises:
            DriveError: the server reports a problem, or cannot be reached.
        """
        answer = await self.raw(method, path, body=body, content=content, query=query)
        try:
            return TypeAdapter(kind).validate_json(answer.content or b"null")
        except ValidationError as error:
            raise ProtocolError(
                "command.gives-answer-another-form", address=self.address, method=method, path=path
            ) from error

    async def raw(
        self,
        method: str,
        path: str,
        *,
        body: object = None,
        content: bytes | None = None,
        query: dict[str, str] | None = None,
    ) -> httpx.Response:
        """One request, with ``body`` as JSON or ``content`` as bytes; the unparsed response.

        Raises:
            DriveError: the server reports a problem, or cannot be reached.
        """
        try:
            answer = await self._http.request(
                method, path, json=body, content=content, params=query
            )
        except httpx.HTTPError as error:
            raise LinkLost(
                "command.no-server-answers", address=self.address, cause=str(error)
            ) from error
        if not answer.is_success:
            raise _problem(answer)
        return answer

    async def result(self, path: str, body: object) -> dict[str, object]:
        """Start a job and wait for its end; the job is cancelled where the caller is.

        Raises:
            NotAllowed: it failed or was cancelled; the message is the server's.
        """
        # Not cancelled halfway: a job whose id is not known yet could not be ended.
        starting = asyncio.ensure_future(self.ask("POST", path, JobInfo, body=body))
        try:
            job = await asyncio.shield(starting)
        except asyncio.CancelledError:
            with contextlib.suppress(DriveError):
                await self.raw("DELETE", f"/jobs/{(await starting).id}")
            raise
        try:
            while job.state == "running":
                await asyncio.sleep(_LOOK_S)
                job = await self.ask("GET", f"/jobs/{job.id}", JobInfo)
                show_progress(job.progress, Text.from_wire(job.step_message.model_dump()))
        except asyncio.CancelledError:
            await asyncio.shield(self.raw("DELETE", f"/jobs/{job.id}"))
            raise
        if job.state != "done":
            raise _not_done(job)
        if isinstance(job.result, BaseModel):
            return job.result.model_dump(mode="json")
        return job.result or {}

    async def drives(self) -> list[DriveSummary]:
        """Drives of the server's axis list."""
        return await self.ask("GET", "/drives", list[DriveSummary])

    async def scan(self, url: str, stations: list[int] | None = None) -> list[FoundDrive]:
        """Drives that answer on a bus."""
        result = await self.result("/scan", {"url": url, "stations": stations})
        return TypeAdapter(list[FoundDrive]).validate_python(result["found"])

    async def drive(self, url: str, station: int, profile: str | None = None) -> DriveSummary:
        """The drive at a station; it is connected where it is not yet.

        Raises:
            NotAllowed: no drive answers there, or several families match.
        """
        wanted = str(parse_url(url))
        for known in await self.drives():
            for port in known.ports:
                if (str(parse_url(port.url)), port.station) == (wanted, station):
                    return known
        found = next((f for f in await self.scan(url, [station]) if f.station == station), None)
        if found is None:
            raise NotAllowed(
                "command.nothing-answers-station-check-power", station=station, url=url
            )
        sure = [m for m in found.matches if m.confidence != "possible"] or found.matches
        if profile is None and len(sure) != 1:
            choices = ", ".join(match.profile for match in found.matches) or "none"
            raise NotAllowed("command.drive-station", station=station, choices=choices)
        body = {"url": url, "station": station, "profile": profile or sure[0].profile}
        return await self.ask("POST", "/drives", DriveSummary, body=body)

    @asynccontextmanager
    async def exchange(self, url: str, cycle_us: int | None) -> AsyncIterator[None]:
        """Context in which the bus exchanges process data; an exchange from before continues after.

        ``cycle_us``: cycle time [µs]; None leaves everything as it is.
        """
        buses = await self.ask("GET", "/buses", list[Bus])
        runs = any(bus.url == url and bus.cyclic is not None for bus in buses)
        if cycle_us is None or runs:
            yield
            return
        await self.ask("POST", "/buses/cyclic", Bus, body={"url": url, "cycle_us": cycle_us})
        try:
            yield
        finally:
            await asyncio.shield(self.raw("DELETE", "/buses/cyclic", query={"url": url}))


@asynccontextmanager
async def remote(server: str) -> AsyncIterator[Remote]:
    """A server for the duration of one command, with the token of ``SERVODECK_TOKEN``."""
    address = server.rstrip("/")
    headers = {**authorisation(), "Accept-Language": language()}
    async with httpx.AsyncClient(
        base_url=f"{address}/api/v1", timeout=_TIMEOUT_S, headers=headers, verify=_trust(address)
    ) as http:
        yield Remote(address, http)


def _trust(address: str) -> bool | ssl.SSLContext:
    """The certificates by which a server is verified.

    Loading those of the system takes 50 ms. With ``http`` there is nothing to verify, so a context
    without any certificate is used, which would refuse a redirection to ``https``.
    """
    return ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT) if address.startswith("http://") else True


def authorisation() -> dict[str, str]:
    """The header with the token of the environment; empty without one."""
    token = os.environ.get("SERVODECK_TOKEN")
    return {"Authorization": f"Bearer {token}"} if token else {}


def _not_done(job: JobInfo) -> NotAllowed:
    """Why a job of the server is not done, with the server's remedy."""
    title = Text.from_wire(job.title_message.model_dump())
    if job.problem is not None:
        return NotAllowed(job.problem.detail, remedy=job.problem.remedy)
    if job.state != "cancelled":
        return NotAllowed("command.job-failed", title=title)
    if (found := job.cancellation) is None:
        return NotAllowed("command.job-cancelled-unknown", title=title)
    why = Text.from_wire(found.cause_message.model_dump())
    return NotAllowed("command.job-cancelled", title=title, why=why, remedy=why.remedy())


def _problem(answer: httpx.Response) -> DriveError:
    try:
        reported = Problem.model_validate_json(answer.content)
    except ValidationError:
        return DriveError("command.server-says", status_code=answer.status_code)
    if not reported.detail:
        return DriveError("command.server-says", status_code=answer.status_code)
    return DriveError(reported.detail, remedy=reported.remedy)
