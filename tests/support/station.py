"""A whole station for tests: virtual drives in their process, the server in a thread."""

from __future__ import annotations

import asyncio
import contextlib
import json
import ssl
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import uvicorn
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from backend.api.app import make_app
from backend.commands.server.serve import LOOPBACK, _listen
from backend.foundation.people.station import People
from backend.station.bench import Bench
from backend.station.demo import DemoBench

#: What takes longer hangs. It is no check of the product: where that guarantees a time, a test says
#: so with a time of its own.
HANG_S = 60.0
#: For clients of a server by plain http: to load the system's certificates takes each 50 ms.
NO_CERTIFICATES = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)


def until(condition: Callable[[], object], timeout_s: float = HANG_S, what: str = "") -> Any:
    """Poll until the condition is true; the value is returned. Fails with ``what`` in time."""
    deadline = time.monotonic() + timeout_s
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {timeout_s} s: {what or condition}")
        time.sleep(0.01)


class Station:
    """Server and virtual drives. ``http`` talks to the interface, ``drives`` causes trouble."""

    def __init__(
        self,
        folder: Path,
        bench_file: Path | None = None,
        segment_options: Sequence[str] = (),
        people: People | None = None,
        *,
        steady: bool = False,
        database: str | None = None,
        blobs: str | None = None,
    ) -> None:
        """With ``steady`` replies on EtherCAT are awaited, as in the demo: a busy machine is then
        no trouble for the drives. ``database`` and ``blobs`` are those of
        `backend.station.bench.Bench`.
        """
        self._records = {"database": database, "blobs": blobs}
        self.people = people
        self.loop: asyncio.AbstractEventLoop | None = None
        self.folder = folder
        self.drives = DemoBench(
            bench_file,
            folder / "wires",
            folder / "nvm",
            segment_options=segment_options,
            steady=steady,
        )
        self._server: uvicorn.Server | None = None
        #: The running server's; made in its thread.
        self.bench: Bench | None = None
        self._thread: threading.Thread | None = None
        self.http = httpx.Client(verify=NO_CERTIFICATES)
        self.port = 0

    def start(self) -> None:
        self.drives.start()
        self.start_server()

    def start_server(self) -> None:
        listening = _listen("127.0.0.1", 0)
        self.port = listening.getsockname()[1]
        started = threading.Event()

        def run() -> None:
            async def main() -> None:
                self.loop = asyncio.get_running_loop()
                bench = Bench(self.folder / "state", self.drives.wires, **self._records)
                self.bench = bench
                config = uvicorn.Config(
                    make_app(bench, hosts=LOOPBACK, people=self.people),
                    log_level="warning",
                    ws_per_message_deflate=False,
                    timeout_graceful_shutdown=2,
                )
                self._server = uvicorn.Server(config)
                serving = asyncio.create_task(self._server.serve(sockets=[listening]))
                while not self._server.started:  # noqa: ASYNC110 - uvicorn has no event for it
                    await asyncio.sleep(0.01)
                started.set()
                await serving

            asyncio.run(main())

        self._thread = threading.Thread(target=run, name="server", daemon=True)
        self._thread.start()
        assert started.wait(HANG_S)
        self.http = httpx.Client(
            base_url=f"{self.url}/api/v1", timeout=HANG_S, verify=NO_CERTIFICATES
        )

    def stop_server(self) -> None:
        self.http.close()
        if self._server is not None and self._thread is not None:
            self._server.should_exit = True
            self._thread.join(HANG_S)
            assert not self._thread.is_alive(), "the server does not shut down"

    def stop(self) -> None:
        self.stop_server()
        self.drives.stop()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    # --- shortcuts --------------------------------------------------------------------

    def ok(self, answer: httpx.Response) -> Any:
        assert answer.is_success, answer.text
        return answer.json() if answer.content else None

    def add(
        self, station: int = 1, url: str = "mlink://virtual0", profile: str = "mms7", name: str = ""
    ) -> str:
        body = {"url": url, "station": station, "profile": profile, "name": name}
        drive = self.ok(self.http.post("/drives", json=body))
        return str(drive["id"])

    def remove(self, *drives: str) -> None:
        """Whatever a test left them doing: stopped, awaited, and removed.

        An axis whose cable was pulled is set up again in order once it answers again. That job is
        not stopped by anybody, and the drive stays until it has ended.
        """
        self.http.post("/stop", json={})
        for job in self.ok(self.http.get("/jobs")):
            if job["state"] == "running":
                self.http.delete(f"/jobs/{job['id']}")
        for drive in drives:

            def gone(drive: str = drive) -> bool:
                answer = self.http.delete(f"/drives/{drive}")
                assert answer.is_success or answer.status_code == 409, answer.text
                return answer.is_success

            until(gone, what=f"{drive} is taken out")

    def job(self, answer: httpx.Response, timeout_s: float = HANG_S) -> Any:
        """Wait for a job's end; returns the job."""
        job = self.ok(answer)

        def ended() -> Any:
            now = self.ok(self.http.get(f"/jobs/{job['id']}"))
            return now if now["state"] != "running" else None

        return until(ended, timeout_s, f"job {job['title']}")

    def done(self, answer: httpx.Response, timeout_s: float = HANG_S) -> Any:
        job = self.job(answer, timeout_s)
        assert job["state"] == "done", job
        return job["result"]

    def state(self, drive: str) -> Any:
        return self.ok(self.http.get(f"/drives/{drive}/state"))

    def live(self) -> Live:
        return Live(f"ws://127.0.0.1:{self.port}/api/v1/live")


class Live:
    """A page's websocket."""

    def __init__(self, url: str, headers: Mapping[str, str] | None = None) -> None:
        # With messages unread, this client does not see the server's close and would wait 10 s.
        self.socket: ClientConnection = connect(
            url, max_size=None, close_timeout=1, additional_headers=headers
        )
        self.binary: list[bytes] = []
        self._heard: deque[str | bytes] = deque()
        hello = self.wait("hello")
        self.connection = hello["connection"]

    def send(self, **message: object) -> None:
        self.socket.send(json.dumps(message))

    def receive(self, timeout_s: float = HANG_S) -> Any:
        heard = self._heard
        message = heard.popleft() if heard else self.socket.recv(timeout=timeout_s)
        if isinstance(message, bytes):
            self.binary.append(message)
            return {"type": "binary"}
        return json.loads(message)

    def listen(self) -> None:
        """Take what has come, for later: with much unread, this client hears no ping any more."""
        with contextlib.suppress(TimeoutError):
            while True:
                self._heard.append(self.socket.recv(timeout=0))

    def wait(self, kind: str, timeout_s: float = HANG_S, **fields: object) -> Any:
        """The next message of this kind whose fields agree."""
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            message = self.receive(deadline - time.monotonic())
            if message["type"] == kind and all(message.get(k) == v for k, v in fields.items()):
                return message
        raise AssertionError(f"no {kind} message within {timeout_s} s")

    @contextmanager
    def holding(self, drive: str) -> Iterator[None]:
        """Renew the jog of ``drive`` from a thread, as a page does while a button is held."""
        released = threading.Event()

        def renew() -> None:
            with contextlib.suppress(ConnectionClosed):  # the server was killed
                while not released.wait(0.02):
                    self.send(type="jog_renew", drive=drive)

        button = threading.Thread(target=renew, daemon=True)
        button.start()
        try:
            yield
        finally:
            released.set()
            button.join()

    def close(self) -> None:
        self.socket.close()

    def __enter__(self) -> Live:
        return self

    def __exit__(self, *_exc: object) -> None:
        self.close()
