"""Operations of the host process, one for each request of the server."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from drivers import cia402
from drivers.cia402 import State
from drivers.computer.timing.realtime import RealTime
from drivers.errors import Busy, DriveError, LinkLost, NotAllowed, OutOfRange, ProtocolError
from drivers.ethercat.exchange.cyclic import CyclicLoop
from drivers.ethercat.exchange.ring import Ring
from drivers.ethercat.exchange.setup import FoundInPart
from drivers.ethercat.process.protocol import Message, error_to_wire
from drivers.ethercat.process.punctuality import Check
from drivers.ethercat.process.segment import InvalidMap, Segment
from drivers.ethercat.process.stations import firmware
from drivers.ethercat.process.stations import station as transactions
from drivers.ethercat.process.stations.eeprom import EepromOperations
from drivers.ethercat.process.stations.examination import examine
from drivers.ethercat.process.stations.requested import refuse_op, request
from drivers.ethercat.process.stations.roster import Roster, Send
from drivers.ethercat.process.stations.station import Station
from drivers.ethercat.wire import coe, esc, reading, sii
from drivers.ethercat.wire.al_status import AlState, state_name
from drivers.ethercat.wire.frames import ROOM_BYTES
from drivers.ethercat.wire.lanes import Done, Lanes, Urgency
from drivers.halt import HaltCause, Halted
from drivers.objects.dictionary import ObjectInfo
from drivers.texts.message import Text, text

_CONTROL_WORD = (0x6040, 0)
_MAX_STEPS_PER_CYCLE = 16
_STARVED_CYCLES = 8
_NS_PER_BYTE = 80
"""100 Mbit/s: a frame must not become so long that process data have to wait for it."""
_FIND_TRIES = 3
"""Searches before lost frames, which leave the result incomplete, are reported as an error."""
_ENDED = Halted(HaltCause.COMMANDED, note=text("ethercat.motion-ended"))


class Operations:
    """One segment with its stations, and the operations on it."""

    def __init__(self, interface: str, ring: Ring, send: Send, *, raw_frames: bool = True) -> None:
        self.segment = Segment(interface, raw_frames=raw_frames)
        self.lanes = Lanes(self.segment, time.monotonic)
        self.roster = Roster(self.segment, self.lanes, ring, send)
        self.granted: RealTime | None = None
        self._ring = ring
        self._send = send
        self._starved = 0
        self._check: tuple[Check, Done] | None = None
        self._eeprom = EepromOperations(self.roster, self.lanes, self._progress_of)
        self._handlers: dict[str, Callable[[Message, Done], None]] = {
            "scan": self._scan, "read": self._read, "read_many": self._read_many,
            "write": self._write, "enumerate": self._enumerate, "state": self._state,
            "counters": self._counters, "clear_counters": self._clear_counters,
            "alias": self._alias, "foe": self._foe, "examine": self._examine,
            "al_request": self._al_request,
            "configure": self._configure, "start": self._start, "stop": self._stop,
            "play": self._play, "renew": self._renew, "halt": self._halt, "pause": self._pause,
            "drive_to": self._drive_to,
            "punctuality": self._punctuality,
            "eeprom_read": self._eeprom.read, "eeprom_write": self._eeprom.write,
        }  # fmt: skip

    @property
    def loop(self) -> CyclicLoop | None:
        """The running exchange, if any."""
        return self.roster.exchange.loop

    def open(self) -> None:
        """Open the interface; see `Segment.open`."""
        self.roster.open()

    def housekeeping(self, now: float) -> None:
        """Supervise stations and interface; see `Roster.housekeeping`."""
        self.roster.housekeeping(now)

    def handle(self, message: Message, done: Done) -> None:
        """Start an operation; ``done`` is called when it ends.

        Raises:
            DriveError: it cannot start.
        """
        handler = self._handlers.get(message["op"])
        if handler is None:
            raise ProtocolError("ethercat.unknown-operation-between-our", message=message["op"])
        if not self.roster.is_open:
            raise LinkLost("ethercat.interface-gone", interface=self.segment.interface)
        handler(message, done)

    @staticmethod
    def stops(message: Message) -> bool:
        """Return whether it writes a control word that can only stop motion."""
        place = message["op"], message.get("index"), message.get("subindex")
        return place == ("write", *_CONTROL_WORD) and cia402.stops(_word(message["data"]))

    @property
    def checking(self) -> bool:
        """Whether the timing of this computer is being measured."""
        return self._check is not None

    def check_cycle(self) -> None:
        """Do one cycle of the timing measurement, and one frame of other work."""
        if self._check is None:
            return
        check, done = self._check
        if self.loop is not None or not self.roster.is_open or self.roster.powered:
            self._check = None
            done(None, Busy("ethercat.segment-busy"))
            return
        result = check.cycle()
        if result is not None:
            self._check = None
            done(result, None)
        self.lanes.step()

    def use_spare_time(self) -> None:
        """Send mailbox frames between two cycles; occasionally one even if there is no time."""
        loop = self.loop
        if loop is None:
            return
        done = 0
        while done < _MAX_STEPS_PER_CYCLE and (spare_ns := loop.spare_ns()) > 0:
            if not self.lanes.step(min(spare_ns // _NS_PER_BYTE, ROOM_BYTES)):
                break
            done += 1
            if self.segment.silent:
                # Frames do not come back: process data must not wait for more of them.
                break
        self._starved = 0 if done else self._starved + 1
        if self._starved >= _STARVED_CYCLES:
            self._starved = 0
            self.lanes.step()

    def shut_down(self, why: Text) -> None:
        """Brake, leave OP, close."""
        if self.roster.is_open:
            self.roster.exchange.shut_down(why)
        self.segment.close()
        self.roster.is_open = False

    def _scan(self, message: Message, done: Done) -> None:
        self.roster.require_not_held()
        wanted = message.get("stations")
        known = wanted is not None and self.roster.knows(wanted)
        if not known:
            self.roster.attach()
        chosen = [s for s in self.roster.stations if wanted is None or s.number in wanted]
        left = {station.number for station in chosen}
        if not chosen:
            self.roster.attached = bool(self.roster.stations)
            done([], None)

        def one(number: int) -> Done:
            def identified(_result: object, error: DriveError | None) -> None:
                if error is not None:
                    self.roster.stations[number - 1].notes.append(error.text)
                left.discard(number)
                share = 1 - len(left) / len(chosen)
                known = len(chosen) - len(left)
                step = text("ethercat.stations-identified", known=known, count=len(chosen))
                self._progress(message, share, step)
                if not left:
                    done([self._found(s) for s in chosen], None)

            return identified

        for station in chosen if known else self.roster.stations:
            number = station.number
            steps = transactions.identify(station, time.monotonic)
            self.lanes.submit(number, "mailbox", steps, one(number) if number in left else _ignore)

    def _found(self, station: Station) -> Message:
        wiring = [s.wiring for s in self.roster.stations if s.wiring is not None]
        parent, port = esc.parents(wiring).get(station.number, (0, 0))
        return {
            "station": station.number, "vendor_id": station.vendor_id,
            "product_code": station.product_code, "revision": station.revision,
            "serial": station.serial, "name": station.name, "alias": station.alias,
            "hardware": station.hardware, "firmware": station.firmware,
            "device_profile": station.device_profile,
            "state": state_name(station.al_state),
            "notes": [note.to_wire() for note in station.notes],
            "parent": parent, "parent_port": port, "dc": station.distributed_clock,
        }  # fmt: skip

    def _progress_of(self, message: Message) -> Callable[[float, Text], None]:
        return lambda share, step: self._progress(message, share, step)

    def _progress(self, message: Message, share: float, step: Text) -> None:
        self._send({"id": message["id"], "progress": share, "text": step.to_wire()})

    # Parameters ----------------------------------------------------------------------------

    def _read(self, message: Message, done: Done) -> None:
        station = self._calm_station(message)
        self._require_parameters(station)
        steps = coe.upload(station.box, message["index"], message["subindex"])
        self.lanes.submit(station.number, "mailbox", steps, done)

    def _read_many(self, message: Message, done: Done) -> None:
        station = self._calm_station(message)
        self._require_parameters(station)
        items = [tuple(item) for item in message["items"]]
        steps = reading.read_items(station, items, lambda _count: None)

        def finished(results: list[bytes | DriveError] | None, error: DriveError | None) -> None:
            if results is None:
                done(None, error)
                return
            done([r if isinstance(r, bytes) else error_to_wire(r) for r in results], None)

        self.lanes.submit(station.number, "mailbox", steps, finished)

    def _write(self, message: Message, done: Done) -> None:
        station = self._calm_station(message)
        self._require_parameters(station)
        index, subindex, data = message["index"], message["subindex"], message["data"]
        if self.roster.exchange.route_write(station.number, index, subindex, data):
            done(None, None)
            return
        if (index, subindex) == _CONTROL_WORD:
            self.roster.commanded(station.number, _word(data))
        if self.stops(message):
            station.box.stopping = True
            steps = coe.stop_write(station.box, index, subindex, data)
            self.lanes.submit(station.number, "mailbox", steps, done, Urgency.STOP)
            return
        steps = coe.download(station.box, index, subindex, data)
        self.lanes.submit(station.number, "mailbox", steps, done, Urgency.WRITE)

    def _enumerate(self, message: Message, done: Done) -> None:
        station = self._calm_station(message)
        self._require_parameters(station)

        def progress(number: int, total: int) -> None:
            self._progress(
                message,
                number / max(total, 1),
                text("ethercat.object-of", number=number, total=total),
            )

        def finished(found: list[Any] | None, error: DriveError | None) -> None:
            if found is None:
                done(None, error)
                return
            done(
                [
                    {"kind": "object" if isinstance(i, ObjectInfo) else "entry"} | asdict(i)
                    for i in found
                ],
                None,
            )

        steps = reading.enumerate_objects(station, progress)
        self.lanes.submit(station.number, "mailbox", steps, finished)

    # State, ports, alias, firmware ---------------------------------------------------------

    def _state(self, message: Message, done: Done) -> None:
        station = self._calm_station(message)
        if self.loop is not None:
            raise Busy("ethercat.cyclic-exchange-owns-states")
        self.roster.require_not_held()
        target = AlState[message["state"]]
        if target is AlState.OP:
            raise NotAllowed("ethercat.op-needs-cyclic-data")
        steps = transactions.change_state(station, target, time.monotonic)
        self.lanes.submit(station.number, "mailbox", steps, done)

    def _al_request(self, message: Message, done: Done) -> None:
        station = self._calm_station(message)
        if self.loop is not None:
            raise Busy("ethercat.cyclic-exchange-owns-states")
        self.roster.require_not_held()
        refuse_op(station, message["control"])
        steps = request(station, message["control"], time.monotonic)
        self.lanes.submit(station.number, "mailbox", steps, done)

    def _counters(self, _message: Message, done: Done) -> None:
        stations = self.roster.stations
        waiting = {station.number for station in stations}
        answered: set[int] = set()

        def one(number: int) -> Done:
            def read(answers: bool | None, _error: DriveError | None) -> None:
                waiting.discard(number)
                if answers:
                    answered.add(number)
                if not waiting:
                    if len(answered) == len(stations):
                        for station in stations:
                            station.wiring = station.ports
                    done(self._survey(stations), None)

            return read

        if not waiting:
            done(self._survey(stations), None)
        for station in stations:
            steps = transactions.read_ports(station)
            self.lanes.submit(station.number, "register", steps, one(station.number))

    def _survey(self, stations: list[Station]) -> Message:
        known = [s.ports for s in stations if s.ports is not None]
        upstream = esc.parents([s.wiring for s in stations if s.wiring is not None])
        found = esc.findings(known, upstream)
        return {
            "ports": [asdict(p) for p in known],
            "findings": [asdict(finding) | {"text": finding.text.to_wire()} for finding in found],
            "stations": [
                self._found(station)
                | {
                    "lost": station.lost,
                    "al": station.al_state,
                    "al_code": station.al_code,
                    "clock_ahead_ns": station.clock_ahead_ns,
                }
                for station in stations
            ],
        }

    def _examine(self, message: Message, done: Done) -> None:
        station = self.roster.station(message)
        setup = self.roster.exchange.planned(station.number)
        steps = examine(station, setup)
        self.lanes.submit(station.number, "mailbox", steps, done)

    def _clear_counters(self, message: Message, done: Done) -> None:
        station = self.roster.station(message)
        self.lanes.submit(station.number, "register", transactions.clear_ports(station), done)

    def _alias(self, message: Message, done: Done) -> None:
        station = self._calm_station(message)
        alias = int(message["alias"])
        if not 0 <= alias <= 0xFFFF:
            raise OutOfRange("ethercat.no-alias", value=alias, limit="0…65535")
        if self.loop is not None:
            raise Busy("ethercat.segment-busy")

        def ended(reported: int | None, error: DriveError | None) -> None:
            if error is None and reported != alias:
                error = ProtocolError(
                    "ethercat.alias-reads-back-written", reported=reported, alias=alias
                )
            if error is None:
                self.roster.new_aliases.add(station.number)
            done({"alias": reported}, error)

        steps = transactions.with_eeprom(station, sii.write_alias(alias, time.monotonic))
        self.lanes.submit(station.number, "register", steps, ended)

    def _foe(self, message: Message, done: Done) -> None:
        station = self._calm_station(message)
        if self.loop is not None:
            raise Busy("ethercat.cyclic-exchange-runs")
        self.roster.require_not_held()

        def ended(where: str | None, error: DriveError | None) -> None:
            self.roster.loading.discard(station.number)
            done({"state": where}, error)

        steps = firmware.load(
            station,
            message["name"],
            message["data"],
            password=message["password"],
            where=message["where"],
            managers=self.roster.managers(station.number),
            clock=time.monotonic,
            report=lambda share, step: self._progress(message, share, step),
        )
        self.roster.loading.add(station.number)
        self.lanes.submit(station.number, "mailbox", steps, ended)

    def _require_parameters(self, station: Station) -> None:
        """Check as `Station.require_parameters`, unless the station is just being brought up."""
        if not self.lanes.busy(station.number, "mailbox"):
            station.require_parameters()

    def _calm_station(self, message: Message) -> Station:
        """Return the station addressed by a message.

        Raises:
            Busy: firmware is being loaded into it.
        """
        station = self.roster.station(message)
        if station.number in self.roster.loading:
            raise Busy("ethercat.station-being-loaded-firmware", station=station.number)
        return station

    def _punctuality(self, message: Message, done: Done) -> None:
        """Measure for ``seconds``, see `drivers.ethercat.process.punctuality`; nothing moves."""
        station = self._calm_station(message)
        if self.loop is not None or self.checking:
            raise Busy("ethercat.segment-busy")
        if self.roster.powered:
            raise Busy("ethercat.axis-enabled-by-mailbox")
        self._check = Check(self.segment, station.number, message["seconds"]), done

    # Cyclic --------------------------------------------------------------------------------

    def _configure(self, message: Message, done: Done) -> None:
        for _ in range(_FIND_TRIES - 1):
            try:
                answer = self._find_and_configure(message)
            except (FoundInPart, InvalidMap):
                continue
            done(answer, None)
            return
        done(self._find_and_configure(message), None)

    def _find_and_configure(self, message: Message) -> Message:
        self.roster.attach()
        for number in message["stations"]:
            if not 1 <= number <= len(self.roster.stations):
                raise LinkLost(
                    "ethercat.no-station-found", station=number, stations=len(self.roster.stations)
                )
        self.roster.exchange.prepare(self.roster.stations)
        for number in message["stations"]:
            if self.roster.stations[number - 1].badly_found:
                raise FoundInPart("ethercat.station-found-part", station=number)
        identities = {n: self.roster.stations[n - 1].identity for n in message["stations"]}
        _require_same(message.get("identities"), identities)
        answer = self.roster.exchange.configure(self.roster.stations, message)
        return answer | {"identities": identities}

    def _start(self, _message: Message, done: Done) -> None:
        self.roster.exchange.start(done)

    def _stop(self, _message: Message, done: Done) -> None:
        self.roster.exchange.stop(done)

    def _play(self, message: Message, done: Done) -> None:
        first = self.roster.exchange.play(message["trajectories"], message["coupled"])
        self._report_figures()
        done(first, None)

    def _renew(self, message: Message, done: Done) -> None:
        self.roster.exchange.axis(message["station"]).renew()
        done(None, None)

    def _pause(self, message: Message, done: Done) -> None:
        self.roster.exchange.axis(message["station"]).pause()
        self._report_figures()
        done(None, None)

    def _halt(self, message: Message, done: Done) -> None:
        if self.loop is not None:
            self.loop.stop_axes(_ENDED, message["station"])
        done(None, None)

    def _drive_to(self, message: Message, done: Done) -> None:
        axis = self.roster.exchange.axis(message["station"])
        if message["goal"] == "fault_reset":
            axis.reset_fault()
        else:
            axis.drive_to(State[message["goal"]], message["mode"])
        self._report_figures()
        done(None, None)

    def _report_figures(self) -> None:
        """Send figures before the reply, so that an earlier motion's end is not mistaken for it."""
        self._send({"event": "status"} | self.status())

    def status(self) -> Message:
        """Return the state of everything, sent several times a second."""
        return self.roster.status()


def _require_same(
    before: Mapping[int, Sequence[int | None]] | None, now: Mapping[int, Sequence[int | None]]
) -> None:
    """Require the same drives after an interruption: a replaced one has other parameter values.

    Raises:
        NotAllowed: another drive answers at a station.
    """
    for number, identity in (before or {}).items():
        if list(now[number]) != list(identity):
            raise NotAllowed("ethercat.another-drive-before-answers", station=number)


def _word(data: bytes) -> int:
    return int.from_bytes(data, "little")


def _ignore(_result: object, _error: DriveError | None) -> None:
    """Ignore the result of a transaction that reports by events."""
