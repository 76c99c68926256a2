"""Sockets and descriptors that are not available on every system."""

from __future__ import annotations

import os
import socket
import struct
import sys
from pathlib import Path
from typing import BinaryIO

from drivers.computer.locks import hold_file
from drivers.errors import NotAllowed

#: Whether a process can send and receive its own Ethernet frames through a socket (packet(7)).
#: Elsewhere EtherCAT goes through SOEM alone, over a packet capture library.
RAW_FRAMES = sys.platform == "linux"

if sys.platform == "linux":
    from socket import AF_NETLINK, AF_PACKET, AF_UNIX, MSG_DONTWAIT, NETLINK_ROUTE
else:
    # Numbers of Linux (bits/socket.h). They are never opened elsewhere: see `RAW_FRAMES`.
    AF_UNIX, AF_NETLINK, AF_PACKET, MSG_DONTWAIT, NETLINK_ROUTE = 1, 16, 17, 0x40, 0

_SIOCGIFFLAGS, _SIOCSIFFLAGS = 0x8913, 0x8914

__all__ = [
    "AF_NETLINK", "AF_PACKET", "AF_UNIX", "MSG_DONTWAIT", "NETLINK_ROUTE", "RAW_FRAMES",
    "hold_name", "interface_flags", "open_sockets", "receive_with_notes",
    "require_linux", "set_blocking", "set_interface_flags",
    "shared_memory_file", "take_port_alone",
]  # fmt: skip


def require_linux(what: str) -> None:
    """Require Linux for ``what``.

    Raises:
        NotAllowed: another system.
    """
    if sys.platform != "linux":
        raise NotAllowed(
            "computer.not-available-looks-linux", value=sys.platform, limit="Linux", what=what
        )


def set_blocking(descriptor: int, wanted: bool) -> None:
    """Set whether reading this descriptor waits; no effect on Windows."""
    if sys.platform != "win32":
        os.set_blocking(descriptor, wanted)


def shared_memory_file(name: str) -> int:
    """Create a file in memory that vanishes with the last process holding it (memfd_create(2)).

    Raises:
        NotAllowed: the system does not support it.
    """
    if sys.platform == "linux":
        return os.memfd_create(name)
    raise NotAllowed("computer.shared-memory-not-available", value=name, limit="Linux")


def receive_with_notes(
    source: socket.socket, most: int, notes: int
) -> tuple[bytes, list[tuple[int, int, bytes]], int, object]:
    """Receive a message with its ancillary data (recvmsg(2)).

    Raises:
        OSError: nothing to receive, or the system has no such call (Windows).
    """
    if sys.platform == "win32":
        raise OSError("recvmsg is not available on Windows")
    else:  # noqa: RET506 - type checkers follow the branches of a system
        return source.recvmsg(most, notes)


def take_port_alone(listening: socket.socket) -> None:
    """Let a socket have a port right after its last user ended, but never beside another program.

    SO_REUSEADDR allows the first on POSIX. On Windows it allows the second: two programs then
    listen on one port, and either gets the connections (learn.microsoft.com, "Using SO_REUSEADDR
    and SO_EXCLUSIVEADDRUSE").
    """
    if sys.platform == "win32":
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
    else:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)


def interface_flags(interface: str) -> int:
    """Return the IFF_ flags of a network interface (netdevice(7)).

    Raises:
        OSError: there is no such interface, or the system does not report them (not Linux).
    """
    return _flags_by(_SIOCGIFFLAGS, interface, 0)


def set_interface_flags(interface: str, flags: int) -> None:
    """Set the IFF_ flags of a network interface (netdevice(7)).

    Raises:
        OSError: not permitted, no such interface, or another system than Linux.
    """
    _flags_by(_SIOCSIFFLAGS, interface, flags)


def _flags_by(request: int, interface: str, flags: int) -> int:
    if sys.platform != "linux":
        raise OSError(f"the flags of {interface} are known on Linux only")
    import fcntl

    wanted = struct.pack("16sH14x", interface.encode(), flags)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        answer = fcntl.ioctl(control, request, wanted)
    return int(struct.unpack("16sH14x", answer)[1])


def hold_name(name: str) -> socket.socket | BinaryIO:
    """Hold this name for this process alone; return what holds it until the process ends.

    On Linux an abstract socket (unix(7)), which belongs to the network namespace, as its interfaces
    do. Elsewhere a locked file in the user's temporary folder, which does not exclude processes of
    other users.

    Raises:
        OSError: another process holds it.
    """
    if sys.platform != "linux":
        return hold_file(name)
    holder = socket.socket(AF_UNIX, socket.SOCK_DGRAM)
    try:
        holder.bind(f"\0{name}")
    except OSError:
        holder.close()
        raise
    return holder


def open_sockets() -> set[int]:
    """Return the descriptors of this process that are sockets; only Linux lists them (proc(5))."""
    found = set()
    for entry in Path("/proc/self/fd").iterdir():
        try:
            if str(entry.readlink()).startswith("socket:"):
                found.add(int(entry.name))
        except OSError:
            continue
    return found
