"""Slow mode, shapers for it, and the residual vibration of a shaped move."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from backend.analysis.signals.shaper import Kind
from backend.tools.tool import Interval, ToolResult
from drivers.texts.message import Language
from drivers.texts.profile_words import ProfileWords

Verdict = Literal["verified", "improved", "no_better", "designed", "stated", "not_seen"]
"""Verdict on the shaper.

``verified``: residual or settling time is at most half. ``designed``: not tried. ``stated``:
designed for a mode that the motor does not show.
"""
Signal = Literal["position_error", "speed", "torque"]
Code = Literal[
    "motor_side",
    "not_excited",
    "long_periods",
    "wide_mode",
    "beyond_prediction",
    "not_settled",
    "samples_lost",
    "drive_filter",
    "drive_filter_range",
    "drive_unstated",
    "in_controller",
]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ShapingFinding(_Part):
    """Something that limits the validity of the result, or where to implement the shaper."""

    code: Code
    value: float | None = None
    unit: str = ""
    parameter: str = ""


class ShapingMode(_Part):
    """The mode; ``range_hz`` and ``range_damping`` contain the interval and every ring-down."""

    frequency_hz: float
    frequency_ci95_hz: Interval
    damping: float
    damping_ci95: Interval
    range_hz: tuple[float, float]
    range_damping: tuple[float, float]
    ring_downs: int
    explained: float = Field(description="share of the signal that this one mode is, 0 to 1")


class ShaperImpulse(_Part):
    """One impulse of a shaper."""

    share: float
    time_s: float


class DesignedShaper(_Part):
    """A shaper and its prediction: the residual in % of the unshaped vibration at the same time."""

    kind: Kind
    impulses: tuple[ShaperImpulse, ...]
    delay_s: float = Field(description="by so much a shaped move ends later")
    residual_percent: tuple[float, float] = Field(
        description="least and most that is left over the range of the mode"
    )
    tolerated_hz: tuple[float, float] = Field(
        description="frequencies between which at most the tolerance is left"
    )


class ShapingResidual(_Part):
    """Half the peak-to-peak value of one signal in the period after the shaped move."""

    signal: Signal
    unit: Literal["rev", "rpm", "%"]
    unshaped: float
    shaped: float


class ShapingComparison(_Part):
    """The same move without and with the shaper.

    Settling counts from the end of the unshaped setpoints in both, so that it includes the delay of
    the shaper; null: not settled at the end of the recording.
    """

    unit: Literal["rev", "rpm", "%"]
    moves: int
    unshaped: float
    unshaped_ci95: Interval
    shaped: float
    shaped_ci95: Interval
    ratio: float
    watched_s: float = Field(description="from the end of the unshaped setpoints on")
    settling_window: float
    settling_unit: Literal["rev", "rpm", "%"]
    settling_unshaped_s: float | None
    settling_shaped_s: float | None
    settling_ratio: float | None = Field(
        description="at most this, where the unshaped move did not settle"
    )
    residuals: tuple[ShapingResidual, ...]


class ShapingDriveValue(_Part):
    """A parameter of the drive's own filter, and its value for the mode."""

    parameter: str
    name: str
    raw: int
    value: float
    unit: str


class FilterSlot(_Part):
    """The parameter of the drive's own filter that holds the mode: Hz, or the period in ms."""

    parameter: str
    name: str
    unit: str
    scale: float
    highest_raw: int


class DriveFilter(_Part):
    """The drive's own filter as its manual documents it; empty where there is none."""

    takes: Literal["frequency", "period"] | None = None
    slot: FilterSlot | None = None
    also: tuple[ShapingDriveValue, ...] = ()
    unstated: tuple[str, ...] = ()
    family: str = ""
    """The drive's profile, for the names of its parameters in other languages."""

    def values_for(self, period_s: float) -> list[ShapingDriveValue]:
        """Parameter values of the filter for this period; empty where it is out of range."""
        slot = self.slot
        if slot is None:
            return []
        raw = round((1.0 / period_s if self.takes == "frequency" else 1e3 * period_s) / slot.scale)
        if not 0 < raw <= slot.highest_raw:
            return []
        own = ShapingDriveValue(
            parameter=slot.parameter,
            name=slot.name,
            raw=raw,
            value=raw * slot.scale,
            unit=slot.unit,
        )
        return [*self.also, own]


class ShapingResult(ToolResult):
    """Result; ``signal`` shows the mode best, and the traces are of it, without its slow creep."""

    tool: Literal["shaping"] = "shaping"
    verdict: Verdict
    signal: Signal | None
    unit: Literal["rev", "rpm", "%"] | None
    mode: ShapingMode | None
    shapers: tuple[DesignedShaper, ...]
    chosen: Kind | None
    comparison: ShapingComparison | None
    drive_values: tuple[ShapingDriveValue, ...] = ()
    family: str = Field(default="", description="profile of the drive; empty in older files")
    trace_s: tuple[float, ...] = Field(default=(), description="from the end of the unshaped move")
    trace_unshaped: tuple[float, ...] = ()
    trace_shaped: tuple[float, ...] = ()
    findings: tuple[ShapingFinding, ...] = ()

    def in_language(self, language: Language) -> Self:
        """The same result with the names of the drive's parameters in this language."""
        say = ProfileWords(self.family, language)
        named = (each.model_copy(update={"name": say(each.name)}) for each in self.drive_values)
        return self.model_copy(update={"drive_values": tuple(named)})
