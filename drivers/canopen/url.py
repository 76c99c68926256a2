"""CANopen bus URLs: ``canopen://INTERFACE/CHANNEL?option=value``.

INTERFACE and CHANNEL are python-can's names. Examples::

    canopen://socketcan/can0?bitrate=1000000
    canopen://slcan//dev/ttyACM0?bitrate=500000
    canopen://udp_multicast/239.74.163.2
"""

from __future__ import annotations

from dataclasses import dataclass
from urllib.parse import parse_qsl, unquote, urlsplit

from drivers.adapters import CAN_INTERFACES, require_channel
from drivers.errors import OutOfRange

INTERFACES = CAN_INTERFACES

BITRATES = (10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000)
"""Bit rates of CiA 301 clause 6.2, and 100 kbit/s, which it no longer recommends."""

_DEFAULT_CHANNEL = {"pcan": "PCAN_USBBUS1", "kvaser": "0", "udp_multicast": "239.74.163.2"}
_OPTIONS = ("bitrate", "timeout_ms", "own_id", "guard_ms", "settle_ms", "port", "tty_baudrate")


@dataclass(frozen=True, slots=True)
class CanUrl:
    """A parsed CANopen URL.

    ``timeout_s`` is the time-out of one SDO answer. ``own_id`` is the node number under which this
    tool sends its own heartbeat. ``guard_s`` is the period of node guarding for silent nodes, 0 for
    none. ``settle_s`` is the delay after opening a serial adapter.
    """

    url: str
    interface: str
    channel: str
    bitrate: int
    timeout_s: float = 0.5
    own_id: int = 127
    guard_s: float = 0.0
    settle_s: float = 0.0
    port: int | None = None
    tty_baudrate: int | None = None


def parse_canopen_url(url: str) -> CanUrl:
    """Parse a URL.

    Raises:
        OutOfRange: another scheme, unknown interface, option or bit rate, or a channel that
            does not fit the interface; the message lists the valid ones.
    """
    parts = urlsplit(url)
    if parts.scheme != "canopen":
        raise OutOfRange("canopen.not-canopen-address", value=url)
    interface = parts.netloc
    if interface not in INTERFACES:
        raise OutOfRange(
            "canopen.not-kind-adapter-known",
            value=url,
            limit=", ".join(INTERFACES),
            interface=interface,
        )
    channel = unquote(parts.path.removeprefix("/")) or _DEFAULT_CHANNEL.get(interface, "")
    if not channel:
        raise OutOfRange("canopen.names-no-channel", value=url, interface=interface)
    require_channel(interface, channel)
    options = dict(parse_qsl(parts.query, keep_blank_values=True))
    unknown = sorted(set(options) - set(_OPTIONS))
    if unknown:
        raise OutOfRange(
            "canopen.unknown-option",
            value=url,
            limit=", ".join(_OPTIONS),
            unknown=", ".join(unknown),
        )
    bitrate = _number(options, "bitrate", 1_000_000.0, 1, 1_000_000)
    if int(bitrate) not in BITRATES:
        raise OutOfRange(
            "canopen.bit-not-canopen-bit", value=int(bitrate), limit=", ".join(map(str, BITRATES))
        )
    return CanUrl(
        url=url,
        interface=interface,
        channel=channel,
        bitrate=int(bitrate),
        timeout_s=_number(options, "timeout_ms", 500, 5, 60_000) / 1e3,
        own_id=int(_number(options, "own_id", 127, 1, 127)),
        guard_s=_number(options, "guard_ms", 0, 0, 60_000) / 1e3,
        settle_s=_number(options, "settle_ms", 0, 0, 10_000) / 1e3,
        port=_port(options),
        tty_baudrate=int(_number(options, "tty_baudrate", 0, 0, 20_000_000)) or None,
    )


def _port(options: dict[str, str]) -> int | None:
    # Other services listen below 1024 and would interpret a frame as a message.
    port = int(_number(options, "port", 0, 0, 65535))
    return int(_number(options, "port", 0, 1024, 65535)) if port else None


def _number(options: dict[str, str], name: str, default: float, low: float, high: float) -> float:
    text = options.get(name)
    if text is None:
        return default
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not low <= value <= high:
        raise OutOfRange(
            "canopen.must-number",
            value=text,
            limit=f"{low:g}…{high:g}",
            name=name,
            low=low,
            high=high,
        )
    return value
