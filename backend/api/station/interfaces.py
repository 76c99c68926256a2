"""Interfaces of this machine through which drives can be connected."""

from __future__ import annotations

from collections.abc import Sequence

from serial.tools import list_ports

from backend.api.messages.errors import message_or_none, words_of
from backend.api.station.models import Interfaces, NetworkInterface, SerialPort
from drivers.computer.network.interfaces import Interface, network_interfaces
from drivers.computer.serial_ports.terminals import may_open
from drivers.texts.message import text


def list_interfaces(virtual: Sequence[str]) -> Interfaces:
    """Serial, network and CAN adapters, with the reason if one is not usable."""
    found = network_interfaces()
    return Interfaces(
        serial=[
            _serial(port.device, port.description)
            for port in sorted(list_ports.comports(), key=lambda p: p.device)
            # Onboard ports without hardware behind them report "n/a" on Linux.
            if port.description != "n/a" or port.hwid != "n/a"
        ],
        network=[_network(one) for one in found if one.is_wired],
        can=[f"canopen://socketcan/{one.name}" for one in found if one.is_can],
        virtual=list(virtual),
    )


def _serial(path: str, description: str) -> SerialPort:
    usable = may_open(path)
    problem = None if usable else text("api-station.no-permission-for-port")
    return SerialPort(
        path=path,
        description=description,
        url=f"mlink://{path}",
        usable=usable,
        problem=words_of(problem),
        problem_message=message_or_none(problem),
    )


def _network(one: Interface) -> NetworkInterface:
    problem = None if one.up else text("api-station.interface-down")
    return NetworkInterface(
        name=one.title or one.name,
        up=one.up,
        url=f"ethercat://{one.name}",
        usable=one.up,
        problem=words_of(problem),
        problem_message=message_or_none(problem),
    )
