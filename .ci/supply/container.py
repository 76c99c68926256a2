"""What a container needs next to the self-contained folder: C library, a name for root, places.

    python .ci/supply/container.py WHEELS OUTPUT [x86_64|aarch64]

The Containerfile puts it below the folder, from scratch: no image is asked of any registry. The
libraries are those of Debian's packages for the Python that the folder has.
"""

from __future__ import annotations

import io
import platform
import sys
import tarfile
import tempfile
from pathlib import Path

import foreign
from portable import DEBIAN, PYTHON, fetch, lists_of, owned_by_root

_LIBRARIES = ("libc6", "libgcc-s1", "libstdc++6", "libudev1", "libcap2")
_STATE = "var/lib/servodeck"
_TEXTS = {
    "etc/passwd": f"root:x:0:0:root:/{_STATE}:/sbin/nologin\n",
    "etc/group": "root:x:0:\n",
    "etc/nsswitch.conf": "hosts: files dns\n",
}


def build(output: Path, version: str, machine: str) -> Path:
    """The base, packed; returns its file.

    Raises:
        CalledProcessError: a package cannot be had.
        SystemExit: a library asks for another that nobody has.
    """
    system = foreign.SYSTEMS[machine]
    file = output / f"container-base-{system.name}.tar.gz"
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=output) as work:
        scratch = Path(work)
        own = machine == platform.machine()
        options = [] if own else lists_of(DEBIAN[machine], scratch / "apt")
        fetch(_LIBRARIES, scratch / "fetched", options)
        root = scratch / "fetched/root"
        problems = foreign.binary_problems(root, system, computer=False)
        if problems:
            raise SystemExit("\n".join(problems))
        with tarfile.open(file, "w:gz", compresslevel=6) as packed:
            for part in ("lib", "lib64", "usr/lib"):
                if (root / part).is_dir():
                    packed.add(root / part, part, filter=owned_by_root)
            folder = f"servodeck-{version}-{system.name}"
            packed.addfile(_link("opt/servodeck", folder))
            packed.addfile(_link("usr/bin/python3", f"../../opt/servodeck/bin/{PYTHON}"))
            for place, mode in ((_STATE, 0o700), ("tmp", 0o1777)):
                packed.addfile(_folder(place, mode))
            for name, text in _TEXTS.items():
                packed.addfile(_file(name, len(text)), io.BytesIO(text.encode()))
    return file


def _link(name: str, target: str) -> tarfile.TarInfo:
    made = tarfile.TarInfo(name)
    made.type, made.linkname = tarfile.SYMTYPE, target
    return made


def _folder(name: str, mode: int) -> tarfile.TarInfo:
    made = tarfile.TarInfo(name)
    made.type, made.mode = tarfile.DIRTYPE, mode
    return made


def _file(name: str, size: int) -> tarfile.TarInfo:
    made = tarfile.TarInfo(name)
    made.size = size
    return made


def main(arguments: list[str]) -> int:
    """Build for the folder that the same wheels make."""
    wheels, output = Path(arguments[0]), Path(arguments[1])
    machine = arguments[2] if len(arguments) > 2 else platform.machine()
    ours = next(wheels.glob("servodeck-*.whl"))
    print(build(output, ours.name.split("-")[1], machine))
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
