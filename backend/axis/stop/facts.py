"""What STOP did and what it reached, as typed facts; words are made of them at the edge."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from drivers.texts.message import Text


class Verdict(StrEnum):
    """What the measured motion says of an axis after STOP."""

    STOPPED = "stopped"
    """Speed and position both say that it is at standstill."""
    COASTING = "coasting"
    """It has no power and slows down by itself."""
    STILL_MOVING = "still_moving"
    """It goes on, or what it measures contradicts itself."""
    UNREACHABLE = "unreachable"
    """The drive was not reached, or does not report how it moves."""


class StepCode(StrEnum):
    """One thing that STOP did."""

    QUICK_STOP = "quick_stop"
    HALT = "halt"
    SPEED_CONTROL = "speed_control_taken"
    """Out of a torque mode, in which this family's quick stop brakes nothing."""
    OPTION_SET = "quick_stop_option_set"
    OPTION_RESTORED = "quick_stop_option_restored"
    TRIGGER_CLEARED = "trigger_cleared"
    BRAKE_APPLIED = "brake_applied"
    VOLTAGE_DISABLED = "voltage_disabled"
    PROCESS_DATA_ENDED = "process_data_ended"


@dataclass(frozen=True, slots=True)
class StopStep:
    """A step that was tried. ``at_s`` counts from STOP; ``figures`` are raw values and rpm."""

    code: StepCode
    at_s: float
    done: bool = True
    parameter: str | None = None
    figures: dict[str, float] = field(default_factory=dict)
    problem: Text | None = None


@dataclass(frozen=True, slots=True)
class AxisStop:
    """What STOP reached at one axis.

    ``speed`` in the axis' unit of speed is what was measured last, None where nothing was;
    ``travelled`` in its unit of position counts from STOP; ``took_s`` until the verdict.
    """

    drive: str
    verdict: Verdict
    took_s: float
    speed: float | None = None
    speed_unit: str = "rpm"
    travelled: float | None = None
    travel_unit: str = "rev"
    steps: tuple[StopStep, ...] = ()
    problem: Text | None = None
    superseded: bool = False
    """Somebody began a new motion before the verdict."""
