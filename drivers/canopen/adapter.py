"""Opening a CAN adapter by its URL, with errors of python-can translated to `LinkLost`."""

from __future__ import annotations

import errno
from pathlib import Path

import can

from drivers.adapters import require_channel, serial_device
from drivers.canopen.slcan import AdapterBlocked, AdapterLost, SlcanBus
from drivers.canopen.url import CanUrl
from drivers.errors import DriveError, LinkLost

#: Errors that python-can and the manufacturers' libraries below it raise when an adapter is missing
#: or fails. They have no narrower base: ctypes bindings raise TypeError, AttributeError, NameError
#: …
ADAPTER_ERRORS = (Exception,)


def open_bus(url: CanUrl) -> can.BusABC:
    """Open the adapter.

    Raises:
        LinkLost: missing, not permitted, in use, or without its driver; the message states which.
        OutOfRange: the ``url`` names no adapter in an allowed form.
    """
    try:
        return _open(url)
    except DriveError:
        raise
    except ADAPTER_ERRORS as error:
        raise translate(url, error) from error


def _open(url: CanUrl) -> can.BusABC:
    require_channel(url.interface, url.channel)
    if url.interface == "slcan":
        # python-can would open any URL that pyserial knows; a resolved device path is not a URL.
        return SlcanBus(
            serial_device(url.channel),
            tty_baudrate=url.tty_baudrate or 115200,
            bitrate=url.bitrate,
            sleep_after_open=url.settle_s,
        )
    if url.interface == "udp_multicast":
        if url.port is not None:
            return can.Bus(interface="udp_multicast", channel=url.channel, fd=False, port=url.port)
        return can.Bus(interface="udp_multicast", channel=url.channel, fd=False)
    if url.interface == "virtual":
        return can.Bus(interface="virtual", channel=url.channel)
    return can.Bus(interface=url.interface, channel=url.channel, bitrate=url.bitrate)


def translate(url: CanUrl, error: BaseException) -> LinkLost:
    """Translate the adapter's error to LinkLost, with a remedy."""
    code = _errno(error)
    text = str(error)
    name = f"{url.interface} {url.channel}"
    if code in (errno.EACCES, errno.EPERM):
        why = "no permission"
        remedy = f"add the user to the group that owns {url.channel} (often dialout), log in again"
    elif code == errno.EBUSY:
        why, remedy = "in use by another program", "close the other program"
    elif code in (errno.ENOENT, errno.ENODEV, errno.ENXIO) or _path_is_missing(url):
        why, remedy = "no such adapter", "plug it in, or check its name"
    elif code == errno.ENETDOWN:
        why = "the interface is down"
        remedy = f"sudo ip link set {url.channel} up type can bitrate {url.bitrate}"
    elif code == errno.ENOBUFS or isinstance(error, AdapterBlocked):
        why = "nobody acknowledges: the send buffer is full"
        remedy = "check wiring, termination and bit rate; at least one other node must be on"
    elif code == errno.EAFNOSUPPORT or "AF_CAN" in text:
        why = "this system's kernel has no SocketCAN"
        remedy = "use an adapter with slcan firmware, or a kernel with CAN support"
    elif isinstance(error, (can.CanInterfaceNotImplementedError, ImportError, NameError)):
        why = f"its driver is not installed ({text})"
        remedy = "install the adapter maker's driver, or use socketcan on Linux"
    elif isinstance(error, AdapterLost):
        why = text
        remedy = "check its USB cable and plug it in again; it is opened by itself when it is back"
    else:
        why, remedy = text or type(error).__name__, "unplug it, plug it in, and check the wiring"
    return LinkLost("canopen.adapter", drive=url.url, remedy=remedy, name=name, why=why)


def _errno(error: BaseException | None) -> int | None:
    """Return the system's error number from anywhere in the chain: python-can wraps it."""
    while error is not None:
        for value in (getattr(error, "errno", None), getattr(error, "error_code", None)):
            if isinstance(value, int):
                return value
        error = error.__cause__ or error.__context__
    return None


def _path_is_missing(url: CanUrl) -> bool:
    return url.channel.startswith("/dev/") and not Path(url.channel).exists()
