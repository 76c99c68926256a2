"""Transfers frames between virtual CANopen nodes and a client, over python-can or slcan.

`CanWire` owns one thread. Optionally every frame takes its time on a real bus.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from queue import SimpleQueue
from typing import Protocol

import can

from drivers.canopen.adapters.slcan import ERROR_BUS_OFF
from drivers.canopen.frames import Frame, exact_bits
from drivers.virtual.wires.canopen import CanopenNode

_LONGEST_WAIT_S = 0.002


class ClientSide(Protocol):
    """Source of the client's frames and destination of the nodes' frames."""

    def recv(self, timeout_s: float) -> Frame | None:
        """Return the next frame, or None after ``timeout_s``."""

    def send(self, frame: Frame) -> None:
        """Send a frame of a node; lost silently if no client listens."""

    def bus_off(self) -> None:
        """Make the client's adapter bus-off until it is opened again."""

    def error(self, kind: int) -> None:
        """Report that a frame of the client failed: ``kind`` is a class of linux/can/error.h."""

    def close(self) -> None:
        """Release all resources."""


class PythonCanSide:
    """Any python-can bus (``virtual``, ``udp_multicast``)."""

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus

    def recv(self, timeout_s: float) -> Frame | None:
        """See `ClientSide`."""
        message = self._bus.recv(timeout_s)
        if message is None or message.is_error_frame or message.is_extended_id:
            return None
        return Frame(message.arbitration_id, bytes(message.data), message.is_remote_frame)

    def send(self, frame: Frame) -> None:
        """See `ClientSide`."""
        self._bus.send(
            can.Message(
                arbitration_id=frame.cob_id,
                is_extended_id=False,
                is_remote_frame=frame.remote,
                data=frame.data,
            )
        )

    def bus_off(self) -> None:
        """Send the error frame with which SocketCAN reports bus-off."""
        self._bus.send(
            can.Message(
                arbitration_id=ERROR_BUS_OFF,
                is_extended_id=False,
                is_error_frame=True,
                data=bytes(8),
            )
        )

    def error(self, kind: int) -> None:
        """See `ClientSide`."""
        self._bus.send(
            can.Message(
                arbitration_id=kind, is_extended_id=False, is_error_frame=True, data=bytes(8)
            )
        )

    def close(self) -> None:
        """See `ClientSide`."""
        self._bus.shutdown()


class CanWire:
    """Runs ``nodes`` on one bus. With ``bitrate``, frames take their real time on the wire."""

    def __init__(
        self, side: ClientSide, nodes: Sequence[CanopenNode], bitrate: int | None = None
    ) -> None:
        self.side = side
        self.nodes = list(nodes)
        self.broken: int | None = None
        """No frame is transferred, and each of the client's ends with an error of this class:
        ERROR_ACKNOWLEDGE without another node on the bus, ERROR_PROTOCOL at another bit rate.
        """
        self._bitrate = bitrate
        self._free_s = 0.0
        self._stopping = threading.Event()
        self._work: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="can-wire", daemon=True)

    def start(self) -> None:
        """Start, and return when the nodes have sent their boot-up messages."""
        self._thread.start()
        for _ in range(2):  # one job per round, so a whole round lies between
            self.do(lambda: None)

    def stop(self) -> None:
        """Stop the thread and close the client's side."""
        self._stopping.set()
        self._thread.join()
        self.side.close()

    def do(self, work: Callable[[], None]) -> None:
        """Run ``work`` on the wire's thread, the only one that may access nodes and drives."""
        done = threading.Event()

        def run() -> None:
            try:
                work()
            finally:
                done.set()

        self._work.put(run)
        done.wait()

    def __enter__(self) -> CanWire:
        self.start()
        return self

    def __exit__(self, *_exc: object) -> None:
        self.stop()

    def _run(self) -> None:
        while not self._stopping.is_set():
            if not self._work.empty():
                self._work.get()()
            wait_s = min((n.next_due_s(_LONGEST_WAIT_S) for n in self.nodes), default=0.002)
            frame = self.side.recv(wait_s)
            if frame is not None and self.broken is not None:
                self.side.error(self.broken)
            elif frame is not None:
                self._occupy(frame)
                for node in self.nodes:
                    node.take(frame)
            self._send_due()

    def _send_due(self) -> None:
        # Frames of one node are received by the others too, as on a real bus.
        ready = [(node, frame) for node in self.nodes for frame in node.due()]
        if self.broken is not None:
            return
        # Lower identifiers win the arbitration.
        for sender, frame in sorted(ready, key=lambda pair: pair[1].cob_id):
            self._occupy(frame)
            self.side.send(frame)
            for other in self.nodes:
                if other is not sender:
                    other.take(frame)

    def _occupy(self, frame: Frame) -> None:
        if self._bitrate is None:
            return
        now_s = time.monotonic()
        self._free_s = max(self._free_s, now_s) + exact_bits(frame) / self._bitrate
        time.sleep(max(self._free_s - now_s, 0.0))
