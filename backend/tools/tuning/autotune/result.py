"""Result of an automatic tuning, as used by page, report and files."""

from __future__ import annotations

from datetime import datetime
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.mechanics.inertia.result import InertiaAnswer
from backend.tools.moving.step.result import StepAnswer
from backend.tools.tool import ToolResult
from backend.tools.tuning.sweep.result import SweepAnswer
from backend.tools.wire_message import MessageInfo, words_of
from drivers.texts.message import Language


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class NotchInfo(_Part):
    """Centre, width and depth of a notch; the depth is negative."""

    center_hz: float
    width_hz: float
    depth_db: float


class GainsInfo(_Part):
    """Gains of both loops; ``speed_bandwidth_hz`` is speed_nms/(2π·J)."""

    speed_nms: float
    integral_hz: float
    position_1_s: float
    speed_bandwidth_hz: float


class MarginsInfo(_Part):
    """Margins of an open loop; None where there is no such crossover."""

    crossover_hz: float | None
    phase_margin_deg: float | None
    phase_margin_hz: float | None
    gain_margin_db: float | None
    gain_margin_hz: float | None
    ms: float | None
    ms_hz: float | None
    stable: bool


class GoalsInfo(_Part):
    """The worst margins that were guaranteed or found; None where they are infinite."""

    gain_margin_db: float | None
    phase_margin_deg: float | None
    ms: float | None


class FiltersInfo(_Part):
    """Corner frequencies of filters that can be set in the drive; None: absent or unknown."""

    speed_hz: float | None
    torque_hz: float | None


class CandidateInfo(_Part):
    """A design: its settings and the predicted figures."""

    notches: tuple[NotchInfo, ...]
    gains: GainsInfo
    bandwidth_hz: float | None
    position_bandwidth_hz: float | None
    nominal: MarginsInfo
    promised: GoalsInfo
    phase_cost_deg: float
    overshoot_percent: float | None
    settling_s: float | None
    marks: tuple[Literal["robust", "balanced", "fast"], ...]
    filters: FiltersInfo


class IntervalInfo(_Part):
    """A value and its 95 % confidence interval; a limit of None is unbounded."""

    value: float | None
    low: float | None
    high: float | None


class BandInfo(_Part):
    """Margins over one band; None where there is no crossover in it."""

    low_hz: float
    high_hz: float | None
    phase_margin_deg: IntervalInfo | None
    gain_margin_db: IntervalInfo | None
    peak_sensitivity: IntervalInfo | None


class VerdictInfo(_Part):
    """Verification of the tuned loop: measured over a band, predicted beyond it."""

    measured: BandInfo | None
    predicted: BandInfo | None
    last_crossover_hz: float | None
    coverage: Literal["measured", "gain_steps", "predicted"]
    shown_gain_db: float | None
    stated: GoalsInfo
    worst: GoalsInfo
    stable: bool
    delay_s: IntervalInfo
    gain_db: IntervalInfo
    contradicted: bool
    designed: BandInfo | None
    uncovered_hz: tuple[float, float] | None = None
    """A crossover that no measured line covers, and the end of the measured band next to it."""


class GainStepInfo(_Part):
    """One raised gain and the oscillation of the torque in % of the rated torque (RMS).

    ``oscillation_percent`` is None where the drive ended the step, for example by a fault.
    """

    gain_db: float
    oscillation_percent: float | None
    stable: bool


class GainStepsInfo(_Part):
    """The highest gain with a stable loop, and the next one, where it was not stable."""

    shown_db: float
    onset_db: float | None
    steps: tuple[GainStepInfo, ...]


class FiguresInfo(_Part):
    """Figures of one loop, read on the verified lines; None outside them."""

    bandwidth_hz: float | None
    phase_margin_deg: float | None
    gain_margin_db: float | None


class VerifiedInfo(_Part):
    """Measurement and verdict of the tuned loop."""

    verdict: VerdictInfo | None
    gain_steps: GainStepsInfo | None
    sweep: SweepAnswer
    predicted_bandwidth_hz: float | None
    measured_bandwidth_hz: float | None
    expected: FiguresInfo | None


class AgainInfo(_Part):
    """A loop whose response differed from the prediction, and the outcome of the redesign."""

    predicted: FiguresInfo
    measured: FiguresInfo
    outcome: str
    gain_ratio: float | None
    frequency_hz: tuple[float, ...] | None
    closed_db: tuple[float, ...] | None
    closed_deg: tuple[float, ...] | None


class AutotuneAnswer(ToolResult):
    """Everything measured and decided; ``before`` holds raw values that undo what was applied."""

    tool: Literal["autotune"] = "autotune"
    inertia: InertiaAnswer
    mechanics: SweepAnswer
    load: Literal["stiff", "medium", "compliant"]
    candidates: tuple[CandidateInfo, ...]
    applied: CandidateInfo | None
    verified: VerifiedInfo | None
    again: AgainInfo | None
    step: StepAnswer | None
    before: dict[str, int]
    after: dict[str, int] = Field(default_factory=dict, description="raw values afterwards")
    written: datetime | None = Field(
        default=None, description="when what is in force was written; its verification came after"
    )
    tried: tuple[str, ...] = Field(description="in English")
    tried_messages: tuple[MessageInfo, ...]
    notes: tuple[str, ...] = Field(description="in English")
    note_messages: tuple[MessageInfo, ...]
    cautious: bool

    def in_language(self, language: Language) -> Self:
        """The same result with all its texts in this language."""
        verified = self.verified
        if verified is not None:
            sweep = verified.sweep.in_language(language)
            verified = verified.model_copy(update={"sweep": sweep})
        changed: dict[str, object] = {
            "inertia": self.inertia.in_language(language),
            "mechanics": self.mechanics.in_language(language),
            "verified": verified,
            "tried": words_of(self.tried_messages, language),
            "notes": words_of(self.note_messages, language),
        }
        return self.model_copy(update=changed)
