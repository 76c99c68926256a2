"""The SYNC loop: one thread, absolute deadlines, samples in and setpoints out.

The handling of an axis's setpoints is the same on every bus: `drivers.motion.playback`.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from drivers.canopen.exchange.images import Images, Key
from drivers.canopen.frames import HEARTBEAT, SYNC, Frame
from drivers.cia402 import State
from drivers.errors import DriveError, LinkLost, LinkTimeout
from drivers.halt import HaltCause, Halted
from drivers.link import LinkEvent, ScopeBlock
from drivers.motion.playback import AxisLoop
from drivers.motion.setpoint_plan import Motion, Phase
from drivers.texts.message import text

_BLOCK_S = 0.025
_HEARTBEAT_S = 0.05
_OPERATIONAL = b"\x05"
_BRAKE_WHEN_SILENT_S = 0.05
_GIVE_UP_WHEN_SILENT_S = 0.3
_LATENESS_KEPT = 4096
_SILENT = Halted(HaltCause.LOST, note=text("canopen.cyclic-data-stopped-coming"))
_SILENT_BRAKED = Halted(HaltCause.LOST, note=text("canopen.cyclic-data-stopped-coming-reported"))


class LoopClock(Protocol):
    """Time source of the loop; a test may replace it."""

    def now_s(self) -> float:
        """Return the time in seconds since any fixed point."""

    def wait_until(self, due_s: float) -> None:
        """Return at ``due_s``, or at once if that is past."""


class ComputerClock:
    """The computer's monotonic clock."""

    def now_s(self) -> float:
        """See `LoopClock`."""
        return time.monotonic()

    def wait_until(self, due_s: float) -> None:
        """See `LoopClock`."""
        time.sleep(max(due_s - time.monotonic(), 0.0))


@dataclass(slots=True)
class _Statistics:
    cycles: int = 0
    skipped: int = 0
    incomplete: int = 0
    lateness_us: list[float] = field(default_factory=list)

    def late(self, microseconds: float) -> None:
        self.lateness_us.append(microseconds)
        if len(self.lateness_us) > 2 * _LATENESS_KEPT:
            del self.lateness_us[:_LATENESS_KEPT]


class SyncLoop:
    """Sends SYNC and output PDOs every ``cycle_s``, collects input PDOs into blocks.

    Every public method may be called from any thread. ``deliver`` and ``notify`` are called on the
    loop's thread and must not block.
    """

    def __init__(
        self,
        send: Callable[[Frame], None],
        images: Images,
        cycle_s: float,
        *,
        deliver: Callable[[ScopeBlock], None],
        notify: Callable[[LinkEvent], None],
        own_id: int,
        clock: LoopClock | None = None,
    ) -> None:
        self.images = images
        self._clock = clock or ComputerClock()
        self.cycle_s = cycle_s
        self._send = send
        self._deliver = deliver
        self._notify = notify
        self._heartbeat = Frame(HEARTBEAT + own_id, _OPERATIONAL)
        self._lock = threading.Condition()
        self._stopping = False
        self._cycle = 0
        self._sent_cycle = -1
        self._sync_late_s = 0.0
        self._block_cycle = 0
        self._arrived: dict[int, bytes] = {}
        self._came: set[int] = set()
        self._silent_s = dict.fromkeys(images.stations, 0.0)
        self._halts = dict.fromkeys(images.stations, 0)
        self._sampled_s: float | None = None
        self._complete: set[int] = set()
        self._sent: list[int | float] = []
        self._rows: list[list[int | float]] = []
        self._row_valid: list[bool] = []
        self._block_start_s = 0.0
        self._sequence = 0
        self._dropped = 0
        self._bus_lost = False
        self._statistics = _Statistics()
        self._thread = threading.Thread(target=self._run, name="canopen-sync", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    @property
    def running(self) -> bool:
        """Whether SYNC is being sent."""
        return self._thread.is_alive()

    @property
    def bus_lost(self) -> bool:
        """Whether the last cycle could not be sent."""
        return self._bus_lost

    def stop(self) -> None:
        """End the thread at once; call `halt_and_wait` first to stop motion."""
        with self._lock:
            self._stopping = True
        self._thread.join()

    def take(self, frame: Frame) -> bool:
        """Take a frame if it is one of the input PDOs."""
        length = self.images.lengths.get(frame.cob_id)
        if length is None or frame.remote:
            return False
        if len(frame.data) >= length:
            with self._lock:
                self._arrived[frame.cob_id] = frame.data
                self._came.add(frame.cob_id)
        return True

    def forget_arrivals(self) -> None:
        """Reset the record of the input PDOs received."""
        with self._lock:
            self._came.clear()

    def arrivals(self, station: int) -> tuple[int, tuple[int, ...]]:
        """Return the number of input PDOs, and those missing since `forget_arrivals`."""
        with self._lock:
            wanted = {
                slot.cob_id for (node, _, _), slot in self.images.inputs.items() if node == station
            }
            return len(wanted), tuple(sorted(wanted - self._came))

    def put(self, key: Key, data: bytes) -> None:
        """Change an output; return when the frame and the SYNC that makes it valid are sent.

        Raises:
            LinkLost: the bus is gone.
            LinkTimeout: the loop does not run.
        """
        with self._lock:
            if not self._bus_lost:
                self.images.set_output(key, data)
                wanted = self._cycle + 2
                sent = self._lock.wait_for(
                    lambda: self._sent_cycle >= wanted or self._bus_lost, 0.5 + 3 * self.cycle_s
                )
                if not sent:
                    raise LinkTimeout("canopen.cyclic-exchange-not-run")
            if self._bus_lost:
                raise LinkLost("canopen.bus-lost")

    def axis(self, station: int, use: Callable[[AxisLoop], None]) -> None:
        """Call ``use`` with the axis of ``station`` between two cycles, if it has one."""
        with self._lock:
            axis = self.images.axes.get(station)
            if axis is not None:
                use(axis)

    def play(self, motions: Sequence[tuple[int, Motion]]) -> int:
        """Start motions together in the next cycle; return its number.

        Raises:
            NotAllowed: one of them cannot start; then none does.
            LinkLost: the bus is gone.
        """
        with self._lock:
            if self._bus_lost:
                raise LinkLost("canopen.bus-lost")
            for station, motion in motions:
                self.images.axes[station].check(motion)
            for station, motion in motions:
                self.images.axes[station].play(motion)
            return self._cycle

    def halt(self, station: int | None, why: Halted) -> None:
        """Brake one station, or all for None, and leave Operation enabled."""
        with self._lock:
            for axis in self.images.axes.values():
                if station in (None, axis.station):
                    self._halts[axis.station] += 1
                    axis.stop(why, State.READY)

    def abandon(self, station: int | None, why: Halted) -> None:
        """End setpoints without a ramp, as the node or bus is lost and would not receive it."""
        with self._lock:
            for node in self.images.stations:
                if station in (None, node):
                    self._halts[node] += 1
                    self.images.neutralise(node, why)

    def halts(self, station: int) -> int:
        """Return how many times this station was halted or abandoned."""
        with self._lock:
            return self._halts[station]

    def halt_and_wait(self) -> None:
        """Stop everything and wait until no axis is enabled, at most 1.5 s. Blocks."""
        self.halt(None, Halted(HaltCause.COMMANDED, note=text("canopen.cyclic-exchange-ends")))

        def still() -> bool:
            return self._bus_lost or all(
                axis.phase is Phase.IDLE
                and (axis.goal is None or axis.state is not State.OPERATION_ENABLED)
                for axis in self.images.axes.values()
            )

        with self._lock:
            self._lock.wait_for(still, 1.5)

    def newest(self, within_s: float) -> dict[str, int | float]:
        """Return the inputs of the last cycle by channel, as `drivers.link.Cyclic.newest`."""
        with self._lock:
            sampled_s = self._sampled_s
            if self._bus_lost or sampled_s is None:
                return {}
            if self._clock.now_s() - sampled_s > within_s:
                return {}
            return {
                self.images.channels[slot.column]: self.images.values[slot.column]
                for (station, _index, _subindex), slot in self.images.inputs.items()
                if station in self._complete
            }

    def statistics(self) -> dict[str, float | int | str]:
        """Return figures for the link quality."""
        with self._lock:
            late = sorted(self._statistics.lateness_us)
            return {
                "cycles": self._statistics.cycles,
                "skipped_cycles": self._statistics.skipped,
                "incomplete_samples": self._statistics.incomplete,
                "sync_late_p50_us": round(late[len(late) // 2], 1) if late else 0.0,
                "sync_late_p99_us": round(late[len(late) * 99 // 100], 1) if late else 0.0,
                "sync_late_max_us": round(late[-1], 1) if late else 0.0,
            }

    def _run(self) -> None:
        due_s = self._clock.now_s() + self.cycle_s
        heartbeat_due_s = 0.0
        self._block_start_s = due_s
        while True:
            self._clock.wait_until(due_s)
            now_s = self._clock.now_s()
            with self._lock:
                if self._stopping:
                    self._flush()
                    return
                if self._cycle > 0:
                    self._close_sample()
                outgoing = [Frame(c, bytes(image)) for c, image in self.images.frames.items()]
                self._sent = self.images.sent()
            if now_s >= heartbeat_due_s:
                heartbeat_due_s = now_s + _HEARTBEAT_S
                outgoing.append(self._heartbeat)
            self._exchange(outgoing)
            with self._lock:
                self._sync_late_s = max(now_s - due_s, 0.0)
                self._statistics.late(1e6 * self._sync_late_s)
                self._statistics.cycles += 1
                self._sent_cycle = self._cycle
                self._cycle += 1
                self._lock.notify_all()
            due_s += self.cycle_s
            missed = int(max(self._clock.now_s() - due_s, 0.0) / self.cycle_s)
            if missed:
                self._skip(missed)
                due_s += missed * self.cycle_s

    def _exchange(self, outgoing: Sequence[Frame]) -> None:
        try:
            self._send(Frame(SYNC))
            for frame in outgoing:
                self._send(frame)
        except DriveError as error:
            with self._lock:
                lost, self._bus_lost = not self._bus_lost, True
                self._lock.notify_all()
            if lost:
                self.abandon(None, Halted(HaltCause.LOST, note=error.text))
                self._notify(
                    LinkEvent("state", None, text("event.exchange-interrupted", cause=error.text))
                )
            return
        self._bus_lost = False

    def _skip(self, missed: int) -> None:
        """Skip whole cycles that the computer missed: their samples do not exist."""
        with self._lock:
            self._flush()
            self._dropped += missed
            self._statistics.skipped += missed
            for axis in self.images.axes.values():
                axis.skip(missed)
            self._cycle += missed
            self._block_start_s += missed * self.cycle_s

    def _close_sample(self) -> None:
        arrived, self._arrived = self._arrived, {}
        self._sampled_s = self._clock.now_s()
        complete = self._complete = self.images.take(arrived)
        valid = len(arrived) == len(self.images.lengths)
        self._statistics.incomplete += not valid
        if not self._rows:
            self._block_cycle = self._sent_cycle
        # The inputs triggered by SYNC are stored with the outputs sent in the same cycle, for the
        # next SYNC.
        self._rows.append([*self.images.values, *self._sent])
        self._row_valid.append(valid)
        for station, axis in self.images.axes.items():
            if station in complete:
                self._silent_s[station] = 0.0
                axis.step(self.images.values, self._sync_late_s)  # type: ignore[arg-type]
            else:
                self._silent(station, axis)
        for station in self.images.axes:
            self.images.pack_axis(station)
        if len(self._rows) * self.cycle_s >= _BLOCK_S:
            self._flush()

    def _silent(self, station: int, axis: AxisLoop) -> None:
        """Handle a cycle without this station's inputs: one is tolerated, several are not."""
        axis.blind()
        before = self._silent_s[station]
        self._silent_s[station] = now = before + self.cycle_s
        if before < _BRAKE_WHEN_SILENT_S <= now:
            # With a cut line the drive receives none of this, and its own watchdog determines what
            # it does.
            axis.stop(_SILENT_BRAKED)
        if before < _GIVE_UP_WHEN_SILENT_S <= now:
            self.images.neutralise(station, _SILENT)

    def _flush(self) -> None:
        if not self._rows:
            return
        samples: npt.NDArray[np.float64] = np.array(self._rows, dtype=np.float64)
        block = ScopeBlock(
            sequence=self._sequence,
            t0_s=self._block_start_s,
            dt_s=self.cycle_s,
            channels=self.images.channels,
            samples=samples.reshape(len(self._rows), len(self.images.channels)),
            dropped=self._dropped,
            valid=np.array(self._row_valid, dtype=np.bool_),
            cycle=self._block_cycle,
        )
        self._sequence += 1
        self._dropped = 0
        self._block_start_s += len(self._rows) * self.cycle_s
        self._rows, self._row_valid = [], []
        self._deliver(block)
