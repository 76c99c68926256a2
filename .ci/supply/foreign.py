"""What a self-contained folder for another system is made of, and whether it is all there.

Packages come as wheels for that system, by their hashes in the lock; nothing of them is run here.
So the folder is looked at instead: every package of the lock is there in a wheel for this system,
every binary is for its processor, and every library that a binary asks for is in the folder or
belongs to the system.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import binaries
from materials import FOLDER
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

_LOCKED = re.compile(r"^[A-Za-z0-9][^#\n]*?(?=\s*\\?$)", re.MULTILINE)
_TAG = re.compile(r"^Tag: (\S+)-(\S+)-(\S+)$", re.MULTILINE)
#: Of the computer, as the Linux Standard Base and every desktop or server have it.
_OF_LINUX = re.compile(
    r"^(ld-linux.*|libc|libm|libdl|librt|libresolv|libutil|libpthread|libstdc\+\+|libgcc_s)\.so\.\d+$"
)
#: Of Windows 10 and newer: its own libraries, the universal C runtime, and its interface sets.
_OF_WINDOWS = frozenset(
    f"{name}.dll" for name in (
        "advapi32", "avicap32", "avrt", "bcrypt", "bcryptprimitives", "cabinet", "cfgmgr32",
        "combase", "comctl32", "comdlg32", "credui", "crypt32", "cryptbase", "d3d11", "d3d12",
        "d3dcompiler_47", "dbghelp", "dnsapi", "dsound", "dwmapi", "dwrite", "dxgi",
        "dxva2", "gdi32", "glu32", "imm32", "iphlpapi", "kernel32", "mf", "mfplat",
        "mfreadwrite", "mpr", "msi", "mswsock", "ncrypt", "netapi32", "ntdll", "ole32", "oleaut32",
        "opengl32", "pdh", "powrprof", "propsys", "psapi", "rpcrt4", "secur32", "setupapi",
        "shcore", "shell32", "shlwapi", "synchronization", "ucrtbase", "uiautomationcore",
        "user32", "userenv", "usp10", "uxtheme", "version", "wbemuuid", "webservices",
        "winhttp", "wininet", "winmm", "winspool", "wintrust", "wldap32", "ws2_32",
        "wsock32", "wtsapi32",
    )
)  # fmt: skip
#: What a part asks for that servodeck can do without: numba takes another of its thread pools, and
#: only the viewer of recordings needs libudev, which every Linux with udev has.
_DONE_WITHOUT = {
    "omppool.": frozenset({"libgomp.so.1.0.0", "libgomp.so.1", "vcomp140.dll"}),
    "tbbpool.": frozenset({"libtbb.so.12", "tbb12.dll"}),
    "rerun": frozenset({"libudev.so.1"}),
}
#: Npcap is installed by its user and never carried along (its licence); the EtherCAT
#: host says so where it is missing.
_BROUGHT_BY_ITS_USER = frozenset({"wpcap.dll", "packet.dll"})


@dataclass(frozen=True, slots=True)
class System:
    """One system that a folder is built for.

    ``uv``: its name for ``uv``; ``wheels``: the end of a wheel's platform tag; ``markers``: what
    PEP 508 asks of it; ``form``: ``elf`` or ``pe``; ``processor``: what the header of a binary
    says.
    """

    name: str
    uv: str
    wheels: str
    markers: Mapping[str, str]
    form: str
    processor: int


def _linux(machine: str, processor: int) -> System:
    markers = {
        "sys_platform": "linux",
        "platform_system": "Linux",
        "os_name": "posix",
        "platform_machine": machine,
    }
    return System(
        f"linux-{machine}", f"{machine}-manylinux_2_28", machine, markers, "elf", processor
    )


#: Processors by ELF's e_machine (gABI, chapter 4) and PE's Machine (PE format, Microsoft).
SYSTEMS = {
    "x86_64": _linux("x86_64", 62),
    "aarch64": _linux("aarch64", 183),
    "windows": System(
        "windows-x86_64", "x86_64-pc-windows-msvc", "win_amd64",
        {"sys_platform": "win32", "platform_system": "Windows", "os_name": "nt",
         "platform_machine": "AMD64"}, "pe", 0x8664,
    ),
}  # fmt: skip


def put_packages(site: Path, system: System, python: str, wheels: Path) -> None:
    """Every package of the lock for another system, and servodeck from its own wheel.

    Raises:
        CalledProcessError: a package has no wheel for that system, or not the locked hash.
    """
    into = [
        sys.executable, "-m", "uv", "pip", "install", "--quiet", "--no-deps", "--target",
        str(site), "--python-platform", system.uv, "--python-version", python,
        "--only-binary", ":all:",
    ]  # fmt: skip
    subprocess.run([*into, "--require-hashes", "-r", str(FOLDER / "run.txt")], check=True)
    ours = next(wheels.glob("servodeck-*.whl"))
    subprocess.run([*into, "--no-index", str(ours)], check=True)


def contents(site: Path) -> list[str]:
    """The packages of a folder with their versions."""
    return sorted(info.name.removesuffix(".dist-info") for info in site.glob("*.dist-info"))


def locked(system: System, python: str, lock: str) -> dict[str, str]:
    """Versions that the lock has for a system and Python, by normalised name."""
    environment = {
        **system.markers,
        "implementation_name": "cpython",
        "python_version": python,
        "platform_python_implementation": "CPython",
        "python_full_version": f"{python}.0",
        "implementation_version": f"{python}.0",
        "platform_release": "",
        "platform_version": "",
    }
    found = {}
    for line in _LOCKED.findall(lock):
        wanted = Requirement(line)
        if wanted.marker is None or wanted.marker.evaluate(environment):
            found[canonicalize_name(wanted.name)] = str(wanted.specifier).removeprefix("==")
    return found


def package_problems(site: Path, wanted: Mapping[str, str], system: System) -> list[str]:
    """Packages that are missing, of another version, or from a wheel for another system."""
    present = {}
    problems = []
    for info in site.glob("*.dist-info"):
        name, version = info.name.removesuffix(".dist-info").rsplit("-", 1)
        present[canonicalize_name(name)] = version
        tags = _TAG.findall((info / "WHEEL").read_text("utf-8"))
        if not any(tag[2] == "any" or tag[2].endswith(system.wheels) for tag in tags):
            problems.append(f"{name} {version}: a wheel for {tags[0][2] if tags else 'nothing'}")
    for name, version in wanted.items():
        if present.get(name) != version:
            problems.append(f"{name} {version}: {present.get(name, 'missing')}")
    return sorted(problems)


def binary_problems(folder: Path, system: System, *, computer: bool = True) -> list[str]:
    """Binaries for another processor, and libraries that they ask for and nobody has.

    With ``computer`` false the computer's own libraries are not there either.
    """
    read: Callable[[Path], binaries.Binary | None] = (
        binaries.read_elf if system.form == "elf" else binaries.read_pe
    )
    files = [file for file in folder.rglob("*") if file.is_file() and not file.is_symlink()]
    # A library in the folder may be called by a link's name.
    here = {file.name.lower() for file in folder.rglob("*") if ".so" in file.name} | {
        file.name.lower() for file in files if file.suffix.lower() in {".dll", ".pyd", ".exe"}
    }
    problems = []
    for file in files:
        binary = read(file)
        if binary is None:
            continue
        where = file.relative_to(folder).as_posix()
        if binary.processor != system.processor:
            if not _of_another_system_on_purpose(file):
                problems.append(f"{where}: for processor {binary.processor:#x}")
            continue
        problems += (
            f"{where}: asks for {name}"
            for name in binary.asks_for
            if name.lower() not in here
            and not (computer and _of_the_system(name, system))
            and not _done_without(file, name)
        )
    return sorted(problems)


def _of_the_system(name: str, system: System) -> bool:
    if system.form == "elf":
        return _OF_LINUX.match(name) is not None
    plain = name.lower()
    return plain in _OF_WINDOWS | _BROUGHT_BY_ITS_USER or plain.startswith(("api-ms-", "ext-ms-"))


def _done_without(file: Path, name: str) -> bool:
    return any(
        file.name.startswith(part) and name.lower() in names
        for part, names in _DONE_WITHOUT.items()
    )


def _of_another_system_on_purpose(file: Path) -> bool:
    """Launchers that an installer carries for several processors."""
    return file.parent.name == "distlib"


def check(folder: Path, site: Path, system: System, python: str) -> None:
    """All of it.

    Raises:
        SystemExit: with everything that is wrong.
    """
    lock = (FOLDER / "run.txt").read_text("utf-8")
    problems: Iterable[str] = [
        *package_problems(site, locked(system, python, lock), system),
        *binary_problems(folder, system),
    ]
    if problems:
        raise SystemExit(f"{system.name}: " + "\n".join(problems))
