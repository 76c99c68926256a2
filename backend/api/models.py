"""Messages of the HTTP interface: the only source of OpenAPI and of the page's client."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

Raw = int | float | str


class Message(BaseModel):
    """Base: unknown fields are refused, so that a misspelt limit is an error."""

    model_config = ConfigDict(extra="forbid")


#: Beyond every axis in any unit, and far from where floating point overflows.
_MOST = 1e12
#: A number that a person gives; NaN would pass comparisons with a limit.
Finite = Annotated[float, Field(ge=-_MOST, le=_MOST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=1e-9, le=_MOST, allow_inf_nan=False)]


class Problem(BaseModel):
    """RFC 9457 problem details, with what a person needs to act."""

    type: str = Field(examples=["urn:servodeck:out-of-range"])
    title: str
    status: int
    detail: str
    drive: str | None = None
    parameter: str | None = None
    value: Raw | None = None
    limit: str | None = None
    remedy: str | None = None
    code: int | None = Field(default=None, description="SDO abort or Modbus exception code")


class Health(Message):
    """The server is alive."""

    version: str
    time: datetime
    demo: bool


class SerialPort(Message):
    """A serial adapter of this machine."""

    path: str
    description: str
    url: str = Field(description="bus URL to start from")
    usable: bool
    problem: str = ""


class NetworkInterface(Message):
    """A network interface that could carry EtherCAT."""

    name: str
    up: bool
    url: str
    usable: bool
    problem: str = ""


class Interfaces(Message):
    """What this machine can connect through."""

    serial: list[SerialPort]
    network: list[NetworkInterface]
    can: list[str] = Field(description="bus URLs to start from")
    virtual: list[str] = Field(description="buses of the running demo bench")


class Quality(Message):
    """Counters of one link or station since it was opened."""

    connected: bool
    state: str
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
    cycle_us: float
    dc: bool | None = Field(description="distributed clocks in use; None where there are none")
    channels: list[str] = Field(description="drive/key of what comes with every cycle")
    left_over: dict[str, str] = Field(description="what did not fit, and why; it is polled")


class CyclicRequest(Message):
    """Begin to exchange process data with all drives of a bus."""

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
    """A profile that fits what was found, and how sure that is."""

    profile: str
    title: str
    confidence: Literal["certain", "likely", "possible"]
    why: str


class FoundDrive(Message):
    """One drive seen by a scan."""

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
    notes: list[str]
    matches: list[ProfileMatch]
    connected_as: str | None = Field(description="id of the drive that already uses this station")


class ConnectRequest(Message):
    """Make a found station a drive of this bench."""

    url: str
    station: int = Field(ge=0, le=65535)
    profile: str
    name: str = Field(default="", max_length=60)


class PortRequest(Message):
    """A further port of a drive that is already connected."""

    url: str
    station: int = Field(ge=0, le=65535)
    accept_difference: bool = Field(
        default=False, description="settings read there differ, and it is the same drive even so"
    )


class DriveUpdate(Message):
    """Name or notes of a drive."""

    name: str | None = Field(default=None, min_length=1, max_length=60)
    notes: str | None = Field(default=None, max_length=4000)
    accept_identity: bool = Field(
        default=False, description="the drive at this place was exchanged on purpose"
    )


class PortInfo(Message):
    """One connection of a drive."""

    url: str
    kind: str
    station: int
    watchdog: bool
    watchdog_help: str


class Lease(Message):
    """Who may move and write this axis now; nobody where ``holder`` is None."""

    holder: str | None
    since: datetime | None
    mine: bool = False
    connection: str | None = Field(default=None, description="live connection of the holder")
    until: datetime | None = Field(default=None, description="end of a hand-over for a time")
    asked_by: str | None = Field(default=None, description="who asks for control and waits")
    asked_until: datetime | None = Field(
        default=None, description="when control passes on if the holder does not answer"
    )


class OwedValue(Message):
    """A parameter that a motion changed and could not put back, as the link was lost."""

    key: str
    name: str
    raw: float | str = Field(description="what it was before; writing it puts it back")
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
    unsaved: int = Field(description="parameters in the drive but not in its memory")
    pending: int = Field(description="parameters waiting for write-settings, enable or power-off")
    owed: list[OwedValue] = Field(description="what a motion could not put back")
    lease: Lease
    quality: Quality


class ActiveFault(Message):
    """A fault or warning that is present now."""

    code: str
    name: str
    kind: Literal["fault", "warning"]
    causes: list[str]
    remedies: list[str]
    reset: str
    source: str


class AxisState(Message):
    """State of an axis, in engineering units where units are named."""

    drive: str
    time: datetime
    fresh: bool = Field(description="False when the last reading failed; values are then old")
    problem: str = Field(description="why the reading failed, or empty")
    state: str
    status_word: int | None
    mode: int | None
    mode_name: str
    modes: list[int] = Field(description="modes this drive supports")
    goals: list[str] = Field(description="states that can be asked for now")
    target_reached: bool
    internal_limit: bool
    mode_bits: dict[str, bool] = Field(description="meaning of bits 12 and 13 in this mode")
    position: float | None
    velocity: float | None
    torque: float | None
    following_error: float | None
    dc_voltage: float | None
    temperature: float | None
    units: dict[str, str] = Field(description="unit of each of the values above")
    faults: list[ActiveFault]
    blocked_by: list[str] = Field(description="causes that keep the axis from being enabled")
    moving_job: str | None


class TransitionRequest(Message):
    """Drive the CiA 402 state machine to a state."""

    goal: Literal[
        "Switch on disabled",
        "Ready to switch on",
        "Switched on",
        "Operation enabled",
        "Quick stop active",
    ]
    mode: int | None = Field(default=None, description="mode of operation to set before")


class ParameterInfo(Message):
    """Description of a parameter, as in the profile."""

    key: str
    number: str | None
    name: str
    group: str
    type: str
    access: Literal["ro", "rw", "wo"]
    pdo: str
    unit: str
    scale: float
    offset: float
    min_raw: int | float | None
    max_raw: int | float | None
    default_raw: Raw | None
    enum: dict[int, str]
    bits: dict[str, str]
    effective: str
    settable: str
    motor_individual: bool
    help: str
    source: str
    also_printed: list[str]
    notes: str
    reachable: bool = Field(description="False when no connected port can carry it")
    unreachable_why: str = ""


class ParameterValue(Message):
    """What the drive said last."""

    key: str
    raw: Raw | None
    value: Raw | None = Field(description="in the parameter's unit")
    time: datetime | None
    error: str = ""
    unused: bool = Field(
        default=False, description="the drive's own count leaves it out: not asked for"
    )
    unsaved: bool = False
    pending: str = Field(
        default="", description="what must happen before it acts: write_settings, reenable …"
    )


class ParameterRow(ParameterInfo):
    """Description and value."""

    reading: ParameterValue


class ParameterWrite(Message):
    """A new value: exactly one of ``raw`` and ``value``."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    raw: Raw | None = None
    value: Raw | None = None

    @field_validator("raw", "value", mode="before")
    @classmethod
    def _no_truth(cls, given: object) -> object:
        if isinstance(given, bool):
            # Else it would become 1 or 0 of whatever unit the parameter has.
            raise ValueError(  # noqa: TRY004 - pydantic reports these only
                "true and false are no values of a parameter: give the number"
            )
        return given


class ParameterWrites(Message):
    """Several new values, written in turn; a failure does not stop the rest."""

    values: dict[str, ParameterWrite] = Field(max_length=2000)


class WriteResult(Message):
    """Result of one write, with the value that was read back."""

    key: str
    ok: bool
    reading: ParameterValue
    problem: Problem | None = None


class ProcedureInfo(Message):
    """A named sequence of the profile."""

    name: str
    title: str
    help: str
    warning: str
    requires_stop: bool
    confirm: list[str] = Field(description="texts the user must agree to")
    steps: list[str]
    source: str
    notes: str


class ProcedureRequest(Message):
    """Run a procedure."""

    confirmed: bool = False


class JobInfo(Message):
    """A piece of long work."""

    id: str
    kind: str
    drive: str | None
    title: str
    state: Literal["running", "done", "failed", "cancelled"]
    progress: float = Field(ge=0, le=1)
    step: str
    started: datetime
    ended: datetime | None
    motion: bool
    result: dict[str, object] | None
    problem: Problem | None


class StopRequest(Message):
    """STOP; all drives where none is named."""

    drive: str | None = None


class StopResult(Message):
    """What STOP reached."""

    stopped: list[str]
    failed: dict[str, str] = Field(description="drives that could not be told, and why")


class ReadAllRequest(Message):
    """Read parameters; all readable ones where ``keys`` is None."""

    keys: list[str] | None = None


class LoadSetRequest(Message):
    """Write chosen rows of a parameter set to a drive."""

    file: str
    keys: list[str] = Field(max_length=5000)
    version: int | None = Field(default=None, ge=1, description="of the set; the latest if null")
    accept_other_identity: bool = False
    accept_motor_individual: bool = Field(
        default=False, description="write values of one motor into another drive all the same"
    )


class SetFileInfo(Message):
    """A stored parameter set."""

    file: str
    profile: str
    drive_name: str
    serial: int | None
    firmware: str
    author: str
    saved: datetime | None
    notes: str
    count: int
    problem: str = Field(default="", description="why the file cannot be used")


class SaveSetRequest(Message):
    """Store the present values of a drive."""

    file: str = Field(pattern=r"^[\w][\w .\-]{0,100}$")
    author: str = Field(default="", max_length=100)
    notes: str = Field(default="", max_length=4000)
    include_motor_individual: bool = False
    overwrite: bool = False


class DiffRow(Message):
    """One parameter whose value differs, or cannot be compared."""

    key: str
    name: str
    group: str
    unit: str
    file_raw: Raw | None
    file_value: Raw | None
    drive_raw: Raw | None
    drive_value: Raw | None
    default_raw: Raw | None
    default_value: Raw | None
    status: Literal["differs", "same", "not_in_drive", "not_in_file", "invalid", "read_only"]
    problem: str = ""
    motor_individual: bool = False
    selected: bool = Field(description="proposed for writing")


class Diff(Message):
    """A parameter set against a drive."""

    file: str
    version: int | None = Field(default=None, description="of the file; null for the latest")
    drive: str
    same_profile: bool
    same_serial: bool | None
    warnings: list[str]
    rows: list[DiffRow]


class LogEntry(Message):
    """The tool's own log."""

    time: datetime
    level: Literal["info", "warning", "error"]
    drive: str | None
    person: str
    text: str


class ProfileInfo(Message):
    """A profile that servodeck brings, or one of the user's own."""

    profile: str
    title: str
    maker: str
    partial: bool
    links: list[str]
    parameters: int
    own: bool = Field(default=False, description="in the user's folder, imported or written there")
    problem: str = Field(default="", description="why this own profile cannot be used")
