"""A root folder started as a container engine starts an image: with its layout and capabilities.

    unshare --mount --ipc --uts python contained.py ROOT STATE CAPS NAME=VALUE… -- PROGRAM…

For computers without an engine. ROOT is read-only inside, but for the volumes; the process is its
root and has CAPS alone (comma separated), as the bounding set has no others, and no way to more.
"""

from __future__ import annotations

import ctypes
import os
import re
import shlex
import subprocess
import sys
import tarfile
from dataclasses import dataclass
from pathlib import Path

#: prctl(2), linux/capability.h
_PR_CAPBSET_DROP, _PR_SET_NO_NEW_PRIVS = 24, 38
_LAST_CAPABILITY = Path("/proc/sys/kernel/cap_last_cap")
NUMBERS = {"CAP_NET_ADMIN": 12, "CAP_NET_RAW": 13, "CAP_IPC_LOCK": 14, "CAP_SYS_NICE": 23}
_DEVICES = ("null", "zero", "random", "urandom")


@dataclass(frozen=True, slots=True)
class Recipe:
    """What a Containerfile says that is needed here: files to unpack, environment, program."""

    adds: tuple[tuple[str, str], ...]
    environment: dict[str, str]
    entry: tuple[str, ...]
    command: tuple[str, ...]
    capabilities: tuple[str, ...]

    @classmethod
    def read(cls, text: str) -> Recipe:
        """From a Containerfile that starts from scratch.

        Raises:
            ValueError: it has an instruction that nothing here carries out.
        """
        arguments = dict(re.findall(r"^ARG (\w+)=(\S+)$", text, re.MULTILINE))
        lines = [line.split(maxsplit=1) for line in text.splitlines() if re.match("[A-Z]", line)]
        said: dict[str, list[str]] = {}
        for word, rest in lines:
            for name, value in arguments.items():
                rest = rest.replace(f"${{{name}}}", value)  # noqa: PLW2901
            said.setdefault(word, []).append(rest)
        known = {"FROM", "ARG", "ADD", "LABEL", "ENV", "VOLUME", "EXPOSE", "STOPSIGNAL",
                 "ENTRYPOINT", "CMD"}  # fmt: skip
        if set(said) - known or said["FROM"] != ["scratch"]:
            raise ValueError(f"not carried out here: {sorted(set(said) - known)}, {said['FROM']}")
        labels = dict(part.split("=", 1) for part in shlex.split(" ".join(said["LABEL"])))
        return cls(
            tuple((add.split()[0], add.split()[1]) for add in said["ADD"]),
            dict(part.split("=", 1) for part in shlex.split(" ".join(said["ENV"]))),
            _listed(said["ENTRYPOINT"]),
            _listed(said["CMD"]),
            tuple(labels["servodeck.capabilities"].split()),
        )

    def unpack(self, context: Path, root: Path) -> None:
        """Lay the files out as the instructions say."""
        for pattern, target in self.adds:
            (file,) = context.glob(pattern)
            place = root / target.lstrip("/")
            place.mkdir(parents=True, exist_ok=True)
            with tarfile.open(file) as packed:
                packed.extractall(place, filter="tar")

    def started(self, root: Path, state: Path, *program: str) -> list[str]:
        """The command line of a container of it; without ``program`` its own command."""
        return [
            "unshare", "--mount", "--ipc", "--uts",
            sys.executable, str(Path(__file__).resolve()), str(root), str(state),
            ",".join(self.capabilities), *(f"{k}={v}" for k, v in self.environment.items()), "--",
            *self.entry, *(program or self.command),
        ]  # fmt: skip


def _listed(said: list[str]) -> tuple[str, ...]:
    return tuple(re.findall(r'"([^"]*)"', said[-1]))


def _mount(*arguments: str) -> None:
    subprocess.run(["mount", *arguments], check=True)


def enter(root: Path, state: Path, capabilities: list[str]) -> None:
    """Make the root of this process's own namespaces, and give all other capabilities away."""
    inside = {name: root / name for name in ("proc", "sys", "dev", "tmp", "var/lib/servodeck")}
    for place in inside.values():
        place.mkdir(parents=True, exist_ok=True)
    _mount("--make-rprivate", "/")
    _mount("--bind", str(root), str(root))
    _mount("-o", "remount,bind,ro", str(root))
    for name in ("proc", "sys"):
        _mount("--rbind", f"/{name}", str(inside[name]))
    for name in ("tmp", "dev"):
        _mount("-t", "tmpfs", "-o", "mode=1777", "tmpfs", str(inside[name]))
    (inside["dev"] / "shm").mkdir(mode=0o1777)
    for device in _DEVICES:
        (inside["dev"] / device).touch()
        _mount("--bind", f"/dev/{device}", str(inside["dev"] / device))
    _mount("--bind", str(state), str(inside["var/lib/servodeck"]))
    os.chroot(root)
    os.chdir("/")
    kept = {NUMBERS[name] for name in capabilities}
    libc = ctypes.CDLL(None, use_errno=True)
    for number in range(int(_LAST_CAPABILITY.read_text()) + 1):
        if number not in kept and libc.prctl(_PR_CAPBSET_DROP, number, 0, 0, 0):
            raise OSError(ctypes.get_errno(), f"capability {number} stays")
    if libc.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0):
        raise OSError(ctypes.get_errno(), "no_new_privs")


def main(arguments: list[str]) -> None:
    """Enter and become the program. Root's permitted set is what the bounding set has left."""
    split = arguments.index("--")
    root, state, capabilities, *environment = arguments[:split]
    program = arguments[split + 1 :]
    enter(Path(root), Path(state), capabilities.split(","))
    os.execve(
        program[0], program, {"PATH": "/usr/bin:/bin"} | dict(v.split("=", 1) for v in environment)
    )


if __name__ == "__main__":
    main(sys.argv[1:])
