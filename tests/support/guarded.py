"""A server with accounts and one servo in memory, in a thread: what a stranger would attack."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Awaitable, Callable, Coroutine
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, TypeVar

import httpx
import uvicorn
from argon2 import PasswordHasher

from backend.commands.server.serve import Serving, _config, _listen
from backend.foundation.people.identity import Actor, Identity, acting
from backend.foundation.people.login.passwords import Passwords
from backend.foundation.people.rights import Right, Role
from backend.foundation.people.station import People
from backend.foundation.work.jobs import Job, JobResult, Progress
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from tests.support.servo import Servo, bench_with
from tests.support.station import HANG_S, NO_CERTIFICATES, Live, until

T = TypeVar("T")
PASSWORD = "eleven blue horses"
#: What argon2 costs is tested once; here it would only be slow.
CHEAP = Passwords(PasswordHasher(time_cost=1, memory_cost=8, parallelism=1))
NAMES = {Role.ADMINISTRATOR: "Anna", Role.OPERATOR: "Olaf", Role.VIEWER: "Vera"}


_interface: dict[str, Any] = {}


class Caller:
    """Somebody with a cookie or a token, or nobody."""

    def __init__(self, server: GuardedServer, cookie: str | None = None, token: str | None = None):
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        self.server = server
        self.http = httpx.Client(
            base_url=f"{server.url}/api/v1",
            timeout=HANG_S,
            verify=NO_CERTIFICATES,
            headers=headers,
            cookies={"servodeck": cookie} if cookie else None,
        )
        server.callers.append(self)
        self.cookie, self.token = cookie, token
        if cookie:
            self.http.headers["X-Servodeck-CSRF"] = self.http.get("/session").json()["csrf"] or "-"

    def ask(self, method: str, path: str, **options: Any) -> httpx.Response:
        return self.http.request(method, path, **options)

    def ok(self, method: str, path: str, body: object = None) -> Any:
        answer = self.http.request(method, path, json=body)
        assert answer.is_success, answer.text
        return answer.json() if answer.content else None

    def live(self) -> Page:
        headers = {"Cookie": f"servodeck={self.cookie}"} if self.cookie else {}
        if self.token:
            headers["Authorization"] = f"Bearer {self.token}"
        return Page(f"{self.server.url.replace('http', 'ws')}/api/v1/live", headers)


class Page(Live):
    """A websocket with a cookie."""

    def refused(self, **message: object) -> Any:
        """Send, then a ping; the problem that came before the pong, or None."""
        self.socket.send(json.dumps(message))
        self.send(type="ping", n=987654)
        problem = None
        while True:
            got = self.receive(10)
            if got["type"] == "refused":
                problem = got["problem"]
            if got["type"] == "pong" and got["n"] == 987654:
                return problem


class GuardedServer:
    """``people`` may be moved in time by ``later``; ``bench`` has the axis x."""

    def __init__(
        self,
        folder: Path,
        *,
        accounts: bool = True,
        making: Callable[[Path], Awaitable[tuple[Bench, ConnectedDrive]]] | None = None,
    ) -> None:
        self.servo = Servo()
        self._making = making or (lambda folder: bench_with(self.servo, folder))
        self.folder = folder
        self.people = People(folder, accounts_needed=accounts, passwords=CHEAP)
        self.ahead = timedelta(0)
        self.callers: list[Caller] = []
        self.people.accounts._now = self.people.accounts.directory._now = lambda: (
            datetime.now(UTC) + self.ahead
        )
        self.bench: Bench
        self.connected: ConnectedDrive
        self.app: Any = None
        self.config: uvicorn.Config
        self.port = 0
        self._loop: asyncio.AbstractEventLoop
        self._server: uvicorn.Server
        self._thread: threading.Thread

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def interface(self) -> dict[str, Any]:
        """The OpenAPI document: slow to make, and the same of every server."""
        if not _interface:
            _interface.update(self.app.openapi())
        return _interface

    @property
    def connections(self) -> set[Any]:
        """HTTP connections and websockets as the server has them."""
        return set(self._server.server_state.connections)

    def start(self) -> GuardedServer:
        listening = _listen("127.0.0.1", 0)
        self.port = listening.getsockname()[1]
        started = threading.Event()

        async def main() -> None:
            self._loop = asyncio.get_running_loop()
            self.bench, self.connected = await self._making(self.folder)
            serving = Serving(accounts=self.people.accounts_needed)
            config = _config(self.bench, self.people, serving, None)
            config.accepting = [listening]
            self.app, self.config = config.app, config
            self._server = uvicorn.Server(config)
            task = asyncio.create_task(self._server.serve(sockets=[listening]))
            while not self._server.started:  # noqa: ASYNC110 - uvicorn has no event for it
                await asyncio.sleep(0.01)
            started.set()
            await task

        self._thread = threading.Thread(target=lambda: asyncio.run(main()), daemon=True)
        self._thread.start()
        assert started.wait(HANG_S)
        return self

    def stop(self) -> None:
        for caller in self.callers:
            caller.http.close()
        self._server.should_exit = True
        self._thread.join(HANG_S)
        assert not self._thread.is_alive(), "the server does not shut down"

    def run(self, work: Coroutine[Any, Any, T]) -> T:
        """Do something on the server's loop."""
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(HANG_S)

    def call(self, work: Callable[[], T]) -> T:
        """Call something on the server's loop."""

        async def calling() -> T:
            return work()

        return self.run(calling())

    # --- people -----------------------------------------------------------------------

    def add_people(self) -> None:
        accounts = self.people.accounts
        for role, name in NAMES.items():
            self.run(accounts.add(name, PASSWORD, role))

    def log_in(self, role: Role) -> Caller:
        made = httpx.post(
            f"{self.url}/api/v1/session",
            json={"name": NAMES[role], "password": PASSWORD},
            timeout=HANG_S,
            verify=NO_CERTIFICATES,
        )
        assert made.is_success, made.text
        return Caller(self, cookie=made.cookies["servodeck"])

    def token(self, role: Role, *scopes: Right) -> Caller:
        owner = next(a for a in self.people.accounts.directory.all() if a.role is role)
        make: Awaitable[Any] = self.people.accounts.make_token(
            owner.id, "script", frozenset(scopes), timedelta(days=1)
        )
        return Caller(self, token=self.run(make)[0])  # type: ignore[arg-type]

    def guest(self, host: Caller, allowed: list[str], minutes: float = 60) -> tuple[Caller, str]:
        """A joined guest, and the id of the invitation."""
        made = host.ok(
            "POST", "/invitations", {"guest": "Gert", "allowed": allowed, "minutes": minutes}
        )
        link = made["link"].removeprefix("/guest/")
        asked = {"link": link, "code": made["invitation"]["code"]}
        joined = httpx.post(
            f"{self.url}/api/v1/guests", json=asked, timeout=HANG_S, verify=NO_CERTIFICATES
        )
        assert joined.is_success, joined.text
        return Caller(self, cookie=joined.cookies["servodeck"]), made["invitation"]["id"]


def begin_motion(server: GuardedServer, identity: Identity) -> Job:
    """A motion of the axis x, begun by somebody, that goes on until it is cancelled."""

    async def work(_progress: Progress) -> JobResult | None:
        await asyncio.Event().wait()
        return None

    async def starting() -> Job:
        acting.set(Actor(identity))
        return server.bench.jobs.start("move", "Move", work, drive="x", motion=True)

    job = server.run(starting())
    until(lambda: server.call(lambda: server.bench.authority.mover_of("x")), what="the axis moves")
    return job
