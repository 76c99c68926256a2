"""Setting cyclic exchange up, starting, stopping and healing it, in the host process."""

from __future__ import annotations

import array
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import TypeVar

from drivers.cia402 import State
from drivers.errors import DriveError, LinkTimeout, NotAllowed, ProtocolError
from drivers.ethercat import coe
from drivers.ethercat import setup as setup_
from drivers.ethercat.al_status import ERROR_BIT, AlState
from drivers.ethercat.cyclic import CyclicLoop, Image, layout, percentile_us, places
from drivers.ethercat.lanes import Done, LaneName, Lanes
from drivers.ethercat.mailbox import Pause, Steps
from drivers.ethercat.mapping import Entry, Pdo
from drivers.ethercat.playback import AxisLoop, Limits, Motion
from drivers.ethercat.protocol import Message
from drivers.ethercat.ring import Ring
from drivers.ethercat.segment import IO_MAP_BYTES, Segment
from drivers.ethercat.setup import Snapshot, StationSetup
from drivers.ethercat.station import Station, al_status, change_state, identify

CYCLE_NS = (250_000, 10_000_000)
_SETUP_S, _LEAVE_S, _SETTLE_DC_S, _SETTLE_S = 30.0, 0.5, 0.4, 0.02
T = TypeVar("T")
Report = Callable[[str, int | None, str], None]
"""Kind of event, station, text."""


class Exchange:
    """Cyclic exchange of one segment: at most one configuration and one loop at a time."""

    def __init__(self, segment: Segment, ring: Ring, lanes: Lanes, report: Report) -> None:
        self.loop: CyclicLoop | None = None
        self.setups: dict[int, StationSetup] = {}
        self._segment = segment
        self._ring = ring
        self._lanes = lanes
        self._report = report
        self._stations: Sequence[Station] = ()
        self._snapshots: dict[int, Snapshot] = {}
        self._images: list[Image] = []
        self._cycle_ns = 1_000_000
        self._dc = False
        self._leaving: tuple[float, Done] | None = None
        self._healing: set[int] = set()
        self.operational = False
        """All configured stations have reached OP and none was asked to leave it."""

    # Set-up --------------------------------------------------------------------------------

    def prepare(self, stations: Sequence[Station]) -> None:
        """Identify all stations after a search, which leaves those that can in PREOP."""
        self._images = []
        jobs = {s.number: identify(s, time.monotonic) for s in stations}
        self._run("mailbox", jobs, "identifying the stations")

    def configure(self, stations: Sequence[Station], message: Message) -> Message:
        """Write mappings, build the IO map, set clocks and watchdogs; ends in SAFEOP.

        All stations must be in PREOP with an address, as after a search.

        Raises:
            NotAllowed: cycle, mapping or watchdog is not possible, with drive and reason.
        """
        cycle_ns = int(message["cycle_ns"])
        if not CYCLE_NS[0] <= cycle_ns <= CYCLE_NS[1]:
            raise NotAllowed(
                f"a cycle of {cycle_ns / 1000:g} µs is not possible", limit="250 µs to 10 ms"
            )
        setup_.interpolation_period(cycle_ns)
        self._stations = stations
        self._cycle_ns = cycle_ns
        self._dc = bool(message["dc"]) and all(s.distributed_clock for s in stations)
        watchdog_ms = max(float(message["watchdog_ms"]), 5 * cycle_ns / 1e6)
        self.setups = {
            number: StationSetup(
                _pdo(plan["rx"]), _pdo(plan["tx"]), cycle_ns, self._dc, watchdog_ms
            )
            for number, plan in message["stations"].items()
        }
        self._write_mappings()
        initial = self._map()
        self._clocks_and_watchdogs()
        self._images = [self._image(number, initial[number]) for number in sorted(self.setups)]
        self._ring.prepare(sum(i.output_size + i.input_size for i in self._images))
        return {
            "dc": self._dc,
            "watchdog_ms": watchdog_ms,
            "images": [
                {"station": i.station, "outputs": i.output_size, "inputs": i.input_size}
                for i in self._images
            ],
        }

    def _write_mappings(self) -> None:
        jobs = {
            number: setup_.write_mapping(self._stations[number - 1], plan)
            for number, plan in self.setups.items()
        }
        self._run("mailbox", jobs, "writing the process data mapping")

    def _map(self) -> dict[int, list[int]]:
        """Build the IO map; returns the values that the outputs begin with."""
        sizes = {
            station.number: setup_.assigned_bytes(station)
            for station in self._stations
            if station.mailbox is not None
        }
        total = sum(self._run("mailbox", sizes, "reading the process data sizes").values())
        initial = self._run(
            "mailbox",
            {
                number: setup_.initial_outputs(self._stations[number - 1], plan.rx.entries)
                for number, plan in self.setups.items()
            },
            "reading the values of the mapped objects",
        )
        # An emergency that lies in a mailbox would make SOEM's mapping fail.
        drains = {s.number: s.box.drain() for s in self._stations if s.mailbox is not None}
        self._run("mailbox", drains, "emptying the mailboxes")
        if total > IO_MAP_BYTES:
            self._segment.map(total)
        self._promise("building the process data map")
        self._segment.map(total)
        for number, plan in self.setups.items():
            told = self._segment.sizes(number)
            if told != (plan.rx.size, plan.tx.size):
                raise ProtocolError(
                    f"station {number} maps {told[0]} bytes of outputs and {told[1]} of inputs,"
                    f" {plan.rx.size} and {plan.tx.size} were written",
                    remedy="the drive keeps a mapping of its own: use its fixed process data",
                )
        return initial

    def _clocks_and_watchdogs(self) -> None:
        self._promise("starting the distributed clocks")
        if self._segment.master.config_dc() and self._dc:
            for number in self.setups:
                self._segment.slaves[number - 1].dc_sync(True, self._cycle_ns)
        # SOEM used the mailboxes by itself: its counter is unknown to us.
        fences = {
            s.number: coe.settle(s.box, force=True) for s in self._stations if s.mailbox is not None
        }
        self._run("mailbox", fences, "taking the mailboxes over")
        guards = {
            number: setup_.arm_watchdog(self._stations[number - 1], plan.watchdog_ms)
            for number, plan in self.setups.items()
        }
        self._run("register", guards, "setting the watchdogs")
        self._snapshots = self._run(
            "register", {n: setup_.take_snapshot() for n in self.setups}, "noting the registers"
        )
        states = {
            station.number: change_state(station, AlState.SAFEOP, time.monotonic)
            for station in self._stations
        }
        self._run("register", states, "going to SAFEOP", optional=set(states) - set(self.setups))

    def _image(self, number: int, initial: list[int]) -> Image:
        plan = self.setups[number]
        rx, tx = layout(plan.rx.entries), layout(plan.tx.entries)
        axis = AxisLoop(
            number,
            inputs=places(plan.tx.entries),
            outputs=places(plan.rx.entries),
            output_count=len(initial),
            cycle_s=self._cycle_ns / 1e9,
            report=lambda station, text: self._report("fault", station, text),
        )
        axis.outputs[:] = initial
        wkc = (2 if rx.size else 0) + (1 if tx.size else 0)
        return Image(
            number, axis, tx.unpack, rx.pack, rx.size, tx.size, wkc, bytes(rx.size), bytes(tx.size)
        )

    def _promise(self, doing: str) -> None:
        self._ring.host_lives_until(time.monotonic_ns() + int(_SETUP_S * 1e9), doing)

    def _run(
        self,
        lane: LaneName,
        jobs: Mapping[int, Steps[T]],
        doing: str,
        optional: set[int] | frozenset[int] = frozenset(),
    ) -> dict[int, T]:
        """Run one transaction per station, all at once, to the end."""
        self._promise(doing)
        results: dict[int, T] = {}
        errors: dict[int, DriveError] = {}

        def done_for(number: int) -> Done:
            def done(result: T, error: DriveError | None) -> None:
                if error is None:
                    results[number] = result
                else:
                    errors[number] = error

            return done

        for number, steps in jobs.items():
            self._lanes.submit(number, lane, steps, done_for(number))
        deadline = time.monotonic() + _SETUP_S
        while len(results) + len(errors) < len(jobs):
            if time.monotonic() > deadline:
                self._lanes.drop(f"{doing} takes longer than {_SETUP_S:g} s")
                raise LinkTimeout(f"{doing} takes longer than {_SETUP_S:g} s")
            if not self._lanes.step():
                time.sleep(0.0002)
        for number, error in errors.items():
            if number not in optional:
                raise error
            self._report("state", number, error.message)
        return results

    # Start and stop ------------------------------------------------------------------------

    def start(self, done: Done) -> None:
        """Exchange process data and bring every configured station to OP."""
        if not self._images:
            raise NotAllowed("configure the cyclic data first")
        if self.loop is not None:
            raise NotAllowed("the cyclic exchange runs already")
        listening = [s for s in self._stations if s.number not in self.setups]
        loop = CyclicLoop(self._segment, self._ring, self._images, self._cycle_ns, dc=self._dc)
        for station in listening:
            if station.al_state in (AlState.SAFEOP, AlState.OP):
                outputs, inputs = self._segment.sizes(station.number)
                loop.expected_wkc += (2 if outputs else 0) + (1 if inputs else 0)
        loop.start()
        self.loop = loop
        waiting = set(self.setups)

        def one(number: int) -> Done:
            def reached(_result: object, error: DriveError | None) -> None:
                waiting.discard(number)
                if error is not None and self.loop is loop:
                    self.abandon()
                    done(None, error)
                elif not waiting and self.loop is loop:
                    self.operational = True
                    done({"number": loop.number, "time_ns": loop.next_ns}, None)

            return reached

        for number in self.setups:
            self._lanes.submit(number, "register", self._to_op(number), one(number))

    def _to_op(self, number: int) -> Steps[None]:
        yield Pause(_SETTLE_DC_S if self._dc else _SETTLE_S)
        yield from change_state(self._stations[number - 1], AlState.OP, time.monotonic)

    def stop(self, done: Done) -> None:
        """Brake what moves, disable, leave OP, then end the exchange."""
        if self.loop is None:
            done(None, None)
            return
        self.loop.stop_axes("the cyclic exchange is being stopped")
        self.operational = False
        self._leaving = (time.monotonic() + _LEAVE_S, done)

    def housekeeping(self) -> None:
        """Finish a stop once the axes stand."""
        if self._leaving is None or self.loop is None:
            return
        deadline, done = self._leaving
        if time.monotonic() < deadline and self._still_enabled():
            return
        self._leaving = None
        waiting = set(self.setups)

        def one(number: int) -> Done:
            def reached(_result: object, error: DriveError | None) -> None:
                if error is not None:
                    self._report("state", number, error.message)
                waiting.discard(number)
                if not waiting:
                    self.abandon()
                    done(None, None)

            return reached

        for number in self.setups:
            steps = change_state(self._stations[number - 1], AlState.PREOP, time.monotonic)
            self._lanes.submit(number, "register", steps, one(number))

    def _still_enabled(self) -> bool:
        assert self.loop is not None
        return self.loop.moving() or any(
            image.axis.state is State.OPERATION_ENABLED and not image.lost
            for image in self.loop.images
        )

    def abandon(self) -> None:
        """End the exchange at once; the slaves' watchdogs stop what still moves."""
        if self.loop is not None:
            self.loop.stop()
        self.loop = None
        self._images = []
        self._leaving = None
        self.operational = False
        self._healing.clear()

    def shut_down(self, why: str) -> None:
        """Brake and disable within half a second, then leave OP. Blocks; for the end only."""
        loop = self.loop
        if loop is None:
            return
        loop.stop_axes(why)
        deadline = time.monotonic() + _LEAVE_S
        while time.monotonic() < deadline and self._still_enabled():
            loop.cycle()
        for number in self.setups:
            self._segment.write(number, 0x120, bytes([AlState.PREOP, 0]))
        self.abandon()

    # Healing -------------------------------------------------------------------------------

    def station_lost(self, station: int) -> None:
        """A station no longer answers: its axis ends, the others go on without it."""
        if self.loop is not None:
            self.loop.stop_axes("the drive no longer answers", station)
            self.loop.leave_out(station, lost=True)

    def healing(self, station: int) -> bool:
        """Whether a station is on its way back to OP."""
        return station in self._healing

    def heal(self, station: Station, *, restarted: bool) -> None:
        """Bring a station that answers again back to OP; its axis stays disabled."""
        number = station.number
        if self.loop is None or number not in self.setups or number in self._healing:
            return
        self._healing.add(number)

        def done(_result: object, error: DriveError | None) -> None:
            self._healing.discard(number)
            if error is not None:
                if self.loop is not None:
                    self.loop.leave_out(number, lost=True)
                self._report("state", number, error.message)
            elif self.loop is not None:
                self._report("back", number, f"station {number} is in OP again")

        self._lanes.submit(number, "mailbox", self._heal(station, restarted=restarted), done)

    def _heal(self, station: Station, *, restarted: bool) -> Steps[None]:
        number = station.number
        loop = self.loop
        if loop is None:
            return
        for image in loop.images:
            if image.station == number:
                image.axis.goal = State.SWITCH_ON_DISABLED
        yield from al_status(station)
        low = station.al_state & ~ERROR_BIT
        if restarted or low not in (AlState.SAFEOP, AlState.OP):
            yield from setup_.restore(
                station,
                self.setups[number],
                self._snapshots[number],
                lambda: int(self._segment.master.dc_time),
                time.monotonic,
            )
        loop.leave_out(station.number, lost=False)
        yield Pause(0.15 if self._dc and restarted else 0.0)
        yield from change_state(station, AlState.OP, time.monotonic)

    # Axes ----------------------------------------------------------------------------------

    def axis(self, number: int) -> AxisLoop:
        """The axis of a station.

        Raises:
            NotAllowed: no cyclic exchange, or the station has no process data.
        """
        if self.loop is None:
            raise NotAllowed("the cyclic exchange does not run", remedy="start it first")
        for image in self.loop.images:
            if image.station == number:
                if image.lost:
                    raise NotAllowed(f"station {number} does not answer at present")
                return image.axis
        raise NotAllowed(f"station {number} has no cyclic data")

    def play(self, trajectories: Sequence[Message]) -> int:
        """Begin trajectories together in the next cycle; returns its number.

        Raises:
            NotAllowed: one of them is not possible; then none begins.
        """
        axes = [self.axis(int(item["station"])) for item in trajectories]
        motions = [_motion(item, self._cycle_ns) for item in trajectories]
        for axis, motion in zip(axes, motions, strict=True):
            axis.check(motion)
        for axis, motion in zip(axes, motions, strict=True):
            axis.play(motion)
        assert self.loop is not None
        return self.loop.number

    def route_write(self, station: int, index: int, subindex: int, data: bytes) -> bool:
        """Take a write to a mapped output into the process data; False when it is not mapped.

        Raises:
            NotAllowed: the control word and setpoints belong to the loop.
        """
        if self.loop is None or station not in self.setups:
            return False
        entries = [e for e in self.setups[station].rx.entries if e.code != "x"]
        for place, entry in enumerate(entries):
            if (entry.index, entry.subindex) != (index, subindex):
                continue
            if index in (0x6040, 0x607A, 0x60FF, 0x6071, 0x60B0, 0x60B1, 0x60B2):
                raise NotAllowed(
                    f"{index:04X}:{subindex:02X} belongs to the cyclic exchange while it runs",
                    parameter=f"{index:04X}:{subindex:02X}",
                    remedy="enable, disable and move through the axis, or stop the exchange",
                )
            (value,) = layout((entry,)).unpack(data)
            self.axis(station).outputs[place] = value
            return True
        return False

    def status(self) -> Message:
        """Figures for the link quality, with units in their names."""
        loop = self.loop
        if loop is None:
            return {"running": False}
        counters = asdict(loop.counters)
        late = counters.pop("late")
        return counters | {
            "running": True,
            "late_histogram": late,
            "late_p50_us": percentile_us(late, 0.50),
            "late_p99_us": percentile_us(late, 0.99),
            "expected_wkc": loop.expected_wkc,
            "dc": loop.dc,
            "axes": {
                image.station: {
                    "state": image.axis.state.value,
                    "phase": image.axis.phase.value,
                    "halted": image.axis.halted,
                }
                for image in loop.images
            },
        }


def _pdo(plan: Message) -> Pdo:
    return Pdo(plan["index"], tuple(Entry(*entry) for entry in plan["entries"]), plan["write"])


def _motion(item: Message, cycle_ns: int) -> Motion:
    values: array.array[int] = array.array("q")
    values.frombytes(item["values"])
    offsets: array.array[int] | None = None
    if item.get("offset_values") is not None:
        offsets = array.array("q")
        offsets.frombytes(item["offset_values"])
    return Motion(
        target=item["target"],
        values=values,
        limits=Limits(**item["limits"]),
        renew_cycles=max(round(item["renew_s"] * 1e9 / cycle_ns), 1),
        longest_step=item["longest_step"],
        offset=item.get("offset"),
        offset_values=offsets,
    )
