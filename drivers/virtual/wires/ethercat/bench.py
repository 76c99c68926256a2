"""Which drives hang on the segment: from a bench file (TOML) or from names on the command line."""

from __future__ import annotations

import importlib
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drivers.virtual.device import Device
from profiles.loader import load_profile
from profiles.schema import Profile

DeviceFactory = Callable[[Profile | None, Mapping[str, Any] | None], Device]


@dataclass(frozen=True, slots=True)
class BenchAxis:
    """One drive: its family, its place in the line (from 1) and its mechanics table."""

    name: str
    drive: str
    station: int
    mechanics: Mapping[str, Any] | None = None
    serial: int = 0
    extra: Mapping[str, Any] = field(default_factory=dict)


def load_bench(path: Path, url: str | None = None) -> list[BenchAxis]:
    """EtherCAT axes of a bench file in the order of their stations.

    ``url`` selects one bus of the file; without it every EtherCAT axis belongs to the segment.

    Raises:
        ValueError: broken TOML, a missing field, or stations that are not 1…N.
    """
    try:
        content = tomllib.loads(path.read_text("utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{path}: {error}") from error
    axes: list[BenchAxis] = []
    for number, table in enumerate(content.get("axis", []), 1):
        bus = str(table.get("on", ""))
        if bus != url if url is not None else not bus.startswith("ethercat://"):
            continue
        if "drive" not in table:
            raise ValueError(f"{path}: axis {number} has no 'drive'")
        mechanics = table.get("mechanics")
        if isinstance(mechanics, str):
            mechanics = tomllib.loads((path.parent / mechanics).read_text("utf-8"))
        axes.append(
            BenchAxis(
                name=str(table.get("name", f"axis {number}")),
                drive=str(table["drive"]),
                station=int(table.get("station", len(axes) + 1)),
                mechanics=mechanics,
                serial=int(table.get("serial", number)),
            )
        )
    axes.sort(key=lambda axis: axis.station)
    stations = [axis.station for axis in axes]
    if stations != list(range(1, len(axes) + 1)):
        raise ValueError(
            f"{path}: EtherCAT stations are places in the line and must be 1…{len(axes)}, "
            f"not {stations}"
        )
    return axes


def load_factory(spec: str) -> DeviceFactory:
    """``module:function`` to the function that makes a device."""
    module, _, name = spec.partition(":")
    found = getattr(importlib.import_module(module), name or "make_device")
    if not callable(found):
        raise TypeError(f"{spec} is not a function")
    factory: DeviceFactory = found
    return factory


def make_devices(axes: list[BenchAxis], factory: DeviceFactory) -> list[Device]:
    """One device per axis. Axes of the drive ``none`` get no profile: the factory has its own."""
    return [
        factory(None if axis.drive == "none" else load_profile(axis.drive), axis.mechanics)
        for axis in axes
    ]
