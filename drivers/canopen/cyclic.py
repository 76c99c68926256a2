"""SYNC-driven process data: `drivers.link.Cyclic` on a CAN bus.

Per cycle: SYNC, then the outputs for the next SYNC; the inputs that SYNC called for arrive
meanwhile and form one sample. The set-up of the drives is undone by `stop`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from functools import partial

from drivers.canopen import frames
from drivers.canopen.busload import BusLoad, require_room
from drivers.canopen.frames import Frame
from drivers.canopen.pdo import INVALID, PdoPlan, SdoWrite, plan, set_up
from drivers.canopen.port import CanPort
from drivers.canopen.setpoints import Player
from drivers.canopen.synchronous import SyncLoop, Tables
from drivers.canopen.url import CanUrl
from drivers.codec import decode
from drivers.errors import DriveError, LinkLost, NotAllowed, Rejected
from drivers.link import (
    CyclicSignal,
    Envelope,
    LinkEvent,
    ScopeBlock,
    Trajectory,
    Unsubscribe,
)

SHORTEST_CYCLE_S = 0.001
_WATCHDOG_MS = 200
_PDO_FLAGS = 0x60000000

#: Which input each limit of an envelope is judged by.
_ENVELOPE_INPUT = {"position": 0x6064, "speed": 0x606C, "torque": 0x6077, "following": 0x60F4}


ReadObject = Callable[[int, int, int], bytes]
"""Read (station, index, subindex), blocking."""

WriteObject = Callable[[int, int, int, bytes], None]
"""Write (station, index, subindex, data), blocking."""

InWorker = Callable[[Callable[[], None]], Awaitable[None]]


@dataclass(slots=True)
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
    ) -> None:
        self.load: BusLoad | None = None
        self.unguarded: frozenset[int] = frozenset()
        """Stations with outputs whose drive offers no watchdog (1016h) against our silence."""
        self._port = port
        self._settings = settings
        self._read = read
        self._write = write
        self._in_worker = in_worker
        self._configured: _Configured | None = None
        self._undo: list[tuple[int, SdoWrite]] = []
        self._loop: SyncLoop | None = None
        self._consumers: list[Callable[[ScopeBlock], None]] = []
        self._tell: Callable[[LinkEvent], None] = lambda _event: None

    def tell_events_to(self, tell: Callable[[LinkEvent], None]) -> None:
        """Where events of the loop go (any thread)."""
        self._tell = tell

    async def configure(
        self, inputs: Sequence[CyclicSignal], outputs: Sequence[CyclicSignal], cycle_s: float
    ) -> tuple[CyclicSignal, ...]:
        """Plan the PDOs and return the signals that fit; nothing is written before `start`.

        Raises:
            NotAllowed: cycle below 1 ms, bus load above 80 %, or still running.
        """
        if self._loop is not None:
            raise NotAllowed(
                "the cyclic exchange is running", remedy="stop it before changing signals"
            )
        if cycle_s < SHORTEST_CYCLE_S * 0.999:
            raise NotAllowed(
                f"a cycle of {cycle_s * 1e3:g} ms is too short for CANopen",
                value=cycle_s,
                limit="1 ms",
                remedy="use 1 ms or longer",
            )
        pdos, left = plan(inputs, outputs)
        if not pdos:
            raise NotAllowed("none of these signals can travel in a PDO", remedy="poll them")
        self.load = require_room([p.size for p in pdos], cycle_s, self._settings.bitrate)
        self._configured = _Configured(pdos, cycle_s)
        return tuple(s for s in (*inputs, *outputs) if s not in left)

    async def start(self) -> None:
        """Map the PDOs, set up the drives' watchdogs, go to Operational and run.

        Raises:
            NotAllowed: nothing configured, or a drive does not let itself be mapped.
            LinkTimeout, LinkLost: as for any write; what was changed has been put back.
        """
        configured = self._configured
        if configured is None:
            raise NotAllowed("no signals are configured", remedy="configure before starting")
        if self._loop is not None:
            return
        event_loop = asyncio.get_running_loop()
        try:
            await self._in_worker(partial(self._set_up_drives, configured))
        except BaseException:
            await asyncio.shield(self._in_worker(self._undo_drives))
            raise
        tables = Tables.of(configured.pdos)
        await self._in_worker(partial(self._read_outputs, configured, tables))

        def deliver(block: ScopeBlock) -> None:
            event_loop.call_soon_threadsafe(self._deliver, block)

        loop = SyncLoop(
            self._port.send,
            tables,
            configured.cycle_s,
            deliver=deliver,
            tell=self._tell,
            own_id=self._settings.own_id,
        )
        self._loop = loop
        loop.start()
        stations = sorted({p.station for p in configured.pdos})
        await self._in_worker(partial(self._nmt, frames.NMT_START, stations))

    async def stop(self) -> None:
        """Ramp down whatever moves, leave Operational and put the drives' PDOs back."""
        loop, configured = self._loop, self._configured
        if loop is None or configured is None:
            return
        stations = sorted({p.station for p in configured.pdos})
        try:
            await self._in_worker(loop.halt_and_wait)
            # Before the silence: else the drives' own watchdog would report a fault.
            await self._in_worker(partial(self._undo_watchdogs))
            await self._in_worker(partial(self._nmt, frames.NMT_PREOPERATIONAL, stations))
        finally:
            await self._in_worker(loop.stop)
            self._loop = None
            await self._in_worker(self._undo_drives)

    async def shut_down(self) -> None:
        """`stop`, whatever state the bus is in."""
        try:
            await self.stop()
        except DriveError as error:
            self._tell(LinkEvent("fault", None, f"the PDOs could not be put back: {error}"))

    async def play(self, trajectories: Sequence[Trajectory]) -> int:
        """Play trajectories in step; returns the cycle counter of the first value.

        Raises:
            NotAllowed: not running, a target that is not a mapped output, or an envelope limit
                whose signal is not among the inputs and so cannot be enforced.
        """
        loop = self._require_running()
        for trajectory in trajectories:
            for target in (trajectory.target, trajectory.offset_target):
                if target is not None and not loop.tables.has_output(
                    trajectory.station, target.index or 0, target.subindex
                ):
                    raise NotAllowed(
                        f"{target} of node {trajectory.station} is not a cyclic output",
                        parameter=str(target),
                        remedy="configure it as an output first",
                    )
            for name, index in _ENVELOPE_INPUT.items():
                if _limits(trajectory.envelope, name) and not loop.tables.has_input(
                    trajectory.station, index
                ):
                    raise NotAllowed(
                        f"the {name} limit of node {trajectory.station} cannot be enforced: "
                        f"{index:04X}:00 is not among the cyclic inputs",
                        parameter=f"{index:04X}:00",
                        remedy="configure it as an input first",
                    )
        return loop.play([Player(t, loop.cycle_s) for t in trajectories])

    async def renew(self, station: int) -> None:
        """Extend the life of the setpoints of ``station``."""
        self._require_running().renew(station)

    async def halt(self, station: int | None = None) -> None:
        """Controlled stop now; the axis stays enabled and its setpoints end."""
        if self._loop is not None:
            self._loop.halt(station)

    def blocks(self, consumer: Callable[[ScopeBlock], None]) -> Unsubscribe:
        """Deliver samples on the event loop's thread."""
        self._consumers.append(consumer)

        def leave() -> None:
            if consumer in self._consumers:
                self._consumers.remove(consumer)

        return leave

    def statistics(self) -> dict[str, float | int | str]:
        """Cycles, lost samples and SYNC lateness in µs, for link quality."""
        figures: dict[str, float | int | str] = {}
        if self.load is not None:
            figures["cyclic_bus_load_percent"] = round(100 * self.load.fraction, 1)
        if self._loop is not None:
            figures |= self._loop.statistics()
        return figures

    def take(self, frame: Frame, now_s: float) -> bool:
        """Take a received frame if it is one of our input PDOs (receiving thread)."""
        loop = self._loop
        return loop is not None and loop.take(frame, now_s)

    def event(self, event: LinkEvent) -> None:
        """A loss or restart ends setpoints: they must not go on by themselves afterwards."""
        if self._loop is None:
            return
        if event.kind in ("lost", "boot") or event.station is None:
            self._loop.abandon(event.station)
        elif event.kind == "fault":
            self._loop.halt(event.station, disable=True)

    def drives(self, station: int, index: int, subindex: int) -> bool:
        """Whether this object is written by our PDOs each cycle."""
        loop = self._loop
        return loop is not None and loop.tables.has_output(station, index, subindex)

    def put(self, station: int, index: int, subindex: int, data: bytes) -> None:
        """Send ``data`` with the PDOs from now on; returns when it is on the bus. Blocks."""
        self._require_running().put(station, index, subindex, data)

    def _require_running(self) -> SyncLoop:
        if self._loop is None:
            raise NotAllowed("the cyclic exchange is not running", remedy="start it first")
        return self._loop

    def _deliver(self, block: ScopeBlock) -> None:
        for consumer in list(self._consumers):
            consumer(block)

    def _nmt(self, command: int, stations: Sequence[int]) -> None:
        for station in stations:
            self._port.send(Frame(frames.NMT, bytes([command, station])))

    # Setting the drives up, with the way back.

    def _set_up_drives(self, configured: _Configured) -> None:
        stations = sorted({p.station for p in configured.pdos})
        self._nmt(frames.NMT_PREOPERATIONAL, stations)
        for station in stations:
            used = {
                p.number for p in configured.pdos if (p.station, p.direction) == (station, "tx")
            }
            for number in range(4):
                if number not in used:
                    self._silence(station, 0x1800 + number)
        for pdo in configured.pdos:
            self._map(pdo)
        unguarded = set()
        for station in sorted({p.station for p in configured.pdos if p.direction == "rx"}):
            if not self._guard(station):
                unguarded.add(station)
                self._tell(
                    LinkEvent(
                        "state",
                        station,
                        f"node {station} offers no heartbeat watchdog (1016h): it would not "
                        "notice if this computer stopped sending",
                    )
                )
        self.unguarded = frozenset(unguarded)

    def _change(self, station: int, write: SdoWrite) -> None:
        """Write, remembering how to undo it."""
        before = self._read(station, write.index, write.subindex)
        self._undo.append((station, SdoWrite(write.index, write.subindex, before)))
        self._write(station, write.index, write.subindex, write.data)

    def _silence(self, station: int, communication: int) -> None:
        try:
            cob = int.from_bytes(self._read(station, communication, 1), "little")
            if not cob & INVALID:
                data = (cob | INVALID).to_bytes(4, "little")
                self._change(station, SdoWrite(communication, 1, data))
        except Rejected:
            return  # a drive without this PDO has nothing to silence

    def _map(self, pdo: PdoPlan) -> None:
        station = pdo.station
        try:
            cob = self._read(station, pdo.communication, 1)
            kind = self._read(station, pdo.communication, 2)
            count = self._read(station, pdo.mapping, 0)
            entries = [self._read(station, pdo.mapping, n) for n in range(1, min(count[0], 8) + 1)]
            before = [SdoWrite(pdo.communication, 1, cob)]
            before += [SdoWrite(pdo.mapping, 0, count)]
            before += [SdoWrite(pdo.mapping, n, e) for n, e in enumerate(entries, 1)][::-1]
            before += [SdoWrite(pdo.mapping, 0, b"\0"), SdoWrite(pdo.communication, 2, kind)]
            invalid = int.from_bytes(cob, "little") | INVALID
            before += [SdoWrite(pdo.communication, 1, invalid.to_bytes(4, "little"))]
            # The list is undone from its end: invalid first, then the mapping, then valid again.
            self._undo += [(station, write) for write in before]
            for write in set_up(pdo, int.from_bytes(cob, "little") & _PDO_FLAGS):
                self._write(station, write.index, write.subindex, write.data)
        except Rejected as refusal:
            names = ", ".join(str(s.address) for s in pdo.signals)
            raise NotAllowed(
                f"node {station} does not let {names} be mapped to PDO {pdo.number + 1}: "
                f"{refusal.message}",
                drive=f"node {station}",
                parameter=refusal.parameter,
                remedy="leave these signals out, they can be polled",
            ) from refusal

    def _guard(self, station: int) -> bool:
        value = (self._settings.own_id << 16 | _WATCHDOG_MS).to_bytes(4, "little")
        try:
            self._change(station, SdoWrite(0x1016, 1, value))
        except Rejected:
            return False
        return self._read(station, 0x1016, 1) == value

    def _undo_watchdogs(self) -> None:
        mine = [(s, w) for s, w in self._undo if w.index == 0x1016]
        self._undo = [(s, w) for s, w in self._undo if w.index != 0x1016]
        self._put_back(mine)

    def _undo_drives(self) -> None:
        undo, self._undo = self._undo, []
        self._put_back(undo)

    def _put_back(self, undo: Sequence[tuple[int, SdoWrite]]) -> None:
        failures: list[str] = []
        for station, write in reversed(undo):
            try:
                self._write(station, write.index, write.subindex, write.data)
            except LinkLost:
                raise
            except DriveError as error:
                failures.append(f"node {station} {write.index:04X}:{write.subindex:02X} ({error})")
        if failures:
            raise NotAllowed(
                "these settings of the drives could not be put back: " + "; ".join(failures),
                remedy="restart the drives before using them with another master",
            )

    def _read_outputs(self, configured: _Configured, tables: Tables) -> None:
        """Start from the drive's present values, so that the first PDO changes nothing."""
        for pdo in configured.pdos:
            if pdo.direction == "rx":
                for signal in pdo.signals:
                    address = signal.address
                    index = address.index or 0
                    data = self._read(pdo.station, index, address.subindex)
                    decode(address.type, data)
                    tables.set_output(pdo.station, index, address.subindex, data)


def _limits(envelope: Envelope, name: str) -> bool:
    values = {
        "position": (envelope.position_min, envelope.position_max),
        "speed": (envelope.speed_max,),
        "torque": (envelope.torque_max,),
        "following": (envelope.following_error_max,),
    }[name]
    return any(value is not None for value in values)
