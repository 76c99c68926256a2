"""Run a virtual segment: ``python -m drivers.virtual.wires.ethercat --iface ec0s --bench FILE``.

Standard input and output are the control channel (see `control`); closing the input ends it.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from drivers.computer.timing import scheduling
from drivers.errors import DriveError
from drivers.virtual.device import Device
from drivers.virtual.firmware.factory import number_device
from drivers.virtual.wires.ethercat.bench import (
    axes_by_name,
    axes_of_bench,
    couple,
    load_factory,
    load_slave,
)
from drivers.virtual.wires.ethercat.clock import LockstepClock, RealClock, SteadyClock, WireClock
from drivers.virtual.wires.ethercat.segment import Segment
from drivers.virtual.wires.ethercat.server import SegmentServer
from drivers.virtual.wires.ethercat.slave import MAILBOXES, SlaveIdentity
from profiles.loader import ProfileError

_FACTORY = "drivers.virtual.firmware.factory:make_device"
_SLAVE = "drivers.virtual.wires.ethercat.slave:Slave"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m drivers.virtual.wires.ethercat")
    parser.add_argument("--iface", required=True, help="interface that the segment answers on")
    parser.add_argument("--bench", type=Path, help="bench file (TOML)")
    parser.add_argument("--on", help="bus URL of the bench file that this segment is")
    parser.add_argument("--drive", action="append", default=[], help="a drive family, in order")
    parser.add_argument("--nvm", type=Path, help="folder for the drives' memory; kept if given")
    parser.add_argument("--factory", default=_FACTORY, help="module:function that makes devices")
    parser.add_argument("--slave", default=_SLAVE, help="module:class of the slaves")
    parser.add_argument("--lockstep", action="store_true", help="time follows the frames")
    parser.add_argument(
        "--steady", action="store_true", help="time follows process data while they flow"
    )
    parser.add_argument("--cycle-us", type=int, default=1000, help="lockstep cycle without DC")
    parser.add_argument("--al-ms", type=float, default=2.0, help="time of a state change")
    parser.add_argument("--sdo-ms", type=float, default=1.0, help="answer time of the mailbox")
    parser.add_argument("--eeprom-us", type=float, default=50.0, help="read time of the EEPROM")
    parser.add_argument(
        "--mailboxes",
        type=int,
        nargs=2,
        default=MAILBOXES,
        metavar=("OUT", "IN"),
        help="bytes of the mailboxes to and from the drives",
    )
    parser.add_argument("--seed", type=int, default=1, help="of random trouble")
    parser.add_argument("--realtime", type=int, default=0, help="SCHED_FIFO priority, if allowed")
    return parser


def _go_realtime(priority: int) -> None:
    if priority and scheduling.real_time(priority):
        return
    # Drives must answer at once, whatever the load of this computer.
    scheduling.short_slice()
    if priority:
        sys.stderr.write("SCHED_FIFO is not permitted here; running with normal priority\n")


def _warm_up(device: Device) -> None:
    """Run the drive for two milliseconds, so that its physics are compiled before use."""
    device.advance(0)
    device.advance(2_000_000)


def build(arguments: argparse.Namespace) -> Segment:
    """Return a segment with the devices of the command line."""
    axes = axes_of_bench(arguments.bench, arguments.on) if arguments.bench else []
    axes += axes_by_name(arguments.drive, len(axes) + 1)
    if not axes:
        raise ValueError("no drives: give --drive or a --bench file with EtherCAT axes")
    factory = load_factory(arguments.factory)
    devices = [
        factory(axis.drive, axis.mechanics, arguments.nvm, station)
        for station, axis in enumerate(axes, 1)
    ]
    if arguments.bench:
        couple(arguments.bench, axes, devices)
    for axis, device in zip(axes, devices, strict=True):
        number_device(device, axis.serial_number)
        _warm_up(device)
    clock: WireClock = SteadyClock() if arguments.steady else RealClock()
    if arguments.lockstep:
        clock = LockstepClock(arguments.cycle_us * 1000)
    mailboxes = (arguments.mailboxes[0], arguments.mailboxes[1])
    if not all(16 <= size <= most for size, most in zip(mailboxes, MAILBOXES, strict=True)):
        raise ValueError(f"--mailboxes: {mailboxes} are not of 16 to {MAILBOXES[0]} bytes")
    slave_type = load_slave(arguments.slave)
    slaves = [
        slave_type(device, clock, SlaveIdentity(serial=axis.serial or station), mailboxes)
        for station, (device, axis) in enumerate(zip(devices, axes, strict=True), 1)
    ]
    for slave in slaves:
        slave.al.delay_ns = int(arguments.al_ms * 1e6)
        slave.mailbox.delay_ns = int(arguments.sdo_ms * 1e6)
        slave.controller.eeprom.read_ns = int(arguments.eeprom_us * 1e3)
        slave.controller.eeprom.write_ns = 5_000_000
    return Segment(slaves, clock, arguments.seed)


def main(argv: list[str] | None = None) -> int:
    """Run the segment; return the exit status."""
    arguments = _parser().parse_args(argv)
    try:
        segment = build(arguments)
        server = SegmentServer(arguments.iface, segment, sys.stdin.buffer, sys.stdout.buffer)
    except (DriveError, ValueError, OSError, ImportError, ProfileError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    _go_realtime(arguments.realtime)
    scheduling.spare_collector()
    try:
        server.run()
    except KeyboardInterrupt:
        return 0
    finally:
        server.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
