"""Starts the self-contained folder for another processor here, and gets its page.

    python .ci/supply/emulated.py FOLDER.tar.gz

The processor is emulated by qemu's user mode (Debian: qemu-user-static), system calls are those of
this computer; the C library, libstdc++ and libgcc_s come from Debian's packages for that processor.
It shows that every binary that a start needs loads and runs, not how fast it would be there, and
nothing of its ports.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import threading
from pathlib import Path
from urllib.request import urlopen

from portable import fetch, lists_of

_OF_THE_COMPUTER = ("libc6", "libstdc++6", "libgcc-s1")
_HANG_S = 300.0
#: Modules with binaries of their own that a start does not load.
_LATER = "scipy.signal, scipy.optimize, numba, pyarrow, rerun, reportlab, psycopg, pysoem, can"


def start(packed: Path, work: Path) -> str:
    """What was found, in a line.

    Raises:
        CalledProcessError: a binary does not load.
        SystemExit: no page, or no emulator.
    """
    emulator = shutil.which("qemu-aarch64-static") or shutil.which("qemu-aarch64")
    if emulator is None:
        raise SystemExit("no emulator on this computer: apt-get install qemu-user-static")
    with tarfile.open(packed) as opened:
        opened.extractall(work, filter="tar")
    (folder,) = work.glob("servodeck-*")
    fetch(_OF_THE_COMPUTER, work / "fetched", lists_of("arm64", work / "apt"))
    (python,) = (folder / "bin").glob("python3.*")
    run = [emulator, "-L", str(work / "fetched/root"), str(python)]
    environment = {"PATH": os.defpath, "HOME": str(work / "home"), "PYTHONNOUSERSITE": "1"}
    said = subprocess.run(
        [*run, "-c", f"import platform, {_LATER}; print(platform.machine())"],
        check=True,
        capture_output=True,
        text=True,
        env=environment,
        cwd=work,
    )
    process = subprocess.Popen(
        [*run, "-m", "backend", "serve", "--port", "0"],
        env=environment,
        cwd=work,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    guard = threading.Timer(_HANG_S, process.kill)
    guard.start()
    try:
        found = _page(process)
    finally:
        process.terminate()
        process.communicate()
        guard.cancel()
    return f"{packed.name}: Python on {said.stdout.strip()}, modules load, {found}"


def _page(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    printed = []
    for line in process.stdout:
        printed.append(line)
        address = re.search(r"http://\S+", line)
        if address is not None:
            with urlopen(address[0], timeout=_HANG_S) as answer:  # our own server has printed it
                page = answer.read().decode()
            for asset in re.findall(r'(?:src|href)="(?:[.]?/)?(assets/[^"]+)"', page):
                with urlopen(f"{address[0].rstrip('/')}/{asset}", timeout=_HANG_S) as answer:
                    answer.read()
            return "page and what it names are served"
    raise SystemExit(f"no server: {''.join(printed)}")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        print(start(Path(sys.argv[1]), Path(place)))
