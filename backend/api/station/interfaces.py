"""What this machine can connect through."""

from __future__ import annotations

import os
from collections.abc import Sequence

from serial.tools import list_ports

from backend.api.station.models import Interfaces, NetworkInterface, SerialPort
from drivers.computer.interfaces import Interface, network_interfaces


def list_interfaces(virtual: Sequence[str]) -> Interfaces:
    """Serial adapters, network interfaces and CAN adapters, with what keeps them from use."""
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
    usable = os.access(path, os.R_OK | os.W_OK)
    problem = "" if usable else "no permission: add yourself to the group dialout and log in again"
    return SerialPort(
        path=path,
        description=description,
        url=f"mlink://{path}",
        usable=usable,
        problem=problem,
    )


def _network(one: Interface) -> NetworkInterface:
    problem = "" if one.up else "no cable, or the interface is down"
    return NetworkInterface(
        name=one.name, up=one.up, url=f"ethercat://{one.name}", usable=one.up, problem=problem
    )
