"""Preparation of process data, from the requested signals to SAFEOP, in the host process."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from drivers.errors import DriveError, LinkTimeout, NotAllowed
from drivers.ethercat.exchange import setup as setup_
from drivers.ethercat.exchange.bring_up import apply_mailbox, from_wire, set_controls
from drivers.ethercat.exchange.cyclic import Image, layout, places
from drivers.ethercat.exchange.mapping import Assigned, Entry, Pdo
from drivers.ethercat.exchange.ring import Ring
from drivers.ethercat.exchange.setup import Snapshot, StationSetup
from drivers.ethercat.process.protocol import Message
from drivers.ethercat.process.segment import IO_MAP_BYTES, InvalidMap, Segment
from drivers.ethercat.process.stations.station import Station, identify
from drivers.ethercat.wire import coe
from drivers.ethercat.wire.lanes import Done, LaneName, Lanes
from drivers.ethercat.wire.steps import Steps
from drivers.link import EventKind
from drivers.motion.interpolation import interpolation_period
from drivers.motion.playback import AxisLoop
from drivers.texts import limits
from drivers.texts.message import Text, text

CYCLE_NS = (250_000, 10_000_000)
_SETUP_S = 30.0
T = TypeVar("T")
Report = Callable[[EventKind, int | None, Text], None]
"""Kind of event, station, message."""


@dataclass(frozen=True, slots=True)
class Prepared:
    """A segment in SAFEOP, ready to exchange process data."""

    setups: dict[int, StationSetup]
    snapshots: dict[int, Snapshot]
    images: list[Image]
    cycle_ns: int
    dc: bool
    watchdog_ms: float


class Preparation:
    """Runs the transactions of `setup` on all stations at once, blocking; nothing moves yet."""

    def __init__(self, segment: Segment, ring: Ring, lanes: Lanes, report: Report) -> None:
        self._segment = segment
        self._ring = ring
        self._lanes = lanes
        self._report = report
        self.stop_waits: Callable[[], bool] = lambda: False
        """Whether a command that stops an axis has arrived meanwhile; it ends the set-up."""
        self._stations: Sequence[Station] = ()
        self._setups: dict[int, StationSetup] = {}
        self._snapshots: dict[int, Snapshot] = {}
        self._cycle_ns = 1_000_000
        self._dc = False

    def planned(self, number: int) -> StationSetup | None:
        """Return the last set-up planned for a station."""
        return self._setups.get(number)

    def identify(self, stations: Sequence[Station]) -> None:
        """Identify all stations after a search; those that can be are then in PREOP."""
        jobs = {s.number: identify(s, time.monotonic) for s in stations}
        self._run("mailbox", jobs, "ethercat.doing-identifying")

    def configure(self, stations: Sequence[Station], message: Message) -> Prepared:
        """Write mappings, build the IO map, set clocks and watchdogs; ends in SAFEOP.

        All stations must be in PREOP with an address, as after a search.

        Raises:
            NotAllowed: cycle, mapping or watchdog is not possible, with drive and reason.
            FoundInPart, InvalidMap: search or mapping was disturbed; one more search may help.
        """
        cycle_ns = int(message["cycle_ns"])
        if not CYCLE_NS[0] <= cycle_ns <= CYCLE_NS[1]:
            raise NotAllowed(
                "ethercat.cycle-not-possible",
                limit=limits.between(0.25, 10.0, "ms"),
                cycle_us=cycle_ns / 1000,
            )
        interpolation_period(cycle_ns)
        self._stations = stations
        self._cycle_ns = cycle_ns
        self._dc = bool(message["dc"]) and all(s.distributed_clock for s in stations)
        watchdog_ms = max(float(message["watchdog_ms"]), 5 * cycle_ns / 1e6)
        self._setups = {
            number: StationSetup(
                _assigned(plan["rx"]),
                _assigned(plan["tx"]),
                cycle_ns,
                self._dc,
                watchdog_ms,
                from_wire(plan.get("bring_up")),
            )
            for number, plan in message["stations"].items()
        }
        for number, plan in self._setups.items():
            if plan.rules is not None:
                apply_mailbox(stations[number - 1], plan.rules)
        self._write_mappings()
        initial = self._map()
        self._check_places()
        self._clocks_and_watchdogs()
        images = [self._image(number, initial[number]) for number in sorted(self._setups)]
        self._ring.prepare(sum(i.output_size + i.input_size for i in images))
        return Prepared(
            self._setups, self._snapshots, images, cycle_ns, dc=self._dc, watchdog_ms=watchdog_ms
        )

    def _write_mappings(self) -> None:
        jobs = {
            number: setup_.write_mapping(self._stations[number - 1], plan)
            for number, plan in self._setups.items()
        }
        self._run("mailbox", jobs, "ethercat.doing-writing-mapping")

    def _map(self) -> dict[int, list[int]]:
        """Build the IO map; return the initial values of the outputs."""
        sizes = {
            station.number: setup_.assigned_bytes(station)
            for station in self._stations
            if station.mailbox is not None
        }
        total = sum(self._run("mailbox", sizes, "ethercat.doing-reading-sizes").values())
        initial = self._run(
            "mailbox",
            {
                number: setup_.initial_outputs(self._stations[number - 1], plan.rx.entries)
                for number, plan in self._setups.items()
            },
            "ethercat.doing-reading-values",
        )
        if total > IO_MAP_BYTES:
            self._segment.map(total)
        # An emergency waiting in a mailbox would make SOEM's mapping fail.
        drains = {s.number: s.box.drain() for s in self._stations if s.mailbox is not None}
        self._run("mailbox", drains, "ethercat.doing-emptying-mailboxes")
        self._announce_life("ethercat.doing-building-map")
        self._segment.map(total)
        wrong = {n: p for n, p in self._setups.items() if not self._fits(n, p)}
        if not wrong:
            return initial
        # SOEM may have missed an answer.
        number, plan = next(iter(wrong.items()))
        reported = self._segment.sizes(number)
        raise InvalidMap(
            "ethercat.station-maps-bytes-outputs",
            station=number,
            reported=reported[0],
            other_reported=reported[1],
            rx_size=plan.rx.size,
            tx_size=plan.tx.size,
        )

    def _fits(self, number: int, plan: StationSetup) -> bool:
        return self._segment.sizes(number) == (plan.rx.size, plan.tx.size)

    def _check_places(self) -> None:
        jobs = {
            number: setup_.check_places(self._stations[number - 1], plan, time.monotonic)
            for number, plan in self._setups.items()
        }
        self._run("register", jobs, "ethercat.doing-locating-process-data")
        controls = {
            number: set_controls(self._stations[number - 1], plan.bring_up)
            for number, plan in self._setups.items()
        }
        self._run("register", controls, "ethercat.doing-sync-managers")

    def _clocks_and_watchdogs(self) -> None:
        self._announce_life("ethercat.doing-clocks")
        if self._segment.master.config_dc() and self._dc:
            starts = {
                number: setup_.start_sync0(self._stations[number - 1], plan, time.monotonic)
                for number, plan in self._setups.items()
            }
            self._run("register", starts, "ethercat.doing-sync0")
        # SOEM used the mailboxes by itself: the state of its counter is unknown.
        fences = {
            s.number: coe.settle(s.box, force=True) for s in self._stations if s.mailbox is not None
        }
        self._run("mailbox", fences, "ethercat.doing-mailboxes")
        guards = {
            number: setup_.arm_watchdog(self._stations[number - 1], plan)
            for number, plan in self._setups.items()
        }
        self._run("register", guards, "ethercat.doing-watchdogs")
        self._snapshots = self._run(
            "register",
            {n: setup_.take_snapshot() for n in self._setups},
            "ethercat.doing-registers",
        )
        # Other drives stay in PREOP, as their process data are not set up.
        spared = {
            s.number: setup_.spare(s)
            for s in self._stations
            if s.number not in self._setups and s.mailbox is not None
        }
        self._run("register", spared, "ethercat.doing-other-drives", optional=set(spared))
        states = {
            station.number: setup_.to_safeop(
                station, self._setups.get(station.number), time.monotonic
            )
            for station in self._stations
            if station.number not in spared
        }
        self._run(
            "register", states, "ethercat.doing-safeop", optional=set(states) - set(self._setups)
        )

    def _image(self, number: int, initial: list[int]) -> Image:
        plan = self._setups[number]
        rx, tx = layout(plan.rx.entries), layout(plan.tx.entries)
        axis = AxisLoop(
            number,
            inputs=places(plan.tx.entries),
            outputs=places(plan.rx.entries),
            output_count=len(initial),
            cycle_s=self._cycle_ns / 1e9,
            report=lambda station, why: self._report("fault", station, why),
        )
        axis.outputs[:] = initial
        wkc = (2 if rx.size else 0) + (1 if tx.size else 0)
        return Image(
            number, axis, tx.unpack, rx.pack, rx.size, tx.size, wkc, bytes(rx.size), bytes(tx.size)
        )

    def _announce_life(self, doing: str) -> None:
        """Extend the host's deadline; ``doing`` is the code of the lengthy step."""
        self._ring.host_lives_until(time.monotonic_ns() + int(_SETUP_S * 1e9), doing)

    def _run(
        self,
        lane: LaneName,
        jobs: Mapping[int, Steps[T]],
        doing: str,
        optional: set[int] | frozenset[int] = frozenset(),
    ) -> dict[int, T]:
        """Run one transaction per station, all at once, until all have ended."""
        self._announce_life(doing)
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
                late = LinkTimeout("ethercat.takes-longer", doing=text(doing), setup_s=_SETUP_S)
                self._lanes.drop(late.text)
                raise late
            if self.stop_waits():
                stopped = NotAllowed("ethercat.stop-ended-set-up")
                self._lanes.drop(stopped.text)
                raise stopped
            if not self._lanes.step():
                time.sleep(0.0002)
        for number, error in errors.items():
            if number not in optional:
                raise error
            self._report("state", number, error.text)
        return results


def _assigned(plan: Message) -> Assigned:
    pdos = tuple(
        Pdo(item["index"], _entries(item["entries"]), item["write"], tuple(item["words"]))
        for item in plan["pdos"]
    )
    return Assigned(pdos, _entries(plan["entries"]), plan["assign"])


def _entries(items: Sequence[Sequence[Any]]) -> tuple[Entry, ...]:
    return tuple(Entry(*item) for item in items)
