"""Messages of the functions of a drive: terminals, history, gear, watch list, braking."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from backend.api.drive.models_parameters import ParameterValue
from backend.api.messages.models import Message, Positive
from backend.axes.functions.regeneration import Verdict
from backend.axes.scales.gear_calculator import Mechanics
from backend.tools.wire_message import MessageInfo


class PastFaultInfo(Message):
    """One fault in the drive's record, with the values frozen with it."""

    name: str = Field(description="which record: last fault, record 3 …")
    name_message: MessageInfo | None = Field(
        default=None, description="of name; None where the profile names the record"
    )
    code: str
    known: bool = Field(description="False where the profile has no such fault")
    title: str
    kind: Literal["fault", "warning"] | None
    causes: list[str]
    remedies: list[str]
    reset: str
    values: list[ParameterValue]
    error: str = ""
    error_message: MessageInfo | None = Field(default=None, description="of error")


class FaultHistoryInfo(Message):
    """How a drive keeps past faults, and the ones that were read."""

    kind: Literal["slots", "selected", "unreadable", "unknown"]
    size: int
    newest_first: bool
    source: str
    notes: str
    clear: str = Field(description="name of the procedure that clears it, or empty")
    read_at: datetime | None
    entries: list[PastFaultInfo]


class TerminalFunction(Message):
    """A function that can be assigned to a terminal."""

    code: int
    name: str
    help: str


class TerminalInfo(Message):
    """One terminal: its state and its function."""

    name: str
    direction: Literal["in", "out"]
    on: bool | None
    function: int | None
    function_name: str
    function_key: str | None
    functions: list[TerminalFunction]
    inverted: bool | None
    polarity_key: str | None
    polarity_bit: int | None = Field(
        description="bit of the polarity key; None: a value of its own"
    )
    same_function: list[str] = Field(description="other terminals with the same function")
    source: str
    notes: str


class ForcingInfo(Message):
    """A way to force terminals, and the session that does."""

    name: Literal["outputs", "simulation"]
    title: str
    help: str
    warning: str
    terminals: list[str]
    two_way: bool = Field(description="a terminal can be overruled to off as well as to on")
    source: str
    notes: str
    running: bool
    job: str | None
    values: dict[str, bool]


class IoInfo(Message):
    """All terminals of a drive, read now."""

    time: datetime
    terminals: list[TerminalInfo]
    forcing: list[ForcingInfo]
    notes: str


class ForcingStart(Message):
    """Begin a forcing session; ``confirmed`` states that the user agreed to the warning."""

    confirmed: bool = False


class ForcingValues(Message):
    """Terminals to force (null releases). An empty request only renews the session."""

    values: dict[str, bool | None] = Field(default_factory=dict, max_length=64)


class ProbeRequest(Message):
    """Set up a touch probe."""

    on: bool
    continuous: bool = False
    rising: bool = True
    falling: bool = False
    source: int = Field(default=0, ge=0, le=3)


class GearValueInfo(Message):
    """One parameter of the gear: present and planned raw value."""

    key: str
    name: str
    now: int | float | str | None
    raw: int


class GearPlanInfo(Message):
    """Planned values of the gear, and their consequences."""

    unit: str
    values: list[GearValueInfo]
    wanted: float = Field(description="user increments per motor revolution")
    reached: float
    error_ppm: float
    travel_per_motor_turn: float
    encoder_counts: int
    encoder_travel: float = Field(description="travel of one encoder increment")
    range_travel: float = Field(description="travel of 2^31 user increments")
    max_speed: float | None = Field(description="travel per second at the greatest motor speed")
    max_speed_rpm: float | None
    acts: str = Field(description="when a change acts, as text")
    notes: str
    source: str
    warnings: list[str]
    warnings_messages: list[MessageInfo] = Field(
        default_factory=list, description="of warnings, as code and facts"
    )
    counted: list[str] = Field(description="parameters whose numbers change their meaning")


class GearWritten(Message):
    """Result of writing the gear."""

    before: dict[str, int] = Field(description="raw values that undo it")
    waits: dict[str, str] = Field(description="key to what must happen before it acts")


class AxisRecordInfo(Message):
    """Stored mechanics and watch list of an axis, and the gentlest ramp of its drive."""

    mechanics: Mechanics | None
    gentlest_ramp_rpm_s: float | None = Field(
        description="gentler accelerations are refused; null where nothing bounds them"
    )
    travel_unit: str = Field(description="mm or °, or empty without mechanics")
    travel_per_motor_turn: float | None
    watch: list[str]


class MechanicsUpdate(Message):
    """Store the mechanics of an axis; null deletes them."""

    mechanics: Mechanics | None


class WatchUpdate(Message):
    """Watch list of an axis, in order."""

    keys: Annotated[list[str], Field(max_length=64)]


class BrakingRequest(Message):
    """The braking cycle and the resistors. SI units except rpm; unknown values are null."""

    inertia_kgm2: Positive
    speed_rpm: Positive
    deceleration_s: Positive
    cycle_s: Positive
    stops_per_cycle: float = Field(default=2, gt=0, le=1000)
    efficiency: float = Field(default=1, gt=0, le=1)
    fall_energy_j: float = Field(default=0, ge=0, le=1e9)
    capacitor_j: float = Field(default=0, ge=0, le=1e9)
    built_in_ohm: Positive | None = None
    built_in_w: Positive | None = None
    min_external_ohm: Positive | None = None
    max_external_w: Positive | None = None
    on_voltage_v: Positive | None = None


class BrakingInfo(Message):
    """Result of the braking calculation: energies of one stop [J], powers [W], resistances [Ω]."""

    kinetic_j: float
    returned_j: float
    excess_j: float
    average_w: float
    peak_w: float
    verdict: Verdict
    external_w: float | None
    min_ohm: float | None
    max_ohm: float | None
    possible: bool


class IdentifyRequest(Message):
    """Identification of motor and load by the drive; travel [rev] from the start point."""

    confirmed: bool = False
    travel_limit: Positive
    torque_limit: float = Field(default=300, gt=0, le=400, description="% of rated")
    timeout_s: float = Field(default=120, gt=0, le=1200)
