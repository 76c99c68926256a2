"""Messages of the websocket ``/api/v1/live``. Text frames contain one of these types as JSON.

Binary frames contain one or more scope blocks in sequence, little endian::

    u32 magic 0x424B4353 ("SCKB")   u32 subscription   u32 sequence   u32 dropped samples
    u16 n rows   u16 k channels   u32 flags (bit 0: true times follow, bit 1: bases follow,
                                             bits 8 to 15: number of the stream)
    f64 t0_s   f64 dt_s
    [n] f64 times_s (only with flag bit 0)
    [k] f64 bases, to be added to the samples of each channel (only with flag bit 1)
    [n*k] f32 samples in engineering units, row after row; NaN where a value is not valid

Sequence and dropped samples are counted per stream of a subscription: channels of the cyclic
exchange and polled channels are separate streams; in a block, the columns of other streams are NaN.
After another ScopeInfo the sequence begins again.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, TypeAdapter

from backend.api.drive.models_axis import AxisState, StopResult
from backend.api.drive.models_parameters import ParameterValue
from backend.api.live.people_messages import PeopleNews, PeopleRequest
from backend.api.messages.models import JobInfo, LogEntry, Message, Positive, Problem
from backend.api.station.models import DriveSummary
from backend.tools.moving.jog.release import ReleaseOfPage
from backend.tools.wire_message import MessageInfo

# --- page to server -----------------------------------------------------------------


class WatchState(Message):
    """Send AxisState of these drives as it changes (replaces the earlier choice)."""

    type: Literal["watch_state"] = "watch_state"
    drives: list[str] = Field(max_length=64)


class WatchValues(Message):
    """Poll and send these parameters of one drive (replaces the earlier choice of that drive)."""

    type: Literal["watch_values"] = "watch_values"
    drive: str
    keys: list[str] = Field(max_length=200)
    period_s: float = Field(default=0.5, ge=0.05, le=60)


class JogStart(Message):
    """Begin to jog; an axis that is not enabled is enabled for the jog.

    The job ends when the renewals stop, the socket closes or control is lost.
    """

    type: Literal["jog_start"] = "jog_start"
    drive: str
    direction: Literal[-1, 1]
    speed: Positive = Field(description="in the axis' velocity unit")
    acceleration: Positive = Field(description="in the axis' acceleration unit")
    travel_limit: Positive = Field(description="greatest distance from where the jog began")
    torque_limit: float = Field(gt=0, le=400, description="% of rated")
    unit: Literal["rev", "mm", "°"] = Field(
        default="rev", description="unit of travel; speed is then rpm, mm/s or °/s"
    )
    press: int = Field(
        default=0, ge=0, description="number of this press, higher than that of the one before"
    )


class JogRenew(Message):
    """Renewal of a jog: the button is still held. Send at 20 Hz or faster.

    The axis brakes if none arrives for 200 ms, and continues if renewals resume within 500 ms and
    the button was not released.
    """

    type: Literal["jog_renew"] = "jog_renew"
    drive: str
    press: int = Field(default=0, ge=0, description="of which press; 0: of any")
    sign: int | None = Field(default=None, ge=0, description="counts the signs of a press")
    sent_ms: float | None = Field(
        default=None, allow_inf_nan=False, description="when it was sent, by the sender's own clock"
    )
    silent_ms: float = Field(
        default=0.0,
        ge=0,
        allow_inf_nan=False,
        description="how long the page had not been heard by its worker then",
    )
    pressed: bool = Field(default=True, description="False: the button was let go")


class JogStop(Message):
    """The button was released."""

    type: Literal["jog_stop"] = "jog_stop"
    drive: str
    press: int = Field(default=0, ge=0, description="of which press; 0: of any")
    reason: ReleaseOfPage = "released"


def _press(number: object) -> int | None:
    """The number of a press; anything else is none, since no STOP may be refused for it."""
    return number if type(number) is int and 0 <= number < 2**53 else None


Press = Annotated[
    int | None,
    BeforeValidator(_press),
    Field(description="number of this press on the page; its answers carry it"),
]


class StopAll(Message):
    """STOP. Same as POST /stop, on the connection that is already open."""

    type: Literal["stop"] = "stop"
    drive: str | None = None
    press: Press = None


class LeaseTake(Message):
    """Take or give up control of an axis."""

    type: Literal["lease"] = "lease"
    drive: str
    take: bool


class ScopeChannel(Message):
    """One channel of a scope subscription."""

    drive: str
    key: str


class ScopeStart(Message):
    """Deliver samples of these channels (replaces an earlier one of the same ``subscription``)."""

    type: Literal["scope_start"] = "scope_start"
    subscription: int = Field(ge=1, le=2**31)
    channels: list[ScopeChannel] = Field(min_length=1, max_length=32)
    period_s: float = Field(default=0.0, ge=0, le=10, description="0: as fast as the link goes")


class ScopeStop(Message):
    """End a subscription."""

    type: Literal["scope_stop"] = "scope_stop"
    subscription: int


class Ping(Message):
    """Round-trip measurement; answered by Pong."""

    type: Literal["ping"] = "ping"
    n: int


DriveRequest = (
    WatchState
    | WatchValues
    | JogStart
    | JogRenew
    | JogStop
    | StopAll
    | LeaseTake
    | ScopeStart
    | ScopeStop
    | Ping
)
FromPage = Annotated[DriveRequest | PeopleRequest, Field(discriminator="type")]
from_page: TypeAdapter[FromPage] = TypeAdapter(FromPage)

# --- server to page -----------------------------------------------------------------


class Hello(Message):
    """First message on every connection."""

    type: Literal["hello"] = "hello"
    connection: str
    version: str


class StateChanged(Message):
    """State of an axis, at 10 Hz at most."""

    type: Literal["state"] = "state"
    state: AxisState


class DrivesChanged(Message):
    """Change in the list of drives, or in quality, control or counts of a drive."""

    type: Literal["drives"] = "drives"
    drives: list[DriveSummary]


class ValuesChanged(Message):
    """New readings; also sent to all pages when a parameter is written."""

    type: Literal["values"] = "values"
    drive: str
    values: list[ParameterValue]


class JobChanged(Message):
    """Progress of a job."""

    type: Literal["job"] = "job"
    job: JobInfo


class JogEnded(Message):
    """End of a jog of this connection; reason and remedy in the language of the connection."""

    type: Literal["jog_ended"] = "jog_ended"
    drive: str
    reason: str = Field(description="empty where the problem states it")
    reason_message: MessageInfo | None = Field(
        default=None, description="of reason, as code and facts"
    )
    remedy: str = Field(
        default="", description="what to do about the reason; empty where nothing is known"
    )
    remedy_message: MessageInfo | None = Field(
        default=None, description="of remedy, as code and facts"
    )
    problem: Problem | None = None


class JogGap(Message):
    """Gap in the renewals of a jog: the axis brakes, or continues after the gap."""

    type: Literal["jog_gap"] = "jog_gap"
    drive: str
    braking: bool = Field(description="True where the gap began, False where the axis goes on")
    gap_ms: float = Field(description="length of the gap so far")


class ScopeInfo(Message):
    """How a subscription's channels are sampled; sent again whenever that changes."""

    type: Literal["scope_info"] = "scope_info"
    subscription: int
    channels: list[ScopeChannelInfo]
    problem: Problem | None = None


class ScopeChannelInfo(Message):
    """Name, unit and timing of one channel."""

    drive: str
    key: str
    name: str
    unit: str
    synchronous: bool
    axis_unit: str = Field(default="", description="unit of the axis; empty where there is none")
    axis_factor: float | None = Field(default=None, description="from ``unit`` to ``axis_unit``")
    fault_bit: int | None = Field(
        default=None, description="of a status word: the bit that is set while there is a fault"
    )


class Logged(Message):
    """A new entry of the station's log."""

    type: Literal["log"] = "log"
    entry: LogEntry


class Refused(Message):
    """A message of the page could not be carried out."""

    type: Literal["refused"] = "refused"
    request: str
    problem: Problem


class StopTaken(Message):
    """STOP has sent its quick stop; its verdict follows as ``stop_result``."""

    type: Literal["stop_taken"] = "stop_taken"
    press: int | None = Field(default=None, description="number of the press that is answered")
    drives: list[str]
    problems: dict[str, str] = Field(description="drives that did not take it yet, and why")
    problem_messages: dict[str, MessageInfo] = Field(
        default_factory=dict, description="of problems, as code and facts, by the same drives"
    )


class StopReached(Message):
    """Verdicts of this connection's STOP."""

    type: Literal["stop_result"] = "stop_result"
    press: int | None = Field(default=None, description="number of the press that is answered")
    result: StopResult


class Pong(Message):
    """Answer to Ping."""

    type: Literal["pong"] = "pong"
    n: int


DriveNews = (
    Hello
    | StateChanged
    | DrivesChanged
    | ValuesChanged
    | JobChanged
    | JogEnded
    | JogGap
    | ScopeInfo
    | Logged
    | Refused
    | StopTaken
    | StopReached
    | Pong
)
ToPage = Annotated[DriveNews | PeopleNews, Field(discriminator="type")]
