"""Runs servodeck's modules as if on another system: what that one lacks is absent for them.

    python -m tests.support.other_system WORK

Only servodeck's own imports are changed, as the libraries come with wheels of their own for every
system. ``sys.platform`` is win32 for them, and what POSIX alone has is missing: modules by
ImportError, names of `os`, `signal`, `socket`, `select` and `time` by AttributeError.
"""

from __future__ import annotations

import asyncio
import builtins
import contextlib
import ctypes
import fcntl
import importlib
import os
import pkgutil
import select
import signal
import socket
import sys
import tempfile
import time
import types
from pathlib import Path
from typing import Any

OURS = ("backend", "drivers", "profiles")
ABSENT = {"fcntl", "grp", "pty", "pwd", "resource", "termios", "tty"}
LACKING = {
    "os": {
        "O_CLOEXEC", "SCHED_FIFO", "SCHED_OTHER", "fork", "forkpty", "get_blocking", "getegid",
        "geteuid", "getgid", "getpgid", "getuid", "killpg", "memfd_create", "nice", "openpty",
        "sched_param", "sched_setscheduler", "set_blocking", "setsid", "ttyname", "writev",
    },
    "select": {"POLLIN", "POLLOUT", "epoll", "poll"},
    "signal": {"SIGALRM", "SIGHUP", "SIGKILL", "SIGUSR1", "SIGUSR2", "alarm"},
    "socket": {"AF_NETLINK", "AF_PACKET", "AF_UNIX", "MSG_DONTWAIT"},
    "time": {"CLOCK_BOOTTIME", "clock_gettime"},
}  # fmt: skip
#: What Windows alone has, as far as servodeck calls it when it imports and starts.
WINDLL = types.SimpleNamespace(
    shell32=types.SimpleNamespace(IsUserAnAdmin=lambda: 0),
    winmm=types.SimpleNamespace(timeBeginPeriod=lambda _ms: 0),
)
DIFFERENT: dict[str, dict[str, object]] = {
    "sys": {"platform": "win32"},
    "ctypes": {"windll": WINDLL},
    # An option that this system has; that the port is not shared is not shown here.
    "socket": {"SO_EXCLUSIVEADDRUSE": socket.SO_KEEPALIVE},
}


class Other(types.ModuleType):
    """A module of the standard library as another system has it."""

    def __init__(self, real: types.ModuleType) -> None:
        super().__init__(real.__name__)
        self.__dict__["_real"] = real

    def __getattr__(self, name: str) -> Any:
        real = self.__dict__["_real"]
        if name in LACKING.get(real.__name__, ()):
            raise AttributeError(f"module {real.__name__!r} has no attribute {name!r}")
        different = DIFFERENT.get(real.__name__, {})
        return different[name] if name in different else getattr(real, name)

    def __setattr__(self, name: str, value: object) -> None:
        setattr(self.__dict__["_real"], name, value)


def _msvcrt() -> types.ModuleType:
    """The one function that servodeck uses of it, by a lock of this system on the same byte."""
    module = types.ModuleType("msvcrt")
    module.LK_NBLCK = 2  # type: ignore[attr-defined]

    def locking(descriptor: int, mode: int, count: int) -> None:
        assert (mode, count) == (2, 1)
        where = os.lseek(descriptor, 0, os.SEEK_CUR)
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB, count, where, os.SEEK_SET)

    module.locking = locking  # type: ignore[attr-defined]
    return module


def _winreg() -> types.ModuleType:
    """A registry without any key: nothing is installed."""
    module = types.ModuleType("winreg")
    module.HKEY_LOCAL_MACHINE = 0x80000002  # type: ignore[attr-defined]

    def open_key(_root: int, key: str) -> object:
        raise FileNotFoundError(key)

    module.OpenKey = open_key  # type: ignore[attr-defined]
    return module


def become_other() -> None:
    """From now on servodeck's modules are imported as on the other system."""
    real_import = builtins.__import__
    others = {one.__name__: Other(one) for one in (ctypes, os, select, signal, socket, sys, time)}
    made = {**others, "msvcrt": _msvcrt(), "winreg": _winreg()}

    def importing(
        name: str, where: Any = None, local: Any = None, names: Any = (), level: int = 0
    ) -> types.ModuleType:
        importer = (where or {}).get("__name__", "")
        if level == 0 and importer.partition(".")[0] in OURS:
            if name in ABSENT:
                raise ModuleNotFoundError(f"No module named {name!r}", name=name)
            if name in made:
                return made[name]
        return real_import(name, where, local, names, level)

    builtins.__import__ = importing  # type: ignore[assignment]


def import_everything() -> None:
    """Every module of servodeck."""
    count = 0
    for name in OURS:
        package = importlib.import_module(name)
        for module in pkgutil.walk_packages(package.__path__, f"{name}."):
            if not module.name.endswith("__main__") and ".migrations" not in module.name:
                importlib.import_module(module.name)
                count += 1
    print(count, "modules")


def command(*arguments: str) -> None:
    """One command of the command line, in this process."""
    from backend import cli

    sys.argv = ["servodeck", *arguments]
    with contextlib.suppress(SystemExit):
        cli.main()


async def serve_once() -> None:
    """The server over an empty station: address, drives, a bus that this system does not have."""
    import httpx

    from backend.commands.server.serve import Serving, serve
    from backend.station.bench import Bench

    folder = Path(tempfile.mkdtemp())
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    bench = Bench(folder)
    running = asyncio.create_task(serve(bench, Serving(port=port)))
    async with httpx.AsyncClient(base_url=f"http://127.0.0.1:{port}", trust_env=False) as client:
        for _ in range(600):
            if running.done():
                await running
            try:
                answer = await client.get("/api/v1/drives")
                break
            except httpx.ConnectError:
                await asyncio.sleep(0.05)
        print("drives", answer.status_code, answer.json())
    running.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await running


async def ethercat() -> None:
    """What an EtherCAT bus answers on a computer with Windows that has no Npcap."""
    from drivers.errors import LinkLost
    from drivers.urls import link_for

    try:
        await link_for("ethercat://NPF_{4D36E972-E325-11CE-BFC1-08002BE10318}").open()
    except LinkLost as error:
        print("refused:", error.message, "|", error.remedy)


def locks() -> None:
    """Two processes want one folder; the second is refused until the first has let go."""
    from backend.foundation.store.lock import FolderLock

    with tempfile.TemporaryDirectory() as folder:
        first = FolderLock(Path(folder))
        print("first", first.take(), flush=True)
        child = os.fork()
        if child == 0:
            os._exit(10 + FolderLock(Path(folder)).take())
        print("second", os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) - 10)
        first.give()
        print("third", int(FolderLock(Path(folder)).take()))


def main() -> None:
    """Carry out the work that is named."""
    become_other()
    work = sys.argv[1]
    if work == "import":
        import_everything()
    elif work == "serve":
        asyncio.run(serve_once())
    elif work == "ethercat":
        asyncio.run(ethercat())
    elif work == "locks":
        locks()
    else:
        command(*sys.argv[2:])


if __name__ == "__main__":
    main()
