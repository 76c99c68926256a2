"""What a name and the roles of ports may be, and that no EtherCAT frame goes into the office."""

from __future__ import annotations

import re
import socket
from collections.abc import Sequence
from pathlib import Path

import psutil

from backend.station.box.kept import Box, read
from drivers.computer.interfaces import Interface
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts.message import text
from drivers.urls import bus_kind, parse_url

#: One label of a host name (RFC 1123, clause 2.1), in small letters.
_NAME = re.compile(r"[a-z0-9]([a-z0-9-]{0,61}[a-z0-9])?")


def checked(box: Box, ports: Sequence[Interface], used: str) -> Box:
    """The same, with the name in small letters.

    ``used`` is the port that the page came by, empty where that is not known.

    Raises:
        OutOfRange: no such name, or no such port.
        NotAllowed: one port is to be both, or EtherCAT is to have the one that the page came by.
    """
    name = box.name.strip().lower()
    if not _NAME.fullmatch(name) or name == "localhost":
        raise OutOfRange("station.box-name", value=box.name, limit=text("limit.host-name"))
    for port, usable in (
        (box.ethercat, [one.name for one in ports if one.is_wired]),
        (box.office, [one.name for one in ports if not one.is_can]),
    ):
        if port and port not in usable:
            raise OutOfRange("station.box-no-port", value=port, limit=", ".join(usable))
    if box.ethercat and box.ethercat == box.office:
        raise NotAllowed("station.box-one-port-for-both", value=box.ethercat)
    if box.ethercat and box.ethercat == used:
        raise NotAllowed("station.box-port-of-this-page", value=used)
    return Box(name, box.ethercat, box.office)


def require_not_office(folder: Path, url: str) -> None:
    """EtherCAT floods a network with frames that no office computer understands.

    Raises:
        NotAllowed: ``url`` is EtherCAT on the office's port, or it is not known which that is.
        OutOfRange: no bus URL.
    """
    bus = parse_url(url)
    if not bus_kind(bus.scheme).traits.fills_network:
        return
    box = read(folder)
    if box is not None and box.office and _same_port(bus.place, box.office):
        raise NotAllowed(
            "station.box-office-port",
            value=url,
            limit=text("limit.ethercat-port", port=box.ethercat or "none"),
        )


def _same_port(one: str, other: str) -> bool:
    """Also by another name that the system has for it."""
    try:
        return one == other or socket.if_nametoindex(one) == socket.if_nametoindex(other)
    except OSError:
        return False


def port_of(address: str) -> str:
    """The port that has this address; empty where none has, or it is the computer's own loop."""
    for name, addresses in psutil.net_if_addrs().items():
        if any(one.address.split("%")[0] == address for one in addresses):
            return "" if _is_loop(address) else name
    return ""


def addresses_of(port: str) -> list[str]:
    """IPv4 addresses of a port, in the system's order."""
    found = psutil.net_if_addrs().get(port, [])
    return [one.address for one in found if one.family == socket.AF_INET]


def _is_loop(address: str) -> bool:
    return address.startswith("127.") or address == "::1"
