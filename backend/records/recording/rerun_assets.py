"""rerun's own viewer, taken once from the installed SDK and stored compressed in a cache.

No package of the viewer matches the SDK's version, so it is fetched from the SDK's command line,
which serves it on the loopback interface. Source: docs of rerun-sdk 0.41, ``rerun --serve-web``.
"""

from __future__ import annotations

import asyncio
import gzip
import http.client
import os
import socket
import subprocess
import tempfile
import time
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import platformdirs

from drivers.computer.files import program_name
from drivers.errors import NotAllowed
from profiles.replacing import move_into_place

FILES = {"re_viewer.js": "text/javascript", "re_viewer_bg.wasm": "application/wasm"}
#: Time limit for the start of the command line [s]; it takes about a second, more when busy.
START_S = 30.0


class ViewerAssets:
    """Viewer files of the installed version. ``folder``: None for the user's cache."""

    def __init__(self, folder: Path | None = None) -> None:
        self.version = version("rerun-sdk")
        base = folder or Path(platformdirs.user_cache_dir("servodeck"))
        self.folder = base / f"rerun-{self.version}"
        self._lock = asyncio.Lock()

    async def file(self, name: str) -> Path:
        """Path of a gzipped file; at first use all files are fetched from the SDK.

        Raises:
            NotAllowed: no such file, or the SDK's command line does not run here.
        """
        if name not in FILES:
            raise NotAllowed("recording.viewer-no-file", value=name)
        path = self.folder / f"{name}.gz"
        async with self._lock:
            if not path.is_file():
                await asyncio.to_thread(extract, self.folder)
        return path

    def size(self, name: str) -> int:
        """Uncompressed length of an existing file (its last 4 bytes, RFC 1952 clause 2.3.1)."""
        with (self.folder / f"{name}.gz").open("rb") as file:
            file.seek(-4, os.SEEK_END)
            return int.from_bytes(file.read(4), "little")


def extract(folder: Path) -> None:
    """Run the command line, fetch the files and compress them. Blocking.

    Raises:
        NotAllowed: it does not start or does not serve the files; the message contains the problem.
    """
    spec = find_spec("rerun_cli")
    if spec is None or not spec.submodule_search_locations:
        raise NotAllowed("recording.rerun-command-line-not")
    program = Path(spec.submodule_search_locations[0]) / program_name("rerun")
    with tempfile.TemporaryDirectory() as home:
        web, data = free_port(), free_port()
        # A temporary home folder: no settings are read or written, and no usage data are sent.
        env = os.environ | {"HOME": home, "XDG_CONFIG_HOME": home, "APPDATA": home}
        process = subprocess.Popen(
            [str(program), "--serve-web", "--web-viewer-port", str(web), "--port", str(data),
             "--bind", "127.0.0.1"],
            env=env, cwd=home, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            contents = {name: _fetch(process, web, name) for name in FILES}
        finally:
            process.kill()
            process.wait()
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in contents.items():
        part = folder / f".{name}.{os.getpid()}.part"
        part.write_bytes(gzip.compress(content, 6))
        move_into_place(part, folder / f"{name}.gz")


def free_port() -> int:
    """A TCP port of the loopback interface that is free now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _fetch(process: subprocess.Popen[bytes], port: int, name: str) -> bytes:
    deadline = time.monotonic() + START_S
    problem = "it does not answer"
    while time.monotonic() < deadline and process.poll() is None:
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
        try:
            connection.request("GET", f"/{name}", headers={"Accept-Encoding": "identity"})
            answer = connection.getresponse()
            content = answer.read()
            if answer.status == 200 and answer.getheader("Content-Encoding") in (None, "identity"):
                return content
            problem = f"it answers {answer.status} for {name}"
        except OSError as error:
            problem = str(error)
        finally:
            connection.close()
        time.sleep(0.05)
    raise NotAllowed("recording.rerun-viewer-not-taken", problem=problem)
