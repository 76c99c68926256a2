"""The segment on a network interface: a raw socket, the clock, and delayed replies."""

from __future__ import annotations

import contextlib
import heapq
import os
import select
import socket
import struct
import time
from typing import IO

from drivers.computer.network.sockets import AF_PACKET, hold_name, receive_with_notes
from drivers.errors import LinkLost
from drivers.virtual.wires import netns
from drivers.virtual.wires.ethercat.control import Control
from drivers.virtual.wires.ethercat.segment import Segment

_ETH_P_ECAT = 0x88A4
_SO_TIMESTAMPNS = 35
_PACKET_IGNORE_OUTGOING = 23
_SOL_PACKET = 263
_LONGEST = 1600
_STALE_NS = 1_000_000_000
_IDLE_S = 0.05
"""Interval of time updates without frames, so that the physics do not fall behind."""


class InterfaceLock:
    """One slave segment per interface: an abstract socket name, which belongs to the network
    namespace like the interface and is released with its process.
    """

    def __init__(self, interface: str) -> None:
        try:
            self._socket = hold_name(f"servodeck-virtual-segment-{interface}")
        except OSError as error:
            raise LinkLost(
                "virtual.another-virtual-segment-already", interface=interface
            ) from error

    def release(self) -> None:
        """Release the lock."""
        self._socket.close()


def open_socket(interface: str) -> socket.socket:
    """Open a raw socket for EtherCAT frames received on ``interface``.

    Raises:
        LinkLost: no such interface or no permission; the message states which.
    """
    if len(interface.encode()) > 15:
        raise LinkLost("virtual.interface-name-longer-15", interface=interface)
    try:
        raw = socket.socket(AF_PACKET, socket.SOCK_RAW, 0)
    except PermissionError as error:
        raise LinkLost("virtual.no-permission-raw-sockets") from error
    try:
        raw.setsockopt(_SOL_PACKET, _PACKET_IGNORE_OUTGOING, 1)
        raw.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        # Report "ready" only after bind: earlier frames would be lost.
        raw.bind((interface, _ETH_P_ECAT))
    except OSError as error:
        raw.close()
        raise LinkLost(
            "virtual.cannot-use-interface", interface=interface, strerror=error.strerror
        ) from error
    raw.setblocking(False)
    return raw


class SegmentServer:
    """Processes frames and control commands until the control channel closes or commands a stop."""

    def __init__(
        self, interface: str, segment: Segment, commands: IO[bytes], answers: IO[bytes]
    ) -> None:
        self._segment = segment
        self._interface = interface
        self._control = Control(segment, interface, answers, self._carrier)
        self._commands = commands.fileno()
        self._lock = InterfaceLock(interface)
        try:
            self._socket = open_socket(interface)
        except LinkLost:
            self._lock.release()
            raise
        self._late: list[tuple[int, int, bool, bytes]] = []
        self._sequence = 0

    def run(self) -> None:
        """Run until commanded to stop."""
        wire, descriptors = self._socket.fileno(), (self._socket.fileno(), self._commands)
        self._control.ready()
        while not self._control.stopped:
            # Drives run at their SYNC0, not when the next frame must be answered.
            tick = self._segment.next_tick_ns()
            ready, _, _ = select.select(descriptors, (), (), self._wait_s(tick))
            if wire in ready:
                # One at a time: if each frame follows the previous answer, none has to wait.
                self._answer()
            if self._commands in ready and not self._command():
                return
            if self._late:
                self._finish_late()
            if not ready:
                # Frames in the socket now came after this SYNC0 and must see its effect.
                self._segment.settle(tick)

    def close(self) -> None:
        """Close the socket and release the interface."""
        self._socket.close()
        self._lock.release()

    def _wait_s(self, tick_ns: int | None) -> float:
        wait_s = _IDLE_S
        ahead_s = None if tick_ns is None else self._segment.clock.ahead_s(tick_ns)
        if ahead_s is not None:
            wait_s = min(wait_s, ahead_s)
        if self._late:
            wait_s = min(wait_s, (self._late[0][0] - time.monotonic_ns()) / 1e9)
        return max(0.0, wait_s)

    def _command(self) -> bool:
        data = os.read(self._commands, 65536)
        if data:
            # A command uses the present state: process earlier frames first.
            self._drain()
            self._control.feed(data)
        return bool(data)

    def _carrier(self, on: bool) -> None:
        """Set the interface's carrier as the master's cable is connected or not, if permitted.

        Without the permission, frames are still not answered.
        """
        with contextlib.suppress(OSError):
            netns.set_up(self._interface, on)

    def _drain(self) -> None:
        """Process all waiting frames, up to a limit, so that commands are processed too."""
        for _ in range(64):
            if not self._answer():
                return

    def _answer(self) -> bool:
        """Process the next waiting frame; return False if there is none."""
        try:
            frame, ancillary, _, _ = receive_with_notes(self._socket, _LONGEST, 64)
        except OSError:
            return False  # no frame, or the interface was switched off; it may be switched on again
        reply = self._segment.process_frame(frame, _age_ns(ancillary))
        if self._segment.hold_ns:
            self._postpone(self._segment.hold_ns, frame, is_reply=False)
        elif reply is not None and self._segment.reply_delay_ns:
            self._postpone(self._segment.reply_delay_ns, reply, is_reply=True)
        elif reply is not None:
            self._send(reply)
        return True

    def _postpone(self, delay_ns: int, frame: bytes, is_reply: bool) -> None:
        self._sequence += 1
        due_ns = time.monotonic_ns() + delay_ns
        heapq.heappush(self._late, (due_ns, self._sequence, is_reply, frame))

    def _finish_late(self) -> None:
        """Send delayed replies and process delayed frames that are due."""
        while self._late and self._late[0][0] <= time.monotonic_ns():
            _, _, is_reply, frame = heapq.heappop(self._late)
            reply = frame if is_reply else self._segment.process_frame(frame, held=True)
            if reply is not None:
                self._send(reply)

    def _send(self, frame: bytes) -> None:
        # If the queue is full or the interface is down, the frame is lost, as on a cable.
        with contextlib.suppress(OSError):
            self._socket.send(frame)


def _age_ns(ancillary: list[tuple[int, int, bytes]]) -> int:
    """Return the time since the kernel received the frame; 0 if unknown or its clock was set."""
    for level, kind, data in ancillary:
        if level == socket.SOL_SOCKET and kind == _SO_TIMESTAMPNS and len(data) >= 16:
            seconds, nanoseconds = struct.unpack_from("qq", data)
            age = time.time_ns() - (seconds * 1_000_000_000 + nanoseconds)
            return age if 0 <= age < _STALE_NS else 0
    return 0
