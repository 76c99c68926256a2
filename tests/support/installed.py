"""An installed servodeck as a person starts it: a process, what it prints, the page behind it."""

from __future__ import annotations

import os
import re
import subprocess
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.request import urlopen

import psutil

_ADDRESS = re.compile(r"servodeck is at (http://\S+)")
_ASSET = re.compile(r'(?:src|href)="(?:[.]?/)?(assets/[^"]+)"')
#: What takes longer hangs.
HANG_S = 120.0


class NoServer(AssertionError):
    """The server ended, or was ended after `HANG_S`, before it gave its address."""


@dataclass(frozen=True)
class Served:
    """A running server: its address, and how long it took until the page was there, with the
    processor time of its processes (seconds).
    """

    address: str
    page: str
    assets: tuple[str, ...]
    seconds: float
    processor_s: float


@contextmanager
def served(
    command: Sequence[str | Path], folder: Path, environment: Mapping[str, str]
) -> Iterator[Served]:
    """Start a server with nothing but this environment, in ``folder``, and get its page.

    ``command`` listens on a free port of loopback by itself (``--port 0``).
    """
    began = time.monotonic()
    process = subprocess.Popen(
        [str(part) for part in command],
        cwd=folder,
        env=dict(environment),
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    guard = threading.Timer(HANG_S, process.kill)
    guard.start()
    try:
        address = _address(process)
        page = _get(address)
        assets = tuple(_ASSET.findall(page))
        for asset in assets:
            _get(f"{address}{asset}")
        seconds = time.monotonic() - began
        first = psutil.Process(process.pid)
        used = [one.cpu_times() for one in (first, *first.children(recursive=True))]
        yield Served(address, page, assets, seconds, sum(one.user + one.system for one in used))
    finally:
        process.terminate()
        # It ends by itself, or the guard ends it.
        process.communicate()
        guard.cancel()


def _address(process: subprocess.Popen[str]) -> str:
    printed = []
    assert process.stdout is not None
    for line in process.stdout:
        printed.append(line)
        found = _ADDRESS.search(line)
        if found:
            return found[1]
    raise NoServer(f"no server: exit code {process.wait()}\n{''.join(printed)}")


def _get(url: str) -> str:
    with urlopen(url, timeout=HANG_S) as answer:  # the address that our own server has printed
        assert answer.status == 200
        return str(answer.read().decode("utf-8", errors="replace"))


def plain_environment(home: Path, *folders: Path) -> dict[str, str]:
    """As on a fresh account: no checkout, no Node, no virtual environment on the path."""
    path = os.pathsep.join([*(str(folder) for folder in folders), "/usr/bin", "/bin"])
    home.mkdir(parents=True, exist_ok=True)
    return {"PATH": path, "HOME": str(home), "LANG": "C.UTF-8"}
