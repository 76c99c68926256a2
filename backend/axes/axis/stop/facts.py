"""Actions and result of STOP as typed facts; texts are made from them at the edge."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from drivers.texts.message import Text


class Verdict(StrEnum):
    """Motion of an axis after STOP, as measured."""

    STOPPED = "stopped"
    """Speed and position both show standstill."""
    COASTING = "coasting"
    """The axis has no power and slows down by itself."""
    STILL_MOVING = "still_moving"
    """The axis still moves, or its speed and position contradict each other."""
    UNREACHABLE = "unreachable"
    """The drive was not reached, or does not report how it moves."""


class StepCode(StrEnum):
    """Kind of a step of STOP."""

    QUICK_STOP = "quick_stop"
    HALT = "halt"
    SPEED_CONTROL = "speed_control_taken"
    """Change from a torque mode, in which this family's quick stop does not brake."""
    OPTION_SET = "quick_stop_option_set"
    OPTION_RESTORED = "quick_stop_option_restored"
    TRIGGER_CLEARED = "trigger_cleared"
    BRAKE_APPLIED = "brake_applied"
    VOLTAGE_DISABLED = "voltage_disabled"
    PROCESS_DATA_ENDED = "process_data_ended"


@dataclass(frozen=True, slots=True)
class StopStep:
    """A step that was tried. ``at_s`` counts from STOP [s]; ``figures``: raw values and rpm."""

    code: StepCode
    at_s: float
    done: bool = True
    parameter: str | None = None
    figures: dict[str, float] = field(default_factory=dict)
    problem: Text | None = None


@dataclass(frozen=True, slots=True)
class AxisStop:
    """Result of STOP at one axis.

    ``speed``: measured last, in ``speed_unit``; None where none was measured. ``travelled``: travel
    since STOP, in ``travel_unit``. ``took_s``: time from STOP to the verdict [s].
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
    """Whether somebody began a new motion before the verdict."""
