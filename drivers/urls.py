"""Bus URLs: the one notation of the command line, the API and the saved configuration.

::

    ethercat://eth0
    canopen://socketcan/can0?bitrate=1000000
    modbus:///dev/ttyUSB0?baudrate=115200&parity=N
    mlink:///dev/ttyUSB0?baudrate=2500000&parity=E
    mlink://COM3                                     (Windows)
    mlink://virtual0                                 (a wire that the demo makes)

Options of serial URLs: ``baudrate``, ``parity`` (N, E, O), ``stopbits`` (1, 2), ``timeout_ms``,
``silence_us`` (pause before each request), ``retries`` (of reads).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Literal
from urllib.parse import parse_qsl, unquote

from drivers.adapters import (
    CAN_INTERFACES,
    require_channel,
    require_interface,
    require_serial_form,
)
from drivers.errors import NotAllowed, OutOfRange
from drivers.link import Link
from drivers.modbus.port import STANDARD_SILENCE_S, LineSettings, Parity

SCHEMES: tuple[Literal["ethercat", "canopen", "modbus", "mlink"], ...] = (
    "ethercat", "canopen", "modbus", "mlink",
)  # fmt: skip
_EXAMPLES = {
    "ethercat": "ethercat://eth0",
    "canopen": "canopen://socketcan/can0?bitrate=1000000",
    "modbus": "modbus:///dev/ttyUSB0?baudrate=115200&parity=N",
    "mlink": "mlink:///dev/ttyUSB0?baudrate=2500000&parity=E",
}

#: Defaults of an MMS7 on MLink: 004:1457-1464.
_MLINK = LineSettings("", baudrate=2_500_000, parity="E")
_MODBUS = LineSettings("", baudrate=115_200, parity="N")


@dataclass(frozen=True, slots=True)
class BusUrl:
    """A bus URL taken apart. ``place`` is the adapter: device path, interface or CAN channel."""

    scheme: Literal["ethercat", "canopen", "modbus", "mlink"]
    place: str
    options: tuple[tuple[str, str], ...] = ()

    @property
    def is_virtual(self) -> bool:
        """True for a wire that the demo makes, such as ``virtual0``."""
        return re.fullmatch(r"virtual\d+", self.place) is not None

    def with_options(self, **options: str | int) -> BusUrl:
        """The same bus with some options replaced."""
        merged = dict(self.options) | {name: str(value) for name, value in options.items()}
        return replace(self, options=tuple(merged.items()))

    def __str__(self) -> str:
        query = "&".join(f"{name}={value}" for name, value in self.options)
        return f"{self.scheme}://{self.place}" + (f"?{query}" if query else "")


def parse_url(text: str) -> BusUrl:
    """Take a bus URL apart.

    Raises:
        OutOfRange: no such scheme, no adapter named, one that is not of the forms in
            `drivers.adapters`, or an option given twice.
    """
    match = re.fullmatch(r"([a-z]+)://([^?]*)(?:\?(.*))?", text.strip())
    scheme = next((known for known in SCHEMES if match and known == match[1]), None)
    if match is None or scheme is None or not text.strip().isprintable():
        raise OutOfRange(
            "link.no-bus-url-must",
            value=text,
            remedy=_like(*SCHEMES),
            schemes=", ".join(f"{known}://" for known in SCHEMES),
        )
    place = match[2]
    if not place.strip("/"):
        raise OutOfRange("link.names-no-adapter", value=text, remedy=_like(scheme))
    options = parse_qsl(match[3] or "", keep_blank_values=True)
    if len(dict(options)) != len(options):
        raise OutOfRange("link.gives-option-twice", value=text, remedy=_like(scheme))
    bus = BusUrl(scheme, place, tuple(options))
    if not bus.is_virtual:
        _require_adapter(bus)
    return bus


def _require_adapter(bus: BusUrl) -> None:
    if bus.scheme == "ethercat":
        require_interface(bus.place)
    elif bus.scheme == "canopen":
        interface, _, channel = bus.place.partition("/")
        # What else can be wrong with it, the CANopen link says (`parse_canopen_url`).
        if interface in CAN_INTERFACES and channel:
            require_channel(interface, unquote(channel))
    else:
        require_serial_form(bus.place)


def line_settings(url: BusUrl) -> LineSettings:
    """Settings of a ``modbus`` or ``mlink`` URL, with the defaults of that kind.

    Modbus keeps the pause of the standard (3.5 characters, 1.75 ms above 19200 baud: MODBUS over
    Serial Line V1.02, clause 2.5.1.1). MLink keeps 3.5 characters at every rate, because 1.75 ms
    are 400 characters at 2.5 Mbaud.

    Raises:
        OutOfRange: an option that does not exist or whose value makes no sense.
    """
    settings = replace(_MLINK if url.scheme == "mlink" else _MODBUS, device=url.place)
    silence_s: float | None = None
    for name, text in url.options:
        if name == "baudrate":
            settings = replace(settings, baudrate=_number(url.scheme, name, text, 300, 12_000_000))
        elif name == "parity":
            settings = replace(settings, parity=_parity(url.scheme, text))
        elif name == "stopbits":
            settings = replace(
                settings, stopbits=2 if _number(url.scheme, name, text, 1, 2) == 2 else 1
            )
        elif name == "timeout_ms":
            settings = replace(
                settings, timeout_s=_number(url.scheme, name, text, 1, 60_000) / 1000
            )
        elif name == "retries":
            settings = replace(settings, retries=_number(url.scheme, name, text, 0, 10))
        elif name == "silence_us":
            silence_s = _number(url.scheme, name, text, 0, 1_000_000) / 1e6
        else:
            raise OutOfRange(
                "link.urls-no-option",
                value=name,
                limit="baudrate, parity, stopbits, timeout_ms, silence_us, retries",
                remedy=_like(url.scheme),
                scheme=url.scheme,
            )
    if silence_s is None and url.scheme == "modbus" and settings.baudrate > 19_200:
        silence_s = STANDARD_SILENCE_S
    return replace(settings, silence_s=silence_s)


def link_for(url: str | BusUrl) -> Link:
    """The link of a bus URL, not yet opened.

    Raises:
        OutOfRange: the URL is wrong.
        NotAllowed: a virtual wire outside the demo that makes it.
    """
    bus = parse_url(url) if isinstance(url, str) else url
    if bus.is_virtual:
        raise NotAllowed("link.wire-running-demo", bus=str(bus))
    text = str(bus)
    if bus.scheme == "mlink":
        from drivers.mlink.link import mlink_link

        return mlink_link(text, line_settings(bus))
    if bus.scheme == "modbus":
        from drivers.modbus.link import modbus_link

        return modbus_link(text, line_settings(bus))
    if bus.scheme == "canopen":
        from drivers.canopen.link import CanopenLink

        return CanopenLink(text)
    from drivers.ethercat.link import EthercatLink

    return EthercatLink(text)


def _like(*schemes: str) -> str:
    """How URLs of these kinds are written."""
    return "write it like " + " or ".join(_EXAMPLES[scheme] for scheme in schemes)


def _number(scheme: str, name: str, text: str, low: int, high: int) -> int:
    if not re.fullmatch(r"\d{1,9}", text) or not low <= int(text) <= high:
        raise OutOfRange(
            "link.must-whole-number",
            value=text,
            limit=f"{low}…{high}",
            remedy=_like(scheme),
            name=name,
            low=low,
            high=high,
        )
    return int(text)


def _parity(scheme: str, text: str) -> Parity:
    for parity in ("N", "E", "O"):
        if text.upper() == parity:
            return parity
    raise OutOfRange(
        "link.parity-must-none-even", value=text, limit="N, E, O", remedy=_like(scheme)
    )
