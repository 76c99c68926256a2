"""Opening a CAN adapter by its URL, with errors of python-can translated to `LinkLost`."""

from __future__ import annotations

import errno
from pathlib import Path

import can
import serial

from drivers.adapters import require_channel, serial_device
from drivers.canopen.adapters.slcan import AdapterBlocked, AdapterLost, SlcanBus
from drivers.canopen.url import CanUrl
from drivers.computer.serial_ports.terminals import deliver_soon, port_errno
from drivers.errors import DriveError, LinkLost
from drivers.texts.message import Text, text

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
        bus = SlcanBus(
            serial_device(url.channel),
            tty_baudrate=url.tty_baudrate or 115200,
            bitrate=url.bitrate,
            sleep_after_open=url.settle_s,
        )
        deliver_soon(bus.serialPortOrig)
        return bus
    if url.interface == "udp_multicast":
        if url.port is not None:
            return can.Bus(interface="udp_multicast", channel=url.channel, fd=False, port=url.port)
        return can.Bus(interface="udp_multicast", channel=url.channel, fd=False)
    if url.interface == "virtual":
        return can.Bus(interface="virtual", channel=url.channel)
    return can.Bus(interface=url.interface, channel=url.channel, bitrate=url.bitrate)


def translate(url: CanUrl, error: BaseException) -> LinkLost:
    """Translate the adapter's error to LinkLost, with a remedy."""
    why = _why(url, error)
    name = f"{url.interface} {url.channel}"
    return LinkLost("canopen.adapter", drive=url.url, remedy=why.remedy(), name=name, why=why)


def _why(url: CanUrl, error: BaseException) -> Text:
    code, words = _errno(error), str(error)
    if code in (errno.EACCES, errno.EPERM):
        return text("canopen.adapter-no-permission", channel=url.channel)
    if code == errno.EBUSY:
        return text("canopen.adapter-in-use")
    if code in (errno.ENOENT, errno.ENODEV, errno.ENXIO) or _path_is_missing(url):
        return text("canopen.adapter-missing")
    if code == errno.ENETDOWN:
        return text("canopen.adapter-down", channel=url.channel, bitrate=url.bitrate)
    if code == errno.ENOBUFS or isinstance(error, AdapterBlocked):
        return text("canopen.adapter-no-acknowledge")
    if code == errno.EAFNOSUPPORT or "AF_CAN" in words:
        return text("canopen.adapter-no-socketcan")
    if isinstance(error, (can.CanInterfaceNotImplementedError, ImportError, NameError)):
        return text("canopen.adapter-no-driver", cause=words)
    if isinstance(error, AdapterLost):
        return text("canopen.adapter-lost", cause=words)
    return text("canopen.adapter-failed", cause=words or type(error).__name__)


def _errno(error: BaseException | None) -> int | None:
    """Return the system's error number from anywhere in the chain: python-can wraps it."""
    while error is not None:
        for value in (getattr(error, "errno", None), getattr(error, "error_code", None)):
            if isinstance(value, int):
                return value
        if isinstance(error, serial.SerialException) and (number := port_errno(error)):
            return number
        error = error.__cause__ or error.__context__
    return None


def _path_is_missing(url: CanUrl) -> bool:
    return url.channel.startswith("/dev/") and not Path(url.channel).exists()
