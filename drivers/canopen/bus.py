"""CANopen as a kind of bus."""

from __future__ import annotations

from urllib.parse import unquote

from drivers.adapters import CAN_INTERFACES, require_channel
from drivers.bus import BusKind, BusUrl
from drivers.link import Link, LinkTraits
from drivers.texts.message import text


def _require_place(place: str) -> None:
    interface, _, channel = place.partition("/")
    # Any other error in it is reported by the CANopen link (`parse_canopen_url`).
    if interface in CAN_INTERFACES and channel:
        require_channel(interface, unquote(channel))


def _serial_port(place: str) -> str:
    interface, _, channel = place.partition("/")
    return unquote(channel) if interface == "slcan" else ""


def _link(url: BusUrl) -> Link:
    from drivers.canopen.link import CanopenLink

    return CanopenLink(str(url))


BUS = BusKind(
    example="canopen://socketcan/can0?bitrate=1000000",
    traits=LinkTraits(
        synchronous=True,
        description="stored_eds",
        silent=text("canopen.check-when-silent"),
    ),
    require_place=_require_place,
    link=_link,
    serial_port=_serial_port,
)
