"""SYNC-driven process data: `drivers.link.Cyclic` on a CAN bus.

Per cycle: SYNC, then the outputs for the next SYNC; the inputs triggered by SYNC arrive meanwhile
and form one sample. `stop` restores the previous settings of the drives. The loop owns the control
word of every axis for which it has outputs (`drivers.link.OwnsPowerState`).
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

from drivers.canopen import frames
from drivers.canopen.adapters.port import CanPort
from drivers.canopen.exchange.busload import BusLoad
from drivers.canopen.exchange.drive_setup import DriveSetup, ReadObject, WriteObject
from drivers.canopen.exchange.fixed_pdo import FixedPdo
from drivers.canopen.exchange.images import CONTROL_WORD, Images
from drivers.canopen.exchange.pdo import PdoPlan, plan_within_load
from drivers.canopen.exchange.synchronous import LoopClock, SyncLoop
from drivers.canopen.exchange.trajectory import motion_of
from drivers.canopen.frames import Frame
from drivers.canopen.sdo.transfers import fitted
from drivers.canopen.url import CanUrl
from drivers.cia402 import Dialect, Mode, State
from drivers.errors import DriveError, LinkLost, NotAllowed
from drivers.halt import HaltCause, Halted, LoopState
from drivers.link import CyclicSignal, LinkEvent, ScopeBlock, Trajectory, Unsubscribe
from drivers.motion.playback import AxisLoop
from drivers.motion.setpoint_plan import Phase
from drivers.motion.setpoints import require_playable
from drivers.texts.message import Text, text

SHORTEST_CYCLE_S = 0.001
_MODE = 0x6060
_SEEN_S = 0.25
_OWNED = (CONTROL_WORD, 0x607A, 0x60FF, 0x6071, 0x60B0, 0x60B1, 0x60B2)

InWorker = Callable[[Callable[[], None]], Awaitable[None]]


@dataclass(frozen=True, slots=True)
class _Configured:
    pdos: tuple[PdoPlan, ...]
    cycle_s: float


class CanopenCyclic:
    """See `drivers.link.Cyclic`. Shortest cycle 1 ms."""

    def __init__(
        self,
        port: CanPort,
        settings: CanUrl,
        read: ReadObject,
        write: WriteObject,
        in_worker: InWorker,
        clock: LoopClock | None = None,
    ) -> None:
        self.load: BusLoad | None = None
        self._fixed_pdos: dict[int, tuple[FixedPdo, ...]] = {}
        self.dc = None
        self.left_over: tuple[tuple[CyclicSignal, Text], ...] = ()
        """Signals of the last `configure` that are not exchanged, each with the reason."""
        self.unguarded: frozenset[int] = frozenset()
        """Stations with outputs whose drive has no heartbeat consumer (1016h)."""
        self._port = port
        self._settings = settings
        self._read = read
        self._write = write
        self._setup = DriveSetup(read, write, settings.own_id)
        self._in_worker = in_worker
        self._configured: _Configured | None = None
        self._without_cyclic_modes: set[int] = set()
        self._dialects: dict[int, Dialect] = {}
        self._clock = clock
        self._loop: SyncLoop | None = None
        self._consumers: list[Callable[[ScopeBlock], None]] = []
        self._send_event: Callable[[LinkEvent], None] = lambda _event: None
        self._heard: Callable[[int], bool] = lambda _node: False

    @property
    def power(self) -> CanopenCyclic:
        """The exchange itself: its loop writes the control words."""
        return self

    @property
    def pairs(self) -> None:
        """None: the loop moves each axis separately."""
        return None

    @property
    def speeds(self) -> CanopenCyclic:
        """The exchange itself: it can send speeds to drives without a cyclic mode."""
        return self

    @property
    def trouble(self) -> Text | None:
        """None: an exchange that broke off is not restarted automatically."""
        return None

    def watch_nodes_by(self, heard: Callable[[int], bool]) -> None:
        """Set the function that returns whether a node of this number is on the bus."""
        self._heard = heard

    def send_events_to(self, send: Callable[[LinkEvent], None]) -> None:
        """Set the receiver of the loop's events (called on any thread)."""
        self._send_event = send

    def set_modes(self, station: int, modes: Sequence[int]) -> None:
        """Set the drive's modes: without CSP, CSV or CST its commands are sent by SDO."""
        if {8, 9, 10} & set(modes):
            self._without_cyclic_modes.discard(station)
        else:
            self._without_cyclic_modes.add(station)

    def set_fixed_pdos(self, station: int, fixed: Sequence[FixedPdo]) -> None:
        """Set the PDOs of the drive that cannot be mapped again."""
        self._fixed_pdos[station] = tuple(fixed)

    def speak(self, station: int, dialect: Dialect) -> None:
        """Set the dialect of the drive's commands; without a cyclic mode they still use SDO."""
        self._dialects[station] = dialect

    def take_speeds(self, station: int, by_profile_velocity: bool) -> None:
        """See `drivers.link.TakesSpeeds`."""
        mode = Mode.PV if by_profile_velocity else Mode.CSV
        self._dialects[station] = replace(self._dialect(station), speed_mode=mode)

    def _dialect(self, station: int) -> Dialect:
        return self._dialects.get(station, Dialect())

    def _by_sdo(self, station: int) -> bool:
        """Return whether the commands of this drive are not sent in the process data."""
        by_speed = self._dialect(station).speed_mode is Mode.PV
        return station in self._without_cyclic_modes and not by_speed

    async def configure(
        self, inputs: Sequence[CyclicSignal], outputs: Sequence[CyclicSignal], cycle_s: float
    ) -> tuple[CyclicSignal, ...]:
        """Plan the PDOs and return the signals that fit; nothing is written before `start`.

        Raises:
            NotAllowed: cycle below 1 ms, bus load above 80 % even with only the most important
                signals, or still running.
        """
        if self._loop is not None:
            raise NotAllowed("canopen.cyclic-exchange-running")
        if cycle_s < SHORTEST_CYCLE_S * 0.999:
            raise NotAllowed(
                "canopen.cycle-ms-too-short", value=cycle_s, limit="1 ms", cycle_ms=cycle_s * 1e3
            )
        by_sdo = [s for s in outputs if self._by_sdo(s.station)]
        cyclic = [s for s in outputs if not self._by_sdo(s.station)]
        planned = plan_within_load(
            inputs, cyclic, cycle_s, self._settings.bitrate, self._fixed_pdos
        )
        why = text("canopen.commanded-by-sdo")
        self.left_over = (*planned.left_over, *((s, why) for s in by_sdo))
        if not planned.pdos:
            raise NotAllowed("canopen.none-signals-travel-pdo")
        self.load = planned.load
        self._configured = _Configured(planned.pdos, cycle_s)
        left = [signal for signal, _ in self.left_over]
        return tuple(s for s in (*inputs, *outputs) if s not in left)

    async def start(self) -> None:
        """Map the PDOs, set up the drives' watchdogs, go to Operational and start the loop.

        Raises:
            NotAllowed: nothing is configured, or a drive refuses the mapping.
            LinkTimeout, LinkLost: as for any write; all changes have been undone.
        """
        configured = self._configured
        if configured is None:
            raise NotAllowed("canopen.no-signals-configured")
        if self._loop is not None:
            return
        event_loop = asyncio.get_running_loop()
        images = Images(configured.pdos, configured.cycle_s, self._report, self._dialects)
        try:
            await self._in_worker(partial(self._prepare, configured, images))
        except BaseException:
            await asyncio.shield(self._in_worker(self._setup.undo))
            raise

        def deliver(block: ScopeBlock) -> None:
            event_loop.call_soon_threadsafe(self._deliver, block)

        self._loop = SyncLoop(
            self._port.send,
            images,
            configured.cycle_s,
            deliver=deliver,
            notify=self._send_event,
            own_id=self._settings.own_id,
            clock=self._clock,
        )
        self._loop.start()
        try:
            await self._in_worker(partial(self._nmt, frames.NMT_START, images.stations))
        except BaseException:
            with suppress(DriveError):
                await asyncio.shield(self.stop())
            raise

    async def stop(self) -> None:
        """Ramp down every moving axis, leave Operational and restore the drives' PDOs."""
        loop = self._loop
        if loop is None:
            return
        try:
            await self._in_worker(loop.halt_and_wait)
            # Before our heartbeat ends: otherwise the drives' own watchdog would report a fault.
            await self._in_worker(self._setup.unguard)
            stations = loop.images.stations
            await self._in_worker(partial(self._nmt, frames.NMT_PREOPERATIONAL, stations))
        finally:
            await self._in_worker(loop.stop)
            self._loop = None
            await self._in_worker(self._setup.undo)

    async def shut_down(self) -> None:
        """Run `stop` in any state of the bus; an error is only reported as an event."""
        try:
            await self.stop()
        except DriveError as error:
            self._send_event(
                LinkEvent("fault", None, text("event.pdos-not-restored", cause=error.text))
            )

    async def play(self, trajectories: Sequence[Trajectory]) -> int:
        """Play trajectories in synchronism; return the cycle number of the first value.

        Raises:
            NotAllowed: not running or not enabled, a target that is not a mapped output, a jump at
                the beginning, or an envelope limit whose signal is not among the inputs.
            OutOfRange: a value does not fit its target or the envelope, there is none, or the
                number of offsets differs; nothing was sent.
        """
        loop = self._require_running()
        for trajectory in trajectories:
            require_playable(trajectory)
        motions = [(t.station, motion_of(t, loop.cycle_s)) for t in trajectories]
        for trajectory in trajectories:
            self._require_axis(trajectory.station)
            await self._until_seen_enabled(loop, trajectory.station)
        return loop.play(motions)

    async def _until_seen_enabled(self, loop: SyncLoop, station: int) -> None:
        """Wait until the process data show Operation enabled, which an SDO may report earlier."""
        axis = loop.images.axes[station]
        waited_s = 0.0
        enabled = State.OPERATION_ENABLED
        while axis.goal is enabled and axis.state is not enabled and waited_s < _SEEN_S:
            await asyncio.sleep(loop.cycle_s)
            waited_s += loop.cycle_s

    async def renew(self, station: int) -> None:
        """Extend the validity of the setpoints of ``station``."""
        self._require_running().axis(station, AxisLoop.renew)

    async def halt(self, station: int | None = None) -> None:
        """Brake now and leave Operation enabled; setpoints end.

        Raises:
            LinkLost: the bus is lost. The setpoints end nevertheless, for when the bus is back.
        """
        if self._loop is not None:
            self._loop.halt(station, Halted(HaltCause.COMMANDED))
            if self._loop.bus_lost:
                raise LinkLost("canopen.bus-lost")

    async def pause(self, station: int) -> None:
        """Brake now and hold, enabled, for the next motion."""
        self._require_running().axis(station, AxisLoop.pause)

    def blocks(self, consumer: Callable[[ScopeBlock], None]) -> Unsubscribe:
        """Deliver samples on the event loop's thread."""
        self._consumers.append(consumer)

        def leave() -> None:
            if consumer in self._consumers:
                self._consumers.remove(consumer)

        return leave

    def newest(self, channels: Sequence[str], within_s: float) -> dict[str, int | float]:
        """Return the raw values of the last cycle, see `drivers.link.Cyclic`."""
        reported = {} if self._loop is None else self._loop.newest(within_s)
        return {channel: reported[channel] for channel in channels if channel in reported}

    # Power states (drivers.link.OwnsPowerState)

    @property
    def running(self) -> bool:
        """Whether process data are being exchanged."""
        return self._loop is not None and self._loop.running

    def owns(self, station: int) -> bool:
        """Return whether the loop writes the control word of ``station``."""
        return self._loop is not None and station in self._loop.images.axes

    async def drive_to(self, station: int, goal: State, mode: int | None = None) -> None:
        """Request a power state; the axis brakes before it leaves Operation enabled.

        Raises:
            NotAllowed: the drive has a fault, moves, or its control word is not mapped; or it was
                halted while its mode was written.
        """
        loop = self._require_running()
        self._require_axis(station)
        halts = loop.halts(station)
        if mode is not None and (station, _MODE, 0) not in loop.images.outputs:
            data = self._dialect(station).mode(mode).to_bytes(1, "little", signed=True)
            await self._in_worker(partial(self._write, station, _MODE, 0, data))

        def head_for(axis: AxisLoop) -> None:
            if goal is State.OPERATION_ENABLED and loop.halts(station) != halts:
                raise NotAllowed("cyclic.station-halted-meanwhile", station=station)
            axis.drive_to(goal, mode)

        loop.axis(station, head_for)

    async def reset_fault(self, station: int) -> None:
        """Reset a fault once; the axis stays disabled."""
        self._require_axis(station)
        self._require_running().axis(station, AxisLoop.reset_fault)

    def axis_state(self, station: int) -> LoopState:
        """Return power state, phase of the setpoints, and why the last motion was halted."""
        axis = None if self._loop is None else self._loop.images.axes.get(station)
        if axis is None:
            return LoopState(State.UNKNOWN.value, Phase.IDLE.value, None)
        return LoopState(axis.state.value, axis.phase.value, axis.halted)

    # For the link

    def statistics(self) -> dict[str, float | int | str]:
        """Return cycles, lost samples and SYNC lateness [µs], for the link quality."""
        figures: dict[str, float | int | str] = {}
        if self.load is not None:
            figures["cyclic_bus_load_percent"] = round(100 * self.load.fraction, 1)
        if self._loop is not None:
            figures |= self._loop.statistics()
        return figures

    def forget_arrivals(self) -> None:
        """See `SyncLoop.forget_arrivals`."""
        if self._loop is not None:
            self._loop.forget_arrivals()

    def arrivals(self, station: int) -> tuple[int, tuple[int, ...]]:
        """See `SyncLoop.arrivals`; empty while the exchange does not run."""
        return (0, ()) if self._loop is None else self._loop.arrivals(station)

    def take(self, frame: Frame) -> bool:
        """Take a received frame if it is one of the input PDOs (receiving thread)."""
        loop = self._loop
        return loop is not None and loop.take(frame)

    def event(self, event: LinkEvent) -> None:
        """End setpoints on a loss or restart: they must not continue afterwards."""
        if self._loop is None:
            return
        own = self._settings.own_id
        if (event.kind, event.station) == ("boot", own) and self._loop.images.outputs:
            # From now on its heartbeat could be taken for ours: see `_require_own_number`.
            twice = text("event.own-number-started", node=own)
            self._loop.halt(None, Halted(HaltCause.LOST, note=twice))
        elif event.kind in ("lost", "boot") or (event.kind == "fault" and event.station is None):
            self._loop.abandon(event.station, Halted(HaltCause.LOST, note=event.text))
        elif event.kind == "fault":
            self._loop.halt(event.station, Halted(HaltCause.LOST, note=event.text))

    def drives(self, station: int, index: int, subindex: int) -> bool:
        """Return whether this object is written by our PDOs in each cycle."""
        loop = self._loop
        return loop is not None and (station, index, subindex) in loop.images.outputs

    def put(self, station: int, index: int, subindex: int, data: bytes) -> None:
        """Send ``data`` with the PDOs from now on; return when they are on the bus. Blocks.

        Raises:
            NotAllowed: the loop itself writes this object.
        """
        loop = self._require_running()
        if station in loop.images.axes and subindex == 0 and index in _OWNED:
            raise NotAllowed(
                "canopen.node-cyclic-exchange-writes",
                parameter=f"{index:04X}:00",
                node=station,
                index=index,
            )
        loop.put((station, index, subindex), data)

    # Beneath

    def _require_running(self) -> SyncLoop:
        if self._loop is None:
            raise NotAllowed("canopen.cyclic-exchange-not-running")
        return self._loop

    def _require_axis(self, station: int) -> None:
        if not self.owns(station):
            raise NotAllowed("canopen.node-control-word-not", node=station)

    def _report(self, station: int, why: Text) -> None:
        self._send_event(
            LinkEvent("fault", station, text("event.of-node", node=station, event=why))
        )

    def _deliver(self, block: ScopeBlock) -> None:
        for consumer in list(self._consumers):
            consumer(block)

    def _nmt(self, command: int, stations: Sequence[int]) -> None:
        for station in stations:
            self._port.send(Frame(frames.NMT, bytes([command, station])))

    def _require_own_number(self) -> None:
        """Raise NotAllowed if the heartbeat of a node could be taken for ours."""
        own = self._settings.own_id
        if self._heard(own):
            raise NotAllowed("canopen.node-bus-number-under", value=own)

    def _prepare(self, configured: _Configured, images: Images) -> None:
        """Map and guard the drives; start from their present values, so that nothing changes."""
        if images.outputs:
            self._require_own_number()
        self._nmt(frames.NMT_PREOPERATIONAL, images.stations)
        self._setup.undo()  # what an exchange left that ended with the loss of the adapter
        self._setup.map_pdos(configured.pdos)
        unguarded = set()
        for station in sorted({station for station, _, _ in images.outputs}):
            self._setup.interpolate(station, configured.cycle_s)
            if not self._setup.guard(station):
                unguarded.add(station)
                self._send_event(
                    LinkEvent("state", station, text("event.no-heartbeat-watchdog", node=station))
                )
        self.unguarded = frozenset(unguarded)
        for key, slot in images.outputs.items():
            data = fitted(self._read(*key), slot.size)
            if len(data) != slot.size:
                raise NotAllowed(
                    "canopen.node-bytes-expected",
                    node=key[0],
                    key=key[1],
                    other_key=key[2],
                    bytes=len(data),
                    slot_size=slot.size,
                )
            images.set_output(key, data)
