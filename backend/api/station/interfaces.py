"""What this machine can connect through."""

from __future__ import annotations

import os
import socket
from collections.abc import Sequence
from pathlib import Path

from serial.tools import list_ports

from backend.api.station.models import Interfaces, NetworkInterface, SerialPort

_NET = Path("/sys/class/net")


def list_interfaces(virtual: Sequence[str]) -> Interfaces:
    """Serial adapters, network interfaces and CAN adapters, with what keeps them from use."""
    return Interfaces(
        serial=[
            _serial(port.device, port.description)
            for port in sorted(list_ports.comports(), key=lambda p: p.device)
            # Onboard ports without hardware behind them report "n/a" on Linux.
            if port.description != "n/a" or port.hwid != "n/a"
        ],
        network=[_network(name) for _, name in socket.if_nameindex() if _is_wired(name)],
        can=[f"canopen://socketcan/{name}" for _, name in socket.if_nameindex() if _is_can(name)],
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


def _type(name: str) -> int:
    try:
        return int((_NET / name / "type").read_text())
    except (OSError, ValueError):
        return -1


def _is_can(name: str) -> bool:
    return _type(name) == 280  # ARPHRD_CAN


def _is_wired(name: str) -> bool:
    return _type(name) == 1 and not (_NET / name / "wireless").exists()  # ARPHRD_ETHER


def _network(name: str) -> NetworkInterface:
    try:
        up = (_NET / name / "operstate").read_text().strip() != "down"
    except OSError:
        up = False
    problem = "" if up else "no cable, or the interface is down"
    return NetworkInterface(name=name, up=up, url=f"ethercat://{name}", usable=up, problem=problem)
