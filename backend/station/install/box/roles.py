"""Checks of the name and of the port roles; no EtherCAT on the office port."""

from __future__ import annotations

import re
import socket
from collections.abc import Sequence
from pathlib import Path

import psutil

from backend.station.install.box.kept import Box, read
from drivers.computer.network.interfaces import Interface
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts.message import text
from drivers.urls import bus_kind, parse_url

#: One label of a host name (RFC 1123, clause 2.1), in lower case.
_NAME = re.compile(r"[a-z0-9]([a-z0-9-]{0,61}[a-z0-9])?")


def checked(box: Box, ports: Sequence[Interface], used: str) -> Box:
    """Check the settings and return them with the name in lower case.

    ``used``: port over which the page is connected; empty where that is not known.

    Raises:
        OutOfRange: not a valid name, or no such port.
        NotAllowed: one port has both roles, or EtherCAT has the port of the page.
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
    """Refuse EtherCAT on the office port, as its frames would flood the office network.

    Raises:
        NotAllowed: ``url`` is EtherCAT on the office port, or the office port is not known.
        OutOfRange: not a bus URL.
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
    """Whether both names are of one port, also by an alternative name of the system."""
    try:
        return one == other or socket.if_nametoindex(one) == socket.if_nametoindex(other)
    except OSError:
        return False


def port_of(address: str) -> str:
    """Name of the port with this IP address; empty for none and for loopback addresses."""
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
