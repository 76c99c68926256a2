"""The network interfaces of this computer, as the system describes them."""

from __future__ import annotations

import socket
import sys
from dataclasses import dataclass
from pathlib import Path

from drivers.computer.network.packet_capture import adapters

_NET = Path("/sys/class/net")
_ARPHRD_ETHER, _ARPHRD_CAN = 1, 280


@dataclass(frozen=True, slots=True)
class Interface:
    """One interface; ``up``: it can carry frames now (not reported as down).

    ``title`` is a name for people, if it differs from ``name``.
    """

    name: str
    up: bool
    is_wired: bool
    is_can: bool
    title: str = ""


def network_interfaces(net: Path = _NET) -> list[Interface]:
    """Return the interfaces that the system lists.

    Only Linux reports the kind of each; elsewhere the list has those that the packet capture
    library can open, including wireless ones.
    """
    if sys.platform != "linux":
        return [
            Interface(one.name, up=True, is_wired=True, is_can=False, title=one.title)
            for one in adapters()
        ]
    return [_interface(net / name, name) for _, name in socket.if_nameindex()]


def _interface(folder: Path, name: str) -> Interface:
    kind = _number(folder / "type")
    return Interface(
        name=name,
        up=_text(folder / "operstate") not in ("", "down"),
        is_wired=kind == _ARPHRD_ETHER and not (folder / "wireless").exists(),
        is_can=kind == _ARPHRD_CAN,
    )


def _text(file: Path) -> str:
    try:
        return file.read_text("ascii").strip()
    except (OSError, UnicodeDecodeError):
        return ""


def _number(file: Path) -> int:
    text = _text(file)
    return int(text) if text.isdecimal() else -1
