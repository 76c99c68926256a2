"""Messages about the bench: its buses, the interfaces of the machine, and its drives."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from backend.api.messages.models import Message
from backend.api.station.printed import PrintedLines, PrintedName
from backend.tools.wire_message import MessageInfo


class Health(Message):
    """State of the server."""

    version: str
    time: datetime
    demo: bool
    tour: bool = Field(description="the demo's virtual drives take training faults")


class SerialPort(Message):
    """A serial adapter of this machine."""

    path: str
    description: str
    url: str = Field(description="bus URL to start from")
    usable: bool
    problem: str = ""
    problem_message: MessageInfo | None = Field(default=None, description="of problem")


class NetworkInterface(Message):
    """A network interface that can be used for EtherCAT."""

    name: str
    up: bool
    url: str
    usable: bool
    problem: str = ""
    problem_message: MessageInfo | None = Field(default=None, description="of problem")


class Interfaces(Message):
    """Interfaces of this machine through which drives can be connected."""

    serial: list[SerialPort]
    network: list[NetworkInterface]
    can: list[str] = Field(description="bus URLs to start from")
    virtual: list[str] = Field(description="buses of the running demo bench")


class Quality(Message):
    """Counters of one link or station since it was opened."""

    connected: bool
    state: str
    state_message: MessageInfo | None = Field(default=None, description="of state")
    transactions: int
    timeouts: int
    crc_errors: int
    framing_errors: int
    retries: int
    lost_frames: int
    wkc_errors: int
    round_trip_ms: float | None
    details: dict[str, float | int | str]


class CyclicInfo(Message):
    """The running cyclic exchange of a bus."""

    running: bool
    problem: str = Field(
        default="",
        description="why it does not run although it is wanted; it is set up again by itself",
    )
    problem_message: MessageInfo | None = Field(default=None, description="of problem")
    cycle_us: float
    dc: bool | None = Field(description="distributed clocks in use; None where there are none")
    channels: list[str] = Field(description="drive/key of what comes with every cycle")
    left_over: dict[str, str] = Field(description="what did not fit, and why; it is polled")
    left_over_messages: dict[str, MessageInfo] = Field(
        default_factory=dict, description="of left_over"
    )


class CyclicRequest(Message):
    """Start to exchange process data with all drives of a bus."""

    url: str
    cycle_us: int = Field(default=1000, ge=250, le=10000)


class Bus(Message):
    """An opened bus."""

    url: str
    kind: str
    quality: Quality
    cyclic_possible: bool
    cyclic: CyclicInfo | None


class ScanRequest(Message):
    """Look for drives on a bus."""

    url: str
    stations: list[int] | None = Field(default=None, description="only these; all where None")
    stop_after_first: bool = False


class ProfileMatch(Message):
    """A profile that matches a found drive, and how certain that is."""

    profile: str
    title: str
    confidence: Literal["certain", "likely", "possible"]
    why: str
    why_message: MessageInfo | None = Field(default=None, description="of why")


class FoundDrive(Message):
    """One drive found by a scan."""

    url: str
    station: int
    vendor_id: int | None
    product_code: int | None
    revision: int | None
    serial: int | None
    name: str
    alias: int | None
    hardware: str
    firmware: str
    state: str
    state_message: MessageInfo | None = Field(default=None, description="of state")
    notes: list[str]
    note_messages: list[MessageInfo] = Field(description="of notes")
    matches: list[ProfileMatch]
    connected_as: str | None = Field(description="id of the drive that already uses this station")


class ConnectRequest(Message):
    """Connect a found station as a drive of this bench."""

    url: str
    station: int = Field(ge=0, le=65535)
    profile: str
    name: PrintedName = Field(default="", max_length=60)


class PortRequest(Message):
    """An additional port of a drive that is already connected."""

    url: str
    station: int = Field(ge=0, le=65535)
    accept_difference: bool = Field(
        default=False, description="settings read there differ, and it is the same drive even so"
    )


class DriveUpdate(Message):
    """New name or notes of a drive."""

    name: PrintedName | None = Field(default=None, min_length=1, max_length=60)
    notes: PrintedLines | None = Field(default=None, max_length=4000)
    accept_identity: bool = Field(
        default=False, description="the drive at this place was exchanged on purpose"
    )


class PortInfo(Message):
    """One connection of a drive to a bus."""

    url: str
    kind: str
    station: int
    watchdog: bool
    watchdog_help: str


class Lease(Message):
    """Holder of control over an axis, who may move and write it; none if ``holder`` is null."""

    holder: str | None
    since: datetime | None
    mine: bool = False
    connection: str | None = Field(default=None, description="live connection of the holder")
    until: datetime | None = Field(default=None, description="end of a hand-over for a time")
    asked_by: str | None = Field(default=None, description="who asks for control and waits")
    asked_until: datetime | None = Field(
        default=None, description="when control passes on if the holder does not answer"
    )


class PendingRestoreValue(Message):
    """A parameter that a motion changed temporarily and could not restore: the link was lost."""

    key: str
    name: str
    raw: float | str = Field(description="what it was before; writing it restores it")
    unapplied: bool = Field(description="it is back, but does not act yet")


class DriveSummary(Message):
    """A drive of the bench."""

    id: str
    name: str
    notes: str
    profile: str
    title: str
    maker: str
    partial: bool
    ports: list[PortInfo]
    connected: bool
    serial: int | None
    firmware: str
    identity_warning: str = Field(description="non-empty when another drive answers here")
    identity_warning_message: MessageInfo | None = Field(description="the same as code and facts")
    unsaved: int = Field(description="parameters in the drive but not in its memory")
    pending: int = Field(description="parameters waiting for write-settings, enable or power-off")
    pending_restores: list[PendingRestoreValue] = Field(
        description="what a motion could not restore"
    )
    lease: Lease
    quality: Quality


class ProfileInfo(Message):
    """A profile of servodeck, or one of the user's own."""

    profile: str
    title: str
    maker: str
    partial: bool
    links: list[str]
    parameters: int
    own: bool = Field(default=False, description="in the user's folder, imported or written there")
    problem: str = Field(default="", description="why this own profile cannot be used")
    problem_message: MessageInfo | None = Field(
        default=None, description="of problem, as code and facts"
    )
