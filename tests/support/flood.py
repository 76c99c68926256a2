"""Floods of a server on this machine, from a process of their own: ``python flood.py KIND PORT …``.

Prints a line when it is under way, goes on until its standard input closes, a minute at the
longest, and then prints how much it did.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import json
import socket
import sys
import time
import zipfile
from collections.abc import Awaitable, Callable
from pathlib import Path

LONGEST_S = 60.0


class Flood:
    """``head`` is what a request of somebody logged in brings: its headers, ready to be sent."""

    def __init__(self, port: int, head: str) -> None:
        self.port, self.head, self.done = port, head, 0
        self.ready = asyncio.Event()

    async def line(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        return await asyncio.open_connection("127.0.0.1", self.port)

    def request(self, method: str, path: str, body: bytes = b"", *, known: bool = False) -> bytes:
        head = self.head if known else ""
        return (
            f"{method} /api/v1{path} HTTP/1.1\r\nHost: localhost\r\n{head}"
            f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n"
            "Connection: close\r\n\r\n"
        ).encode() + body

    async def ask(self, data: bytes) -> None:
        with contextlib.suppress(OSError, asyncio.IncompleteReadError):
            reader, writer = await self.line()
            try:
                writer.write(data)
                await reader.read()
                self.done += 1
            finally:
                writer.close()

    # --- kinds ------------------------------------------------------------------------

    async def idle(self) -> None:
        """600 connections that say nothing; one that is closed is opened again."""
        held = asyncio.Semaphore(0)

        async def hold() -> None:
            first = True
            while True:
                with contextlib.suppress(OSError):
                    reader, writer = await self.line()
                    self.done += 1
                    if first:
                        held.release()
                        first = False
                    await reader.read()
                    writer.close()
                await asyncio.sleep(0.05)

        async def all_held() -> None:
            for _ in range(600):
                await held.acquire()
            self.ready.set()

        await asyncio.gather(all_held(), *(hold() for _ in range(600)))

    async def logins(self) -> None:
        """80 log-ins of nobody at a time."""

        async def one(number: int) -> None:
            count = 0
            while True:
                count += 1
                body = json.dumps({"name": f"x{number}-{count}", "password": "wrong password"})
                await self.ask(self.request("POST", "/session", body.encode()))
                self.ready.set()
                await asyncio.sleep(0.02)

        await asyncio.gather(*(one(n) for n in range(80)))

    async def jobs(self) -> None:
        """Jobs of somebody who may, one after the other, eight at a time."""

        async def one() -> None:
            while True:
                await self.ask(self.request("POST", "/drives/x/jobs/read_all", b"{}", known=True))
                self.ready.set()

        await asyncio.gather(*(one() for _ in range(8)))

    async def bodies(self) -> None:
        """300 bodies that come a byte at a time, of nobody and of somebody."""

        async def one(number: int) -> None:
            known = number % 2 == 0
            path = "/scan" if known else "/session"
            whole = self.request("POST", path, b"x" * 5000, known=known)
            head = whole.index(b"\r\n\r\n") + 4
            while True:
                with contextlib.suppress(OSError):
                    _, writer = await self.line()
                    writer.write(whole[:head])
                    self.done += 1
                    if self.done >= 300:
                        self.ready.set()
                    for byte in whole[head : head + 100]:
                        writer.write(bytes([byte]))
                        await writer.drain()
                        await asyncio.sleep(0.2)
                    writer.close()
                await asyncio.sleep(0.05)

        await asyncio.gather(*(one(n) for n in range(300)))

    async def requests(self) -> None:
        """What nobody may ask, as fast as eight connections go."""

        async def one() -> None:
            while True:
                await self.ask(self.request("GET", "/drives"))
                self.ready.set()

        await asyncio.gather(*(one() for _ in range(8)))

    async def files(self) -> None:
        """Large files of somebody who may, one after the other: what takes long to read."""
        rows = b"index;subindex;value\n" + b"0x6083;0;100\n" * 300_000
        uploads = [
            ("POST", "/measurements?name=a.sdmeas", _measurement_with_long_head()),
            ("POST", "/drives/x/handover/compare?file=a.csv", rows * 2),
            ("POST", "/sets/list?profile=mms7&file=b.toml&overwrite=true", rows),
            (
                "PUT",
                "/sets/a.toml?overwrite=true",
                b"".join(map(b"k%d = [1]\n".__mod__, range(250_000))),
            ),
            ("POST", "/scope/snapshots/a", b"SDSCOPE1" + b"\xff" * (30 << 20)),
        ]

        async def one(upload: tuple[str, str, bytes]) -> None:
            while True:
                await self.ask(self.request(*upload, known=True))

        self.ready.set()
        await asyncio.gather(*map(one, uploads))


def _measurement_with_long_head() -> bytes:
    """A file whose JSON about itself has 20 MB, in the form of numpy (NEP 1) inside a zip."""
    text = b'{"version":1,"kind":"sweep","drive":"x","saved":"2026-01-01T00:00:00+00:00","pad":['
    text += b'["abc"],' * 2_500_000 + b"0]}"
    head = b"{'descr':'|u1','fortran_order':False,'shape':(%d,),}" % len(text)
    head += b" " * (118 - len(head) - 1) + b"\n"
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr(
            "meta.npy", b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head + text
        )
    return out.getvalue()


def stops(port: int, head: str) -> None:
    """STOP by a connection of its own for each line of the standard input.

    Prints the seconds from the first packet to the answer, and those that this process waited for
    a processor meanwhile.
    """
    data = (
        f"POST /api/v1/stop HTTP/1.1\r\nHost: localhost\r\n{head}"
        "Content-Type: application/json\r\nContent-Length: 2\r\nConnection: close\r\n\r\n{}"
    ).encode()
    waits = Path("/proc/self/schedstat")
    for _ in sys.stdin:
        before, began = int(waits.read_text().split()[1]), time.monotonic()
        with socket.create_connection(("127.0.0.1", port), timeout=30) as line:
            line.sendall(data)
            answer = b""
            while part := line.recv(65536):
                answer += part
        took = time.monotonic() - began
        if not answer.startswith(b"HTTP/1.1 200") or b'"failed":{}' not in answer:
            raise SystemExit(f"STOP was not served: {answer[:300]!r}")
        print(took, (int(waits.read_text().split()[1]) - before) / 1e9, flush=True)


async def main(kind: str, port: int, head: str) -> None:
    flood = Flood(port, head)
    kinds: dict[str, Callable[[], Awaitable[None]]] = {
        "idle": flood.idle,
        "logins": flood.logins,
        "jobs": flood.jobs,
        "bodies": flood.bodies,
        "requests": flood.requests,
        "files": flood.files,
    }
    running = asyncio.ensure_future(kinds[kind]())
    await asyncio.wait_for(flood.ready.wait(), 30)
    print("under way", flush=True)
    with contextlib.suppress(TimeoutError):
        await asyncio.wait_for(asyncio.to_thread(sys.stdin.read), LONGEST_S)
    running.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await running
    print(flood.done, flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "stops":
        stops(int(sys.argv[2]), sys.argv[3])
        raise SystemExit
    asyncio.run(main(sys.argv[1], int(sys.argv[2]), sys.argv[3] if len(sys.argv) > 3 else ""))
