"""The drives of a segment: from a bench file or by name on the command line."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from pathlib import Path

from drivers.errors import NotAllowed
from drivers.texts.message import Unsuitable, text
from drivers.virtual.bench import AxisSpec, load_bench
from drivers.virtual.device import Device
from drivers.virtual.firmware.motion.gantry import VirtualGantry
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics.spec import MechanicsSpec
from drivers.virtual.wires.ethercat.slave import Slave

DeviceFactory = Callable[[str, MechanicsSpec, Path | None, int], Device]
"""Makes a device from drive family, mechanics, folder of the NVM files and station."""


def axes_of_bench(path: Path, url: str | None) -> list[AxisSpec]:
    """Return the EtherCAT axes of a bench file in cable order.

    ``url`` selects one bus; without it the file must have exactly one EtherCAT bus.

    Raises:
        NotAllowed: invalid file, unknown bus, or stations other than 1…N.
    """
    bench = load_bench(path)
    urls = bench.urls("ethercat")
    if url is None:
        if len(urls) != 1:
            raise NotAllowed("virtual.bench-file-ethercat-buses", value=len(urls), path=str(path))
        url = urls[0]
    found = sorted(bench.on(url), key=lambda pair: pair[1])
    if not found:
        raise NotAllowed("virtual.bench-file-no-drive", value=url, path=str(path))
    stations = [station for _, station in found]
    if stations != list(range(1, len(found) + 1)):
        raise NotAllowed(
            "virtual.bench-file-ethercat-stations",
            value=stations,
            path=str(path),
            found_count=len(found),
            stations=", ".join(map(str, stations)),
        )
    return [axis for axis, _ in found]


def couple(path: Path, axes: Sequence[AxisSpec], devices: Sequence[Device]) -> None:
    """Connect the gantry axes of the bench file to their beams, before any drive has run.

    Raises:
        NotAllowed: invalid file.
        ValueError: devices of another factory, which have no shaft for a beam.
    """
    by_name = {axis.name: device for axis, device in zip(axes, devices, strict=True)}
    for gantry in load_bench(path).gantry:
        first, second = (by_name.get(name) for name in gantry.axes)
        if first is None or second is None:
            continue  # a beam of another segment
        if not isinstance(first, VirtualServo) or not isinstance(second, VirtualServo):
            raise Unsuitable(text("mechanics.gantry-of-servos"))
        VirtualGantry(gantry, first, second)


def axes_by_name(drives: Sequence[str], first: int) -> list[AxisSpec]:
    """Return drives with the standard mechanics, the first at station ``first``."""
    return [
        AxisSpec(name=f"axis {station}", drive=drive, on="ethercat://virtual0", station=station)
        for station, drive in enumerate(drives, first)
    ]


def load_factory(spec: str) -> DeviceFactory:
    """Return the device factory for ``module:function``."""
    module, _, name = spec.partition(":")
    factory: DeviceFactory = getattr(importlib.import_module(module), name)
    return factory


def load_slave(spec: str) -> type[Slave]:
    """Return the slave class for ``module:class``."""
    module, _, name = spec.partition(":")
    found: type[Slave] = getattr(importlib.import_module(module), name)
    return found
