"""Snapshot of a segment as the host process reports it: positions, ports, clocks, timing."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.ethercat.process.protocol import Message
from drivers.ethercat.wire.al_status import ERROR_BIT, al_status_text, state_name
from drivers.ethercat.wire.esc import Finding, Port, PortCounters
from drivers.texts.message import Text


@dataclass(frozen=True, slots=True)
class SurveyedStation:
    """One slave.

    ``parent`` is the station before it (0: the computer) and ``parent_port`` the port there, as
    found when all stations last answered. ``clock_ahead_ns`` is the deviation of its clock from the
    reference clock, None without distributed clock.
    """

    station: int
    name: str
    vendor_id: int
    product_code: int
    revision: int
    serial: int | None
    alias: int
    firmware: str
    lost: bool
    al: int
    al_code: int
    parent: int
    parent_port: int
    distributed_clock: bool
    clock_ahead_ns: int | None
    ports: tuple[Port, ...]
    notes: tuple[Text, ...]

    @property
    def state(self) -> str:
        """Name of the AL state; empty while the station does not answer."""
        return "" if self.lost else state_name(self.al)

    @property
    def al_text(self) -> Text | None:
        """Reason of its error and what to do; None without an error."""
        return al_status_text(self.al_code) if self.al & ERROR_BIT and not self.lost else None


@dataclass(frozen=True, slots=True)
class Survey:
    """All stations in the order of the cable, and the faults that their counters indicate."""

    stations: tuple[SurveyedStation, ...]
    findings: tuple[Finding, ...]


@dataclass(frozen=True, slots=True)
class ExchangeFigures:
    """Figures of the running exchange, since its start.

    ``late`` counts wake-ups: the first figure those less than 1 µs late, figure n those from
    2^(n-1) up to 2^n µs, the last one everything above. DC figures are the deviation [ns] of the
    computer's grid from the reference clock.
    """

    cycles: int
    overruns: int
    lost_frames: int
    wkc_errors: int
    expected_wkc: int
    last_wkc: int
    late: tuple[int, ...]
    late_max_us: int
    late_p50_us: int
    late_p99_us: int
    dc: bool
    dc_deviation_ns: int
    dc_deviation_max_ns: int


def survey_from(answer: Message) -> Survey:
    """Convert the host's answer to "counters"."""
    ports = {item["station"]: _ports(item) for item in answer["ports"]}
    stations = tuple(_station(item, ports.get(item["station"])) for item in answer["stations"])
    findings = (
        Finding(item["station"], item["port"], Text.from_wire(item["text"]))
        for item in answer["findings"]
    )
    return Survey(stations, tuple(findings))


def exchange_from(status: Message) -> ExchangeFigures | None:
    """Convert the cyclic part of the host's status; None while nothing is exchanged."""
    if not status.get("running"):
        return None
    names = ExchangeFigures.__dataclass_fields__.keys() - {"late"}
    return ExchangeFigures(
        late=tuple(status["late_histogram"]), **{name: status[name] for name in names}
    )


def _station(item: Message, ports: PortCounters | None) -> SurveyedStation:
    taken = {"hardware", "state", "dc", "notes", "device_profile"}
    return SurveyedStation(
        **{name: value for name, value in item.items() if name not in taken},
        distributed_clock=item["dc"],
        notes=tuple(Text.from_wire(note) for note in item["notes"]),
        ports=() if ports is None else ports.ports,
    )


def _ports(item: Message) -> PortCounters:
    ports = tuple(Port(**port) for port in item["ports"])
    return PortCounters(**(item | {"ports": ports}))
