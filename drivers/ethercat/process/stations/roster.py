"""The stations of a segment: search, supervision, and recovery."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Sequence

from drivers.errors import Busy, DriveError, LinkLost
from drivers.ethercat.exchange.exchange import Exchange
from drivers.ethercat.exchange.ring import Ring
from drivers.ethercat.exchange.setup import restore_mailbox
from drivers.ethercat.process.protocol import Message
from drivers.ethercat.process.segment import Segment
from drivers.ethercat.process.stations import station as transactions
from drivers.ethercat.process.stations.station import Station
from drivers.ethercat.wire.al_status import ERROR_BIT, AlState, al_status_text, state_name
from drivers.ethercat.wire.lanes import Lanes
from drivers.ethercat.wire.mailbox import Mailbox
from drivers.ethercat.wire.steps import Steps
from drivers.link import EventKind
from drivers.texts.message import Text, text

_FIND_S, _WATCH_S, _REOPEN_S = 30.0, 0.25, 1.0
_LET_END_S = 0.3
_MIN_MAILBOX = 16
_FIND_TRIES = 5
_PAUSES_S = (1.0, 3.0, 10.0)
"""Pauses between attempts to repair what a search left out or set wrong [s]: each delays others."""
_MENDINGS = 2
"""After this many attempts on its own, the segment is searched again: the data may be wrong."""
_ENABLES = 0x0F

Send = Callable[[Message], None]


class Roster:
    """Keeps the list of stations and their states; reports every change."""

    def __init__(self, segment: Segment, lanes: Lanes, ring: Ring, send: Send) -> None:
        self.segment = segment
        self.lanes = lanes
        self.exchange = Exchange(segment, ring, lanes, self.event)
        self.stations: list[Station] = []
        self.attached = False
        self.is_open = False
        self.new_aliases: set[int] = set()
        self.held: set[int] = set()
        """Stations whose EEPROM is being written: a search would read it meanwhile."""
        self.loading: set[int] = set()
        """Stations being loaded with firmware: a search would end that in the middle."""
        self._ring = ring
        self._send = send
        self._next_watch = 0.0
        self._next_open = 0.0
        self._search_due = False
        self._search_failed: Text | None = None
        """Why the last search failed, which is reported once."""
        self._wanted, self._wanted_at = 0, 0.0
        self._repairing: dict[int, tuple[int, float]] = {}
        #: Stations enabled by their last control word over the mailbox: no search may reset them.
        self._powered: set[int] = set()
        self._managers: dict[int, bytes] = {}
        self._emergencies: dict[int, tuple[bytes, float]] = {}

    def open(self) -> None:
        """Open the interface; see `Segment.open`."""
        self.segment.open()
        self.is_open = True

    @property
    def powered(self) -> bool:
        """Whether a control word over the mailbox has enabled a station."""
        return bool(self._powered)

    # Watching ------------------------------------------------------------------------------

    def housekeeping(self, now: float) -> None:
        """Supervise lost and returned stations, and the interface itself."""
        self.exchange.housekeeping()
        loop = self.exchange.loop
        if loop is not None and loop.suspicious():
            # A lost station is left out before the others become invalid and brake as well.
            self._next_watch = now
        if now < self._next_watch:
            return
        self._next_watch = now + _WATCH_S
        if not self.is_open:
            self._reopen(now)
            return
        if self.segment.replaced():
            self._interface_gone()
            return
        if self._search_due or any(station.badly_found for station in self.stations):
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
        kept = self._powered or self.held or self.loading
        if now < self._next_open or self.exchange.loop is not None or kept:
            return
        self._next_open = now + _REOPEN_S
        before = len(self.stations)
        self._search_due = False
        try:
            self.attach_and_identify()
        except DriveError as error:
            # Another master, or too many slaves: it is tried again, as nobody asked for it.
            self._search_due = True
            if error.text != self._search_failed:
                self._search_failed = error.text
                self.event("fault", None, error.text)
            return
        self._search_failed = None
        if len(self.stations) != before:
            self._wanted, self._search_due = 0, True
        elif not self._search_due:
            for number in self.new_aliases:
                self.event("back", number, text("event.station-switched-on", station=number))
            self.new_aliases.clear()

    def _interface_gone(self) -> None:
        code = "event.answers-too-late" if self.segment.mixed_up else "event.interface-gone"
        why = text(code, interface=self.segment.interface)
        self.exchange.abandon()
        self.lanes.drop(why)
        self.segment.close()
        self.is_open = self.attached = False
        self.stations = []
        self.event("lost", None, why)

    def _reopen(self, now: float) -> None:
        if now < self._next_open:
            return
        self._next_open = now + _REOPEN_S
        try:
            self.segment.open()
        except DriveError:
            return
        self.is_open = True
        self.event("back", None, text("event.interface-back", interface=self.segment.interface))

    def _watch(self, station: Station) -> Steps[None]:
        before = station.al_state
        if not (yield from transactions.answers(station, time.monotonic)):
            self._missing(station)
            return
        if station.lost:
            self._returned(station, restarted=False)
        elif self.exchange.operational and station.number in self.exchange.setups:
            if station.al_state != AlState.OP:
                self._fell_back(station, before)
            return
        if station.al_state != before and station.al_state & ERROR_BIT:
            self.event("state", station.number, self.al_text(station))
        if station.al_state & ~ERROR_BIT == AlState.INIT and (
            station.al_state & ERROR_BIT or station.mailbox is not None
        ):
            self._repair(station)
        else:
            self._repairing.pop(station.number, None)

    def _repair(self, station: Station) -> None:
        """Bring a station in INIT back to PREOP.

        It fell out of PREOP, for example because a frame of the search was lost, and cannot be
        stopped in INIT. Or it never reached PREOP, for example because it was switched on again and
        started more slowly than a state change may take; it then answers no parameter, and nothing
        else requests another state.
        """
        number, now = station.number, time.monotonic()
        # A search cannot reset anything in it that is still set.
        self._powered.discard(number)
        tries, due = self._repairing.get(number, (0, now))
        if now < due or self.exchange.loop is not None or self.lanes.busy(number, "mailbox"):
            return
        self._repairing[number] = tries + 1, now + _PAUSES_S[min(tries, len(_PAUSES_S) - 1)]
        if tries == _MENDINGS:
            self._search_due = True
        elif station.mailbox is not None:
            steps = restore_mailbox(station, self._managers[number], time.monotonic)
            self.lanes.submit(number, "mailbox", steps, _ignore)

    def _fell_back(self, station: Station, before: int) -> None:
        if self.exchange.healing(station.number):
            return
        if station.al_state != before:
            self.event("state", station.number, self.al_text(station))
        self.exchange.station_lost(station.number)
        self.exchange.heal(station, restarted=False)

    def _missing(self, station: Station) -> None:
        if not station.lost:
            station.lost = True
            self._powered.discard(station.number)
            station.al_state = 0
            why = text("event.station-lost", station=station.number, name=station.name)
            self.event("lost", station.number, why)
            self.exchange.station_lost(station.number)
        if self.segment.recover(station.number):
            self._returned(station, restarted=True)
        elif station.number in self.new_aliases and self.exchange.loop is None:
            # SOEM identifies a slave by its old alias and refuses it with the new one.
            self._search_due = True

    def _returned(self, station: Station, *, restarted: bool) -> None:
        station.lost = False
        code = "event.station-switched-on" if restarted else "event.station-answers-again"
        self.event("back", station.number, text(code, station=station.number))
        if self.exchange.loop is not None and station.number in self.exchange.setups:
            self.exchange.heal(station, restarted=restarted)
        elif restarted and station.mailbox is not None:
            managers = self._managers[station.number]
            steps = restore_mailbox(station, managers, time.monotonic)
            self.lanes.submit(station.number, "mailbox", steps, _ignore)

    def al_text(self, station: Station) -> Text:
        """Return AL state and status of a station as a message."""
        number, state = station.number, state_name(station.al_state)
        if station.al_state & ERROR_BIT:
            cause = al_status_text(station.al_code)
            return text("event.station-error", station=number, state=state, cause=cause)
        return text("event.station-state", station=number, state=state)

    def event(
        self, kind: EventKind, station: int | None, why: Text, code: int | None = None
    ) -> None:
        """Send an event to the server, after the figures, so that both are consistent."""
        self._send({"event": "status"} | self.status())
        event = {"kind": kind, "station": station, "text": why.to_wire(), "code": code}
        self._send({"event": "link"} | event)

    def _emergency(self, number: int) -> Callable[[bytes], None]:
        def received(data: bytes) -> None:
            # Some firmware repeats an emergency until it is read: once a second is enough.
            last, at = self._emergencies.get(number, (b"", 0.0))
            now = time.monotonic()
            if data == last and now - at < 1.0:
                return
            self._emergencies[number] = (data, now)
            code, register = struct.unpack_from("<HB", data)
            facts = {"station": number, "number": code, "register": register}
            self.event(
                "emergency",
                number,
                text("event.station-emergency", **facts, bytes=data[3:8].hex(" "))
                if code
                else text("event.station-error-gone", station=number),
                code,
            )

        return received

    def commanded(self, number: int, control_word: int) -> None:
        """Record a control word sent to a station by mailbox."""
        if control_word & _ENABLES == _ENABLES:
            self._powered.add(number)
        else:
            self._powered.discard(number)

    def _request_search(self) -> None:
        """Request a search, with growing pauses while searching does not help."""
        now = time.monotonic()
        if now >= self._wanted_at:
            self._wanted_at = now + _PAUSES_S[min(self._wanted, len(_PAUSES_S) - 1)]
            self._wanted, self._search_due = self._wanted + 1, True

    # Finding -------------------------------------------------------------------------------

    def knows(self, numbers: Sequence[int]) -> bool:
        """Return whether these stations are known, so that no search has to reset the others."""
        return (
            self.attached
            and self.exchange.loop is None
            and all(1 <= number <= len(self.stations) for number in numbers)
            and not any(
                self.stations[number - 1].lost or self.stations[number - 1].badly_found
                for number in numbers
            )
        )

    def require_not_held(self) -> None:
        """Require that no EEPROM of the segment is being written.

        Raises:
            Busy: one is.
        """
        if self.held:
            raise Busy("ethercat.eeprom-being-written", station=min(self.held))

    def attach(self) -> None:
        """Search the segment and create the stations; blocks for as long as SOEM takes.

        Raises:
            Busy: the exchange runs, an EEPROM is being written, or firmware is being loaded.
        """
        if self.exchange.loop is not None:
            raise Busy("ethercat.cyclic-exchange-runs-segment")
        self.require_not_held()
        if self.loading:
            raise Busy("ethercat.station-being-loaded-firmware", station=min(self.loading))
        self._ring.host_lives_until(
            time.monotonic_ns() + int(_FIND_S * 1e9), "ethercat.doing-search"
        )
        self._let_end()
        self.lanes.drop(text("ethercat.segment-searched-again"))
        self.segment.find()
        self.stations = [self._make_station(n + 1) for n in range(len(self.segment.slaves))]
        self.attached = True

    def _let_end(self) -> None:
        """Let pending requests of responding drives finish, without waiting for silent drives."""
        deadline = time.monotonic() + _LET_END_S
        while (due := self.lanes.wake_s()) is not None and time.monotonic() < deadline:
            if not self.lanes.step():
                time.sleep(max(min(due, deadline) - time.monotonic(), 0.0))

    def attach_and_identify(self) -> None:
        """Search the segment and start identifying its stations."""
        self.attach()
        for found in self.stations:
            steps = transactions.identify(found, time.monotonic)
            self.lanes.submit(found.number, "mailbox", steps, _ignore)

    def _make_station(self, number: int) -> Station:
        slave = self.segment.slaves[number - 1]
        station = Station(number, slave.man, slave.id, slave.rev, slave.name)
        managers = None
        for _ in range(_FIND_TRIES):
            managers = managers or self.segment.read(number, 0x800, 16)
        if managers is None:
            # Not a device without mailbox, but one that does not answer. It is added when it does.
            self._search_due = True
            station.notes.append(text("ethercat.note-not-answered"))
        else:
            self._managers[number] = managers
            out_at, out_size, in_at, in_size = struct.unpack("<HH4xHH4x", managers)
            if min(out_size, in_size) >= _MIN_MAILBOX:
                station.mailbox = Mailbox(
                    out_at, out_size, in_at, in_size, time.monotonic, self._emergency(number)
                )
        return station

    def managers(self, number: int) -> bytes:
        """Return the registers of sync managers 0 and 1 of a station in PREOP."""
        return self._managers[number]

    def station(self, message: Message) -> Station:
        """Return the station addressed by a message; search the segment first if not yet done.

        Raises:
            LinkLost: there is no such station, or it does not answer.
        """
        number = int(message["station"])
        if not self.attached:
            self.attach_and_identify()
        if not 1 <= number <= len(self.stations):
            self.attached = self.attached and bool(self.stations)
            # A drive that was without supply, or behind a cut cable, when the others were found.
            self._request_search()
            raise LinkLost(
                "ethercat.no-station-found-check-supply",
                station=number,
                interface=self.segment.interface,
                stations=len(self.stations),
            )
        station = self.stations[number - 1]
        if station.lost:
            raise LinkLost(
                "ethercat.station-not-answer", station=number, other_station=station.name
            )
        return station

    def status(self) -> Message:
        """Return the state of everything, sent several times a second."""
        return {
            "attached": self.attached,
            "open": self.is_open,
            "frames": self.lanes.frames,
            "late_frames": self.segment.late_frames,
            "stations": {
                s.number: {
                    "lost": s.lost,
                    "al": s.al_state,
                    "text": (text("link.no-answer") if s.lost else self.al_text(s)).to_wire(),
                    "repeats": s.mailbox.repeats if s.mailbox is not None else 0,
                }
                for s in self.stations
            },
            "cyclic": self.exchange.status(),
        }


def _ignore(_result: object, _error: DriveError | None) -> None:
    """Ignore the result of a transaction that reports by events."""
