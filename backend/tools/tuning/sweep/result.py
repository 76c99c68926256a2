"""Result of a frequency response, as used by page, report, files and command line."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.tool import ToolResult
from backend.tools.wire_message import MessageInfo, words_of
from drivers.texts.message import Language


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ResonanceInfo(_Part):
    """A row of the table of resonances; ``height_db`` is the rise or fall of the response there."""

    kind: Literal["resonance", "antiresonance"]
    frequency_hz: float
    damping: float
    height_db: float
    frequency_ci95_hz: tuple[float, float] | None
    damping_ci95: tuple[float, float] | None


class DirectResponse(_Part):
    """The response without any model, on the same lines."""

    valid_band_hz: tuple[float, float]
    magnitude_db: tuple[float, ...]
    phase_deg: tuple[float, ...]
    std_db: tuple[float | None, ...]
    std_deg: tuple[float | None, ...]


class LoadResponse(_Part):
    """The response to the position of a second encoder at the load, on the lines of the motor's.

    It is the speed of the load at the motor shaft, so that its unit is that of the motor's response
    and both are equal where the coupling is stiff. How late the drive reports the encoder is not
    known: it remains in the phase.
    """

    valid_band_hz: tuple[float, float]
    frequency_hz: tuple[float, ...]
    magnitude_db: tuple[float, ...]
    phase_deg: tuple[float, ...]
    coherence: tuple[float, ...]
    std_db: tuple[float | None, ...]
    std_deg: tuple[float | None, ...]
    counts_per_motor_rev: float = Field(
        description="of the encoder, as measured; negative where it counts backwards"
    )


class ModeInfo(_Part):
    """One resonance of the model: α·(s + β)/(s² + 2ζωs + ω²)."""

    frequency_hz: float
    damping: float
    residue: float
    zero_rad_s: float


class ModelInfo(_Part):
    """Model from torque to velocity: ``gain`` is 1/J of the rigid part, ``pole_rad_s`` b/J."""

    gain: float
    pole_rad_s: float
    modes: tuple[ModeInfo, ...]


class DetectedInfo(_Part):
    """Median motion on lines left empty, as a share of that on the lines around them."""

    even: float = Field(description="on even lines, without noise")
    odd: float = Field(description="on odd lines, without noise")
    noise: float = Field(description="scatter of the mean over the periods")


class SweepAnswer(ToolResult):
    """The response [lines] with its deviations, and the figures read from it.

    ``coherence`` and the deviations are given for each line; None where unknown. ``margins`` are
    valid from ``from_hz`` to ``to_hz``, each None where no crossover was measured.
    """

    tool: Literal["sweep"] = "sweep"
    kind: Literal["mechanics", "speed_loop", "position_loop"]
    loop: str = Field(description="that was closed meanwhile")
    sample_rate_hz: float
    valid_band_hz: tuple[float, float]
    frequency_hz: tuple[float, ...]
    magnitude_db: tuple[float, ...]
    phase_deg: tuple[float, ...]
    coherence: tuple[float, ...]
    std_db: tuple[float | None, ...]
    std_deg: tuple[float | None, ...]
    resonances: tuple[ResonanceInfo, ...]
    margins: dict[str, float | bool | None]
    unit: str = Field(description="of the magnitude, which is in dB of it")
    trusted: bool
    delay_s: float | None
    motion_s: float
    saturated_share: float = Field(description="of the samples had the torque at its limit")
    current_bandwidth_hz: float | None
    speed_filter_hz: float | None
    coulomb_nm: float | None
    noise: tuple[float | None, ...]
    distortion: tuple[float | None, ...]
    detected: DetectedInfo | None = Field(description="None where not only odd lines were excited")
    periods_used: int
    periods_dropped: int
    direct: DirectResponse
    model: ModelInfo | None
    load: LoadResponse | None = Field(
        default=None, description="None where the drive has no second encoder, or it shows nothing"
    )
    warnings: tuple[str, ...] = Field(description="in English")
    warning_messages: tuple[MessageInfo, ...]

    def in_language(self, language: Language) -> Self:
        """The same result with ``warnings`` in this language."""
        return self.model_copy(update={"warnings": words_of(self.warning_messages, language)})
