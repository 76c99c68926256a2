"""Allow-list of the forms that the adapter in a bus URL may have.

The adapter part of a bus URL comes from the network, from a saved list of drives or from a file,
and the libraries below accept far more than adapter names: pyserial opens URLs of its own (``spy:``
writes a file, ``socket:`` and ``rfc2217:`` connect to any computer, ``hwgrep:`` and ``alt:`` search
and load code), python-can takes ``NAME@BAUD``, and merely opening a device that is not a serial
port can have effects (a watchdog starts to count). Therefore only these forms are accepted:

- a serial port: an absolute path that leads to a serial device, or ``COM1`` … ``COM999``;
- a network interface by its name, or a Windows network adapter by its ``NPF_{…}``;
- a channel of one of python-can's interfaces, in the form that this interface uses.

`require_serial_form` checks the text alone, so that an address can be checked on any computer;
`serial_device` follows links and is called again each time a port is opened.
"""

from __future__ import annotations

import ipaddress
import os
import re
import stat
from collections.abc import Callable
from pathlib import Path

from serial.tools import list_ports

from drivers.computer.network.packet_capture import NPF_NAME
from drivers.computer.serial_ports.terminals import has_descriptor, own_terminals
from drivers.errors import LinkLost, OutOfRange
from drivers.texts.message import text

_COM = re.compile(r"(?:\\\\\.\\)?COM[1-9]\d{0,2}", re.IGNORECASE)
#: Absolute, without control characters, and without the characters that the libraries interpret.
_PATH = re.compile(r"/[^\x00-\x1f\x7f-\x9f\ud800-\udfff\\?#]{1,250}")
#: Serial lines, USB adapters, Bluetooth, the Mac's call-out ports, and pseudo-terminals. Consoles
#: (/dev/tty, /dev/tty1) and all other devices are excluded.
_DEVICE = re.compile(
    r"/dev/(?:tty[A-Za-z][\w.\-]{0,60}|(?:cu|tty)\.[\w.\-]{1,80}|rfcomm\d{1,3}|pts/\d{1,7})"
)
#: Interface names as the kernel forms them, without unusual characters.
_INTERFACE = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.@:\-]{0,14}")

SERIAL_LIMIT = text("limit.serial-device")


def require_serial_form(place: str) -> None:
    """Check that the text is a device path or a COM port.

    Raises:
        OutOfRange: it is anything else, such as a URL of pyserial.
    """
    if _COM.fullmatch(place):
        return
    parts = place.split("/")
    if not _PATH.fullmatch(place) or ".." in parts or place.startswith("//"):
        raise OutOfRange("link.no-serial-port", value=place, limit=SERIAL_LIMIT)


def serial_device(place: str) -> str:
    """Return the device to open for the name of a serial port, with all links followed.

    A link anywhere may lead to it, as those of udev and of virtual drives do. A device that is not
    a serial device is never opened, and for paths outside ``/dev`` the error does not reveal
    whether they exist.

    Raises:
        OutOfRange: the form is not that of a serial port.
        LinkLost: not a serial device, or the terminal in which this server was started.
    """
    require_serial_form(place)
    if not has_descriptor():
        return place
    device = os.path.realpath(place)
    if not place.startswith("/dev/") and not _is_serial(device):
        raise LinkLost(
            "link.no-serial-port-plug-adapter",
            value=place,
            limit=SERIAL_LIMIT,
            ports_found=ports_found(),
        )
    if Path(device).exists() and not _is_serial(device):
        raise LinkLost("link.no-serial-port-give-device", value=place, limit=SERIAL_LIMIT)
    if device in own_terminals():
        raise LinkLost("link.terminal-servodeck-itself-runs", value=place)
    return device


def is_same_port(one: str, other: str) -> bool:
    """Return whether two names stand for one serial port: links, and the forms of a COM port."""
    com = [_COM.fullmatch(name) for name in (one, other)]
    if all(com):
        return one.upper().rpartition("\\")[2] == other.upper().rpartition("\\")[2]
    return not any(com) and os.path.realpath(one) == os.path.realpath(other)


def ports_found() -> str:
    """Return the names of the serial ports of this computer for display, or "none"."""
    return ", ".join(sorted(port.device for port in list_ports.comports())) or "none"


def _is_serial(device: str) -> bool:
    try:
        mode = Path(device).stat().st_mode
    except OSError:
        return False
    return _DEVICE.fullmatch(device) is not None and stat.S_ISCHR(mode)


def require_interface(name: str) -> None:
    """Check that the text is the name of a network interface, 1 to 15 characters.

    Raises:
        OutOfRange: it is not.
    """
    if not _INTERFACE.fullmatch(name):
        raise OutOfRange(
            "link.no-network-interface",
            value=name,
            limit=text("limit.interface-name"),
        )


def require_ethercat_adapter(name: str) -> None:
    """Check that the text is the name of a network interface, or ``NPF_{GUID}`` of a Windows
    adapter.

    The adapter opened is looked up in the system's own list; a name of the right form does not open
    anything by itself.

    Raises:
        OutOfRange: it is neither.
    """
    if not NPF_NAME.fullmatch(name):
        require_interface(name)


def _require_multicast(channel: str) -> None:
    """Require a multicast address; any other could be a computer that the caller chooses."""
    try:
        address = ipaddress.ip_address(channel)
    except ValueError:
        address = None
    if address is None or not address.is_multicast or "%" in channel:
        raise OutOfRange(
            "link.no-multicast-address",
            value=channel,
            limit="224.0.0.0…239.255.255.255, ff00::/8",
        )


def _pattern(pattern: str, example: str) -> Callable[[str], None]:
    form = re.compile(pattern)

    def require(channel: str) -> None:
        if not form.fullmatch(channel):
            raise OutOfRange("link.no-channel-kind-adapter", value=channel, limit=example)

    return require


#: Form of the channel for each interface name of python-can.
_CHANNELS: dict[str, Callable[[str], None]] = {
    "socketcan": require_interface,
    "slcan": require_serial_form,
    "pcan": _pattern(r"PCAN_(?:NONE|[A-Z]{3}BUS(?:[1-9]|1[0-6]))", "PCAN_USBBUS1"),
    "kvaser": _pattern(r"\d{1,3}", "0"),
    "usb2can": _pattern(r"[A-Za-z0-9]{1,32}", "ED000200"),
    "udp_multicast": _require_multicast,
    "virtual": _pattern(r"[\w.\-]{1,64}", "can0"),
}
CAN_INTERFACES = tuple(_CHANNELS)


def require_channel(interface: str, channel: str) -> None:
    """Check that the text is a channel of this interface of python-can, one of `CAN_INTERFACES`.

    Raises:
        OutOfRange: it is not.
    """
    _CHANNELS[interface](channel)
