"""CANopen as a `drivers.link.Link` on any adapter supported by python-can.

SDO transfers are implemented here instead of using ``canopen.SdoClient``, which has no lock and
takes a late answer for the same object as the new one. `drivers.canopen.sdo.channel` excludes this.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from typing import TypeVar

import can

from drivers.canopen.adapters.adapter import open_bus
from drivers.canopen.adapters.port import CanPort
from drivers.canopen.bus import BUS
from drivers.canopen.doctor import Examiner
from drivers.canopen.exchange.cyclic import CanopenCyclic
from drivers.canopen.exchange.fixed_pdo import fixed_pdos
from drivers.canopen.exchange.synchronous import LoopClock
from drivers.canopen.frames import HEARTBEAT, SDO_ANSWER, SDO_REQUEST, Frame
from drivers.canopen.lss.access import LssAccess
from drivers.canopen.lss.codes import ANSWER as LSS_ANSWER
from drivers.canopen.lss.codes import REQUEST as LSS_REQUEST
from drivers.canopen.lss.master import LssMaster
from drivers.canopen.nodes import NodeWatch
from drivers.canopen.sdo import transfers as sdo
from drivers.canopen.sdo.channel import SdoChannel
from drivers.canopen.sdo.scanning import identify, probe
from drivers.canopen.url import CanUrl, parse_canopen_url
from drivers.cia402 import is_stop
from drivers.doctor.can_diagnosis import diagnose
from drivers.doctor.examined import Examination
from drivers.errors import DriveError, LinkLost, NotAllowed, NotAsked
from drivers.link import (
    Address,
    Cyclic,
    Found,
    Link,
    LinkEvent,
    LinkQuality,
    Progress,
    Unsubscribe,
    lists_nothing,
    notify,
)
from drivers.objects.codec import size_of
from drivers.objects.dialect import dialect_of
from drivers.objects.dictionary import Described
from drivers.texts.message import Text, text
from profiles.schema import LinkKind, Profile

T = TypeVar("T")

_WRITE_TIMEOUT_S = 1.0
_STORE_TIMEOUT_S = 10.0
_STORE_INDICES = (0x1010, 0x1011)
#: One for every node and one for the exchange: a node that does not answer delays only itself.
_WORKERS = 128


def _heard(future: asyncio.Future[T]) -> None:
    if not future.cancelled():
        future.exception()


class CanopenLink:
    """One CAN bus with CANopen nodes; stations are node numbers 1 to 127.

    One transfer at a time per node; different nodes do not wait for each other.
    """

    kind: LinkKind = "canopen"
    traits = BUS.traits

    def __init__(
        self,
        url: str | CanUrl,
        opener: Callable[[CanUrl], can.BusABC] = open_bus,
        clock: LoopClock | None = None,
    ) -> None:
        self._settings = parse_canopen_url(url) if isinstance(url, str) else url
        self.url = self._settings.url
        self._watch = NodeWatch()
        self._watch_lock = threading.Lock()
        self._channels = {
            node: SdoChannel(node, self._request_sender(node)) for node in range(1, 128)
        }
        self._turns = {node: asyncio.Lock() for node in range(1, 128)}
        #: Number of writes waiting for their turn: one may be the stop, so batches of reads yield.
        self._urgent = dict.fromkeys(range(1, 128), 0)
        self._port = CanPort(self._settings, self._frame, self._event, self._idle, opener)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._workers: ThreadPoolExecutor | None = None
        self._listeners: list[Callable[[LinkEvent], None]] = []
        self._used: set[int] = set()
        self._strays_reported = dict.fromkeys(range(1, 128), 0)
        self._cyclic = CanopenCyclic(
            self._port, self._settings, self._sdo_read, self._sdo_write, self._in_worker, clock
        )
        self._profiles: dict[int, Profile] = {}
        self._lss = LssMaster(lambda data: self._port.send(Frame(LSS_REQUEST, data)))
        self.lss = LssAccess(
            self._lss, self._in_worker, self._answers, lambda: self._cyclic.running
        )
        self._examiner = Examiner(
            self._port, self._watch, self._watch_lock, self._channels, self._cyclic
        )
        self._cyclic.send_events_to(self._announce)
        self._cyclic.watch_nodes_by(self._watch.is_there)
        self.cyclic: Cyclic | None = self._cyclic

    async def open(self) -> None:
        """Open the adapter. Raises LinkLost with the reason and a remedy."""
        if self._workers is not None:
            return
        self._loop = asyncio.get_running_loop()
        workers = ThreadPoolExecutor(_WORKERS, thread_name_prefix="canopen")
        opening = self._loop.run_in_executor(workers, self._port.open)
        try:
            await asyncio.shield(opening)
        except asyncio.CancelledError:
            # The thread cannot be interrupted; what it opens would stay in use.
            opening.add_done_callback(_heard)
            await asyncio.wait([opening])
            await self._loop.run_in_executor(workers, self._port.close)
            workers.shutdown(wait=False)
            raise
        except DriveError:
            workers.shutdown(wait=False)
            raise
        self._workers = workers

    async def close(self) -> None:
        """Stop cyclic data, close the adapter and the threads. Further calls have no effect."""
        workers, self._workers = self._workers, None
        if workers is None:
            return
        self._workers = workers
        try:
            await self._cyclic.shut_down()
        finally:
            self._workers = None
            await asyncio.get_running_loop().run_in_executor(None, self._port.close)
            workers.shutdown(wait=True)

    def attach(self, station: int, profile: Profile) -> None:
        """See `drivers.link.Link.attach`: modes, dialect and fixed PDOs of the drive."""
        self._profiles[station] = profile
        self._cyclic.set_modes(station, profile.supported_modes)
        self._cyclic.speak(station, dialect_of(profile))
        self._cyclic.set_fixed_pdos(station, fixed_pdos(profile, station))

    def unreachable(self, station: int, address: Address) -> Text | None:
        """See `drivers.link.Link.unreachable`; SDO transfers carry every object."""
        del station
        return None if address.index is not None else text("link.no-object", address=str(address))

    async def enumerate(self, station: int, progress: Progress) -> list[Described]:
        """See `drivers.link.Link.enumerate`: a node may store its EDS instead (1021h)."""
        del progress
        raise lists_nothing(self.kind, station)

    async def scan(
        self,
        progress: Progress,
        stations: Sequence[int] | None = None,
        *,
        stop_after: int | None = None,
    ) -> list[Found]:
        """Request the device type from every node number, and the identity from those that answer.

        Numbers with more than one answer, and nodes that send heartbeats but do not answer, are in
        the result with a note.
        """
        del stop_after  # sixteen are queried at once
        numbers = sorted(set(stations if stations is not None else range(1, 128)))
        found: list[Found] = []
        for start in range(0, len(numbers), 16):
            group = numbers[start : start + 16]
            progress(
                0.8 * start / len(numbers),
                text("canopen.asking-nodes", group=group[0], other_group=group[-1]),
            )
            answers = await self._in_worker(partial(probe, [self._channel(n) for n in group]))
            for node, got in answers.items():
                progress(0.8 * start / len(numbers), text("canopen.node-answered", node=node))
                found.append(await self._identify(node, got))
        heard = {f.station for f in found}
        with self._watch_lock:
            silent = [r for r in self._watch.nodes.values() if r.last_heartbeat_s is not None]
        found += [
            Found(
                station=record.node,
                state=record.nmt_state,
                notes=(text("canopen.note-heartbeats-only"),),
            )
            for record in silent
            if record.node in numbers and record.node not in heard
        ]
        progress(1.0, text("canopen.nodes-found", found_count=len(found)))
        return sorted(found, key=lambda f: f.station)

    async def _answers(self, node: int) -> bool:
        """Return whether a node answers under this number."""
        return bool(await self._in_worker(partial(probe, [self._channel(node)])))

    async def _identify(self, node: int, answers: list[bytes]) -> Found:
        found = await self._run(
            node, lambda: identify(self._channel(node), answers, self._settings.timeout_s)
        )
        with self._watch_lock:
            record = self._watch.record(node)
            same = len(answers) > 1
            record.conflict = text("canopen.state-same-number") if same else None
            state = record.nmt_state
        return replace(found, state=state)

    async def read(self, station: int, address: Address) -> bytes:
        """Read one object. See `Link.read` for the result."""
        return await self._run(station, lambda: self._read_now(station, address))

    async def read_many(
        self, station: int, addresses: Sequence[Address]
    ) -> list[bytes | DriveError]:
        """Read several objects in turn; a silent node or a loss ends the rest too."""
        cancelled = threading.Event()

        def batch(addresses: Sequence[Address]) -> list[bytes | DriveError]:
            results: list[bytes | DriveError] = []
            for address in addresses:
                if cancelled.is_set() or self._urgent[station]:
                    break
                try:
                    results.append(self._read_now(station, address))
                except (LinkLost, NotAsked) as gone:
                    results += [gone] * (len(addresses) - len(results))
                    break
                except DriveError as error:
                    results.append(error)
            return results

        answers: list[bytes | DriveError] = []
        while len(answers) < len(addresses):
            rest = addresses[len(answers) :]
            answers += await self._run(station, partial(batch, rest), cancelled)
        return answers

    async def write(self, station: int, address: Address, data: bytes) -> None:
        """Write one object; never repeated. After a LinkTimeout the outcome is unknown."""
        index, subindex = _object(address)
        if self._cyclic.drives(station, index, subindex):
            # The next PDO would overwrite an SDO write.
            await self._in_worker(lambda: self._cyclic.put(station, index, subindex, data))
        else:
            self._channel(station)
            self._urgent[station] += 1
            try:
                await self._run(station, lambda: self._sdo_write(station, index, subindex, data))
            finally:
                self._urgent[station] -= 1

    def quality(self, station: int | None = None) -> LinkQuality:
        """Return the SDO counters and NMT state of one station, or the counters of the bus."""
        port = self._port
        details: dict[str, float | int | str] = {
            "frames_received": port.received,
            "frames_sent": port.sent,
            "error_frames": port.error_frames,
            "bus_offs": port.bus_offs,
            "reopened": port.reopened,
        }
        details |= self._cyclic.statistics()
        if station is None:
            channels = list(self._channels.values())
            state = port.why_not
        else:
            channels = [self._channel(station)]
            with self._watch_lock:
                record = self._watch.record(station)
                details |= {"boots": record.boots, "emergencies": record.emergencies}
                state = record.shown_state
        trips = [c.round_trip_s for c in channels if c.round_trip_s is not None]
        details["late_answers"] = sum(c.late_answers for c in channels)
        details["stray_answers"] = sum(c.strays for c in channels)
        return LinkQuality(
            connected=port.connected,
            transactions=sum(c.transactions for c in channels),
            timeouts=sum(c.timeouts for c in channels),
            lost_frames=port.lost_frames,
            round_trip_ms=1e3 * max(trips) if trips else None,
            state=state,
            details=details,
        )

    def listen(self, listener: Callable[[LinkEvent], None]) -> Unsubscribe:
        """Subscribe to boot-ups, emergencies, lost nodes, bus-off …; on the event loop's thread."""
        self._listeners.append(listener)

        def leave() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)

        return leave

    # Beneath: what runs on worker threads.

    def _channel(self, station: int) -> SdoChannel:
        channel = self._channels.get(station)
        if channel is None:
            raise NotAllowed("canopen.not-canopen-node-number", value=station, limit="1…127")
        return channel

    def _request_sender(self, node: int) -> Callable[[bytes], None]:
        return lambda data: self._port.send(Frame(SDO_REQUEST + node, data))

    def _read_now(self, station: int, address: Address) -> bytes:
        index, subindex = _object(address)
        data = self._sdo_read(station, index, subindex)
        return sdo.fitted(data, size_of(address.type))

    def _sdo_read(self, station: int, index: int, subindex: int) -> bytes:
        self._in_use(station)
        return self._channel(station).read(index, subindex, self._settings.timeout_s)

    def _sdo_write(self, station: int, index: int, subindex: int, data: bytes) -> None:
        self._in_use(station)
        timeout_s = max(self._settings.timeout_s, _WRITE_TIMEOUT_S)
        if index in _STORE_INDICES:
            timeout_s = max(timeout_s, _STORE_TIMEOUT_S)
        stop = is_stop(index, subindex, data)
        self._channel(station).write(index, subindex, data, timeout_s, at_any_rate=stop)

    def _in_use(self, station: int) -> None:
        if station not in self._used:
            with self._watch_lock:
                self._watch.record(station).in_use = True
            self._used.add(station)

    async def _in_worker(
        self, work: Callable[[], T], cancelled: threading.Event | None = None
    ) -> T:
        if self._workers is None:
            raise LinkLost("canopen.not-open", drive=self.url)
        future = asyncio.get_running_loop().run_in_executor(self._workers, work)
        try:
            return await asyncio.shield(future)
        except asyncio.CancelledError:
            # The thread cannot be interrupted; the next job must not overtake it.
            if cancelled is not None:
                cancelled.set()
            # No caller is left to retrieve its error: asyncio would log that as a defect.
            future.add_done_callback(_heard)
            await asyncio.wait([future])
            raise

    async def _run(
        self, station: int, work: Callable[[], T], cancelled: threading.Event | None = None
    ) -> T:
        self._channel(station)
        async with self._turns[station]:
            try:
                return await self._in_worker(work, cancelled)
            except DriveError as error:
                error.at(drive=text("canopen.node-on", node=station, url=self.url))
                raise

    # Beneath: what runs on the receiving thread.

    def _frame(self, frame: Frame, now_s: float) -> None:
        if self._cyclic.take(frame):
            return
        if frame.cob_id == LSS_ANSWER and not frame.remote:
            self._lss.deliver(frame.data)
            return
        function, node = frame.cob_id & 0x780, frame.cob_id & 0x7F
        if function == SDO_ANSWER and node:
            self._channels[node].deliver(frame.data)
            return
        with self._watch_lock:
            events = self._watch.observe(frame, now_s)
        for event in events:
            self._event(event)

    def _idle(self, now_s: float) -> None:
        with self._watch_lock:
            events = self._watch.overdue(now_s)
            ask: list[int] = []
            if self._settings.guard_s > 0:
                ask, lost = self._watch.guard_due(self._settings.guard_s, now_s)
                events += lost
            for node, channel in self._channels.items():
                if channel.strays > self._strays_reported[node]:
                    self._strays_reported[node] += 1
                    event = self._watch.stray_answer(node, now_s)
                    events += [event] if event else []
        for event in events:
            self._event(event)
        for node in ask:
            try:
                self._port.send(Frame(HEARTBEAT + node, remote=True))
            except LinkLost:
                return  # the receiving thread is about to notice and report it

    @property
    def doctor(self) -> CanopenLink:
        """The link itself, which determines why a station is not in Operational."""
        return self

    async def stations_known(self) -> Sequence[int]:
        """See `drivers.doctor.examined.Examines`."""
        return self._examiner.known()

    async def examination(self, station: int, refusal: DriveError | None = None) -> Examination:
        """See `drivers.doctor.examined.Examines`; station 0 is the bus alone.

        Raises:
            LinkLost: the link is not open.
        """
        profile = self._profiles.get(station)
        found = await self._in_worker(partial(self._examiner.examine, station, profile, refusal))
        causes = diagnose(found)
        return Examination(station, not causes, causes)

    @property
    def frames(self) -> CanopenLink:
        """The link itself, which keeps the last minute of its frames."""
        return self

    async def flight(self, station: int | None = None) -> bytes:
        """See `drivers.link.RecordsFrames`."""
        return await asyncio.to_thread(self._port.ring.file, station)

    def _event(self, event: LinkEvent) -> None:
        if event.station is None and event.kind in ("lost", "fault"):
            for channel in self._channels.values():
                channel.fail(LinkLost(event.text, drive=self.url))
        self._cyclic.event(event)
        self._announce(event)

    def _announce(self, event: LinkEvent) -> None:
        self._port.ring.note(f"{event.kind}: {event.text.words()}", event.station)
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(self._notify, event)

    def _notify(self, event: LinkEvent) -> None:
        notify(self._listeners, event)


def _object(address: Address) -> tuple[int, int]:
    if address.index is None:
        raise NotAllowed("canopen.exists-over-modbus", parameter=str(address), address=str(address))
    return address.index, address.subindex


def can_bus_of(link: Link | None) -> CanopenLink | None:
    """Return the link as a CAN bus; None for another bus."""
    return link if isinstance(link, CanopenLink) else None
