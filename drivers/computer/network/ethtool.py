"""Processing of frames in a network card before delivery (ethtool, linux/ethtool.h).

Only the settings that delay single frames: coalescing of interrupts and grouping of frames.
"""

from __future__ import annotations

import ctypes
import socket
import struct
import sys
from collections.abc import Mapping

_SIOCETHTOOL = 0x8946
_GCOALESCE, _SCOALESCE = 0x0E, 0x0F
_GGRO, _SGRO = 0x2B, 0x2C
_GFLAGS, _SFLAGS = 0x25, 0x26
_FLAG_LRO = 1 << 15
#: struct ethtool_coalesce: the command and 22 numbers; rx_coalesce_usecs and tx_coalesce_usecs.
_COALESCE = struct.Struct("23I")
_RX_USECS, _TX_USECS = 1, 5
_VALUE = struct.Struct("2I")

SETTINGS = ("rx-usecs", "tx-usecs", "gro", "lro")


def read_card(interface: str) -> Mapping[str, int]:
    """Read the settings of this card, by their names in `SETTINGS`; µs, or 1 for on.

    Settings that a card or driver does not support are absent; empty on systems other than Linux.
    """
    found: dict[str, int] = {}
    coalesce = _ask(interface, _COALESCE.pack(_GCOALESCE, *[0] * 22))
    if coalesce is not None:
        numbers = _COALESCE.unpack(coalesce)
        found |= {"rx-usecs": numbers[_RX_USECS], "tx-usecs": numbers[_TX_USECS]}
    gro = _ask(interface, _VALUE.pack(_GGRO, 0))
    if gro is not None:
        found["gro"] = int(_VALUE.unpack(gro)[1] != 0)
    flags = _ask(interface, _VALUE.pack(_GFLAGS, 0))
    if flags is not None:
        found["lro"] = int(bool(_VALUE.unpack(flags)[1] & _FLAG_LRO))
    return found


def write_card(interface: str, name: str, value: int) -> None:
    """Set one of `SETTINGS`.

    Raises:
        OSError: not permitted (CAP_NET_ADMIN), or the card does not accept it.
        ValueError: not one of `SETTINGS`.
    """
    if name in ("rx-usecs", "tx-usecs"):
        now = _require(interface, _COALESCE.pack(_GCOALESCE, *[0] * 22))
        numbers = list(_COALESCE.unpack(now))
        numbers[0] = _SCOALESCE
        numbers[_RX_USECS if name == "rx-usecs" else _TX_USECS] = value
        _require(interface, _COALESCE.pack(*numbers))
    elif name == "gro":
        _require(interface, _VALUE.pack(_SGRO, value))
    elif name == "lro":
        flags = _VALUE.unpack(_require(interface, _VALUE.pack(_GFLAGS, 0)))[1]
        flags = flags | _FLAG_LRO if value else flags & ~_FLAG_LRO
        _require(interface, _VALUE.pack(_SFLAGS, flags))
    else:
        raise ValueError(f"{name!r} is none of {', '.join(SETTINGS)}")


def _ask(interface: str, command: bytes) -> bytes | None:
    try:
        return _require(interface, command)
    except OSError:
        return None


def _require(interface: str, command: bytes) -> bytes:
    if sys.platform != "linux":
        raise OSError(f"the card of {interface} is asked on Linux only")
    import fcntl

    buffer = ctypes.create_string_buffer(command, len(command))
    request = struct.pack("16sP", interface.encode(), ctypes.addressof(buffer))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        fcntl.ioctl(control, _SIOCETHTOOL, request + bytes(16))
    return buffer.raw
