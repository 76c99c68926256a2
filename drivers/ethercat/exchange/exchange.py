"""Set-up, start, stop and recovery of the cyclic exchange, in the host process."""

from __future__ import annotations

import array
import time
from collections.abc import Callable, Sequence

from drivers.cia402 import State
from drivers.errors import DriveError, NotAllowed
from drivers.ethercat.exchange import setup as setup_
from drivers.ethercat.exchange.bring_up import BEFORE_OP, send_commands, timeout_s
from drivers.ethercat.exchange.cyclic import CyclicLoop, Image, layout, percentile_us
from drivers.ethercat.exchange.preparation import Preparation, Report
from drivers.ethercat.exchange.ring import Ring
from drivers.ethercat.exchange.setup import Snapshot, StationSetup
from drivers.ethercat.process.protocol import Message
from drivers.ethercat.process.segment import Segment
from drivers.ethercat.process.stations.station import (
    STATE_TIMEOUT_S,
    Station,
    al_status,
    change_state,
)
from drivers.ethercat.wire.al_status import ERROR_BIT, AlState
from drivers.ethercat.wire.lanes import Done, LaneName, Lanes
from drivers.ethercat.wire.steps import Pause, Steps
from drivers.halt import HaltCause, Halted
from drivers.motion.pair_guard import PairGuard, SkewLimit
from drivers.motion.playback import AxisLoop
from drivers.motion.setpoint_plan import Motion, limits_of
from drivers.texts.message import Text, text

_NOT_YET, _OP_TRIES, _OP_PAUSE_S = (0x001B, 0x002D), 5, 0.2
"""AL status codes for missing process data or SYNC0 (ETG.1020 table 2); attempts; pause [s]."""
_LEAVE_S, _SETTLE_DC_S, _SETTLE_S = 0.5, 0.4, 0.02
_STOPPING = Halted(HaltCause.COMMANDED, note=text("ethercat.cyclic-exchange-being-stopped"))
_NO_ANSWER = Halted(HaltCause.LOST, note=text("ethercat.drive-no-longer-answers"))


def enter_op(station: Station, limit_s: float) -> Steps[None]:
    """Go to OP; retry if data or SYNC0 were briefly missing: a computer may stall for 50 ms.

    Raises:
        NotAllowed: the station refuses OP, with the reason that it states.
    """
    for _ in range(_OP_TRIES - 1):
        try:
            yield from change_state(station, AlState.OP, time.monotonic, limit_s)
        except NotAllowed:
            if station.al_code not in _NOT_YET:
                raise
            yield Pause(_OP_PAUSE_S)
        else:
            return
    yield from change_state(station, AlState.OP, time.monotonic, limit_s)


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
        self._leaving: float | None = None
        """Time by which the axes to be stopped are at standstill."""
        self._stops: list[Done] = []
        """Stops to be answered when the exchange has ended."""
        self._preparation = Preparation(segment, ring, lanes, report)
        self._healing: set[int] = set()
        self.lockstep = 0.0
        """Above 0: the segment's time follows the frames, see `CyclicLoop`."""
        self.operational = False
        """All configured stations have reached OP, and no stop has been requested."""

    def end_set_up_when(self, stop_waits: Callable[[], bool]) -> None:
        """Set the condition that ends a set-up with an error, so that it never delays a STOP."""
        self._preparation.stop_waits = stop_waits

    def prepare(self, stations: Sequence[Station]) -> None:
        """Identify all stations after a search; those that can be are then in PREOP."""
        self._images = []
        self._preparation.identify(stations)

    def configure(self, stations: Sequence[Station], message: Message) -> Message:
        """Set everything up; see `Preparation.configure`."""
        prepared = self._preparation.configure(stations, message)
        self._stations = stations
        self._cycle_ns, self._dc = prepared.cycle_ns, prepared.dc
        self.setups, self._snapshots = prepared.setups, prepared.snapshots
        self._images = prepared.images
        return {
            "dc": prepared.dc,
            "watchdog_ms": prepared.watchdog_ms,
            "images": [
                {"station": i.station, "outputs": i.output_size, "inputs": i.input_size}
                for i in self._images
            ],
        }

    def planned(self, number: int) -> StationSetup | None:
        """Return the last set-up planned for a station, including one that was refused."""
        return self._preparation.planned(number)

    # Start and stop ------------------------------------------------------------------------

    def start(self, done: Done) -> None:
        """Exchange process data and bring every configured station to OP.

        ``done`` is called once, with an error also if the exchange ends or is stopped meanwhile.
        """
        if not self._images:
            raise NotAllowed("ethercat.configure-cyclic-data-first")
        if self.loop is not None:
            raise NotAllowed("ethercat.cyclic-exchange-runs-already")
        listening = [s for s in self._stations if s.number not in self.setups]
        loop = CyclicLoop(
            self._segment,
            self._ring,
            self._images,
            self._cycle_ns,
            dc=self._dc,
            lockstep=self.lockstep,
        )
        for station in listening:
            if station.al_state in (AlState.SAFEOP, AlState.OP):
                outputs, inputs = self._segment.sizes(station.number)
                loop.expected_wkc += (2 if outputs else 0) + (1 if inputs else 0)
        loop.start()
        self.loop = loop
        waiting = set(self.setups)
        unanswered = [done]

        def answer(result: object, error: DriveError | None) -> None:
            if unanswered:
                unanswered.pop()(result, error)

        def one(number: int) -> Done:
            def reached(_result: object, error: DriveError | None) -> None:
                waiting.discard(number)
                if error is not None:
                    if self.loop is loop:
                        self.abandon()
                    answer(None, error)
                elif self.loop is not loop or self._stops:
                    answer(None, NotAllowed("ethercat.cyclic-exchange-not-run"))
                elif not waiting:
                    self.operational = True
                    answer({"number": loop.number, "time_ns": loop.next_ns}, None)

            return reached

        for number in self.setups:
            # Commands before OP use the mailbox, which only its own lane may access.
            lane: LaneName = "mailbox" if self._has_commands(number) else "register"
            self._lanes.submit(number, lane, self._to_op(number), one(number))

    def _has_commands(self, number: int) -> bool:
        commands = self.setups[number].bring_up.commands
        return any(command.transition in BEFORE_OP for command in commands)

    def _to_op(self, number: int) -> Steps[None]:
        yield Pause(_SETTLE_DC_S if self._dc else _SETTLE_S)
        yield from self._enter_op(self._stations[number - 1])

    def _enter_op(self, station: Station) -> Steps[None]:
        rules = self.setups[station.number].rules
        if rules is not None and self._has_commands(station.number):
            yield from send_commands(station, rules, BEFORE_OP)
        yield from enter_op(station, timeout_s(rules, STATE_TIMEOUT_S[AlState.OP]))

    def stop(self, done: Done) -> None:
        """Brake moving axes, disable, leave OP, then end the exchange."""
        if self.loop is None:
            done(None, None)
            return
        self._stops.append(done)
        if len(self._stops) > 1:
            return
        self.loop.stop_axes(_STOPPING)
        self.operational = False
        self._leaving = time.monotonic() + _LEAVE_S

    def housekeeping(self) -> None:
        """Complete a stop once the axes are at standstill."""
        if self._leaving is None or self.loop is None:
            return
        if time.monotonic() < self._leaving and self._still_enabled():
            return
        self._leaving = None
        loop, waiting = self.loop, set(self.setups)

        def one(number: int) -> Done:
            def reached(_result: object, error: DriveError | None) -> None:
                if error is not None:
                    self._report("state", number, error.text)
                waiting.discard(number)
                if not waiting and self.loop is loop:
                    self.abandon()

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
        """End the exchange at once; the slaves' watchdogs stop any axis that still moves.

        Stops that wait for this are answered.
        """
        if self.loop is not None:
            self.loop.stop()
        self.loop = None
        self._images = []
        self._leaving = None
        self.operational = False
        self._healing.clear()
        stops, self._stops = self._stops, []
        for done in stops:
            done(None, None)

    def shut_down(self, why: Text) -> None:
        """Brake and disable within half a second, then leave OP. Blocks; only for the shutdown."""
        loop = self.loop
        if loop is None:
            return
        loop.stop_axes(Halted(HaltCause.LOST, note=why))
        deadline = time.monotonic() + _LEAVE_S
        while time.monotonic() < deadline and self._still_enabled():
            loop.cycle()
        for number in self.setups:
            self._segment.write(number, 0x120, bytes([AlState.PREOP, 0]))
        self.abandon()

    # Healing -------------------------------------------------------------------------------

    def station_lost(self, station: int) -> None:
        """Handle a station that no longer answers: its motion ends, the others continue."""
        if self.loop is not None:
            self.loop.stop_axes(_NO_ANSWER, station)
            self.loop.leave_out(station, lost=True)

    def healing(self, station: int) -> bool:
        """Return whether a station is on its way back to OP."""
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
                self._report("state", number, error.text)
            elif self.loop is not None:
                self._report("back", number, text("event.station-operational", station=number))

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
        yield from self._enter_op(station)

    # Axes ----------------------------------------------------------------------------------

    def axis(self, number: int) -> AxisLoop:
        """Return the axis of a station.

        Raises:
            NotAllowed: no cyclic exchange, the station has no process data, or it does not answer.
        """
        if self.loop is None:
            raise NotAllowed("ethercat.cyclic-exchange-not-run")
        for image in self.loop.images:
            if image.station == number:
                if image.lost:
                    raise NotAllowed("ethercat.station-not-answer-present", station=number)
                return image.axis
        raise NotAllowed("ethercat.station-no-cyclic-data", station=number)

    def play(self, trajectories: Sequence[Message], coupled: Message | None) -> int:
        """Start trajectories together in the next cycle; return its number.

        Two of them may be ``coupled``, see `drivers.link.Coupled`.

        Raises:
            NotAllowed: one of them is not possible; then none starts.
        """
        axes = [self.axis(int(item["station"])) for item in trajectories]
        motions = [_motion(item, self._cycle_ns) for item in trajectories]
        for axis, motion in zip(axes, motions, strict=True):
            axis.check(motion)
        assert self.loop is not None
        for axis, motion in zip(axes, motions, strict=True):
            axis.play(motion)
        if coupled is not None:
            first, second = axes
            limit = SkewLimit(tuple(coupled["zero"]), coupled["ratio"], coupled["skew_max"])
            self.loop.hold_together(PairGuard((first, second), limit))
        return self.loop.number

    def route_write(self, station: int, index: int, subindex: int, data: bytes) -> bool:
        """Set a mapped output in the process data; return False if it is not mapped.

        Raises:
            NotAllowed: the control word or a setpoint, which only the loop may write.
        """
        if self.loop is None or station not in self.setups:
            return False
        entries = [e for e in self.setups[station].rx.entries if e.code != "x"]
        for place, entry in enumerate(entries):
            if (entry.index, entry.subindex) != (index, subindex):
                continue
            if index in (0x6040, 0x607A, 0x60FF, 0x6071, 0x60B0, 0x60B1, 0x60B2):
                raise NotAllowed(
                    "ethercat.belongs-cyclic-exchange-runs",
                    parameter=f"{index:04X}:{subindex:02X}",
                    index=index,
                    subindex=subindex,
                )
            (value,) = layout((entry,)).unpack(data)
            self.axis(station).outputs[place] = value
            return True
        return False

    def status(self) -> Message:
        """Return figures for the link quality, with units in their names."""
        loop = self.loop
        if loop is None:
            return {"running": False}
        figures = dict(vars(loop.counters))
        late: list[int] = list(figures.pop("late"))
        return figures | {
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
                    "halted": None if image.axis.halted is None else image.axis.halted.to_wire(),
                }
                for image in loop.images
            },
        }


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
        limits=limits_of(item["limits"]),
        renew_cycles=max(round(item["renew_s"] * 1e9 / cycle_ns), 1),
        longest_step=item["longest_step"],
        offset=item.get("offset"),
        offset_values=offsets,
    )
