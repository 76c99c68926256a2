"""The recorder of an EtherCAT segment: ``python -m drivers.flight.process IFACE --control FD``.

The kernel copies every EtherCAT frame of the interface, sent and received, with its time in
nanoseconds; this process only collects the copies. It runs next to the host process at low
priority and looks every 10 ms: a process that waits for each frame would be woken from within the
host's cycle, which costs the cycle some microseconds. It first writes `READY`. Lines of JSON come
on the control socket: ``{"note": TEXT, "station": N, "time_ns": T}`` and ``{"file": true,
"station": N}``; the answer to the latter is a length of 8 bytes, little endian, and the pcapng
file.
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

from drivers.computer.processes import yield_processor
from drivers.computer.signals import ignore_interrupt
from drivers.computer.sockets import AF_PACKET, receive_with_notes
from drivers.flight.kinds import ethercat_ring
from drivers.flight.ring import FrameRing

_ALL, _NICE = 0x0003, 10
_TIMESTAMP_NS, _RECEIVE_BUFFER = 35, 8 << 20
READY = b"ready\n"
_OUTGOING = 4
"""sll_pkttype of packet(7): sent by this computer."""
_AGAIN_S, _BATCH, _LONGEST = 1.0, 256, 1600
_LOOK_S = 0.01
"""At 4000 cycles/s of the longest frames 80 frames wait meanwhile, less than 200 kB."""


class Recorder:
    """Frames in, files out. ``control`` ends it when it closes."""

    def __init__(self, interface: str, control: socket.socket) -> None:
        self._interface = interface
        self._control = control
        self._ring: FrameRing = ethercat_ring(interface)
        self._line = b""
        self._wire: socket.socket | None = None
        self._sending = threading.Lock()

    def run(self) -> None:
        """Until the control socket closes. Says `READY` once the wire is being listened to."""
        self._wire, retry_s = open_wire(self._interface), time.monotonic() + _AGAIN_S
        with contextlib.suppress(OSError):
            self._control.sendall(READY)
        # Only now: a busy computer would keep the first frames of a bus from being recorded.
        yield_processor(_NICE)
        behind = False
        while True:
            now = time.monotonic()
            if self._wire is None and now >= retry_s:
                self._wire, retry_s = open_wire(self._interface), now + _AGAIN_S
            wait_s = _AGAIN_S if self._wire is None else _LOOK_S
            ready, _, _ = select.select([self._control], (), (), 0.0 if behind else wait_s)
            # Before the commands: a file has the frames up to its request.
            behind = self._wire is not None and self._take()
            if ready and not self._commands():
                return

    def _take(self) -> bool:
        """Collect what has come; whether there may be more."""
        assert self._wire is not None
        for _ in range(_BATCH):
            try:
                data, notes, _, address = receive_with_notes(self._wire, _LONGEST, 64)
            except BlockingIOError:
                return False
            except OSError:
                # The interface went down or away; it is opened again.
                self._wire.close()
                self._wire = None
                return False
            if data[12:14] == b"\x88\xa4":
                kind = address[2] if isinstance(address, tuple) else 0
                self._ring.put(_time_ns(notes), kind == _OUTGOING, data)
        return True

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
                # The file is made and sent while frames go on being taken.
                threading.Thread(target=self._send, args=(request["station"],)).start()
        return True

    def _send(self, station: int | None) -> None:
        data = self._ring.file(station)
        with self._sending, contextlib.suppress(OSError):
            self._control.sendall(struct.pack("<Q", len(data)) + data)


def open_wire(interface: str) -> socket.socket | None:
    """A socket that gets copies of all frames of the interface; None where it cannot be had."""
    try:
        wire = socket.socket(AF_PACKET, socket.SOCK_RAW, 0)
    except OSError:
        return None
    try:
        with contextlib.suppress(OSError):
            wire.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
        wire.setsockopt(socket.SOL_SOCKET, _TIMESTAMP_NS, 1)
        # Frames that this computer sends come only to sockets of all protocols.
        wire.bind((interface, _ALL))
        wire.setblocking(False)
    except OSError:
        wire.close()
        return None
    return wire


def _time_ns(notes: list[tuple[int, int, bytes]]) -> int:
    for level, kind, data in notes:
        if level == socket.SOL_SOCKET and kind == _TIMESTAMP_NS and len(data) >= 16:
            seconds, nanoseconds = struct.unpack_from("qq", data)
            return int(seconds * 1_000_000_000 + nanoseconds)
    return time.time_ns()


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
