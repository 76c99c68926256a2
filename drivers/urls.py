"""Bus URLs: the one notation of the command line, the API and the saved configuration.

::

    ethercat://eth0
    canopen://socketcan/can0?bitrate=1000000
    modbus:///dev/ttyUSB0?baudrate=115200&parity=N
    mlink:///dev/ttyUSB0?baudrate=2500000&parity=E
    mlink://COM3                                     (Windows)
    mlink://virtual0                                 (a wire created by the demo)
"""

from __future__ import annotations

import importlib
import re
from typing import get_args
from urllib.parse import parse_qsl

from drivers.bus import BusKind, BusUrl
from drivers.errors import NotAllowed, OutOfRange
from drivers.link import Link
from drivers.texts.message import text
from profiles.schema import LinkKind

SCHEMES: tuple[LinkKind, ...] = get_args(LinkKind)


def bus_kind(kind: LinkKind) -> BusKind:
    """Return the description of a kind of bus; the module of its link loads with the first link."""
    found: BusKind = importlib.import_module(f"drivers.{kind}.bus").BUS
    return found


def parse_url(url: str) -> BusUrl:
    """Parse a bus URL.

    Raises:
        OutOfRange: unknown scheme, no adapter, an adapter in a form that
            `drivers.adapters` does not allow, or an option given twice.
    """
    match = re.fullmatch(r"([a-z]+)://([^?]*)(?:\?(.*))?", url.strip())
    scheme = next((known for known in SCHEMES if match and known == match[1]), None)
    if match is None or scheme is None or not url.strip().isprintable():
        raise OutOfRange(
            "link.no-bus-url-must",
            value=url,
            schemes=", ".join(f"{known}://" for known in SCHEMES),
            remedy=text(
                "link.write-it-like",
                example=", ".join(bus_kind(known).example for known in SCHEMES),
            ),
        )
    place = match[2]
    if not place.strip("/"):
        raise OutOfRange("link.names-no-adapter", value=url, remedy=bus_kind(scheme).like)
    options = parse_qsl(match[3] or "", keep_blank_values=True)
    if len(dict(options)) != len(options):
        raise OutOfRange("link.gives-option-twice", value=url, remedy=bus_kind(scheme).like)
    bus = BusUrl(scheme, place, tuple(options))
    if not bus.is_virtual:
        bus_kind(scheme).require_place(place)
    return bus


def serial_port_of(url: str) -> str:
    """Return the serial port that a bus URL names; empty for none, and for what is no bus URL."""
    try:
        bus = parse_url(url)
    except OutOfRange:
        return ""
    return "" if bus.is_virtual else bus_kind(bus.scheme).serial_port(bus.place)


def link_for(url: str | BusUrl) -> Link:
    """Create the link of a bus URL without opening it.

    Raises:
        OutOfRange: the URL is wrong.
        NotAllowed: a virtual wire, which exists only inside the demo.
    """
    bus = parse_url(url) if isinstance(url, str) else url
    if bus.is_virtual:
        raise NotAllowed("link.wire-running-demo", bus=str(bus))
    return bus_kind(bus.scheme).link(bus)
