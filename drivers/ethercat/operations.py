"""What the host process can do, each operation as the server asks for it."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from drivers.cia402 import State
from drivers.errors import Busy, DriveError, LinkLost, NotAllowed, OutOfRange, ProtocolError
from drivers.ethercat import coe, esc, foe, sii
from drivers.ethercat import station as transactions
from drivers.ethercat.al_status import ERROR_BIT, AlState, al_status_text, state_name
from drivers.ethercat.cyclic import CyclicLoop
from drivers.ethercat.exchange import Exchange
from drivers.ethercat.lanes import Done, Lanes
from drivers.ethercat.mailbox import Mailbox, Steps, Write
from drivers.ethercat.protocol import Message, error_to_wire
from drivers.ethercat.realtime import RealTime
from drivers.ethercat.ring import Ring
from drivers.ethercat.segment import Segment
from drivers.ethercat.setup import restore_mailbox
from drivers.ethercat.station import Station

_FIND_S, _WATCH_S, _REOPEN_S = 30.0, 0.25, 1.0
_MIN_MAILBOX = 16
_MAX_STEPS_PER_CYCLE = 16
_STARVED_CYCLES = 8

Send = Callable[[Message], None]


class Operations:
    """One segment with its stations, and what can be asked of it."""

    def __init__(self, interface: str, ring: Ring, send: Send) -> None:
        self.segment = Segment(interface)
        self.lanes = Lanes(self.segment, time.monotonic)
        self.exchange = Exchange(self.segment, ring, self.lanes, self._event)
        self.stations: list[Station] = []
        self.granted: RealTime | None = None
        self._ring = ring
        self._send = send
        self._attached = False
        self._open = False
        self._next_watch = 0.0
        self._next_open = 0.0
        self._starved = 0
        self._new_aliases: set[int] = set()
        self._search_due = False
        self._managers: dict[int, bytes] = {}
        self._emergencies: dict[int, tuple[bytes, float]] = {}
        self._handlers: dict[str, Callable[[Message, Done], None]] = {
            "scan": self._scan, "read": self._read, "read_many": self._read_many,
            "write": self._write, "enumerate": self._enumerate, "state": self._state,
            "counters": self._counters, "clear_counters": self._clear_counters,
            "alias": self._alias, "foe": self._foe,
            "configure": self._configure, "start": self._start, "stop": self._stop,
            "play": self._play, "renew": self._renew, "halt": self._halt,
            "drive_to": self._drive_to,
        }  # fmt: skip

    @property
    def loop(self) -> CyclicLoop | None:
        """The running exchange, if any."""
        return self.exchange.loop

    def open(self) -> None:
        """Open the interface; see `Segment.open`."""
        self.segment.open()
        self._open = True

    def handle(self, message: Message, done: Done) -> None:
        """Begin an operation; ``done`` is called when it ends.

        Raises:
            DriveError: it cannot begin.
        """
        handler = self._handlers.get(message["op"])
        if handler is None:
            raise ProtocolError(f"unknown operation {message['op']!r} between our processes")
        if not self._open:
            raise LinkLost(
                f"the interface {self.segment.interface} is gone",
                remedy="it is opened again by itself as soon as it is back",
            )
        handler(message, done)

    def use_spare_time(self) -> None:
        """Mailbox frames between two cycles; now and then one although there is no time."""
        loop = self.loop
        if loop is None:
            return
        done = 0
        while done < _MAX_STEPS_PER_CYCLE and loop.spare_ns() > 0 and self.lanes.step():
            done += 1
        self._starved = 0 if done else self._starved + 1
        if self._starved >= _STARVED_CYCLES:
            self._starved = 0
            self.lanes.step()

    def shut_down(self, why: str) -> None:
        """Brake, leave OP, close."""
        if self._open:
            self.exchange.shut_down(why)
        self.segment.close()
        self._open = False

    # Watching ------------------------------------------------------------------------------

    def housekeeping(self, now: float) -> None:
        """Look after lost and returned stations, and after the interface itself."""
        self.exchange.housekeeping()
        if now < self._next_watch:
            return
        self._next_watch = now + _WATCH_S
        if not self._open:
            self._reopen(now)
            return
        if self.segment.replaced():
            self._interface_gone()
            return
        if self._search_due:
            self._search_again(now)
        for station in self.stations:
            if not self.lanes.busy(station.number, "register"):
                self.lanes.submit(station.number, "register", self._watch(station), _ignore)
            if (
                station.mailbox is not None
                and not station.lost
                and station.al_state & 0x0F > AlState.INIT
                and not self.lanes.busy(station.number, "mailbox")
            ):
                self.lanes.submit(station.number, "mailbox", station.box.drain(), _ignore)

    def _search_again(self, now: float) -> None:
        if now < self._next_open or self.loop is not None:
            return
        self._next_open = now + _REOPEN_S
        before = len(self.stations)
        self._attach_and_identify()
        if len(self.stations) == before:
            self._search_due = False
            for number in self._new_aliases:
                self._event("back", number, f"station {number} was switched on again")
            self._new_aliases.clear()

    def _interface_gone(self) -> None:
        why = f"the interface {self.segment.interface} is gone"
        self.exchange.abandon()
        self.lanes.drop(why)
        self.segment.close()
        self._open = self._attached = False
        self.stations = []
        self._event("lost", None, why)

    def _reopen(self, now: float) -> None:
        if now < self._next_open:
            return
        self._next_open = now + _REOPEN_S
        try:
            self.segment.open()
        except DriveError:
            return
        self._open = True
        self._event("back", None, f"the interface {self.segment.interface} is back")

    def _watch(self, station: Station) -> Steps[None]:
        before = station.al_state
        answers = False
        for _ in range(3):
            answers = yield from transactions.al_status(station)
            if answers:
                break
        if not answers:
            self._missing(station)
            return
        if station.lost:
            self._returned(station, restarted=False)
        elif self.exchange.operational and station.number in self.exchange.setups:
            if station.al_state != AlState.OP:
                self._fell_back(station, before)
        elif station.al_state != before and station.al_state & ERROR_BIT:
            self._event("state", station.number, self._al_words(station))

    def _fell_back(self, station: Station, before: int) -> None:
        if self.exchange.healing(station.number):
            return
        if station.al_state != before:
            self._event("state", station.number, self._al_words(station))
        self.exchange.station_lost(station.number)
        self.exchange.heal(station, restarted=False)

    def _missing(self, station: Station) -> None:
        if not station.lost:
            station.lost = True
            station.al_state = 0
            self._event(
                "lost", station.number,
                f"station {station.number} ({station.name}) no longer answers:"
                " supply off or cable cut",
            )  # fmt: skip
            self.exchange.station_lost(station.number)
        if self.segment.recover(station.number):
            self._returned(station, restarted=True)
        elif station.number in self._new_aliases and self.loop is None:
            # SOEM knows a slave by its old alias and refuses it with the new one.
            self._search_due = True

    def _returned(self, station: Station, *, restarted: bool) -> None:
        station.lost = False
        how = "was switched on again" if restarted else "answers again"
        self._event("back", station.number, f"station {station.number} {how}")
        if self.loop is not None and station.number in self.exchange.setups:
            self.exchange.heal(station, restarted=restarted)
        elif restarted and station.mailbox is not None:
            managers = self._managers[station.number]
            steps = restore_mailbox(station, managers, time.monotonic)
            self.lanes.submit(station.number, "mailbox", steps, _ignore)

    def _al_words(self, station: Station) -> str:
        words = f"station {station.number} is in {state_name(station.al_state)}"
        if station.al_state & ERROR_BIT:
            words += f": {al_status_text(station.al_code).text}"
        return words

    def _event(self, kind: str, station: int | None, text: str, code: int | None = None) -> None:
        # The figures go first, so that who looks at them on hearing of it sees the same.
        self._send({"event": "status"} | self.status())
        self._send({"event": "link", "kind": kind, "station": station, "text": text, "code": code})

    def _emergency(self, number: int) -> Callable[[bytes], None]:
        def received(data: bytes) -> None:
            # SOEM-era firmware repeats an emergency until it is read: once a second is enough.
            last, at = self._emergencies.get(number, (b"", 0.0))
            now = time.monotonic()
            if data == last and now - at < 1.0:
                return
            self._emergencies[number] = (data, now)
            code, register = struct.unpack_from("<HB", data)
            text = (
                f"station {number}: emergency {code:#06x}, error register {register:#04x},"
                f" data {data[3:8].hex(' ')}"
                if code
                else f"station {number}: the error is gone"
            )
            self._event("emergency", number, text, code)

        return received

    # Finding -------------------------------------------------------------------------------

    def _attach(self) -> None:
        """Search the segment and make the stations; blocks for as long as SOEM takes."""
        if self.loop is not None:
            raise Busy(
                "the cyclic exchange runs on this segment",
                remedy="stop it first: a search resets every drive",
            )
        self.lanes.drop("the segment is being searched again")
        self._ring.host_lives_until(
            time.monotonic_ns() + int(_FIND_S * 1e9), "searching the segment"
        )
        self.segment.find()
        self.stations = [self._make_station(n + 1) for n in range(len(self.segment.slaves))]
        self._attached = True

    def _attach_and_identify(self) -> None:
        self._attach()
        for found in self.stations:
            steps = transactions.identify(found, time.monotonic)
            self.lanes.submit(found.number, "mailbox", steps, _ignore)

    def _make_station(self, number: int) -> Station:
        slave = self.segment.slaves[number - 1]
        station = Station(number, slave.man, slave.id, slave.rev, slave.name)
        serial = int.from_bytes(slave.eeprom_read(sii.SERIAL_WORD), "little")
        station.serial = serial or None
        managers = self.segment.read(number, 0x800, 16)
        if managers is not None:
            self._managers[number] = managers
            out_at, out_size, in_at, in_size = struct.unpack("<HH4xHH4x", managers)
            if min(out_size, in_size) >= _MIN_MAILBOX:
                station.mailbox = Mailbox(
                    out_at, out_size, in_at, in_size, time.monotonic, self._emergency(number)
                )
        return station

    def _station(self, message: Message) -> Station:
        """The station a message is about; searches the segment if that was not done yet."""
        number = int(message["station"])
        if not self._attached:
            self._attach_and_identify()
        if not 1 <= number <= len(self.stations):
            self._attached = self._attached and bool(self.stations)
            raise LinkLost(
                f"there is no station {number} on {self.segment.interface}:"
                f" {len(self.stations)} were found",
                remedy="check supply and cables, then scan again",
            )
        station = self.stations[number - 1]
        if station.lost:
            raise LinkLost(
                f"station {number} ({station.name}) does not answer",
                remedy="check supply and cable; it is taken up again by itself",
            )
        return station

    def _scan(self, message: Message, done: Done) -> None:
        self._attach()
        wanted = message.get("stations")
        chosen = [s for s in self.stations if wanted is None or s.number in wanted]
        left = {station.number for station in chosen}
        if not chosen:
            self._attached = bool(self.stations)
            done([], None)

        def one(number: int) -> Done:
            def identified(_result: object, error: DriveError | None) -> None:
                if error is not None:
                    self.stations[number - 1].notes.append(error.message)
                left.discard(number)
                share = 1 - len(left) / len(chosen)
                text = f"{len(chosen) - len(left)} of {len(chosen)} stations identified"
                self._progress(message, share, text)
                if not left:
                    done([self._found(s) for s in chosen], None)

            return identified

        for station in self.stations:
            number = station.number
            steps = transactions.identify(station, time.monotonic)
            self.lanes.submit(number, "mailbox", steps, one(number) if number in left else _ignore)

    def _found(self, station: Station) -> Message:
        known = [s.ports for s in self.stations if s.ports is not None]
        parent, port = esc.parents(known).get(station.number, (0, 0))
        return {
            "station": station.number, "vendor_id": station.vendor_id,
            "product_code": station.product_code, "revision": station.revision,
            "serial": station.serial, "name": station.name, "alias": station.alias,
            "hardware": station.hardware, "firmware": station.firmware,
            "state": state_name(station.al_state), "notes": list(station.notes),
            "parent": parent, "parent_port": port, "dc": station.distributed_clock,
        }  # fmt: skip

    def _progress(self, message: Message, share: float, text: str) -> None:
        self._send({"id": message["id"], "progress": share, "text": text})

    # Parameters ----------------------------------------------------------------------------

    def _read(self, message: Message, done: Done) -> None:
        station = self._station(message)
        steps = coe.upload(station.box, message["index"], message["subindex"])
        self.lanes.submit(station.number, "mailbox", steps, done)

    def _read_many(self, message: Message, done: Done) -> None:
        station = self._station(message)
        items = [tuple(item) for item in message["items"]]
        steps = transactions.read_items(station, items, lambda _count: None)

        def finished(results: list[bytes | DriveError] | None, error: DriveError | None) -> None:
            if results is None:
                done(None, error)
                return
            done([r if isinstance(r, bytes) else error_to_wire(r) for r in results], None)

        self.lanes.submit(station.number, "mailbox", steps, finished)

    def _write(self, message: Message, done: Done) -> None:
        station = self._station(message)
        index, subindex, data = message["index"], message["subindex"], message["data"]
        if self.exchange.route_write(station.number, index, subindex, data):
            done(None, None)
            return
        steps = coe.download(station.box, index, subindex, data)
        self.lanes.submit(station.number, "mailbox", steps, done)

    def _enumerate(self, message: Message, done: Done) -> None:
        station = self._station(message)

        def progress(number: int, total: int) -> None:
            self._progress(message, number / max(total, 1), f"object {number} of {total}")

        def finished(found: list[Any] | None, error: DriveError | None) -> None:
            if found is None:
                done(None, error)
                return
            done(
                [
                    {"kind": "object" if isinstance(i, coe.ObjectInfo) else "entry"} | asdict(i)
                    for i in found
                ],
                None,
            )

        steps = transactions.enumerate_objects(station, progress)
        self.lanes.submit(station.number, "mailbox", steps, finished)

    # State, ports, alias, firmware ---------------------------------------------------------

    def _state(self, message: Message, done: Done) -> None:
        station = self._station(message)
        if self.loop is not None:
            raise Busy("the cyclic exchange owns the states", remedy="stop it first")
        target = AlState[message["state"]]
        if target is AlState.OP:
            raise NotAllowed("OP needs cyclic data", remedy="start the cyclic exchange")
        steps = transactions.change_state(station, target, time.monotonic)
        self.lanes.submit(station.number, "mailbox", steps, done)

    def _counters(self, _message: Message, done: Done) -> None:
        waiting = {station.number for station in self.stations}

        def one(number: int) -> Done:
            def read(_result: object, _error: DriveError | None) -> None:
                waiting.discard(number)
                if not waiting:
                    known = [s.ports for s in self.stations if s.ports is not None]
                    findings = esc.cable_findings(known)
                    done({"ports": [asdict(p) for p in known], "findings": findings}, None)

            return read

        if not waiting:
            done({"ports": [], "findings": []}, None)
        for station in self.stations:
            steps = transactions.read_ports(station)
            self.lanes.submit(station.number, "register", steps, one(station.number))

    def _clear_counters(self, message: Message, done: Done) -> None:
        def clear() -> Steps[None]:
            # Any write to the counters clears them (ETG.1000.4 clause 6.2).
            yield Write(0x300, bytes(8))
            yield Write(0x310, bytes(4))

        station = self._station(message)
        self.lanes.submit(station.number, "register", clear(), done)

    def _alias(self, message: Message, done: Done) -> None:
        station = self._station(message)
        alias = int(message["alias"])
        if not 0 <= alias <= 0xFFFF:
            raise OutOfRange(f"{alias} is no alias", value=alias, limit="0…65535")
        if self.loop is not None:
            raise Busy("the segment is busy", remedy="stop the cyclic exchange first")
        slave = self.segment.slaves[station.number - 1]
        self._ring.host_lives_until(time.monotonic_ns() + 10_000_000_000, "writing the alias")
        words = bytearray(b"".join(slave.eeprom_read(word)[:2] for word in range(sii.CONFIG_WORDS)))
        words[2 * sii.ALIAS_WORD : 2 * sii.ALIAS_WORD + 2] = struct.pack("<H", alias)
        slave.eeprom_write(sii.ALIAS_WORD, struct.pack("<H", alias))
        slave.eeprom_write(sii.CHECKSUM_WORD, struct.pack("<H", sii.checksum(bytes(words))))
        told = int.from_bytes(slave.eeprom_read(sii.ALIAS_WORD)[:2], "little")
        self.segment.forget_errors()
        if told != alias:
            raise ProtocolError(f"the alias reads back as {told}, {alias} was written")
        self._new_aliases.add(station.number)
        done({"alias": told}, None)

    def _foe(self, message: Message, done: Done) -> None:
        station = self._station(message)
        if self.loop is not None:
            raise Busy("the cyclic exchange runs", remedy="stop it before loading firmware")
        data: bytes = message["data"]

        def progress(sent: int) -> None:
            share = sent / max(len(data), 1)
            self._progress(message, share, f"{sent} of {len(data)} bytes: do not switch off")

        steps = foe.write_file(
            station.box, message["name"], data, password=message["password"], on_progress=progress
        )
        self.lanes.submit(station.number, "mailbox", steps, done)

    # Cyclic --------------------------------------------------------------------------------

    def _configure(self, message: Message, done: Done) -> None:
        self._attach()
        for number in message["stations"]:
            if not 1 <= number <= len(self.stations):
                raise LinkLost(f"there is no station {number}: {len(self.stations)} were found")
        self.exchange.prepare(self.stations)
        done(self.exchange.configure(self.stations, message), None)

    def _start(self, _message: Message, done: Done) -> None:
        self.exchange.start(done)

    def _stop(self, _message: Message, done: Done) -> None:
        self.exchange.stop(done)

    def _play(self, message: Message, done: Done) -> None:
        done(self.exchange.play(message["trajectories"]), None)

    def _renew(self, message: Message, done: Done) -> None:
        self.exchange.axis(message["station"]).renew()
        done(None, None)

    def _halt(self, message: Message, done: Done) -> None:
        if self.loop is not None:
            self.loop.stop_axes("stopped by the user", message["station"])
        done(None, None)

    def _drive_to(self, message: Message, done: Done) -> None:
        axis = self.exchange.axis(message["station"])
        if message["goal"] == "fault_reset":
            axis.reset_fault()
        else:
            axis.drive_to(State[message["goal"]], message["mode"])
        done(None, None)

    def status(self) -> Message:
        """The state of everything, sent several times a second."""
        return {
            "attached": self._attached,
            "open": self._open,
            "frames": self.lanes.frames,
            "late_frames": self.segment.late_frames,
            "stations": {
                s.number: {
                    "lost": s.lost,
                    "al": s.al_state,
                    "words": "no answer" if s.lost else self._al_words(s),
                    "repeats": s.mailbox.repeats if s.mailbox is not None else 0,
                }
                for s in self.stations
            },
            "cyclic": self.exchange.status(),
        }


def _ignore(_result: object, _error: DriveError | None) -> None:
    """For transactions that report by events."""
