"""One axis over CANopen frames in virtual time: the product's link and loop next to a virtual node.

Everything is as on a wire (SDO, PDO mapping, NMT, SYNC), but the node's time is the loop's: it
passes with SYNC, however busy the computer is, and up to ``pace`` times as fast as the clock.
"""

from __future__ import annotations

import itertools
import queue
import threading
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass

import can

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from backend.tools.tuning.sweep import profile_speed
from drivers.canopen.frames import SYNC, Frame
from drivers.canopen.link import CanopenLink
from drivers.virtual.device import Device
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.mechanics import MechanicsSpec
from drivers.virtual.wires.canopen import CanopenNode
from profiles.loader import load_profile
from tests.virtual.tools.rig import outlive

STATION = 3
_numbers = itertools.count()
#: Simulated time for one request while no SYNC is sent.
_ACCESS_NS = 200_000
_SILENT_S = 0.05


class LockstepBus(can.BusABC):
    """A CAN bus with one node on it, whose answers are there as soon as a frame was sent."""

    def __init__(self, device: Device, pace: float) -> None:
        super().__init__(channel="lockstep")
        self.now_ns = 0
        self.node = CanopenNode(device, STATION, lambda: self.now_ns)
        self.cut = False
        """The cable is pulled: frames of the computer do not reach the node, nor the other way."""
        self.spoil: dict[int, Callable[[bytes], bytes]] = {}
        """What the node makes of frames with these identifiers."""
        self._pace = pace
        self._lock = threading.Lock()
        self._answers: queue.Queue[Frame] = queue.Queue()
        self._handled = True
        self._waited_s = 0.0
        self._real_s = time.monotonic()

    # What the link's port uses

    def send(self, message: can.Message, timeout: float | None = None) -> None:
        del timeout
        frame = Frame(message.arbitration_id, bytes(message.data), message.is_remote_frame)
        with self._lock:
            if frame.cob_id != SYNC and time.monotonic() - self._waited_s > _SILENT_S:
                self.now_ns += _ACCESS_NS
            if frame.cob_id in self.spoil:
                frame = Frame(frame.cob_id, self.spoil[frame.cob_id](frame.data))
            if not self.cut:
                self.node.take(frame)
            self._hear()

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if not self._handled:
            self._answers.task_done()
            self._handled = True
        try:
            frame = self._answers.get(timeout=timeout)
        except queue.Empty:
            return None
        self._handled = False
        return can.Message(
            arbitration_id=frame.cob_id,
            is_extended_id=False,
            is_remote_frame=frame.remote,
            data=frame.data,
        )

    def shutdown(self) -> None:
        self._is_shutdown = True

    def _hear(self) -> None:
        for frame in self.node.due():
            if not self.cut:
                self._answers.put(frame)

    # The loop's clock (drivers.canopen.exchange.synchronous.LoopClock)

    def now_s(self) -> float:
        return self.now_ns / 1e9

    def wait_until(self, due_s: float) -> None:
        with self._answers.all_tasks_done:
            self._answers.all_tasks_done.wait_for(lambda: not self._answers.unfinished_tasks, 1.0)
        step_s = due_s - self.now_s()
        self._real_s = max(self._real_s + step_s / self._pace, time.monotonic() - 0.05)
        time.sleep(max(self._real_s - time.monotonic(), 0.0))
        with self._lock:
            self.now_ns = max(round(due_s * 1e9), self.now_ns)
            self._waited_s = time.monotonic()

    def pass_s(self, seconds: float) -> None:
        """Let time pass without any frame, as when the computer is dead."""
        with self._lock:
            self.now_ns += round(seconds * 1e9)
            self.node.due()


@dataclass
class CanBench:
    axis: Axis
    session: CyclicSession
    link: CanopenLink
    bus: LockstepBus
    spec: MechanicsSpec


def incremental(spec: MechanicsSpec) -> MechanicsSpec:
    """These mechanics with the encoder of a DS_C: 2500 lines, four edges each (003:76)."""
    encoder = spec.encoder.model_copy(update={"counts_per_rev": 10000, "noise_counts": 0.0})
    return spec.model_copy(update={"encoder": encoder})


@asynccontextmanager
async def can_bench(
    spec: MechanicsSpec,
    cycle_s: float = 1e-3,
    *,
    drive: str = "ds_c",
    pace: float = 4.0,
    bitrate: int = 1_000_000,
    patient: bool = True,
) -> AsyncIterator[CanBench]:
    """``patient``: setpoints outlive that simulated time passes faster than the tools' clock."""
    profile = load_profile(drive)
    bus = LockstepBus(make_device(drive, spec, station=STATION), pace)
    bus.pass_s(0.01)
    link = CanopenLink(
        f"canopen://virtual/lockstep-{next(_numbers)}?bitrate={bitrate}",
        opener=lambda _url: bus,
        clock=bus,
    )
    await link.open()
    try:
        link.attach(STATION, profile)
        one = Drive("x", "X", profile, [Port(link, STATION, profile.link("canopen"))])
        session = CyclicSession(link, [one], {"x"} if profile_speed.needed(one, link) else ())
        axis = Axis(one)
        if patient:
            outlive(session)
        await session.start(cycle_s)
        axis.session = session
        try:
            yield CanBench(axis, session, link, bus, spec)
        finally:
            axis.session = None
            await session.stop()
    finally:
        await link.close()
