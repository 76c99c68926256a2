"""Virtual drives on serial and CAN wires, in a process of their own.

::

    python -m drivers.virtual.host --bench FILE --folder DIR [--nvm DIR]

It creates the wires under ``DIR``, prints one JSON line ``{"ready": true, "wires": {URL: URL}}``
(the bench's URL to the real one), then reads one JSON command per line and answers each: ``pull``,
``heal`` (a wire), ``power_cycle``, ``inject`` (an axis), ``mute``, ``stop``. It ends when its
standard input closes, so it never outlives its parent.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from drivers.computer.timing import scheduling
from drivers.errors import DriveError, why_of
from drivers.texts.message import Text
from drivers.texts.profile_errors import profile_error_text
from drivers.urls import parse_url
from drivers.virtual.bench import AxisSpec, BenchSpec, load_bench
from drivers.virtual.device import Device, SdoAbort, shaft_rev
from drivers.virtual.firmware.factory import make_device, number_device
from drivers.virtual.shared import SharedDevice
from drivers.virtual.wires.can_wire import CanWire
from drivers.virtual.wires.canopen import CanopenNode
from drivers.virtual.wires.modbus import ModbusSlave, ObjectRegisters, Registers, TableRegisters
from drivers.virtual.wires.pty import PtyWire, WireTime
from drivers.virtual.wires.slcan import SlcanSide
from profiles.loader import ProfileError


class Cable(Protocol):
    """Something that can be unplugged and plugged in again."""

    def pull(self) -> None:
        """Unplug it."""

    def heal(self) -> None:
        """Plug it in again."""


class CanCable:
    """A CAN adapter as a cable."""

    def __init__(self, side: SlcanSide) -> None:
        self._side = side

    def pull(self) -> None:
        """Unplug the adapter."""
        self._side.unplug()

    def heal(self) -> None:
        """Plug it in again."""
        self._side.plug()


class Wires:
    """The running wires of a bench (without EtherCAT, which has its own process)."""

    def __init__(self, bench: BenchSpec, folder: Path, nvm: Path | None) -> None:
        self.devices: dict[str, Device] = {}
        self.real_urls: dict[str, str] = {}
        self._slaves: dict[str, ModbusSlave] = {}
        self._can_wires: dict[str, tuple[CanWire, SlcanSide]] = {}
        self._lock = threading.RLock()
        self._bench = bench
        self._folder = folder
        self._nvm = nvm

    def start(self) -> None:
        """Create the devices and their wires.

        Raises:
            DriveError: a wire cannot be created.
        """
        for scheme in ("mlink", "modbus"):
            for number, url in enumerate(self._bench.urls(scheme)):
                self._start_serial(scheme, url, number)
        for number, url in enumerate(self._bench.urls("canopen")):
            self._start_can(url, number)

    def stop(self) -> None:
        """Stop all wires."""
        for slave in self._slaves.values():
            slave.stop()
        for wire, _ in self._can_wires.values():
            wire.stop()

    def _device(self, axis: AxisSpec, station: int) -> Device:
        device = self.devices.get(axis.name)
        if device is None:
            # Drives of different buses may have the same station and must not share a memory.
            nvm = None if self._nvm is None else self._nvm / re.sub(r"\W+", "-", axis.on)
            if nvm is not None:
                nvm.mkdir(parents=True, exist_ok=True)
            real = make_device(axis.drive, axis.mechanics, nvm, station)
            number_device(real, axis.serial_number)
            device = SharedDevice(real, self._lock)
            # Compiles the physics on a machine's first start, before the drive is accessed.
            now_ns = time.monotonic_ns()
            device.advance(now_ns)
            device.advance(now_ns + 10_000_000)
            self.devices[axis.name] = device
        return device

    def _start_serial(self, scheme: str, url: str, number: int) -> None:
        parsed = parse_url(url)
        path = self._folder / f"{scheme}{number}" if parsed.is_virtual else Path(parsed.place)
        options = dict(parsed.options)
        wire_time = None
        if (rate := options.get("wire_baudrate")) is not None:
            wire_time = WireTime(int(rate))
        stations: dict[int, tuple[Device, Registers]] = {}
        for axis, station in self._bench.on(url):
            device = self._device(axis, station)
            registers: Registers = (
                ObjectRegisters(device) if scheme == "mlink" else TableRegisters(device)
            )
            stations[station] = (device, registers)
        slave = ModbusSlave(PtyWire(path, wire_time), stations, lock=self._lock)
        slave.start()
        self._slaves[url] = slave
        # A pty refuses parity (EINVAL), so the URL passed on requests none.
        self.real_urls[url] = f"{scheme}://{path}?parity=N"

    def _start_can(self, url: str, number: int) -> None:
        parsed = parse_url(url)
        place = parsed.place.removeprefix("slcan/")
        path = self._folder / f"can{number}" if parsed.is_virtual else Path(place)
        options = dict(parsed.options)
        bitrate = int(options.get("bitrate", "1000000"))
        wire_bitrate = int(options["wire_bitrate"]) if "wire_bitrate" in options else None
        nodes = [
            CanopenNode(self._device(axis, station), station, time.monotonic_ns)
            for axis, station in self._bench.on(url)
        ]
        side = SlcanSide(path)
        wire = CanWire(side, nodes, wire_bitrate)
        wire.start()
        self._can_wires[url] = (wire, side)
        self.real_urls[url] = f"canopen://slcan/{path}?bitrate={bitrate}"

    # --- failures ---------------------------------------------------------------------

    def carry_out(self, command: dict[str, object]) -> object:
        """Execute one command of the control channel.

        Raises:
            ValueError: no such command, wire or axis.
        """
        actions: dict[str, Callable[[dict[str, object]], object]] = {
            "pull": lambda c: self._cable(c).pull(),
            "heal": lambda c: self._cable(c).heal(),
            "mute": self._mute,
            "swap": self._swap,
            "power_cycle": self._power_cycle,
            "inject": self._inject,
            "read": self._read,
            "shaft": self._shaft,
        }
        action = actions.get(str(command.get("do")))
        if action is None:
            raise ValueError(f"no command {command.get('do')!r}; there are {', '.join(actions)}")
        return action(command)

    def _cable(self, command: dict[str, object]) -> Cable:
        found = self._can_wires.get(str(command.get("wire")))
        return CanCable(found[1]) if found is not None else self._slave(command).wire

    def _slave(self, command: dict[str, object]) -> ModbusSlave:
        slave = self._slaves.get(str(command.get("wire")))
        if slave is None:
            raise ValueError(f"no wire {command.get('wire')!r}; there are {list(self._slaves)}")
        return slave

    def _axis(self, command: dict[str, object]) -> Device:
        device = self.devices.get(str(command.get("axis")))
        if device is None:
            raise ValueError(f"no axis {command.get('axis')!r}; there are {list(self.devices)}")
        return device

    def _mute(self, command: dict[str, object]) -> None:
        """Mute all drives of a wire, or the one at ``station``."""
        on, station = bool(command.get("on", True)), command.get("station")
        can_wire = self._can_wires.get(str(command.get("wire")))
        if can_wire is not None:
            for node in can_wire[0].nodes:
                if station in (None, node.node_id):
                    node.mute = on
            return
        slave = self._slave(command)
        if station is None:
            slave.mute = on
        elif on:
            slave.mute_stations.add(int(str(station)))
        else:
            slave.mute_stations.discard(int(str(station)))

    def _swap(self, command: dict[str, object]) -> None:
        """Exchange two drives on their wire."""
        slave = self._slave(command)
        first, second = int(str(command["first"])), int(str(command["second"]))
        with self._lock:
            stations = slave.stations
            stations[first], stations[second] = stations[second], stations[first]

    def _power_cycle(self, command: dict[str, object]) -> None:
        with self._lock:
            self._axis(command).power_cycle(float(str(command.get("off_s", 0.0))))

    def _inject(self, command: dict[str, object]) -> None:
        with self._lock:
            value = float(str(command.get("value", 1.0)))
            self._axis(command).inject(str(command.get("what")), value)

    def _read(self, command: dict[str, object]) -> str:
        """Return the drive's own present value, bypassing the wire."""
        with self._lock:
            index, subindex = int(str(command["index"])), int(str(command["subindex"]))
            device = self._axis(command)
            device.advance(time.monotonic_ns())
            return device.read(index, subindex).hex()

    def _shaft(self, command: dict[str, object]) -> float:
        """Return the shaft's angle in revolutions, independent of wires and units."""
        with self._lock:
            device = self._axis(command)
            device.advance(time.monotonic_ns())
            return shaft_rev(device)


def _why(error: Exception) -> Text:
    return profile_error_text(error) if isinstance(error, ProfileError) else why_of(error)


def main(argv: list[str] | None = None) -> int:
    """Run until standard input closes."""
    parser = argparse.ArgumentParser(prog="python -m drivers.virtual.host")
    parser.add_argument("--bench", type=Path, required=True)
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--nvm", type=Path)
    options = parser.parse_args(argv)
    scheduling.virtual_priority()
    try:
        wires = Wires(load_bench(options.bench), options.folder, options.nvm)
        wires.start()
    except (DriveError, ProfileError, ValueError, OSError) as error:
        _answer({"ready": False, "error": _why(error).to_wire()})
        return 1
    _answer({"ready": True, "wires": wires.real_urls})
    try:
        for line in sys.stdin:
            try:
                _answer({"ok": True, "result": wires.carry_out(json.loads(line))})
            except (ValueError, KeyError, SdoAbort) as error:
                _answer({"ok": False, "error": _why(error).to_wire()})
    except KeyboardInterrupt:
        pass
    finally:
        wires.stop()
    return 0


def _answer(message: dict[str, object]) -> None:
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    raise SystemExit(main())
