"""A virtual drive without a wire: the product's own loop (`AxisLoop`) next to the firmware.

For what needs many axes or many samples and nothing of the wire itself. While the exchange runs
time passes as fast as the computer can, 20 ms at a go, and `time.monotonic` with it: who waits for
30 ms or has 3 s, waits for 30 ms and has 3 s of the drive. While something is computed in a thread
time keeps to the pace of its processor time about, so that a busy computer, where the same takes
longer, changes nothing. One cycle lies between a setpoint and the sample that shows it, as with
EtherCAT.
"""

from __future__ import annotations

import array
import asyncio
import struct
import threading
import time
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.drive import Drive
from backend.axes.drive.ports import Port
from drivers.cia402 import State
from drivers.errors import DriveError, LinkLost, Rejected
from drivers.ethercat.exchange.cyclic import layout, places
from drivers.ethercat.exchange.mapping import Pdo, plan_station
from drivers.halt import HaltCause, Halted, LoopState
from drivers.link import (
    Address,
    CyclicSignal,
    Found,
    LinkEvent,
    LinkQuality,
    Progress,
    ScopeBlock,
    Trajectory,
    Unsubscribe,
)
from drivers.motion.interpolation import interpolation_period
from drivers.motion.playback import AxisLoop
from drivers.motion.setpoint_plan import Motion, limits_of
from drivers.texts.message import Text
from drivers.urls import bus_kind
from drivers.virtual.device import Device, SdoAbort
from drivers.virtual.firmware.factory import make_device
from drivers.virtual.mechanics import MechanicsSpec
from profiles.loader import load_profile
from profiles.schema import Profile
from tests.support.granted import set_up

STATION = 1
_MODE = 0x6060
#: Simulated time for one access to the dictionary.
_ACCESS_NS = 200_000
_TURN_NS = 20_000_000
#: What a turn lasts for those who compute meanwhile, in time of a processor: as long as the turn.
_REST_S = 0.02
#: Setpoints live this much longer than on a wire: simulated time outruns the tools' clock.
_PATIENCE = 1000


@dataclass
class DirectBench:
    axis: Axis
    session: CyclicSession
    link: DirectLink
    spec: MechanicsSpec


class _Computing:
    """How many calls the worker threads of event loops have at hand."""

    count = 0
    _lock = threading.Lock()

    @classmethod
    def watch(cls, loop: asyncio.AbstractEventLoop) -> None:
        ordinary = loop.run_in_executor

        def counted(executor: Any, work: Callable[..., Any], *rest: Any) -> asyncio.Future[Any]:
            def done() -> Any:
                try:
                    return work(*rest)
                finally:
                    cls._add(-1)

            cls._add(1)
            return ordinary(executor, done)

        loop.run_in_executor = counted  # type: ignore[method-assign, assignment]

    @classmethod
    def _add(cls, calls: int) -> None:
        with cls._lock:
            cls.count += calls

    @classmethod
    def rest(cls) -> float:
        """Let threads compute for `_REST_S` of processor time, or until they are through.

        Returns the processor time that passed, in s: the drive's turn stands for it.
        """
        begun = time.process_time()
        while cls.count and time.process_time() - begun < _REST_S:
            # Not asyncio's: that would be over in no time, as it is the drive's.
            time.sleep(_REST_S / 5)
        return time.process_time() - begun


class _Clock:
    """`time.monotonic` of who waits for a drive whose time is ``drive_ns``.

    To that comes the processor's time while the exchange ``runs``, and else the computer's; not
    what it takes to ``simulate`` the drive, which no computer next to a real one does.
    """

    def __init__(
        self, drive_ns: Callable[[], int], runs: Callable[[], bool], simulate: Callable[[], float]
    ) -> None:
        self._drive_ns, self._runs, self._simulate = drive_ns, runs, simulate
        self._simulated = simulate()
        self._computers = time.monotonic
        self._lock = threading.Lock()
        self._passed = self._wall = self._computers()
        self._processor = time.process_time()

    def __call__(self) -> float:
        with self._lock:
            wall, processor = self._computers(), time.process_time()
            # Threads may compute side by side.
            simulated = self._simulate()
            own = processor - self._processor - (simulated - self._simulated)
            self._simulated = simulated
            computed = max(min(own, wall - self._wall), 0.0)
            self._passed += computed if self._runs() else wall - self._wall
            self._wall, self._processor = wall, processor
            return self._passed + self._drive_ns() / 1e9


class DirectLink:
    """`drivers.link.Link` and its `Cyclic` in one, on one virtual drive."""

    kind: Literal["ethercat", "canopen", "modbus", "mlink"] = "ethercat"
    url = "direct://virtual"
    traits = bus_kind("ethercat").traits
    left_over = ()
    doctor = frames = speeds = None
    trouble = None

    def __init__(self, device: Device, profile: Profile) -> None:
        self.device = device
        self.profile = profile
        self.now_ns = 0
        self.dc = True
        self.cycle_ns = 1_000_000
        self.cut = False
        """The cable is pulled: nothing comes back."""
        self.highest = {"speed": 0.0, "torque": 0.0, "low": 0.0, "high": 0.0}
        """Extremes of the actual values since the exchange began, raw."""
        self.late: Callable[[], int] = lambda: 0
        """Asked before each cycle: by how many cycles the computer is late for it."""
        self.lost: Callable[[], bool] = lambda: False
        """Asked at each cycle: whether its answer does not come; the drive has heard it."""
        self._loop: AxisLoop | None = None
        self._pump: asyncio.Task[None] | None = None
        self._count = 0
        """Of cycles whose samples were delivered."""
        self._ordinary_time = time.monotonic
        self.simulated_s = 0.0
        """Processor time that simulating took, and that passed as turns of the drive."""
        self._consumers: list[Callable[[ScopeBlock], None]] = []
        self._channels: tuple[str, ...] = ()
        self._written: dict[int, int] = {}

    # Link ----------------------------------------------------------------------------------

    def attach(self, station: int, profile: Profile) -> None:
        pass

    def unreachable(self, station: int, address: Address) -> Text | None:
        return None

    @property
    def cyclic(self) -> DirectLink:
        return self

    async def open(self) -> None:
        self.device.advance(0)
        _Computing.watch(asyncio.get_running_loop())
        time.monotonic = _Clock(lambda: self.now_ns, lambda: self.running, lambda: self.simulated_s)

    async def close(self) -> None:
        await self.stop()
        time.monotonic = self._ordinary_time

    async def scan(
        self,
        progress: Progress,
        stations: Sequence[int] | None = None,
        stop_after: int | None = None,
    ) -> list[Found]:
        del progress, stations, stop_after
        return [Found(STATION)]

    def pass_s(self, seconds: float) -> None:
        """Let time pass without any access."""
        self.now_ns += round(seconds * 1e9)
        self.device.advance(self.now_ns)

    def _access(self) -> None:
        if not self._reached:
            raise LinkLost("the cable is pulled, or the drive has no supply")
        if not self.running:
            self.now_ns += _ACCESS_NS
            self.device.advance(self.now_ns)

    async def read(self, station: int, address: Address) -> bytes:
        del station
        self._access()
        await asyncio.sleep(0)
        try:
            return self.device.read(address.index or 0, address.subindex)
        except SdoAbort as abort:
            raise Rejected(f"{address}", abort_code=abort.code) from abort

    async def read_many(
        self, station: int, addresses: Sequence[Address]
    ) -> list[bytes | DriveError]:
        found: list[bytes | DriveError] = []
        for address in addresses:
            try:
                found.append(await self.read(station, address))
            except DriveError as error:
                found.append(error)
        return found

    async def write(self, station: int, address: Address, data: bytes) -> None:
        del station
        self._access()
        if self.running and address.index == _MODE and _MODE in self._written:
            # As `drivers.ethercat.exchange.exchange` does: else the next cycle would take it back.
            assert self._loop is not None
            mode = int.from_bytes(data, "little", signed=True)
            self._loop.outputs[self._written[_MODE]] = mode
            await asyncio.sleep(0)
            return
        try:
            self.device.write(address.index or 0, address.subindex, data)
        except SdoAbort as abort:
            raise Rejected(f"{address}", abort_code=abort.code) from abort
        await asyncio.sleep(0)

    def quality(self, station: int | None = None) -> LinkQuality:
        del station
        return LinkQuality(connected=not self.cut)

    def listen(self, listener: Callable[[LinkEvent], None]) -> Unsubscribe:
        del listener
        return lambda: None

    # Cyclic --------------------------------------------------------------------------------

    async def configure(
        self, inputs: Sequence[CyclicSignal], outputs: Sequence[CyclicSignal], cycle_s: float
    ) -> tuple[CyclicSignal, ...]:
        plan = plan_station(STATION, inputs, outputs, self.profile)
        self.cycle_ns = round(cycle_s * 1e9)
        value, exponent = interpolation_period(self.cycle_ns)
        for sub, data in ((1, struct.pack("<B", value)), (2, struct.pack("<b", exponent))):
            try:
                self.device.write(0x60C2, sub, data)
            except SdoAbort:
                continue
        self._rx = self.device.map_process_data([e.word for e in plan.rx.entries], "rx")
        self._tx = self.device.map_process_data([e.word for e in plan.tx.entries], "tx")
        self._pack, self._unpack = layout(plan.rx.entries), layout(plan.tx.entries)
        names = {(s.address.index, s.address.subindex): s.channel for s in plan.mapped}
        self._columns = _columns(plan.rx, names), _columns(plan.tx, names)
        self._taken = tuple([place for place, _ in part] for part in self._columns)
        self._channels = tuple(n for part in self._columns for _, n in part)
        known = [e for e in plan.rx.entries if e.code != "x"]
        self._written = places(plan.rx.entries)
        self._loop = AxisLoop(
            STATION,
            inputs=places(plan.tx.entries),
            outputs=self._written,
            output_count=len(known),
            cycle_s=cycle_s,
            report=lambda _n, _t: None,
        )
        if _MODE in self._written:
            mode = self.device.read(_MODE, 0)
            self._loop.outputs[self._written[_MODE]] = int.from_bytes(mode, "little", signed=True)
        found = places(plan.tx.entries)
        self._watch = found[0x606C], found[0x6077], found[0x6064]
        return plan.mapped

    async def start(self) -> None:
        self._latched = self._tx.pack()
        self._pump = asyncio.get_running_loop().create_task(self._run())

    async def stop(self) -> None:
        if self._pump is not None:
            self._pump.cancel()
            self._pump = None

    @property
    def running(self) -> bool:
        return self._pump is not None and not self._pump.done() and self._reached

    @property
    def _reached(self) -> bool:
        return self.device.powered and not self.cut

    async def _run(self) -> None:
        per_turn = max(1, round(_TURN_NS / self.cycle_ns))
        while True:
            rows: list[list[float]] = []
            missed, begun = 0, time.thread_time()
            for _ in range(per_turn):
                if late := self.late():
                    self._deliver(rows, missed)
                    rows, missed = [], late
                    # As the real loops show it.
                    assert self._loop is not None
                    self._loop.skip(late)
                    self.now_ns += late * self.cycle_ns
                    self.device.advance(self.now_ns)
                rows.append(self._cycle())
                if self.lost():
                    # What was sent is known all the same.
                    inputs = len(self._columns[1])
                    rows[-1][-inputs:] = [np.nan] * inputs
            self.simulated_s += time.thread_time() - begun
            if not self._reached:
                return
            self._deliver(rows, missed)
            await asyncio.sleep(0)
            self.simulated_s += _Computing.rest()

    def _deliver(self, rows: list[list[float]], missed: int) -> None:
        if not rows:
            return
        samples = np.array(rows, np.float64)
        valid = ~np.isnan(samples).any(axis=1)
        block = ScopeBlock(
            0, self.now_ns / 1e9, self.cycle_ns / 1e9, self._channels, samples, missed, valid,
            cycle=self._count + missed,
        )  # fmt: skip
        self._count += missed + len(rows)
        for consumer in tuple(self._consumers):
            consumer(block)

    def _cycle(self) -> list[float]:
        loop = self._loop
        assert loop is not None
        outputs = loop.outputs
        sent = self._pack.pack(*outputs)
        self.now_ns += self.cycle_ns
        self.device.advance(self.now_ns)
        values = self._unpack.unpack(self._latched)
        row: list[float] = [outputs[i] for i in self._taken[0]]
        row += [values[i] for i in self._taken[1]]
        self._rx.unpack(sent)
        self._latched = self._tx.pack()
        self._extremes(values)
        loop.step(values)
        return row

    def _extremes(self, values: tuple[int, ...]) -> None:
        highest, (speed, torque, position) = self.highest, self._watch
        highest["speed"] = max(highest["speed"], abs(values[speed]))
        highest["torque"] = max(highest["torque"], abs(values[torque]))
        highest["low"] = min(highest["low"], values[position])
        highest["high"] = max(highest["high"], values[position])

    async def play(self, trajectories: Sequence[Trajectory]) -> int:
        assert self._loop is not None
        for t in trajectories:
            step = int(np.max(np.abs(np.diff(t.values)), initial=0))
            offset = t.offset_values
            self._loop.play(
                Motion(
                    t.target.index or 0,
                    array.array("q", t.values.tolist()),
                    limits_of(asdict(t.envelope)),
                    _PATIENCE * 1000,
                    step,
                    None if t.offset_target is None else t.offset_target.index,
                    None if offset is None else array.array("q", offset.tolist()),
                )
            )
        return self._count

    async def renew(self, station: int) -> None:
        del station
        assert self._loop is not None
        self._loop.renew()

    async def halt(self, station: int | None = None) -> None:
        del station
        assert self._loop is not None
        self._loop.stop(Halted(HaltCause.COMMANDED))

    async def pause(self, station: int) -> None:
        del station
        assert self._loop is not None
        self._loop.pause()

    def blocks(self, consumer: Callable[[ScopeBlock], None]) -> Unsubscribe:
        self._consumers.append(consumer)
        return lambda: self._consumers.remove(consumer)

    def newest(self, channels: Sequence[str], within_s: float) -> dict[str, int | float]:
        del channels, within_s
        return {}

    # OwnsPowerState ------------------------------------------------------------------------

    @property
    def power(self) -> DirectLink:
        return self

    async def drive_to(self, station: int, goal: State, mode: int | None = None) -> None:
        del station
        assert self._loop is not None
        self._loop.drive_to(goal, mode)

    async def reset_fault(self, station: int) -> None:
        del station
        assert self._loop is not None
        self._loop.reset_fault()

    def axis_state(self, station: int) -> LoopState:
        del station
        assert self._loop is not None
        return LoopState(self._loop.state.value, self._loop.phase.value, self._loop.halted)


def _columns(pdo: Pdo, names: Mapping[tuple[int | None, int], str]) -> list[tuple[int, str]]:
    known = [e for e in pdo.entries if e.code != "x"]
    return [
        (place, names[e.index, e.subindex])
        for place, e in enumerate(known)
        if (e.index, e.subindex) in names
    ]


@asynccontextmanager
async def direct(
    spec: MechanicsSpec,
    cycle_s: float = 1e-3,
    *,
    drive: str = "mms7",
    settings: Mapping[str, int] | None = None,
) -> AsyncIterator[DirectBench]:
    profile = load_profile(drive)
    link = DirectLink(make_device(drive, spec), profile)
    await link.open()
    axis = Axis(Drive("x", "X", profile, [Port(link, STATION, profile.link("ethercat"))]))
    await set_up(axis, settings or {})
    if settings:
        from backend.tools.measuring.temporary import make_effective

        await make_effective(axis)
    session = CyclicSession(link, [axis.drive])
    await session.start(cycle_s)
    axis.session = session
    try:
        yield DirectBench(axis, session, link, spec)
    finally:
        await session.stop()
        await link.close()
