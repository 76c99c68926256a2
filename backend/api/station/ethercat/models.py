"""Messages of EtherCAT segments: stations, ports, cycle timing, permissions, EEPROM."""

from __future__ import annotations

from pydantic import Field

from backend.api.messages.models import Message
from backend.tools.wire_message import MessageInfo


class SegmentPort(Message):
    """One port of a slave. Counters saturate at 255 and count since they were last cleared."""

    number: int
    link: bool
    communicating: bool
    lost_links: int
    rx_errors: int
    invalid_frames: int
    forwarded_errors: int
    findings: list[str] = Field(description="which cable the counters accuse, as text")


class SegmentStation(Message):
    """One slave; slaves are listed in the order of the cable."""

    station: int
    name: str
    drive: str | None = Field(description="id of the connected drive")
    vendor_id: int
    product_code: int
    revision: int
    serial: int | None
    alias: int
    firmware: str
    answers: bool
    state: str = Field(description="AL state; empty while it does not answer")
    error: str = Field(description="why it is in an error state, after its AL status code")
    remedy: str
    behind_station: int = Field(description="the station before it; 0 is the computer")
    behind_port: int
    distributed_clock: bool
    reference_clock: bool = Field(description="the others follow its clock")
    clock_ahead_ns: int | None = Field(
        description="of the reference clock; None where no exchange with clocks keeps it current"
    )
    ports: list[SegmentPort]
    findings: list[str] = Field(description="what its counters accuse that is no cable")
    notes: list[str]
    note_messages: list[MessageInfo] = Field(description="of notes")
    foe: bool = Field(description="its profile says that it takes firmware by FoE")


class LateBin(Message):
    """Cycles that began less than ``below_us`` late, and at least the previous bin's limit."""

    below_us: int | None = Field(description="None: everything above")
    count: int


class SegmentExchange(Message):
    """Figures of the running exchange, since its start."""

    cycles: int
    overruns: int
    lost_frames: int
    wkc_errors: int
    expected_wkc: int
    last_wkc: int
    late_p50_us: int
    late_p99_us: int
    late_max_us: int
    late: list[LateBin]
    dc: bool
    dc_deviation_ns: int = Field(description="of the computer's grid from the reference clock")
    dc_deviation_max_ns: int


class EthercatPermissions(Message):
    """Permissions that are missing to use an interface, and the commands that grant them."""

    interface: str
    ready: bool
    text: str
    text_message: MessageInfo | None = Field(default=None, description="of text")
    missing: list[str] = Field(description="capabilities without which EtherCAT is impossible")
    advised: list[str] = Field(description="capabilities that only make cycles more punctual")
    commands: list[str]


class EthercatSegment(Message):
    """State of a segment now."""

    url: str
    connected: bool
    state: str
    problem: str = Field(description="why the stations could not be asked; empty if they were")
    problem_message: MessageInfo | None = Field(default=None, description="of problem")
    stations: list[SegmentStation]
    late_frames: int = Field(description="frames that came back after they were given up")
    host_restarts: int
    real_time: list[str]
    real_time_messages: list[MessageInfo] = Field(description="of real_time")
    private_network: bool
    exchange: SegmentExchange | None
    permissions: EthercatPermissions | None = Field(description="None in a private network")


class CountersRequest(Message):
    """Station whose error counters are cleared; null: all stations."""

    url: str
    station: int | None = Field(default=None, ge=1)


class AliasRequest(Message):
    """Station alias to write to the EEPROM of a slave."""

    url: str
    station: int = Field(ge=1)
    alias: int = Field(ge=0, le=0xFFFF)
    confirmed: bool = False


class EepromDifference(Message):
    """A field in the EEPROM (``first``) and in the file (``second``), as bytes in hex."""

    field: str = Field(description="a field of the header or a category, as ETG.2010 names it")
    word: int
    first: str | None = Field(description="None where the EEPROM has it not")
    second: str | None = Field(description="None where the file has it not")


class EepromComparison(Message):
    """Comparison of the EEPROM of a slave with a file."""

    bytes: int
    sound: bool
    problem: str | None = Field(description="what is wrong with the present contents")
    vendor_id: int
    product_code: int
    revision: int
    serial: int | None
    alias: int
    differences: list[EepromDifference]


class EepromPlan(Message):
    """Contents of a planned or completed change of an EEPROM."""

    digest: str = Field(description="confirms this change and no other")
    words: int = Field(description="how many words are written, without the checksum's own steps")
    keeps_serial: bool = Field(description="the drive keeps its serial number, not the file's")
    warning: str
    changes: list[EepromDifference]
