"""The cyclic exchange on an absolute time grid: process data first, then everything else.

Allocation is limited to the few short-lived objects that pysoem itself creates; the garbage
collector is off. A frame that does not come back costs only its own cycle: the socket is polled
with `select`, because SOEM's own time-outs round up to a jiffy of 4 ms.
"""

from __future__ import annotations

import select
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from drivers.ethercat.exchange.gridphase import GridPhase
from drivers.ethercat.exchange.mapping import Entry
from drivers.ethercat.exchange.ring import RESYNCED, VALID, Ring, lost_flag
from drivers.ethercat.process.segment import Segment
from drivers.halt import HaltCause, Halted
from drivers.motion.pair_guard import PairGuard
from drivers.motion.playback import AxisLoop
from drivers.motion.setpoint_plan import Phase
from drivers.texts.message import text

DISTRUST_S = 0.03
"""Time without valid process data after which setpoints cannot be trusted: all axes brake [s]."""

_DISTRUST_CYCLES, _SUSPICIOUS_CYCLES = 5, 2
_RECEIVE_US = 300
_LEAST_WAIT_S = 100e-6
_LOCKSTEP_WAIT_S = 0.25
_MARGIN_NS = 120_000
_LATE_BINS = 16


@dataclass
class Image:
    """Process data of one station in the loop."""

    station: int
    axis: AxisLoop
    unpack: Callable[[bytes], tuple[int, ...]]
    pack: Callable[..., bytes]
    output_size: int
    input_size: int
    wkc: int
    outputs: bytes = b""
    inputs: bytes = b""
    lost: bool = False


@dataclass
class CycleCounters:
    """Counters since the start of the exchange. ``late`` counts wake-ups by powers of two [µs]."""

    cycles: int = 0
    overruns: int = 0
    lost_frames: int = 0
    wkc_errors: int = 0
    last_wkc: int = 0
    late: list[int] = field(default_factory=lambda: [0] * _LATE_BINS)
    late_max_us: int = 0
    dc_deviation_ns: int = 0
    dc_deviation_max_ns: int = 0


def layout(entries: tuple[Entry, ...]) -> struct.Struct:
    """Return the layout of the process data of one direction; unused bytes are skipped."""
    parts = (f"{entry.size}x" if entry.code == "x" else entry.code for entry in entries)
    return struct.Struct("<" + "".join(parts))


def places(entries: tuple[Entry, ...]) -> dict[int, int]:
    """Return the place of each object index (of subindex 0) among the unpacked values."""
    known = [entry for entry in entries if entry.code != "x"]
    return {entry.index: place for place, entry in enumerate(known) if entry.subindex == 0}


class CyclicLoop:
    """The cyclic loop, see the module docstring. The caller uses the time left after `cycle`."""

    def __init__(
        self,
        segment: Segment,
        ring: Ring,
        images: list[Image],
        cycle_ns: int,
        *,
        dc: bool,
        lockstep: float = 0.0,
    ) -> None:
        """``lockstep`` is for segments whose time follows the frames.

        Cycles are then never skipped and replies are awaited; time runs at most ``lockstep`` times
        as fast as real time.
        """
        self.images = images
        self.cycle_ns = cycle_ns
        self.dc = dc
        self.counters = CycleCounters()
        self.number = 0
        self.next_ns = 0
        self.expected_wkc = sum(image.wkc for image in images)
        self._left_out_wkc = 0
        self._lost_flags = 0
        self._segment = segment
        self._master = segment.master
        self._ring = ring
        self._slaves = [segment.slaves[image.station - 1] for image in images]
        self._fd = segment.socket_fd
        self._distrust = max(round(DISTRUST_S * 1e9 / cycle_ns), _DISTRUST_CYCLES)
        self._invalid_run = 0
        self._phase = GridPhase(cycle_ns)
        self._late_ns = 0
        self._sampled_late_s = 0.0
        self._resynced = 0
        self._lockstep = lockstep
        self._real_next_ns = 0
        self._pairs: list[PairGuard] = []

    def start(self) -> None:
        """Start the grid now; frames no longer block."""
        self._segment.wait_for_frames(False)
        for image in self.images:
            image.outputs = image.pack(*image.axis.outputs)
            self._segment.set_output(image.station, image.outputs)
        self.next_ns = time.monotonic_ns() + self.cycle_ns

    def stop(self) -> None:
        """Make frames block again, for everything that is not cyclic."""
        self._segment.wait_for_frames(True)

    def cycle(self) -> None:
        """Wait for the grid, exchange process data, step every axis, and store the sample."""
        self._wait_for_grid()
        counters = self.counters
        wkc = self._exchange()
        # A slave that fell back to SAFEOP still counts, so a station left out may or may not add.
        valid = self.expected_wkc <= wkc <= self.expected_wkc + self._left_out_wkc
        counters.cycles += 1
        counters.last_wkc = wkc
        for image, slave in zip(self.images, self._slaves, strict=True):
            if wkc > 0 and not image.lost:
                image.inputs = slave.input
        self._sample(wkc, valid=valid)
        if valid:
            self._invalid_run = 0
        else:
            self._count_invalid(wkc)
        for image, slave in zip(self.images, self._slaves, strict=True):
            self._decide(image, slave, valid=valid)
        if self._pairs:
            self._look_at_pairs()
        self.number += 1
        follows = self.dc and not self._lockstep
        self.next_ns += self.cycle_ns + (self._follow_clock() if follows and wkc > 0 else 0)

    def spare_ns(self) -> int:
        """Return the time [ns] for mailbox frames before the next cycle, less a margin."""
        if self._lockstep:
            return max(self._real_next_ns - time.monotonic_ns(), self.cycle_ns // 2)
        return self.next_ns - time.monotonic_ns() - max(_MARGIN_NS, self.cycle_ns // 5)

    def suspicious(self) -> bool:
        """True once, when several consecutive answers lacked a station."""
        return self._invalid_run == _SUSPICIOUS_CYCLES and self.counters.last_wkc >= 0

    def moving(self) -> bool:
        """Return whether any axis is moved by setpoints or brakes."""
        return any(image.axis.phase is not Phase.IDLE for image in self.images)

    def stop_axes(self, why: Halted, station: int | None = None) -> None:
        """Brake one axis or all."""
        for image in self.images:
            if station in (None, image.station):
                image.axis.stop(why)

    def hold_together(self, pair: PairGuard) -> None:
        """Couple two axes until both are idle, in place of any earlier coupling of either."""
        self._pairs = [p for p in self._pairs if not set(p.axes) & set(pair.axes)]
        self._pairs.append(pair)

    def leave_out(self, station: int, *, lost: bool) -> None:
        """Take a lost station out of the expected working counter, or include it again."""
        for image in self.images:
            if image.station == station and image.lost is not lost:
                image.lost = lost
                change = image.wkc if lost else -image.wkc
                self.expected_wkc -= change
                self._left_out_wkc += change
                self._invalid_run = 0
        self._lost_flags = 0
        for place, image in enumerate(self.images):
            self._lost_flags |= lost_flag(place) if image.lost else 0

    # Parts ---------------------------------------------------------------------------------

    def _wait_for_grid(self) -> None:
        now = time.monotonic_ns()
        if self._lockstep:
            time.sleep(max(self._real_next_ns - now, 0) * 1e-9)
            step = round(self.cycle_ns / self._lockstep)
            self._real_next_ns = max(time.monotonic_ns(), self._real_next_ns) + step
            return
        ahead = self.next_ns - now
        if ahead > 0:
            time.sleep(ahead * 1e-9)
            now = time.monotonic_ns()
        late = max(now - self.next_ns, 0)
        self._resynced = 0
        if late >= self.cycle_ns:
            skipped = late // self.cycle_ns
            self.next_ns += skipped * self.cycle_ns
            self.number += skipped
            self.counters.overruns += skipped
            for image in self.images:
                image.axis.skip(skipped)
            self._resynced = RESYNCED
        late_us = late // 1000
        self._late_ns = late
        self._sampled_late_s = self._sampling_delay_ns(late % self.cycle_ns) * 1e-9
        self.counters.late[min(late_us.bit_length(), _LATE_BINS - 1)] += 1
        self.counters.late_max_us = max(self.counters.late_max_us, late_us)

    def _sampling_delay_ns(self, late: int) -> int:
        """Return the delay [ns] of the input sampling relative to the grid, for a late frame.

        With SYNC0, inputs are sampled on the grid, half a cycle before the frame; a frame that
        passes after the next SYNC0 gets the sample of that one. Without SYNC0 the frame itself
        triggers the sampling.
        """
        if not self.dc:
            return late
        return self.cycle_ns if 2 * late > self.cycle_ns else 0

    def _exchange(self) -> int:
        if not self._segment.in_step():
            return -1
        self._master.send_processdata()
        left_s = (self.next_ns + self.cycle_ns - time.monotonic_ns()) * 0.95e-9
        if self._lockstep:
            # A late reply is awaited; a missing one must not delay the others.
            left_s = self.cycle_ns * 1e-9 if self._invalid_run else _LOCKSTEP_WAIT_S
        if self._fd is None:
            # Without a socket to wait for, SOEM polls the capture library. Meanwhile another thread
            # receives commands, a STOP among them.
            wait_us = round(max(left_s, _LEAST_WAIT_S) * 1e6)
            came = int(self._master.receive_processdata(wait_us, release_gil=True))
            self._segment.note_process_data(came_back=came >= 0)
            return came
        ready, _, _ = select.select((self._fd,), (), (), max(left_s, _LEAST_WAIT_S))
        if not ready:
            # Makes SOEM give the frame up; it returns at once.
            self._master.receive_processdata(0)
            return -1
        wkc: int = self._master.receive_processdata(_RECEIVE_US)
        return wkc

    def _count_invalid(self, wkc: int) -> None:
        if wkc < 0:
            self.counters.lost_frames += 1
        else:
            self.counters.wkc_errors += 1
        self._invalid_run += 1
        if self._invalid_run >= self._distrust and self.moving():
            silent = text("ethercat.no-valid-process-data", cycles=self._invalid_run)
            self.stop_axes(Halted(HaltCause.LOST, note=silent))

    def _decide(self, image: Image, slave: object, *, valid: bool) -> None:
        axis = image.axis
        if valid and not image.lost:
            axis.step(image.unpack(image.inputs), self._sampled_late_s)
        else:
            axis.blind()
        try:
            outputs = image.pack(*axis.outputs)
        except struct.error:
            # A setpoint does not fit its type: the last valid outputs are kept while the axis
            # brakes.
            axis.stop(Halted(HaltCause.UNFIT))
            return
        if outputs != image.outputs:
            image.outputs = outputs
            slave.output = outputs  # type: ignore[attr-defined]

    def _look_at_pairs(self) -> None:
        for pair in self._pairs:
            pair.look()
        self._pairs = [pair for pair in self._pairs if not pair.over]

    def _sample(self, wkc: int, *, valid: bool) -> None:
        self._ring.put(
            (
                self.number,
                self.next_ns,
                self._master.dc_time if self.dc else 0,
                wkc,
                self.expected_wkc,
                (VALID if valid else 0) | self._resynced | self._lost_flags,
                self._late_ns // 1000,
            ),
            self._payload(),
        )

    def _payload(self) -> list[bytes]:
        parts = []
        for image in self.images:
            parts.append(image.outputs)
            parts.append(image.inputs)
        return parts

    def _follow_clock(self) -> int:
        """Return the correction of the grid [ns] so that frames pass half a cycle before SYNC0."""
        error = self._phase.error_ns(self._master.dc_time, self._late_ns)
        self.counters.dc_deviation_ns = error
        if abs(error) > self.counters.dc_deviation_max_ns and self.number > 2000:
            self.counters.dc_deviation_max_ns = abs(error)
        return self._phase.correction_ns(error)


def percentile_us(late: list[int], fraction: float) -> int:
    """Return the upper edge [µs] of the bin below which ``fraction`` of all wake-ups lie."""
    total = sum(late)
    seen = 0
    for place, count in enumerate(late):
        seen += count
        if total and seen >= fraction * total:
            return int(2**place)
    return 0
