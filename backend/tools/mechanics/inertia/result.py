"""Result of an inertia measurement; in SI units at the motor shaft, where ``unit`` is SI."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.tool import Interval, ToolResult
from drivers.texts.message import Language, Text, joined, text

Reason = Literal[
    "at-limit", "one-direction", "too-little-acceleration", "torque-opposes-acceleration",
    "negative-friction", "does-not-follow", "backlash", "below-motor-inertia", "too-few-samples",
]  # fmt: skip
"""Why the data do not support a result."""
RatioReference = Literal["given", "drive", "stored"]
"""Motor inertia that was given, that the drive reports, or the inertia stored in the drive."""

_REASONS: dict[Reason, Text] = {
    "at-limit": text("inertia.at-limit"),
    "one-direction": text("inertia.one-direction"),
    "too-little-acceleration": text("inertia.too-little-acceleration"),
    "torque-opposes-acceleration": text("inertia.torque-opposes-acceleration"),
    "negative-friction": text("inertia.negative-friction"),
    "does-not-follow": text("inertia.does-not-follow"),
    "backlash": text("inertia.backlash"),
    "below-motor-inertia": text("inertia.below-motor-inertia"),
    "too-few-samples": text("inertia.too-few-samples"),
}
_REFERENCES: dict[RatioReference, Text] = {
    "given": text("inertia.ratio-to-given"),
    "drive": text("inertia.ratio-to-drive"),
    "stored": text("inertia.ratio-to-stored"),
}


def verdict_of(reasons: Iterable[Reason]) -> Text:
    """Text of the reasons why an inertia is not identified."""
    return joined([_REASONS[each] for each in reasons], "\n")


class InertiaIntervals(BaseModel):
    """95 % intervals of the fields of the same names."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    inertia_kgm2: Interval
    viscous_nms: Interval
    coulomb_nm: Interval
    gravity_nm: Interval
    load_ratio: Interval | None


class InertiaAnswer(ToolResult):
    """Result; values are None where not finite, and valid only where ``identifiable``."""

    tool: Literal["inertia"] = "inertia"
    method: str
    inertia_kgm2: float | None
    viscous_nms: float | None
    coulomb_nm: float | None
    gravity_nm: float | None
    load_ratio: float | None
    load_ratio_against: str = Field(
        default="", description="what it compares with, as text; empty without a ratio"
    )
    load_ratio_reference: RatioReference | None = Field(
        default=None, description="what it compares with"
    )
    ci95: InertiaIntervals
    place_nm: float | None = Field(
        default=None, description="half the span of a torque by place: spring, arm, imbalance"
    )
    place_periods_rev: tuple[float, ...] = ()
    fan_nm: float | None = Field(
        default=None, description="torque by the square of the speed, at the highest: fan, pump"
    )
    r2: float
    verdict: str = Field(default="ok", description="of reasons, as text; ok where there are none")
    reasons: tuple[Reason, ...] = Field(default=(), description="why it is not identifiable")
    identifiable: bool
    unit: Literal["SI", "torque as a share of rated torque"]
    ends_rev: tuple[float, float] | None
    motion_s: float

    def in_language(self, language: Language) -> Self:
        """With `verdict` and `load_ratio_against` in this language.

        A result of an older version contains only the texts, and keeps them.
        """
        changed: dict[str, str] = {}
        if self.reasons:
            changed["verdict"] = verdict_of(self.reasons).words(language)
        if self.load_ratio_reference is not None:
            changed["load_ratio_against"] = _REFERENCES[self.load_ratio_reference].words(language)
        return self.model_copy(update=changed)
