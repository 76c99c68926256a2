"""One open CAN adapter: receiving thread, sending, and reopening after a loss."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import can

from drivers.canopen.adapters.adapter import ADAPTER_ERRORS, open_bus, translate
from drivers.canopen.adapters.slcan import (
    ERROR_ACKNOWLEDGE,
    ERROR_BUS_OFF,
    ERROR_CONTROLLER,
    ERROR_PROTOCOL,
)
from drivers.canopen.frames import Frame
from drivers.canopen.url import CanUrl
from drivers.errors import DriveError, LinkLost
from drivers.flight.kinds import can_data, can_ring
from drivers.link import LinkEvent
from drivers.texts.message import Text, text

_IDLE_S = 0.05
_FIRST_RETRY_S = 0.2
_LAST_RETRY_S = 5.0
_SEND_TIMEOUT_S = 0.05


class CanPort:
    """The adapter and its receiving thread.

    ``on_frame`` (frame, monotonic seconds), ``on_event`` and ``on_idle`` (seconds; at least every
    50 ms) are called on the receiving thread and must not block.
    """

    def __init__(
        self,
        url: CanUrl,
        on_frame: Callable[[Frame, float], None],
        on_event: Callable[[LinkEvent], None],
        on_idle: Callable[[float], None],
        opener: Callable[[CanUrl], can.BusABC] = open_bus,
    ) -> None:
        self.url = url
        self.error_frames = 0
        self.received = 0
        self.sent = 0
        self.lost_frames = 0
        self.acknowledge_errors = 0
        self.protocol_errors = 0
        self.error_passive = 0
        self.bus_offs = 0
        self.bus_off_s: float | None = None
        """When the adapter last was bus-off, in monotonic seconds."""
        self.reopened = 0
        self._on_frame = on_frame
        self._on_event = on_event
        self._on_idle = on_idle
        self._opener = opener
        self.ring = can_ring(url.channel)
        self._bus: can.BusABC | None = None
        self._why: DriveError | None = None
        self._closing = threading.Event()
        self._send_lock = threading.Lock()
        self._thread: threading.Thread | None = None

    @property
    def connected(self) -> bool:
        """Whether the adapter is open and not bus-off."""
        return self._bus is not None

    @property
    def why_not(self) -> Text | None:
        """Why it is not connected, or None."""
        return None if self._why is None else self._why.text

    def open(self) -> None:
        """Open the adapter and start receiving. Blocks. Raises LinkLost."""
        if self._thread is not None:
            return
        self._closing.clear()
        self._bus = self._opener(self.url)
        self._why = None
        self._thread = threading.Thread(target=self._receive, name="can-receive", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop receiving and close the adapter. Further calls have no effect."""
        self._closing.set()
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join()
        self._drop_bus()

    def send(self, frame: Frame) -> None:
        """Send a frame.

        Raises:
            LinkLost: adapter gone, bus-off, or no acknowledge.
        """
        message = can.Message(
            arbitration_id=frame.cob_id,
            is_extended_id=False,
            is_remote_frame=frame.remote,
            data=frame.data,
            check=False,
        )
        with self._send_lock:
            bus = self._bus
            if bus is None:
                raise self._lost_error()
            try:
                bus.send(message, timeout=_SEND_TIMEOUT_S)
            except ADAPTER_ERRORS as error:
                self.lost_frames += 1
                raise translate(self.url, error) from error
        self.sent += 1
        data = can_data(frame.cob_id, frame.data, frame.remote)
        self.ring.put(time.time_ns(), True, data)

    def _lost_error(self) -> LinkLost:
        why = self._why
        if why is None:
            return LinkLost("canopen.adapter-closed", drive=self.url.url, channel=self.url.channel)
        return LinkLost(why.text, drive=self.url.url, remedy=why.remedy_text)

    def _receive(self) -> None:
        idle_due_s = 0.0
        while not self._closing.is_set():
            bus = self._bus
            if bus is None:
                return
            try:
                message = bus.recv(_IDLE_S)
            except ADAPTER_ERRORS as error:
                self._recover(translate(self.url, error), "lost", _FIRST_RETRY_S)
                continue
            now_s = time.monotonic()
            if now_s >= idle_due_s:
                idle_due_s = now_s + _IDLE_S
                self._on_idle(now_s)
            if message is None:
                continue
            if message.is_error_frame:
                self._error_frame(message)
            elif not message.is_extended_id:
                self.received += 1
                frame = Frame(message.arbitration_id, bytes(message.data), message.is_remote_frame)
                data = can_data(frame.cob_id, frame.data, frame.remote)
                self.ring.put(time.time_ns(), False, data)
                self._on_frame(frame, now_s)

    def _error_frame(self, message: can.Message) -> None:
        self.error_frames += 1
        self._count(message)
        bus = self._bus
        if not message.arbitration_id & ERROR_BUS_OFF and (
            bus is None or bus.state is not can.BusState.ERROR
        ):
            return
        self.bus_offs += 1
        self.bus_off_s = time.monotonic()
        why = LinkLost(
            "canopen.adapter-bus-off-switched", drive=self.url.url, channel=self.url.channel
        )
        self._recover(why, "fault", _FIRST_RETRY_S)

    def _count(self, message: can.Message) -> None:
        """Count the kind of error: missing acknowledge, damaged frame, or error counters."""
        kind = message.arbitration_id
        if kind & ERROR_ACKNOWLEDGE:
            self.acknowledge_errors += 1
        elif kind & ERROR_PROTOCOL:
            self.protocol_errors += 1
        elif kind & ERROR_CONTROLLER:
            self.error_passive += 1

    def _recover(self, why: LinkLost, kind: str, retry_s: float) -> None:
        """Report the loss, then retry until the adapter is open again or the port closes."""
        self._why = why
        self._drop_bus()
        remedy = why.remedy_text
        event = why.text if remedy is None else text("event.lost", cause=why.text, remedy=remedy)
        self._on_event(LinkEvent("fault" if kind == "fault" else "lost", None, event))
        while not self._closing.wait(retry_s):
            try:
                bus = self._opener(self.url)
            except LinkLost as error:
                self._why = error
                retry_s = min(retry_s * 2, _LAST_RETRY_S)
                continue
            with self._send_lock:
                self._bus = bus
            self._why = None
            self.reopened += 1
            self._on_event(
                LinkEvent("back", None, text("event.can-adapter-back", channel=self.url.channel))
            )
            return

    def _drop_bus(self) -> None:
        with self._send_lock:
            bus, self._bus = self._bus, None
        if bus is not None:
            try:
                bus.shutdown()
            except ADAPTER_ERRORS:
                return  # a dead adapter cannot be closed; its descriptor is gone with it
