"""Promiscuous mode for the life of a socket only.

SOEM sets the flag of the interface itself (IFF_PROMISC, netdevice(7)), which remains when the
master is closed or killed: the computer then reads all traffic of that network permanently. A
membership of the socket (PACKET_MR_PROMISC, packet(7)) has the same effect, and the kernel ends it
with the socket.
"""

from __future__ import annotations

import contextlib
import socket
import struct

from drivers.computer.network.sockets import interface_flags, set_interface_flags

_IFF_PROMISC = 0x100
_SOL_PACKET, _ADD_MEMBERSHIP, _MR_PROMISC = 263, 1, 1


def is_set(interface: str) -> bool:
    """Return whether the interface has been permanently switched to promiscuous mode."""
    try:
        return bool(interface_flags(interface) & _IFF_PROMISC)
    except OSError:
        return False


def bind_to(packets: socket.socket, interface: str, index: int) -> None:
    """Set the mode for this packet socket, and clear it in the interface's own flags.

    Where this is not permitted, SOEM was not permitted to set it either.
    """
    with contextlib.suppress(OSError):
        membership = struct.pack("iHH8s", index, _MR_PROMISC, 0, b"")
        packets.setsockopt(_SOL_PACKET, _ADD_MEMBERSHIP, membership)
        flags = interface_flags(interface)
        if flags & _IFF_PROMISC:
            set_interface_flags(interface, flags & ~_IFF_PROMISC)
