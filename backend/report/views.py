"""Results of the tools as a report needs them: their JSON forms, checked where they come in."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from backend.library.measurements import BadMeasurement
from backend.tools.autotune.result import VerdictInfo
from backend.tools.registry import BY_KIND
from backend.tools.tool import ToolResult
from drivers.texts.answers import messages_in
from drivers.texts.message import Language


class View(BaseModel):
    """Fields that a report does not show are left out."""

    model_config = ConfigDict(extra="ignore", frozen=True)


class ResonanceView(View):
    """One resonance or antiresonance; height in dB."""

    kind: Literal["resonance", "antiresonance"]
    frequency_hz: float
    damping: float
    height_db: float


class SweepView(View):
    """A frequency response; lists [n] over ``frequency_hz``."""

    kind: Literal["mechanics", "speed_loop", "position_loop"]
    loop: str
    sample_rate_hz: float
    valid_band_hz: tuple[float, float]
    frequency_hz: list[float]
    magnitude_db: list[float]
    phase_deg: list[float]
    coherence: list[float]
    std_db: list[float | None]
    std_deg: list[float | None]
    resonances: list[ResonanceView]
    margins: dict[str, bool | float | None]
    unit: str
    trusted: bool
    saturated_share: float
    warnings: list[str]
    warning_messages: list[dict[str, object]] | None = None

    def cautions(self, language: Language) -> list[str]:
        """The warnings in a language; of a file of an older version as they stand in it."""
        facts = {"warnings": self.warnings, "warning_messages": self.warning_messages}
        return [each.words(language) for each in messages_in(facts, "warnings", "warning")]


AnyView = SweepView | ToolResult


def verdict_of(kept: object) -> VerdictInfo | None:
    """The verdict that an automatic tuning left beside its measurement; None where there is none.

    Raises:
        BadMeasurement: it is not what a tuning concludes.
    """
    if kept is None:
        return None
    try:
        return VerdictInfo.model_validate(kept)
    except ValidationError as error:
        raise BadMeasurement(
            "report.result-not-complete", tool="autotune", cause=str(error)
        ) from error


def view_of(tool: object, result: dict[str, object]) -> AnyView:
    """The result of a tool, by the name that its measurements carry.

    Raises:
        BadMeasurement: it is not what that tool concludes.
    """
    kinds: dict[object, type[AnyView]] = {
        "sweep": SweepView,
    }
    known = BY_KIND.get(str(tool))
    kind = known.result if known is not None else kinds.get(tool)
    if kind is None:
        raise BadMeasurement("report.report-cannot-show-measures", value=str(tool), tool=str(tool))
    try:
        return kind.model_validate(result)
    except ValidationError as error:
        raise BadMeasurement(
            "report.result-not-complete", tool=str(tool), cause=str(error)
        ) from error
