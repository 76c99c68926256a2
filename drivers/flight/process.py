"""The recorder of an EtherCAT segment: ``python -m drivers.flight.process IFACE --control FD``.

The kernel copies every EtherCAT frame of the interface, sent and received, with its time in
nanoseconds; this process only collects the copies. It runs next to the host process at low priority
and polls ten times a second: a process that waits for each frame would be woken within the host's
cycle, which costs the cycle some microseconds. It first writes `READY`. Lines of JSON come on the
control socket: ``{"note": TEXT, "station": N, "time_ns": T}`` and ``{"file": true, "station": N}``;
the answer to the latter is a length of 8 bytes, little endian, and the pcapng file.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import select
import socket
import struct
import sys
import threading
import time

from drivers.computer.network.packet_ring import CLOSED_S, PacketRing
from drivers.computer.processes import yield_processor
from drivers.computer.signals import ignore_interrupt
from drivers.flight.capture import frames_of_block
from drivers.flight.kinds import ethercat_ring

_NICE = 10
READY = b"ready\n"
_AGAIN_S, _LOOK_S = 1.0, 0.1


class Recorder:
    """Collects frames and sends files. The process ends when ``control`` closes."""

    def __init__(self, interface: str, control: socket.socket) -> None:
        self._interface = interface
        self._control = control
        self._ring = ethercat_ring(interface, frames_of_block)
        self._line = b""
        self._wire: PacketRing | None = None
        self._sending = threading.Lock()

    def run(self) -> None:
        """Run until the control socket closes. Sends `READY` once the wire is being recorded."""
        self._wire, retry_s = open_wire(self._interface), time.monotonic() + _AGAIN_S
        with contextlib.suppress(OSError):
            self._control.sendall(READY)
        # Not earlier: on a busy computer, low priority would delay the recording of the first
        # frames.
        yield_processor(_NICE)
        while True:
            now = time.monotonic()
            if self._wire is None and now >= retry_s:
                self._wire, retry_s = open_wire(self._interface), now + _AGAIN_S
            wait_s = _AGAIN_S if self._wire is None else _LOOK_S
            ready, _, _ = select.select([self._control], (), (), wait_s)
            self._take()
            if ready and not self._commands():
                return

    def _take(self) -> None:
        """Collect the blocks that the kernel has closed."""
        if self._wire is None:
            return
        self._keep(self._wire)
        try:
            lost = self._wire.lost()
        except OSError:
            # The interface went down or away; it is opened again. Its last frames are kept.
            time.sleep(2 * CLOSED_S)
            self._keep(self._wire)
            self._wire.close()
            self._wire = None
            return
        if lost:
            self._ring.note(f"{lost} frames before this one were not recorded: computer busy")

    def _keep(self, wire: PacketRing) -> None:
        for last_ns, frames, block in wire.take():
            self._ring.put_packed(last_ns, frames, block)

    def _commands(self) -> bool:
        data = self._control.recv(1 << 16)
        if not data:
            return False
        *lines, self._line = (self._line + data).split(b"\n")
        for line in lines:
            request = json.loads(line)
            if "note" in request:
                self._ring.note(request["note"], request["station"], request["time_ns"])
            else:
                # A file contains the frames up to its request: wait until the block open at that
                # time is closed.
                time.sleep(2 * CLOSED_S)
                self._take()
                # The file is created and sent while recording continues.
                threading.Thread(target=self._send, args=(request["station"],)).start()
        return True

    def _send(self, station: int | None) -> None:
        data = self._ring.file(station)
        with self._sending, contextlib.suppress(OSError):
            self._control.sendall(struct.pack("<Q", len(data)) + data)


def open_wire(interface: str) -> PacketRing | None:
    """Open the recording of the interface; None if that is not possible."""
    try:
        return PacketRing(interface)
    except OSError:
        return None


def main(argv: list[str] | None = None) -> int:
    """Entry point of the process."""
    parser = argparse.ArgumentParser(description="flight recorder of an EtherCAT segment")
    parser.add_argument("interface")
    parser.add_argument("--control", type=int, required=True, help="descriptor of the socket")
    options = parser.parse_args(argv)
    ignore_interrupt()
    Recorder(options.interface, socket.socket(fileno=options.control)).run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
