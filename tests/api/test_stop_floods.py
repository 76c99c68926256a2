"""STOP is served within 100 ms while connections, log-ins, jobs, bodies or files flood the server.

The figures of one run stand in docs/security.md; ``SERVODECK_PRINT_FIGURES=1`` prints those of
this one.
"""

from __future__ import annotations

import gc
import os
import re
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from argon2 import PasswordHasher

from backend.commands.server.serve import settle
from backend.foundation.people.login.passwords import DEFAULT
from backend.foundation.people.rights import Role
from tests.support import flood
from tests.support.guarded import Caller, GuardedServer

KINDS = ["none", "idle", "logins", "jobs", "bodies", "requests", "files"]
STOPS, P99_S = 200, 0.1


@pytest.fixture
def server(tmp_path: Path) -> Iterator[GuardedServer]:
    running = GuardedServer(tmp_path).start()
    running.add_people()
    running.run(settle())  # as every server does at the end of its start
    yield running
    running.stop()
    gc.unfreeze()


def stops(server: GuardedServer, caller: Caller, count: int) -> list[tuple[float, float]]:
    """Seconds that STOP took, each time by a connection of its own, from another process.

    The second figure is without those for which the server's thread, or the caller, was ready and
    had no processor: the floods run on the same computer, and so may much else. Nor is that in it
    which the host of a virtual machine took from this one (steal, in steps of 10 ms).
    """
    head = f"Cookie: servodeck={caller.cookie}\r\n"
    waits = Path(f"/proc/self/task/{server._thread.native_id}/schedstat")
    process = subprocess.Popen(
        [sys.executable, flood.__file__, "stops", str(server.port), head],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    found = []
    try:
        for _ in range(count):
            before, had = int(waits.read_text().split()[1]), stolen_s()
            process.stdin.write("stop\n")
            process.stdin.flush()
            took, waited = map(float, process.stdout.readline().split())
            waited += (int(waits.read_text().split()[1]) - before) / 1e9
            waited += max(now - then for now, then in zip(stolen_s(), had, strict=True))
            found.append((took, max(0.0, took - waited)))
            time.sleep(0.01)
    finally:
        process.stdin.close()
        process.wait(60)
        process.stdout.close()
    return found


def stolen_s() -> list[float]:
    """Of each processor, the time [s] that a host gave to others since the start (proc(5))."""
    lines = Path("/proc/stat").read_text().splitlines()
    each = [line.split() for line in lines if re.match(r"cpu\d", line)]
    return [int(fields[8]) / os.sysconf("SC_CLK_TCK") for fields in each]


@contextmanager
def flooded(server: GuardedServer, kind: str, caller: Caller) -> Iterator[None]:
    if kind == "none":
        yield
        return
    head = (
        f"Cookie: servodeck={caller.cookie}\r\n"
        f"X-Servodeck-CSRF: {caller.http.headers['X-Servodeck-CSRF']}\r\n"
    )
    process = subprocess.Popen(
        [sys.executable, flood.__file__, kind, str(server.port), head],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        assert process.stdout.readline() == "under way\n"
        yield
        assert process.poll() is None, "the flood ended before the test"
    finally:
        process.stdin.close()
        done = int(process.stdout.read() or -1)
        process.wait(30)
        process.stdout.close()
    assert done > 0


@pytest.mark.long(keep=["idle"])
@pytest.mark.parametrize("kind", KINDS)
def test_stop_within_100_ms(server: GuardedServer, kind: str) -> None:
    operator, viewer = server.log_in(Role.OPERATOR), server.log_in(Role.VIEWER)
    # What a guess really costs.
    passwords = server.people.accounts._passwords
    assert isinstance(DEFAULT, PasswordHasher)
    cheap, passwords._hasher = passwords._hasher, DEFAULT
    passwords.decoy, decoy = DEFAULT.hash("nobody's"), passwords.decoy
    try:
        with flooded(server, kind, operator):
            took = stops(server, viewer, STOPS)
    finally:
        passwords._hasher, passwords.decoy = cheap, decoy
    p99 = figures(kind, took)
    assert p99 < P99_S, f"{kind}: p99 {p99:.3f} s"


def figures(kind: str, took: list[tuple[float, float]]) -> float:
    """The p99 less what the machine took; all of it is printed where that is wanted."""
    shown = []
    for name, each in zip(("wall", "own"), zip(*took, strict=True), strict=True):
        ordered = sorted(each)
        p50, p99 = ordered[len(ordered) // 2], ordered[int(len(ordered) * 0.99) - 1]
        shown.append(
            f"{name}: p50 {p50 * 1e3:.1f}, p99 {p99 * 1e3:.1f}, longest {ordered[-1] * 1e3:.1f} ms"
        )
    if os.environ.get("SERVODECK_PRINT_FIGURES"):
        print(f"\n{kind}: {'; '.join(shown)}")
    return p99


@pytest.mark.long
def test_idle_connections_do_not_grow_in_number(server: GuardedServer) -> None:
    viewer = server.log_in(Role.VIEWER)
    lines = []
    try:
        for _ in range(1200):
            lines.append(socket.create_connection(("127.0.0.1", server.port), timeout=30))
        stops(server, viewer, 1)
        assert len(server.connections) <= 801
        # The one that came last is still there; the first was let go for it.
        lines[-1].sendall(b"GET /api/v1/health HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert lines[-1].recv(100).startswith(b"HTTP/1.1 200")
        assert lines[0].recv(1) == b""
    finally:
        for line in lines:
            line.close()
