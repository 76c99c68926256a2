"""The process that owns one EtherCAT segment: `python -m drivers.ethercat.process.host IFACE …`.

One thread does everything on the wire. While process data are exchanged it follows the grid and
uses the rest of each cycle for mailbox frames and commands; otherwise it works through transactions
as fast as the slaves answer. The server may kill it at any time: pysoem holds the interpreter lock
in many calls, and in a separate process only that process hangs with it.

It ends by itself when the server's end of the channel closes, after braking the axes. Should even
that hang, the slaves' watchdogs stop the axes and an alarm ends the process.
"""

from __future__ import annotations

import argparse
import contextlib
import socket
import struct
import sys
import time
from collections import deque
from pathlib import Path

from drivers.computer import signals
from drivers.computer.processes import end_within
from drivers.computer.timing import realtime
from drivers.errors import DriveError, LinkLost, ProtocolError
from drivers.ethercat.exchange.ring import Ring
from drivers.ethercat.process import protocol
from drivers.ethercat.process.channel import HostEnd, PipeHostEnd, SocketHostEnd
from drivers.ethercat.process.operations import Operations
from drivers.ethercat.process.protocol import Message
from drivers.halt import HaltCause, Halted
from drivers.texts.message import text

_LAST_WORDS_S = 5
_STATUS_S = 0.2
_PATIENT_FRAME_US = 30_000
_SERVER_SILENT_S = 3.0
_SILENT = Halted(
    HaltCause.LOST,
    note=text("ethercat.server-silent-axis-braked", server_silent_s=_SERVER_SILENT_S),
)


class Host:
    """Receives commands, sends replies and events, and runs the loop, which waits for neither."""

    def __init__(
        self, interface: str, control: HostEnd, ring: Ring, *, raw_frames: bool = True
    ) -> None:
        """``raw_frames``: registers by frames of our own, else by SOEM's calls."""
        self._control = control
        self._unpacker = protocol.Unpacker()
        self._outgoing = bytearray()
        self._incoming: deque[Message] = deque()
        self._ring = ring
        self._orphaned = False
        self._next_status = 0.0
        self.operations = Operations(interface, ring, self.send, raw_frames=raw_frames)
        self.operations.roster.exchange.end_set_up_when(self._stop_waits)

    def run(self, granted: realtime.RealTime) -> None:
        """Run until the server is gone."""
        self.operations.granted = granted
        try:
            self.operations.open()
            self.send(
                {
                    "event": "ready",
                    "fifo": granted.fifo_priority,
                    "notes": [note.to_wire() for note in granted.notes],
                }
            )
        except DriveError as error:
            self.send({"event": "failed", "error": protocol.error_to_wire(error)})
            self._flush()
            return
        while not self._orphaned:
            self._turn()
        self._ring.host_lives_until(time.monotonic_ns() + 10_000_000_000, "ethercat.doing-ending")
        self.operations.shut_down(text("ethercat.server-is-gone"))

    def _turn(self) -> None:
        operations = self.operations
        now = time.monotonic()
        self._ring.host_lives_until(int((now + 2) * 1e9))
        loop = operations.loop
        if loop is not None:
            loop.cycle()
            self._commands(0.0)
            if self._server_is_silent():
                loop.stop_axes(_SILENT)
            operations.use_spare_time()
        elif operations.checking:
            operations.check_cycle()
            self._commands(0.0)
        else:
            worked = any(operations.lanes.step() for _ in range(8))
            self._flush()
            self._commands(0.0 if worked or self._outgoing else self._idle_s(now))
        operations.housekeeping(now)
        if now >= self._next_status:
            self._next_status = now + _STATUS_S
            self.send({"event": "status"} | operations.status())
        self._flush()

    def _idle_s(self, now: float) -> float:
        wake = self.operations.lanes.wake_s()
        return 0.05 if wake is None else min(max(wake - now, 0.0), 0.05)

    def _server_is_silent(self) -> bool:
        seen = self._ring.server_seen_ns()
        return bool(seen) and time.monotonic_ns() - seen > _SERVER_SILENT_S * 1e9

    def _commands(self, timeout_s: float) -> None:
        if timeout_s > 0:
            self._control.wait(timeout_s)
        self._receive()
        while self._incoming:
            self._handle(self._incoming.popleft())

    def _stop_waits(self) -> bool:
        self._receive()
        return any(self.operations.stops(message) for message in self._incoming)

    def _receive(self) -> None:
        data = self._control.receive()
        if data is None:
            return
        if not data:
            self._orphaned = True
            return
        self._incoming.extend(self._unpacker.feed(data))

    def _handle(self, message: Message) -> None:
        number = message["id"]

        def done(result: object, error: DriveError | None) -> None:
            if error is None:
                self.send({"id": number, "result": result})
            else:
                self.send({"id": number, "error": protocol.error_to_wire(error)})

        try:
            self.operations.handle(message, done)
        except DriveError as error:
            done(None, error)
        except (KeyError, TypeError, ValueError, struct.error) as error:
            # An invalid request must not end the process that moves axes.
            done(None, ProtocolError("ethercat.request-cannot-carried-out", cause=str(error)))

    def send(self, message: Message) -> None:
        """Queue a message; a slow server never delays the wire."""
        self._outgoing += protocol.pack(message)

    def _flush(self) -> None:
        if not self._outgoing:
            return
        sent = self._control.send(self._outgoing)
        if sent is None:
            self._orphaned = True
            return
        del self._outgoing[:sent]

    def orphan(self) -> None:
        """Handle SIGTERM: end in an orderly way."""
        end_within(_LAST_WORDS_S)
        self._orphaned = True


def main(argv: list[str] | None = None) -> int:
    """Entry point of the process."""
    parser = argparse.ArgumentParser(description="EtherCAT host process of servodeck")
    parser.add_argument("interface")
    parser.add_argument("--control", type=int, help="descriptor of the socket, else by pipes")
    ring = parser.add_mutually_exclusive_group(required=True)
    ring.add_argument("--ring", type=int, help="descriptor of the ring")
    ring.add_argument("--ring-file", type=Path, help="file of the ring")
    parser.add_argument("--library-frames", action="store_true", help="registers by SOEM's calls")
    parser.add_argument("--no-realtime", action="store_true")
    parser.add_argument("--lockstep", type=float, default=0.0, help="for virtual segments")
    options = parser.parse_args(argv)
    realtime.die_with_parent()
    signals.ignore_interrupt()
    control: HostEnd = (
        PipeHostEnd.of_this_process()
        if options.control is None
        else SocketHostEnd(socket.socket(fileno=options.control))
    )
    memory = Ring(options.ring) if options.ring_file is None else Ring.of_file(options.ring_file)
    host = Host(options.interface, control, memory, raw_frames=not options.library_frames)
    if options.lockstep:
        host.operations.roster.exchange.lockstep = options.lockstep
        # A virtual segment on a busy computer answers only when it is scheduled.
        host.operations.segment.frame_timeout_us = _PATIENT_FRAME_US
    signals.on_termination(host.orphan)
    granted = realtime.claim(wanted=not options.no_realtime)
    with contextlib.suppress(LinkLost):
        host.run(granted)
    end_within(_LAST_WORDS_S)
    control.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
