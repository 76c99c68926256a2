"""Starts programs of the self-contained folder for Windows here, under Wine.

    python .ci/supply/under_wine.py FOLDER.zip

Wine (Debian: wine64, wine) runs programs of Windows with its own libraries in place of those of
Windows. The folder is unpacked where a user's name has umlauts and Chinese characters and OneDrive
puts spaces. Shown are its CPython, its launcher with the list of commands, the lock of a state
folder between two processes, and which modules with binaries load. Wine has not all functions that
they ask for: without numpy the server does not start there, so that page, buses and COM ports are
not shown.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_HANG_S = 300.0
_FOLDER = "Jürgen Müller 王伟/OneDrive - Größe GmbH"
#: Modules with binaries; pysoem is not among them, as it needs Npcap, which no folder contains.
_MODULES = (
    "ssl", "sqlite3", "ctypes", "winreg", "serial", "can", "zeroconf", "sqlalchemy", "psutil",
    "drivers.computer.serial_ports.terminals", "drivers.computer.serial_ports.latency_timer",
    "drivers.computer.network.packet_capture", "drivers.computer.registry",
    "backend.foundation.store.lock",
    "numpy", "pydantic_core", "cryptography.x509",
)  # fmt: skip
#: Ends with 0 where the first process has the lock and the second one has not.
_LOCK = """\
import pathlib, subprocess, sys
from backend.foundation.store.lock import FolderLock
folder = pathlib.Path(sys.argv[1])
folder.mkdir(exist_ok=True)
with FolderLock(folder) as lock:
    if len(sys.argv) > 2:
        sys.exit(7 if lock.held else 3)
    second = subprocess.run([sys.executable, sys.argv[0], str(folder), "second"],
                            stdin=subprocess.DEVNULL).returncode
    sys.exit(0 if lock.held and second == 3 else 1)
"""


class Failed(Exception):
    """A program of the folder did not end with 0; with what it printed."""


class Windows:
    """Wine with a configuration of its own in a scratch folder."""

    def __init__(self, work: Path) -> None:
        """Make it.

        Raises:
            SystemExit: there is no Wine.
        """
        found = shutil.which("wine64") or shutil.which("wine")
        if found is None:
            raise SystemExit("no Wine on this computer: apt-get install wine64 wine")
        self._wine = found
        self._environment = {
            "PATH": os.defpath,
            "HOME": str(work),
            "LANG": "C.UTF-8",
            "WINEPREFIX": str(work / "wine"),
            "WINEDEBUG": "-all",
            # Neither .NET, nor a browser, nor a debugger, which Wine would ask for.
            "WINEDLLOVERRIDES": "mscoree,mshtml,winedbg.exe=",
        }
        self.run("wineboot", "--init")
        self.run("reg", "add", r"HKCU\Software\Wine", "/v", "Version", "/d", "win10", "/f")

    def run(self, *arguments: str | Path) -> str:
        """Run a program to its end; what it has printed.

        Raises:
            Failed: it did not end with 0.
        """
        done = subprocess.run(
            [self._wine, *(str(one) for one in arguments)],
            env=self._environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_HANG_S,
            check=False,
        )
        said, complaint = (
            each.decode("utf-8", "replace").strip() for each in (done.stdout, done.stderr)
        )
        if done.returncode:
            raise Failed(f"{said}\n{complaint}".strip())
        return said

    def end(self) -> None:
        """End what is left of it."""
        subprocess.run(
            ["wineserver", "--kill"], env=self._environment, check=False, capture_output=True
        )


@contextmanager
def unpacked(packed: Path) -> Iterator[tuple[Windows, Path]]:
    """Wine, and the folder as its user unpacks it."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as place:
        windows = Windows(Path(place))
        try:
            target = Path(place) / _FOLDER
            with zipfile.ZipFile(packed) as opened:
                opened.extractall(target)
            (folder,) = target.glob("servodeck-*")
            yield windows, folder
        finally:
            windows.end()


def looked_at(windows: Windows, folder: Path) -> Iterator[str]:
    """What was found, line by line.

    Raises:
        Failed: one of those that Wine can run did not work.
    """
    python = folder / "python/python.exe"
    yield windows.run(python, "-c", "import sys; print('CPython', sys.version.split()[0])")
    listed = windows.run("cmd", "/c", folder / "servodeck.cmd", "--help")
    if "serve" not in listed or "preflight" not in listed:
        raise Failed(listed)
    yield "servodeck.cmd lists the commands"
    script = folder / "lock.py"
    script.write_text(_LOCK, "ascii")
    windows.run(python, script, folder / "Zustand 状态")
    yield "one process at a time has a state folder"
    for name in _MODULES:
        try:
            windows.run(python, "-c", f"import {name}")
        except Failed as why:
            lines = [line for line in str(why).splitlines() if "rror" in line or "unimpl" in line]
            yield f"{name}: does not load under this Wine: {lines[-1] if lines else why}"
        else:
            yield f"{name}: loads"


def main(packed: Path) -> None:
    """Print what was found."""
    with unpacked(packed) as (windows, folder):
        for line in looked_at(windows, folder):
            print(line, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
