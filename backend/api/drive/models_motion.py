"""Requests for motion, and the homing methods of a drive."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from backend.api.messages.models import Finite, Message, Positive

#: Unit of travel in a motion request; speeds are then rpm, mm/s or °/s. mm and ° need mechanics.
TravelName = Literal["rev", "mm", "°"]


class MoveRequest(Message):
    """One move in a profile mode, in units of the axis (see AxisState.units) or of its load."""

    mode: Literal["PP", "PV", "PT"]
    target: Finite
    relative: bool = False
    immediate: Literal[True] = Field(
        default=True, description="a drive gets one target at a time: moves are not queued"
    )
    speed: Positive | None = None
    acceleration: Positive | None = None
    deceleration: Positive | None = None
    travel_limit: Positive = Field(description="greatest distance from the start point")
    torque_limit: float = Field(gt=0, le=400, description="% of rated")
    timeout_s: float = Field(default=30, gt=0, le=600)
    consent: bool = Field(
        default=False,
        description="PV/PT without a watchdog in the drive: the user agreed to the text",
    )
    unit: TravelName = Field(default="rev", description="unit of travel; speeds follow it")


class SequenceRequest(Message):
    """Reciprocating move between two positions."""

    first: Finite
    second: Finite
    speed: Positive
    acceleration: Positive
    dwell_s: float = Field(default=0.5, ge=0, le=60)
    count: int = Field(default=5, ge=1, le=100000)
    travel_limit: Positive
    torque_limit: float = Field(gt=0, le=400)
    unit: TravelName = Field(default="rev", description="unit of travel; speeds follow it")


class GenerateRequest(Message):
    """A test signal in a cyclic mode; amplitude in rev (CSP), rpm (CSV) or %, or by `unit`."""

    mode: Literal["CSP", "CSV", "CST"]
    shape: Literal["step", "ramp", "trapezoid", "sine", "chirp"]
    amplitude: Finite
    duration_s: float = Field(gt=0, le=120)
    frequency_hz: float = Field(default=1.0, gt=0, le=2000)
    frequency_end_hz: float = Field(default=10.0, gt=0, le=2000)
    acceleration: Positive = 10.0
    travel_limit: Positive
    speed_limit: Positive
    torque_limit: float = Field(gt=0, le=400)
    unit: TravelName = Field(default="rev", description="unit of travel; speeds follow it")


class HomeRequest(Message):
    """Homing by one of the drive's methods."""

    method: int
    speed_switch: Positive | None = None
    speed_zero: Positive | None = None
    acceleration: Positive | None = None
    offset: Finite | None = None
    travel_limit: Positive
    torque_limit: float = Field(gt=0, le=400)
    timeout_s: float = Field(default=60, gt=0, le=600)
    unit: TravelName = Field(default="rev", description="unit of travel; speeds follow it")


class HomingMethodInfo(Message):
    """A homing method of the drive."""

    method: int
    name: str
    help: str
    direction: str
    signal: str
    uses_index: bool
    uses_limit: bool
    source: str
    notes: str
