"""Messages about an axis: its state, transitions, procedures and STOP."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from backend.api.messages.models import Message
from backend.tools.wire_message import MessageInfo


class ActiveFault(Message):
    """A fault or warning that is active now."""

    code: str
    name: str
    kind: Literal["fault", "warning"]
    causes: list[str]
    remedies: list[str]
    reset: str
    source: str


class TurningInfo(Message):
    """An axis that moves although no motion is permitted."""

    kind: Literal["disabled", "without_grant"] = Field(
        description="without power: by hand or by gravity, or the drive's own jog; or enabled"
    )
    speed: float
    unit: str


class AxisState(Message):
    """State of an axis, in engineering units where units are named."""

    drive: str
    time: datetime
    fresh: bool = Field(description="False when the last reading failed; values are then old")
    problem: str = Field(description="why the reading failed, or empty")
    problem_message: MessageInfo | None = Field(default=None, description="of problem")
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
    blocked_by_messages: list[MessageInfo] = Field(
        default_factory=list, description="of blocked_by, as code and facts"
    )
    moving_job: str | None
    turning: TurningInfo | None = Field(
        description="it turns although nobody may move it; None where it does not"
    )


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


class ProcedureInfo(Message):
    """A procedure of the profile: a named sequence of steps."""

    name: str
    title: str
    help: str
    warning: str
    requires_stop: bool
    confirm: list[str] = Field(description="texts the user must agree to")
    steps: list[str]
    step_messages: list[MessageInfo] = Field(default_factory=list, description="of steps")
    source: str
    notes: str


class ProcedureRequest(Message):
    """Run a procedure."""

    confirmed: bool = False


class StopRequest(Message):
    """STOP of one drive; of all drives if none is named."""

    drive: str | None = None


class StopStepInfo(Message):
    """One action of STOP, successful or not."""

    code: Literal[
        "quick_stop", "halt", "speed_control_taken", "quick_stop_option_set",
        "quick_stop_option_restored",
        "trigger_cleared", "brake_applied", "voltage_disabled", "process_data_ended",
    ]  # fmt: skip
    at_s: float = Field(description="seconds since STOP")
    done: bool
    parameter: str | None
    figures: dict[str, float]
    problem: str = Field(description="why it was in vain, or empty")
    problem_message: MessageInfo | None = Field(default=None, description="of problem")


class AxisStopInfo(Message):
    """Verdict of STOP at one axis, from its measured motion."""

    drive: str
    verdict: Literal["stopped", "coasting", "still_moving", "unreachable"]
    took_s: float = Field(description="seconds from STOP to the verdict")
    speed: float | None = Field(description="measured last, magnitude")
    speed_unit: str
    travelled: float | None = Field(description="since STOP, magnitude")
    travel_unit: str
    steps: list[StopStepInfo]
    problem: str = Field(description="why it was in vain, or empty")
    problem_message: MessageInfo | None = Field(default=None, description="of problem")
    superseded: bool = Field(description="a new motion began before the verdict")


class StopResult(Message):
    """Result of STOP."""

    stopped: list[str] = Field(description="drives whose axis is at standstill by what it measures")
    failed: dict[str, str] = Field(
        description="all others: not reached, coasting or still moving, and what to do"
    )
    failed_messages: dict[str, MessageInfo] = Field(
        default_factory=dict, description="of failed, as code and facts"
    )
    axes: list[AxisStopInfo] = Field(description="each axis' verdict")
