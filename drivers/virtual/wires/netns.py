"""Network namespaces without root rights: virtual cables that other processes cannot see.

A *holder* process creates a user and network namespace, makes veth pairs in it by netlink (no
system package required) and runs until its standard input closes. Other processes run inside by
`Namespace.command`, or join by `enter` while they still have a single thread.

Run as a module it is the holder (``--hold PAIR…``) or joins and executes (``--join PID -- …``). It
imports only small modules: a namespace can be changed only while there is one thread.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import struct
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

from drivers.computer.network.namespaces import (
    AVAILABLE,
    disable_ipv6,
    enter_namespaces,
    leave_namespaces,
)
from drivers.computer.network.sockets import AF_NETLINK, NETLINK_ROUTE
from drivers.computer.timing import scheduling
from drivers.texts.message import Unsuitable, prose, text

_RTM_NEWLINK = 16
_REQUEST, _ACK, _EXCLUSIVE, _CREATE = 0x01, 0x04, 0x200, 0x400
_IFLA_IFNAME, _IFLA_LINKINFO, _IFLA_AF_SPEC = 3, 18, 26
_INFO_KIND, _INFO_DATA, _VETH_PEER = 1, 2, 1
_ADDR_GEN_MODE, _ADDR_GEN_NONE = 8, 1
_UP = 0x1
_NESTED = 0x8000

_KEEP_TIME = ("drivers.virtual.", "drivers.ethercat.process")


class NamespaceUnavailable(Unsuitable):
    """The system forbids namespaces; the message states the cause and the remedies."""


def unavailable() -> str | None:
    """Return why namespaces cannot be used, in one sentence; None if they can."""
    try:
        Namespace.create().close()
    except NamespaceUnavailable as error:
        return str(error)
    return None


class Namespace:
    """A user and network namespace with veth pairs; closes with its owner."""

    def __init__(self, holder: subprocess.Popen[str], pairs: tuple[tuple[str, str], ...]) -> None:
        self._holder = holder
        self.pairs = pairs

    @classmethod
    def create(cls, pairs: Sequence[tuple[str, str]] = (("ec0m", "ec0s"),)) -> Namespace:
        """Start a holder with these veth pairs, all switched on.

        Raises:
            NamespaceUnavailable: with the cause and the remedies.
        """
        if not AVAILABLE:
            raise NamespaceUnavailable(text("virtual.cables-need-linux"))
        for name in (name for pair in pairs for name in pair):
            if not 0 < len(name.encode()) <= 15:
                raise ValueError(f"interface name {name!r} must have 1 to 15 bytes")
        names = [name for pair in pairs for name in pair]
        holder = subprocess.Popen(
            [*_python(), "--hold", *names],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=child_environment(),
        )
        assert holder.stdout is not None
        answer = holder.stdout.readline().strip()
        if answer != "ready":
            namespace = cls(holder, ())
            namespace.close()
            reason = prose(answer) if answer else text("virtual.process-ended")
            raise NamespaceUnavailable(text("virtual.no-private-network", reason=reason))
        return cls(holder, tuple(pairs))

    @property
    def pid(self) -> int:
        """Process ID of the holder, whose namespaces others join."""
        return self._holder.pid

    def command(self, argv: Sequence[str]) -> list[str]:
        """Return the command line that runs ``argv`` inside."""
        return [*_python(), "--join", str(self.pid), "--", *argv]

    def popen(self, argv: Sequence[str], **options: object) -> subprocess.Popen[str]:
        """Start ``argv`` inside, with text pipes according to the options of `subprocess.Popen`."""
        environment = child_environment()
        command = self.command(argv)
        return subprocess.Popen(command, text=True, env=environment, **options)  # type: ignore[call-overload, no-any-return]

    def close(self) -> None:
        """Stop the holder; the namespace is removed when its last process ends."""
        for stream in (self._holder.stdin, self._holder.stdout):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()
        try:
            self._holder.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self._holder.kill()
            self._holder.wait()

    def __enter__(self) -> Namespace:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def enter(pid: int) -> None:
    """Move this process into the namespaces of ``pid``. It must have a single thread.

    Raises:
        NamespaceUnavailable: not permitted, more than one thread, or no such process.
    """
    try:
        enter_namespaces(pid)
    except OSError as error:
        reason = f"{error.filename}: {error.strerror}"
        why = text("virtual.cannot-join-namespaces", pid=pid, cause=reason)
        raise NamespaceUnavailable(why) from error


def _python() -> list[str]:
    return [sys.executable, "-m", "drivers.virtual.wires.netns"]


def child_environment() -> dict[str, str]:
    """Return an environment in which children find the package from any directory."""
    root = str(Path(__file__).resolve().parents[3])
    path = os.environ.get("PYTHONPATH")
    return {**os.environ, "PYTHONPATH": f"{root}:{path}" if path else root}


# -- inside the holder --------------------------------------------------------------------------


def _attribute(kind: int, data: bytes) -> bytes:
    length = 4 + len(data)
    return struct.pack("<HH", length, kind) + data + bytes(-length % 4)


def _name(name: str) -> bytes:
    return _attribute(_IFLA_IFNAME, name.encode() + b"\0")


def _request(flags: int, body: bytes, what: str) -> None:
    """Send one netlink request and wait for its acknowledgement.

    Raises:
        OSError: refused by the kernel; names ``what``.
    """
    header = struct.pack("<IHHII", 16 + len(body), _RTM_NEWLINK, _REQUEST | _ACK | flags, 1, 0)
    with socket.socket(AF_NETLINK, socket.SOCK_RAW, NETLINK_ROUTE) as netlink:
        netlink.send(header + body)
        answer = netlink.recv(65536)
    code = -struct.unpack_from("<i", answer, 16)[0]
    if code:
        raise OSError(code, f"{what}: {os.strerror(code)}")


def create_veth(first: str, second: str) -> None:
    """Create a pair of interfaces, the two ends of one cable."""
    peer = _attribute(_VETH_PEER | _NESTED, bytes(16) + _name(second))
    info = _attribute(_INFO_KIND, b"veth") + _attribute(_INFO_DATA | _NESTED, peer)
    body = bytes(16) + _name(first) + _attribute(_IFLA_LINKINFO | _NESTED, info)
    _request(_CREATE | _EXCLUSIVE, body, f"cannot create the veth pair {first}, {second}")


def set_up(name: str, up: bool = True) -> None:
    """Switch an interface on or off."""
    index = socket.if_nametoindex(name)
    head = struct.pack("<BxHiII", socket.AF_UNSPEC, 0, index, _UP if up else 0, _UP)
    _request(0, head, f"cannot switch {name} {'on' if up else 'off'}")


def silence(name: str) -> None:
    """Disable IPv6 addresses, so that only our frames are on the cable.

    A kernel without IPv6 refuses this, which has the same effect.
    """
    index = socket.if_nametoindex(name)
    head = struct.pack("<BxHiII", socket.AF_UNSPEC, 0, index, 0, 0)
    mode = _attribute(_ADDR_GEN_MODE, bytes([_ADDR_GEN_NONE]))
    inet6 = _attribute(socket.AF_INET6 | _NESTED, mode)
    with contextlib.suppress(OSError):
        _request(0, head + _attribute(_IFLA_AF_SPEC | _NESTED, inet6), f"cannot silence {name}")
    disable_ipv6(name)


def _hold(names: Sequence[str]) -> int:
    try:
        leave_namespaces()
        set_up("lo")
        for first, second in zip(names[::2], names[1::2], strict=True):
            create_veth(first, second)
            for name in (first, second):
                silence(name)
                set_up(name)
    except OSError as error:
        text = error.strerror or errno.errorcode.get(error.errno or 0, "unknown error")
        sys.stdout.write(f"{text}\n")
        sys.stdout.flush()
        return 1
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    sys.stdin.read()
    return 0


def _keeps_time(argv: Sequence[str]) -> bool:
    """Whether a command is virtual hardware or its master, running in real time.

    If time follows the frames, priority would only let setpoints expire while the process that
    renews them waits for the processor. A server or a recorder would block all others.
    """
    return "--lockstep" not in argv and any(word.startswith(_KEEP_TIME) for word in argv)


def _main(argv: Sequence[str]) -> int:
    if argv[:1] == ["--hold"]:
        return _hold(argv[1:])
    if len(argv) > 3 and argv[0] == "--join" and argv[2] == "--":
        # Inside the namespace, priority cannot be requested any more.
        if _keeps_time(argv):
            scheduling.virtual_priority()
        try:
            enter(int(argv[1]))
        except NamespaceUnavailable as error:
            sys.stderr.write(f"{error}\n")
            return 1
        os.execvp(argv[3], list(argv[3:]))  # noqa: S606
    sys.stderr.write("usage: netns --hold NAME PEER … | --join PID -- COMMAND …\n")
    return 2


if __name__ == "__main__":
    sys.exit(_main(sys.argv[1:]))
