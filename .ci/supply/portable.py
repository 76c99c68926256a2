"""Builds a self-contained folder for Linux: servodeck, all packages and a CPython of its own.

    python .ci/supply/portable.py WHEELS OUTPUT [x86_64|aarch64]

WHEELS is what ``debian.py`` takes. For another processor than this computer's the packages are
those of the lock (`foreign`), and apt reads that architecture's lists in a folder of its own. The
interpreter is the one of Debian's packages, fetched by ``apt-get download`` (apt checks their
signatures) for the CPython version that builds it. It finds its library next to itself, wherever
the folder lies; its shared libraries are found by a search path relative to the interpreter
(DT_RPATH, set by patchelf). Modules whose libraries are not carried along (`_LEFT_OUT`) are left
out. Only the C library, libstdc++ and libgcc_s come from the computer; the oldest C library that
suffices is printed and stands in ``CONTENTS.txt``.
"""

from __future__ import annotations

import compileall
import platform
import py_compile
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterable
from pathlib import Path

import foreign
from debian import install_wheels

_VERSION = f"{sys.version_info.major}.{sys.version_info.minor}"
PYTHON = f"python{_VERSION}"
#: How Debian calls a processor.
DEBIAN = {"x86_64": "amd64", "aarch64": "arm64"}
_INTERPRETER = (f"{PYTHON}-minimal", f"lib{PYTHON}-minimal", f"lib{PYTHON}-stdlib")
_LIBRARIES = (
    "libssl3", "libffi8", "libsqlite3-0", "libexpat1", "zlib1g", "liblzma5", "libbz2-1.0",
    "libuuid1",
)  # fmt: skip
#: Not needed by servodeck, and their libraries are not carried along.
_LEFT_OUT = ("readline", "nis", "_dbm", "_crypt", "_curses", "_curses_panel")
_LAUNCHER = """\
#!/bin/sh
# servodeck with the Python in this folder; nothing of the computer's own Python is used.
here=$(dirname "$(readlink -f "$0")")
unset PYTHONPATH PYTHONHOME
export PYTHONNOUSERSITE=1
exec "$here/bin/{python}" -m backend {arguments}
"""
_README = """\
servodeck {version}, for Linux {machine} with glibc {glibc} or newer

./open-page              start the server and open its page in a browser
./servodeck demo --open  the same on virtual drives
./servodeck --help       all commands

Nothing is installed. What is kept lies in the state folder (./servodeck serve --help), not here:
delete this folder to remove the program, and unpack a newer one beside it to upgrade.
"""


def build(wheels: Path, output: Path, version: str, machine: str) -> Path:
    """The packed folder; returns its file.

    Raises:
        CalledProcessError: a package or wheel cannot be had.
        SystemExit: something in it is for another system, or missing.
    """
    system, own = foreign.SYSTEMS[machine], machine == platform.machine()
    name = f"servodeck-{version}-linux-{machine}"
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=output) as place:
        scratch, folder = Path(place), Path(place) / name
        fetch(("patchelf",), scratch / "tools")
        options = [] if own else lists_of(DEBIAN[machine], scratch / "apt")
        packages = fetch((*_INTERPRETER, *_LIBRARIES), scratch / "fetched", options)
        put_interpreter(scratch / "fetched/root", folder, scratch / "tools/root/usr/bin/patchelf")
        site = folder / "lib/python3/dist-packages"
        if own:
            install_wheels(wheels, site)
        else:
            foreign.put_packages(site, system, _VERSION, wheels)
        # Programs of the packages, with the path of the interpreter that has unpacked them.
        shutil.rmtree(site / "bin", ignore_errors=True)
        foreign.check(folder, site, system, _VERSION)
        known = {"version": version, "machine": machine, "glibc": oldest_glibc(folder)}
        put_texts(folder, known, [*packages, *foreign.contents(site)])
        # A stamp of the source's time would be wrong after unpacking on some file systems.
        compileall.compile_dir(
            str(folder / "lib"),
            quiet=2,
            workers=0,
            invalidation_mode=py_compile.PycInvalidationMode.UNCHECKED_HASH,
        )
        file = output / f"{name}.tar.gz"
        with tarfile.open(file, "w:gz", compresslevel=3) as packed:
            packed.add(folder, name, filter=owned_by_root)
    return file


def lists_of(architecture: str, folder: Path) -> list[str]:
    """apt's options for another architecture, with lists of its own in ``folder``.

    Raises:
        CalledProcessError: the lists cannot be read.
    """
    (folder / "lists/partial").mkdir(parents=True)
    (folder / "cache/archives/partial").mkdir(parents=True)
    settings = {
        "APT::Architecture": architecture,
        "APT::Architectures": architecture,
        "Dir::State::Lists": f"{folder}/lists",
        "Dir::Cache": f"{folder}/cache",
        "Dir::State::status": "/dev/null",
    }
    options = [part for name, value in settings.items() for part in ("-o", f"{name}={value}")]
    subprocess.run(["apt-get", *options, "--quiet=2", "update"], check=True)
    return options


def fetch(names: Iterable[str], folder: Path, options: Iterable[str] = ()) -> list[str]:
    """Download Debian packages and unpack them into ``folder/root``; returns their files' names."""
    folder.mkdir(parents=True)
    folder.chmod(0o755)
    subprocess.run(["apt-get", *options, "--quiet=2", "download", *names], cwd=folder, check=True)
    files = sorted(folder.glob("*.deb"))
    for file in files:
        subprocess.run(["dpkg-deb", "--extract", str(file), str(folder / "root")], check=True)
    return [file.name for file in files]


def put_interpreter(root: Path, folder: Path, patchelf: Path) -> None:
    """Interpreter, standard library and shared libraries from unpacked packages."""
    (folder / "bin").mkdir(parents=True)
    binary = folder / "bin" / PYTHON
    shutil.copy2(root / "usr/bin" / PYTHON, binary)
    library = folder / "lib" / PYTHON
    # sitecustomize.py points to /etc.
    shutil.copytree(
        root / "usr/lib" / PYTHON,
        library,
        symlinks=True,
        ignore=shutil.ignore_patterns("sitecustomize.py", "__pycache__"),
    )
    for module in _LEFT_OUT:
        for file in (library / "lib-dynload").glob(f"{module}.cpython-*.so"):
            file.unlink()
    for file in (*root.glob("lib/*-linux-gnu/*.so*"), *root.glob("usr/lib/*-linux-gnu/*.so*")):
        shutil.copy2(file, folder / "lib" / file.name, follow_symlinks=False)
    for text in root.glob("usr/share/doc/*/copyright"):
        target = folder / "licences" / f"{text.parent.name}.txt"
        target.parent.mkdir(exist_ok=True)
        shutil.copyfile(text, target)
    # DT_RPATH (not RUNPATH) also serves what extension modules need in turn (ld.so(8)).
    subprocess.run(
        [str(patchelf), "--force-rpath", "--set-rpath", "$ORIGIN/../lib", str(binary)],
        check=True,
    )


def put_texts(folder: Path, known: dict[str, str], contents: Iterable[str]) -> None:
    """Launchers, what to do with the folder, and what is in it."""
    for name, arguments in (("servodeck", '"$@"'), ("open-page", 'serve --open "$@"')):
        file = folder / name
        file.write_text(_LAUNCHER.format(python=PYTHON, arguments=arguments), "utf-8")
        file.chmod(0o755)
    (folder / "README.txt").write_text(_README.format(**known), "utf-8")
    lines = [f"glibc {known['glibc']} or newer", *contents]
    (folder / "CONTENTS.txt").write_text("\n".join(lines) + "\n", "utf-8")


def oldest_glibc(folder: Path) -> str:
    """The newest version of the C library that a file of the folder asks for, such as ``2.36``."""
    newest = (2, 0)
    for file in (folder / "bin" / PYTHON, *(folder / "lib").rglob("*.so*")):
        if file.is_file():
            asked = re.findall(rb"GLIBC_(\d+)\.(\d+)", file.read_bytes())
            newest = max([newest, *((int(a), int(b)) for a, b in asked)])
    return f"{newest[0]}.{newest[1]}"


def owned_by_root(entry: tarfile.TarInfo) -> tarfile.TarInfo:
    """A packed file belongs to nobody of the computer that packs it."""
    entry.uid = entry.gid = 0
    entry.uname = entry.gname = "root"
    return entry


def main(arguments: list[str]) -> int:
    """Build from a folder of wheels."""
    if not sys.platform.startswith("linux") or shutil.which("apt-get") is None:
        print("no self-contained folder: its interpreter comes from Debian's packages (apt-get)")
        return 0
    wheels, output = Path(arguments[0]), Path(arguments[1])
    ours = next(wheels.glob("servodeck-*.whl"))
    machine = arguments[2] if len(arguments) > 2 else platform.machine()
    file = build(wheels, output, ours.name.split("-")[1], machine)
    print(f"{file}: {file.stat().st_size >> 20} MiB")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
