"""The EtherCAT link in the server: sends commands to the host process and supervises it.

`EthercatLink.open` starts the host, and it is restarted whenever it dies or hangs; each such
incident is an event. Nothing here blocks, as the other process owns the wire.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from drivers import cia402
from drivers.computer import permissions
from drivers.computer.network.sockets import RAW_FRAMES
from drivers.doctor.diagnosis import Cause, diagnose
from drivers.doctor.evidence import Evidence
from drivers.doctor.examined import Examination
from drivers.errors import DriveError, LinkLost, NotAllowed
from drivers.ethercat.bus import BUS
from drivers.ethercat.doctor import evidence_of
from drivers.ethercat.eeprom.access import EepromAccess
from drivers.ethercat.exchange.segmentcyclic import EthercatCyclic
from drivers.ethercat.process.hostprocess import HostProcess
from drivers.ethercat.process.protocol import Message
from drivers.ethercat.process.punctuality import Kept
from drivers.ethercat.process.stations import firmware
from drivers.ethercat.process.stations.requested import AlRequests
from drivers.ethercat.process.survey import ExchangeFigures, Survey, exchange_from, survey_from
from drivers.ethercat.wire.al_status import AlState
from drivers.ethercat.wire.listing import Item, fitted, object_of, read_list
from drivers.flight.segment import SegmentRecorder
from drivers.link import (
    Address,
    Cyclic,
    Found,
    Link,
    LinkEvent,
    LinkQuality,
    Progress,
    Unsubscribe,
    notify,
)
from drivers.objects.dictionary import Described, EntryDescription, ObjectInfo
from drivers.texts.message import Text, prose, text
from profiles.schema import LinkKind, Profile

_SCHEME = "ethercat://"
_ANSWER_S, _SCAN_S, _FOE_S = 15.0, 60.0, 1800.0
_OPERATIONAL = 8
"""AL state (ETG.1000.6 table 8)."""


class EthercatLink:
    """One segment, by bus URL or by interface name.

    ``launcher`` precedes the host's command line, for example to enter the private network of a
    virtual segment; ``url`` is then the name shown to the user.

    Stations count from 1 in the order of the cable. Implements `drivers.link.Link` and the
    functions that only EtherCAT has.
    """

    kind: LinkKind = "ethercat"
    traits = BUS.traits

    def __init__(
        self,
        interface: str,
        *,
        url: str | None = None,
        launcher: Sequence[str] = (),
        lockstep: float = 0.0,
        raw_frames: bool = RAW_FRAMES,
    ) -> None:
        """Create the link without opening it.

        ``lockstep`` is only for virtual segments whose time follows the frames: no cycle is skipped
        then, and time runs at most this many times as fast as real time. Without ``raw_frames``
        only functions available on all systems are used: frames go through SOEM's own calls, and
        none are recorded.
        """
        interface = interface.removeprefix(_SCHEME)
        self.interface = interface
        self.url = url or f"{_SCHEME}{interface}"
        self._profiles: dict[int, Profile] = {}
        self._listeners: list[Callable[[LinkEvent], None]] = []
        self._status: Message = {}
        self._counts = {"transactions": 0, "timeouts": 0}
        self._launched = bool(launcher)
        self._host = HostProcess(
            interface,
            launcher,
            self._received,
            self._restarted,
            _options(lockstep),
            raw_frames=raw_frames,
        )
        self._raw_frames = raw_frames
        self.recorder = SegmentRecorder(interface, launcher)
        self.process_data = EthercatCyclic(
            self._host,
            self._profiles,
            self._exchange_changed,
            self.recorder.note,
            None if raw_frames else Kept(interface),
        )
        self.cyclic: Cyclic | None = self.process_data
        self.eeprom = EepromAccess(self._call, self.read)
        self.al_states = AlRequests(self._call)

    # Link ----------------------------------------------------------------------------------

    async def open(self) -> None:
        """Start the host process and open the interface.

        Raises:
            LinkLost: no such interface, switched off, or a permission is missing; with commands.
            Busy: another servodeck uses it.
        """
        if not RAW_FRAMES:
            _require_capture(self.interface)
        await self._host.start()
        if not self._raw_frames:
            return
        try:
            await self.recorder.start()
        except BaseException:
            # Cancelled: whoever opens it again would find the interface in use.
            await self.close()
            raise

    async def close(self) -> None:
        """Brake, leave OP, end the host. Further calls have no effect."""
        try:
            await self.process_data.close()
        finally:
            # Also where the caller was cancelled meanwhile, as in `open`.
            try:
                await self._host.stop()
            finally:
                await self.recorder.stop()

    async def scan(
        self,
        progress: Progress,
        stations: Sequence[int] | None = None,
        *,
        stop_after: int | None = None,
    ) -> list[Found]:
        """Search the segment: every drive is reset to PREOP and identified.

        If all ``stations`` given are known and answer, the others are left alone.

        Raises:
            Busy: the cyclic exchange runs.
        """
        del stop_after  # all stations are queried at once
        wanted = None if stations is None else list(stations)
        found: list[Message] = await self._call(
            {"op": "scan", "stations": wanted}, _SCAN_S, progress=progress
        )
        return [_found(item) for item in found]

    async def read(self, station: int, address: Address) -> bytes:
        """Read one value; text as sent."""
        index, subindex = object_of(address)
        data: bytes = await self._call(
            {"op": "read", "station": station, "index": index, "subindex": subindex}, _ANSWER_S
        )
        return fitted(address, data)

    async def read_many(
        self, station: int, addresses: Sequence[Address]
    ) -> list[bytes | DriveError]:
        """Read several values; objects of which all subindices are requested are read at once.

        A drive whose mailbox does not answer two parts of the list is not queried any further.
        """

        async def ask(items: list[Item], patience_s: float) -> list[bytes | Message]:
            answers: list[bytes | Message] = await self._call(
                {"op": "read_many", "station": station, "items": items}, _ANSWER_S + patience_s
            )
            return answers

        self._counts["transactions"] += len(addresses)
        return await read_list(station, addresses, ask)

    async def write(self, station: int, address: Address, data: bytes) -> None:
        """Write one value; never repeated. A mapped output is set in the process data.

        Raises:
            NotAllowed: control word or setpoint while the cyclic exchange owns it; an enabling
                control word while the exchange is being set up again, which resets the drives.
        """
        index, subindex = object_of(address)
        if (
            self.process_data.trouble
            and (index, subindex) == (0x6040, 0)
            and not cia402.stops(int.from_bytes(data, "little"))
        ):
            raise NotAllowed(
                "ethercat.cyclic-exchange-broke-off", trouble=self.process_data.trouble
            )
        await self._call(
            {"op": "write", "station": station, "index": index, "subindex": subindex, "data": data},
            _ANSWER_S,
        )

    def quality(self, station: int | None = None) -> LinkQuality:
        """Return the counters, at most 200 ms old."""
        cyclic = self._status.get("cyclic", {})
        stations: Mapping[int, Message] = self._status.get("stations", {})
        here = stations.get(station) if station is not None else None
        details: dict[str, float | int | str] = {
            "host_restarts": self._host.restarts,
            "late_frames": int(self._status.get("late_frames", 0)),
            "mailbox_repeats": sum(int(item["repeats"]) for item in stations.values()),
        }
        for key, value in cyclic.items():
            if isinstance(value, int | float | str) and key not in ("wkc_errors", "lost_frames"):
                details[f"cyclic_{key}"] = value
        if cyclic.get("running"):
            for power, count in enumerate(cyclic["late_histogram"]):
                details[f"late_below_{2**power}_us"] = count
        lost = bool(here["lost"]) if here else station is not None and bool(stations)
        return LinkQuality(
            connected=self._host.running and not lost and bool(self._status.get("open")),
            transactions=self._counts["transactions"],
            timeouts=self._counts["timeouts"],
            retries=int(details["mailbox_repeats"]),
            lost_frames=int(cyclic.get("lost_frames", 0)),
            wkc_errors=int(cyclic.get("wkc_errors", 0)),
            state=Text.from_wire(here["text"]) if here else self._host.why,
            details=details,
        )

    def listen(self, listener: Callable[[LinkEvent], None]) -> Unsubscribe:
        """Subscribe to lost and returned stations, emergencies, states, restarts of the host."""
        self._listeners.append(listener)

        def unsubscribe() -> None:
            with contextlib.suppress(ValueError):
                self._listeners.remove(listener)

        return unsubscribe

    # What only EtherCAT has ----------------------------------------------------------------

    def attach(self, station: int, profile: Profile) -> None:
        """See `drivers.link.Link.attach`: the limits of its process data."""
        self._profiles[station] = profile

    def unreachable(self, station: int, address: Address) -> Text | None:
        """See `drivers.link.Link.unreachable`; the mailbox carries every object."""
        del station
        return None if address.index is not None else text("link.no-object", address=str(address))

    async def enumerate(self, station: int, progress: Progress) -> list[Described]:
        """Read the drive's own dictionary by the SDO information service."""
        found: list[Message] = await self._call(
            {"op": "enumerate", "station": station}, 600.0, progress=progress
        )
        described: list[Described] = []
        for item in found:
            whole = item.pop("kind") == "object"
            described.append(ObjectInfo(**item) if whole else EntryDescription(**item))
        return described

    async def set_state(self, station: int, state: AlState) -> None:
        """Bring one slave to a state.

        Raises:
            NotAllowed: it refuses; the reason is its AL status code as text.
        """
        await self._call({"op": "state", "station": station, "state": state.name}, _ANSWER_S)

    async def survey(self) -> Survey:
        """Return the present segment: stations in the order of the cable, ports, findings.

        Empty before the first search. Reads some registers of every slave.

        Raises:
            LinkLost: the host or the interface is gone.
        """
        return survey_from(await self._call({"op": "counters"}, _ANSWER_S))

    @property
    def exchange(self) -> ExchangeFigures | None:
        """Figures of the running exchange, at most 200 ms old; None while none runs."""
        return exchange_from(self._status.get("cyclic", {}))

    @property
    def real_time(self) -> tuple[Text, ...]:
        """Messages on the real-time privileges that the host process was granted and denied."""
        return self._host.granted

    @property
    def private_network(self) -> bool:
        """Whether the interface is in a private network, in which everything is permitted."""
        return self._launched

    async def clear_port_counters(self, station: int) -> None:
        """Set the ESC error counters of a slave to zero."""
        await self._call({"op": "clear_counters", "station": station}, _ANSWER_S)

    async def set_alias(self, station: int, alias: int) -> None:
        """Write the station alias and the checksum to the EEPROM; valid after a power cycle."""
        await self._call({"op": "alias", "station": station, "alias": alias}, _ANSWER_S)

    async def load_firmware(
        self,
        station: int,
        name: str,
        data: bytes,
        progress: Progress,
        *,
        password: int = 0,
        where: firmware.Where = "auto",
    ) -> str:
        """Send a file by FoE and bring the drive back to PREOP; see `firmware.load`.

        An interrupted download can leave a drive without firmware. Returns the state in which the
        drive accepted the file: BOOT, or PREOP if it has no BOOT.
        """
        message = {"op": "foe", "station": station, "name": name, "data": data}
        message |= {"password": password, "where": where}
        answer: Message = await self._call(message, _FOE_S, progress=progress)
        state: str = answer["state"]
        return state

    async def diagnose(
        self, station: int, refusal: DriveError | None = None
    ) -> tuple[Evidence, tuple[Cause, ...]]:
        """Return the present facts of a station, and the matching causes, the most likely first.

        ``refusal`` is the error raised by a start of the exchange. Only reads registers and
        objects.

        Raises:
            LinkLost: the host or the interface is gone.
        """
        stations = (await self.survey()).stations
        if all(each.station != station or each.lost for each in stations):
            # The search before the refusal did not find it, or it was lost since.
            found = Evidence(station=station, answers=False)
            return found, diagnose(found)
        facts: Message = await self._call({"op": "examine", "station": station}, _SCAN_S)
        aliases = [each.alias for each in stations if each.station != station]
        figures = self.exchange
        if figures is not None:
            facts |= {"wkc": figures.last_wkc, "planned_wkc": figures.expected_wkc}
        found = evidence_of(facts, self._profiles.get(station), refusal, aliases)
        return found, diagnose(found)

    @property
    def doctor(self) -> EthercatLink:
        """The link itself, which determines why a station is not in Operational."""
        return self

    async def stations_known(self) -> Sequence[int]:
        """See `drivers.doctor.examined.Examines`."""
        return [each.station for each in (await self.survey()).stations]

    async def examination(self, station: int, refusal: DriveError | None = None) -> Examination:
        """See `drivers.doctor.examined.Examines`."""
        found, causes = await self.diagnose(station, refusal)
        reached = refusal is None and found.al == _OPERATIONAL
        return Examination(station, reached, () if reached else causes)

    @property
    def frames(self) -> EthercatLink | None:
        """The link itself where a process receives copies of its frames (Linux), else None."""
        return self if self._raw_frames else None

    async def flight(self, station: int | None = None) -> bytes:
        """See `drivers.link.RecordsFrames`."""
        return await self.recorder.file(station)

    def permissions(self) -> permissions.Permissions:
        """Return what is missing on the interface, with the commands that grant it."""
        return permissions.check(self.interface)

    # Parts ---------------------------------------------------------------------------------

    async def _call(
        self, message: Message, timeout_s: float, progress: Progress | None = None
    ) -> Any:
        self._counts["transactions"] += message["op"] in ("read", "write")
        try:
            return await self._host.call(message, timeout_s, progress)
        except DriveError as error:
            self._counts["timeouts"] += error.kind == "link-timeout"
            raise

    def _received(self, message: Message) -> None:
        if message["event"] == "status":
            self._status = message
            self.process_data.update(message["cyclic"], reachable=bool(message["open"]))
        elif message["event"] == "link":
            kind, station = message["kind"], message["station"]
            if kind == "back" and station is None and self.process_data.trouble:
                # A listener that reads everything again on "back" must wait until the drives are
                # set up.
                kind = "state"
            self._notify(LinkEvent(kind, station, Text.from_wire(message["text"]), message["code"]))

    def _restarted(self, why: Text) -> None:
        self._status = {}
        self._notify(LinkEvent("lost", None, why))
        self.process_data.host_gone(why)

    def _exchange_changed(self, why: Text, well: bool) -> None:
        if not well:
            self._notify(LinkEvent("fault", None, why))
            return
        self._notify(LinkEvent("state", None, why))
        for station in self.process_data.stations:
            again = text("event.station-operational-disabled", station=station)
            self._notify(LinkEvent("back", station, again))

    def _notify(self, event: LinkEvent) -> None:
        self.recorder.note(f"{event.kind}: {event.text.words()}", event.station)
        # An error raised here would be taken for a fault of the host process, which is replaced.
        notify(self._listeners, event)


def _found(item: Message) -> Found:
    parent = item["parent"]
    behind = (
        text("ethercat.note-behind-computer")
        if parent == 0
        else text("ethercat.note-behind-station", station=parent, port=item["parent_port"])
    )
    notes = (behind, *(Text.from_wire(note) for note in item["notes"]))
    return Found(
        station=item["station"],
        vendor_id=item["vendor_id"],
        product_code=item["product_code"],
        revision=item["revision"],
        serial=item["serial"],
        name=item["name"],
        alias=item["alias"],
        hardware=item["hardware"],
        firmware=item["firmware"],
        state=prose(item["state"]),
        notes=notes,
        device_profile=item["device_profile"],
    )


def _options(lockstep: float) -> tuple[str, ...]:
    return ("--lockstep", f"{lockstep:g}") if lockstep else ()


def _require_capture(interface: str) -> None:
    """Check the packet capture library, without which the host process could not start.

    Raises:
        LinkLost: the library is missing, too old or not permitted, or has no such adapter.
    """
    report = permissions.check(interface)
    if report.capture is not None:
        raise LinkLost(report.capture, remedy=report.capture_remedy)


def segment_of(link: Link | None) -> EthercatLink | None:
    """Return the link as an EtherCAT segment; None for another bus."""
    return link if isinstance(link, EthercatLink) else None
