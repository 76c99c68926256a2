"""`drivers.link.Cyclic` by means of the host process."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt

from drivers.cia402 import State
from drivers.errors import DriveError, LinkLost, LinkTimeout, NotAllowed, motion_halted
from drivers.ethercat.exchange.bring_up import station_bring_up, to_wire
from drivers.ethercat.exchange.mapping import Assigned, Entry, StationPlan, plan_station
from drivers.ethercat.exchange.recovery import Recovery
from drivers.ethercat.exchange.ring import VALID, RingReader, lost_flag
from drivers.ethercat.exchange.samples import contiguous, fields_of
from drivers.ethercat.exchange.trajectory import message_of
from drivers.ethercat.process.hostprocess import HostProcess
from drivers.ethercat.process.protocol import Message
from drivers.ethercat.process.punctuality import (
    CHECK_S,
    Kept,
    Punctuality,
    require_fine_clock,
    require_punctual,
)
from drivers.halt import Halted, LoopState
from drivers.link import Coupled, CyclicSignal, ScopeBlock, Trajectory, Unsubscribe
from drivers.motion.setpoint_plan import Phase
from drivers.texts.message import Text, text
from profiles.schema import Profile

_ANSWER_S, _CONFIGURE_S, _START_S, _STOP_S = 5.0, 60.0, 25.0, 15.0
_DRAIN_S = 0.04
_RENEW_S, _PATIENCE = 0.05, 10
WATCHDOG_MS = 50.0
"""Process-data watchdog in the slaves [ms]; with braking well below the 200 ms allowed."""


@dataclass
class _Consumer:
    deliver: Callable[[ScopeBlock], None]
    sequence: int = 0


class EthercatCyclic:
    """Synchronous process data of one segment. See `drivers.link.Cyclic`.

    The loop owns the control word: enable and disable with `drive_to`. Setpoints are valid for
    ``renew_s`` from `play` and from every `renew`; `run` plays and renews until its task ends.
    """

    def __init__(
        self,
        host: HostProcess,
        profiles: Mapping[int, Profile],
        notify: Callable[[Text, bool], None],
        note: Callable[[str, int | None], None] = lambda _text, _station: None,
        unproven: Kept | None = None,
    ) -> None:
        """Create the exchange of a segment.

        ``notify`` receives a message when the exchange breaks off (False) or runs again (True).
        ``note`` receives each command with its station, for the recording of the bus. ``unproven``:
        this system guarantees no real time, so that process data require a check of the timing of
        computer and adapter; this is where the last result is kept.
        """
        self._note = note
        self._unproven = unproven
        self._host = host
        self._notify = notify
        self._setup: Message = {}
        self._wanted = False
        self._generation = 0
        self._played: dict[int, int] = {}
        self._last_ns = 0
        self._recovery = Recovery(lambda: self._host.running, self._set_up_again, notify)
        self._profiles = profiles
        self._plans: tuple[StationPlan, ...] = ()
        self._cycle_s = 0.001
        self._watchdog_ms = WATCHDOG_MS
        self._consumers: list[_Consumer] = []
        self._draining: asyncio.Task[None] | None = None
        self._status: Message = {}
        self._fields: dict[str, tuple[str, int]] = {}
        self._reader: RingReader | None = None
        self.dc = False
        self.left_over: tuple[tuple[CyclicSignal, Text], ...] = ()
        """Signals that did not fit, each with the reason as text; poll them."""

    # Cyclic --------------------------------------------------------------------------------

    @property
    def power(self) -> EthercatCyclic:
        """The exchange itself: its loop writes the control words."""
        return self

    @property
    def pairs(self) -> EthercatCyclic:
        """The exchange itself: its loop can couple two axes."""
        return self

    @property
    def speeds(self) -> None:
        """None: velocity setpoints require a drive with a cyclic mode."""

    async def configure(
        self, inputs: Sequence[CyclicSignal], outputs: Sequence[CyclicSignal], cycle_s: float
    ) -> tuple[CyclicSignal, ...]:
        """Map signals and return those that fit; the others are in `left_over`.

        Every drive is reset to PREOP for this, so the exchange must not run.

        Raises:
            NotAllowed: cycle time, an output that does not fit, a drive that refuses, or a
                computer that does not keep the cycle.
        """
        await self._forget()
        self._check_names([*inputs, *outputs])
        stations = sorted({signal.station for signal in [*inputs, *outputs]})
        plans = tuple(
            plan_station(
                number,
                [s for s in inputs if s.station == number],
                [s for s in outputs if s.station == number],
                self._profiles.get(number),
            )
            for number in stations
        )
        for plan in plans:
            self._check_cycle(plan.station, cycle_s)
        if self._unproven is not None:
            await self._require_punctual(self._unproven, stations[0], cycle_s)
        message: Message = {
            "op": "configure",
            "cycle_ns": round(cycle_s * 1e9),
            "dc": True,
            "watchdog_ms": self._watchdog_ms,
            "stations": {p.station: self._station_wire(p, round(cycle_s * 1e9)) for p in plans},
        }
        answer: Message = await self._host.call(message, _CONFIGURE_S)
        self._setup = message | {"identities": answer["identities"]}
        self._plans, self._cycle_s, self.dc = plans, cycle_s, bool(answer["dc"])
        self._fields = fields_of(plans)
        self.left_over = tuple(item for plan in plans for item in plan.left_over)
        return tuple(signal for plan in plans for signal in plan.mapped)

    async def _require_punctual(self, kept: Kept, station: int, cycle_s: float) -> None:
        """Require a timing check that allows this cycle: the last one, or a new one of 10 s."""
        require_fine_clock()
        found = kept.read()
        if found is None or not found.allows(cycle_s * 1e6):
            message = {"op": "punctuality", "station": station, "seconds": CHECK_S}
            answer: Message = await self._host.call(message, 3 * CHECK_S + _ANSWER_S)
            found = Punctuality(tuple(answer["counts"]))
            kept.write(found)
        require_punctual(kept.interface, found, cycle_s)

    def _station_wire(self, plan: StationPlan, cycle_ns: int) -> Message:
        rules = station_bring_up(self._profiles.get(plan.station), cycle_ns)
        return {"rx": _wire(plan.rx), "tx": _wire(plan.tx), "bring_up": to_wire(rules)}

    async def start(self) -> None:
        """Go to Operational and exchange process data.

        Raises:
            NotAllowed: a drive refuses; the reason is its AL status code as text.
        """
        await self._start()
        self._last_ns = 0
        self._wanted = True

    async def stop(self) -> None:
        """Brake moving axes, disable, leave Operational; no restart is attempted afterwards."""
        broken = self._recovery.active
        try:
            await self._forget()
        finally:
            # Also where the caller was cancelled meanwhile: an exchange would go on unwanted.
            await self._stop(broken=broken)

    async def _stop(self, *, broken: bool) -> None:
        try:
            await self._host.call({"op": "stop"}, _STOP_S)
        except LinkLost:
            # The exchange has already ended: the drives' watchdogs have stopped them.
            if not broken:
                raise
        finally:
            self.shut_down()

    async def play(self, trajectories: Sequence[Trajectory]) -> int:
        """Start trajectories together; return the cycle number of their first value.

        Raises:
            OutOfRange: a value does not fit its object or the envelope; nothing moves.
            NotAllowed: not enabled, not mapped, a limit that cannot be monitored, or a jump.
        """
        return await self._play(trajectories, None)

    async def play_pair(self, pair: tuple[Trajectory, Trajectory], coupled: Coupled) -> int:
        """See `drivers.link.PlaysPairs`."""
        return await self._play(pair, asdict(coupled))

    async def _play(self, trajectories: Sequence[Trajectory], coupled: Message | None) -> int:
        messages = [message_of(trajectory) for trajectory in trajectories]
        generation = self._generation
        for each in trajectories:
            values = f"{len(each.values)} values" if len(each.values) != 1 else "1 value"
            self._note(f"setpoints: {values} for {each.target}", each.station)
        message = {"op": "play", "trajectories": messages, "coupled": coupled}
        number: int = await self._host.call(message, _ANSWER_S)
        self._played |= {trajectory.station: generation for trajectory in trajectories}
        return number

    async def renew(self, station: int) -> None:
        """Extend the validity of the setpoints of ``station`` by its renewal time.

        Raises:
            LinkLost: the exchange broke off meanwhile; the motion ended with it.
        """
        if self._played.get(station, self._generation) != self._generation:
            raise LinkLost("ethercat.station-cyclic-exchange-broke", station=station)
        await self._host.call({"op": "renew", "station": station}, _ANSWER_S)

    async def halt(self, station: int | None = None) -> None:
        """Brake now and leave Operation enabled; setpoints end."""
        await self._host.call({"op": "halt", "station": station}, _ANSWER_S)

    async def pause(self, station: int) -> None:
        """Brake now and hold, enabled, for the next motion."""
        await self._host.call({"op": "pause", "station": station}, _ANSWER_S)

    def blocks(self, consumer: Callable[[ScopeBlock], None]) -> Unsubscribe:
        """Deliver samples on the event loop's thread."""
        entry = _Consumer(consumer)
        self._consumers.append(entry)

        def unsubscribe() -> None:
            with contextlib.suppress(ValueError):
                self._consumers.remove(entry)

        return unsubscribe

    def newest(self, channels: Sequence[str], within_s: float) -> dict[str, int | float]:
        """Return the raw values of the last cycle, see `drivers.link.Cyclic`."""
        sample = None if self._reader is None or not self.running else self._reader.newest()
        if sample is None or not int(sample["flags"][0]) & VALID:
            return {}
        # In lockstep the grid differs from real time, so the age of a sample is unknown.
        if abs(time.monotonic_ns() - int(sample["time_ns"][0])) > within_s * 1e9:
            return {}
        lost = {name for _, names in self._lost_in(sample) for name in names}
        return {
            name: sample[name][0].item()
            for name in channels
            if name in self._fields and name not in lost
        }

    # Beyond the protocol -------------------------------------------------------------------

    @property
    def running(self) -> bool:
        """Whether process data are being exchanged."""
        return self._draining is not None and not self._draining.done()

    async def drive_to(self, station: int, goal: State, mode: int | None = None) -> None:
        """Request a power state; the axis brakes before it leaves Operation enabled.

        Returns at once; `axis_state` shows when the state is reached.

        Raises:
            NotAllowed: the drive has a fault, or its control word is not mapped.
        """
        message = {"op": "drive_to", "station": station, "goal": goal.name, "mode": mode}
        self._note(f"power state {goal.name} is commanded", station)
        await self._host.call(message, _ANSWER_S)

    async def reset_fault(self, station: int) -> None:
        """Reset a fault once; the axis stays disabled."""
        await self._host.call(
            {"op": "drive_to", "station": station, "goal": "fault_reset", "mode": None}, _ANSWER_S
        )

    def axis_state(self, station: int) -> LoopState:
        """Return power state, phase of the setpoints, and why the last motion was halted."""
        reported = self._status.get("axes", {}).get(station)
        if not reported:
            return LoopState(State.UNKNOWN.value, Phase.IDLE.value, None)
        halt = None if reported["halted"] is None else Halted.from_wire(reported["halted"])
        return LoopState(reported["state"], reported["phase"], halt)

    async def run(self, trajectories: Sequence[Trajectory]) -> int:
        """Play and renew until all values have been sent; cancelling brakes the axes.

        Raises:
            NotAllowed: as `play`.
            MotionHalted: the loop ended the motion; `MotionHalted.halt` is the cause.
            LinkTimeout: the motion did not end in time.
        """
        number = await self.play(trajectories)
        stations = {trajectory.station for trajectory in trajectories}
        longest = max(len(trajectory.values) for trajectory in trajectories)
        takes_s = longest * self._cycle_s
        try:
            async with asyncio.timeout(_PATIENCE * takes_s + _ANSWER_S):
                await self._until_played(stations, takes_s)
        except TimeoutError:
            await self._halt_all(stations)
            raise LinkTimeout(
                "ethercat.motion-not-end-times", takes_s=takes_s, patience=_PATIENCE
            ) from None
        except BaseException:
            await self._halt_all(stations)
            raise
        return number

    @property
    def stations(self) -> tuple[int, ...]:
        """Stations whose process data are exchanged."""
        return tuple(plan.station for plan in self._plans)

    @property
    def trouble(self) -> Text | None:
        """Why the exchange does not run although it is requested; None otherwise."""
        return self._recovery.trouble

    def update(self, status: Message, *, reachable: bool) -> None:
        """Store the newest figures of the loop; ``reachable``: the interface is open."""
        self._status = status
        if self._wanted and reachable and not status["running"] and not self._recovery.active:
            self._broke_off(text("event.exchange-ended-by-itself"))

    def host_gone(self, why: Text) -> None:
        """Handle the end of the host process, which ends the exchange."""
        if self._wanted and not self._recovery.active:
            self._broke_off(why)
        else:
            self.shut_down()

    async def close(self) -> None:
        """End the exchange because the bus is being closed."""
        try:
            await self._forget()
        finally:
            self.shut_down()

    def shut_down(self) -> None:
        """Stop delivering samples."""
        self._generation += 1
        if self._draining is not None:
            self._draining.cancel()
            self._draining = self._reader = None
        self._status = {}

    # Parts ---------------------------------------------------------------------------------

    async def _start(self) -> None:
        slowest_ms = max(
            (
                each["bring_up"]["safeop_op_ms"] or 0
                for each in self._setup.get("stations", {}).values()
            ),
            default=0,
        )
        await self._host.call({"op": "start"}, max(_START_S, slowest_ms / 1000 + _ANSWER_S))
        ring = self._host.ring
        if ring is None:
            raise LinkLost("ethercat.ethercat-process-ended")
        self._reader = reader = ring.reader(self._fields)
        self._draining = asyncio.get_running_loop().create_task(self._drain(reader))

    def _broke_off(self, why: Text) -> None:
        self.shut_down()
        self._notify(text("event.exchange-broke-off", cause=why), False)
        self._recovery.begin(why)

    async def _set_up_again(self) -> None:
        """Repeat `configure` and `start` with the same drives; all of them end up disabled."""
        await self._host.call(self._setup, _CONFIGURE_S)
        try:
            await self._start()
        except LinkTimeout:
            # It may be running by now, and the next attempt could then not search the segment.
            with contextlib.suppress(DriveError):
                await self._host.call({"op": "stop"}, _STOP_S)
            raise

    async def _forget(self) -> None:
        self._wanted = False
        self._played.clear()
        await self._recovery.end()

    async def _until_played(self, stations: Iterable[int], takes_s: float) -> None:
        end = asyncio.get_running_loop().time() + takes_s
        while asyncio.get_running_loop().time() < end or self._playing(stations):
            await asyncio.sleep(_RENEW_S)
            for station in stations:
                await self.renew(station)
                self._raise_if_halted(station)

    async def _halt_all(self, stations: Iterable[int]) -> None:
        for station in stations:
            with contextlib.suppress(LinkLost):
                await asyncio.shield(self.halt(station))

    def _playing(self, stations: Iterable[int]) -> bool:
        """Return whether values are still to come: a busy computer plays them later."""
        return any(self.axis_state(n).phase == Phase.PLAYING.value for n in stations)

    def _raise_if_halted(self, station: int) -> None:
        if (halt := self.axis_state(station).halted) is not None:
            raise motion_halted(text("link.station", station=station), halt)

    def _check_names(self, signals: Sequence[CyclicSignal]) -> None:
        names = [signal.channel for signal in signals]
        if len(set(names)) != len(names):
            raise NotAllowed("ethercat.two-signals-same-channel")

    def _check_cycle(self, station: int, cycle_s: float) -> None:
        profile = self._profiles.get(station)
        spec = profile.pdo if profile is not None else None
        cycle_us = cycle_s * 1e6
        low = spec.cycle_min_us if spec is not None else None
        high = spec.cycle_max_us if spec is not None else None
        if (low is not None and cycle_us < low) or (high is not None and cycle_us > high):
            raise NotAllowed(
                "ethercat.station-takes-cycles-not",
                value=cycle_us,
                limit=f"{low}…{high} µs",
                station=station,
                low=low,
                high_us=high,
            )

    async def _drain(self, reader: RingReader) -> None:
        names = tuple(self._fields)
        lost = 0
        expected = -1
        try:
            while True:
                await asyncio.sleep(_DRAIN_S)
                taken, overwritten = reader.drain()
                lost += overwritten
                for part in contiguous(taken):
                    first = int(part["cycle"][0])
                    if expected >= 0:
                        # Includes overwritten samples and those that the bus skipped between them.
                        dropped = max(first - expected, 0)
                    else:
                        before = self._missed(int(part["time_ns"][0])) if self._last_ns else 0
                        dropped = max(lost, before)
                    self._deliver(names, part, dropped)
                    expected, lost = int(part["cycle"][-1]) + 1, 0
                    self._last_ns = int(part["time_ns"][-1])
        finally:
            reader.release()

    def _lost_in(self, part: npt.NDArray[np.void]) -> list[tuple[npt.NDArray[np.bool_], list[str]]]:
        """Return the rows in which a station was lost, each with the inputs of that station."""
        if not (part["flags"] >> 8).any():
            return []
        found = []
        for place, plan in enumerate(self._plans):
            rows = (part["flags"] & lost_flag(place)).astype(bool)
            if rows.any():
                known = {(e.index, e.subindex) for e in plan.tx.entries if e.code != "x"}
                inputs = [
                    s.channel
                    for s in plan.mapped
                    if (s.address.index, s.address.subindex) in known and s.channel in self._fields
                ]
                found.append((rows, inputs))
        return found

    def _missed(self, first_ns: int) -> int:
        """Return the cycles between the end of a broken-off exchange and the start of the next."""
        return max(round((first_ns - self._last_ns) / (self._cycle_s * 1e9)) - 1, 0)

    def _deliver(self, names: tuple[str, ...], part: npt.NDArray[np.void], dropped: int) -> None:
        samples = np.empty((len(part), len(names)), np.float64)
        for column, name in enumerate(names):
            samples[:, column] = part[name]
        for rows, absent in self._lost_in(part):
            for name in absent:
                samples[rows, names.index(name)] = np.nan
        valid = (part["flags"] & VALID).astype(bool)
        for consumer in tuple(self._consumers):
            consumer.deliver(
                ScopeBlock(
                    sequence=consumer.sequence,
                    t0_s=float(part["time_ns"][0]) / 1e9,
                    dt_s=self._cycle_s,
                    channels=names,
                    samples=samples,
                    dropped=dropped,
                    valid=valid,
                    cycle=int(part["cycle"][0]),
                )
            )
            consumer.sequence += 1


def _wire(assigned: Assigned) -> Message:
    pdos = [
        {"index": p.index, "entries": _listed(p.entries), "write": p.write, "words": p.words}
        for p in assigned.pdos
    ]
    return {"pdos": pdos, "entries": _listed(assigned.entries), "assign": assigned.assign}


def _listed(entries: tuple[Entry, ...]) -> list[list[object]]:
    return [[e.index, e.subindex, e.size, e.code] for e in entries]
