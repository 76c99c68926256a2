"""Settings of a frequency response."""

from __future__ import annotations

from pydantic import Field

from backend.tools.measuring.waveform import Waveform
from backend.tools.tool import ToolSettings
from backend.tools.tuning.sweep.evaluation import Kind, Loop, SweepSettings


class SweepRequest(ToolSettings):
    """Settings of a frequency response."""

    kind: Kind = Field(default="mechanics", description="what is measured")
    loop: Loop = Field(default="auto", description="which loop is closed meanwhile")
    f_min_hz: float = Field(default=5.0, ge=3, description="lowest line")
    f_max_hz: float | None = Field(default=None, gt=0, description="highest line")
    share: float = Field(
        default=0.35, gt=0, le=0.9, description="excitation's share of the permitted torque"
    )
    realisations: int = Field(default=2, ge=1, le=8, description="pairs of realisations")
    base_motion: bool = Field(
        default=True, description="turn the axis slowly meanwhile, so that friction is passed"
    )
    excitation: Waveform = Field(
        default="multisine",
        description="a stepped sine is one tone after another, with a closed loop, in one pair "
        "of realisations; the others excite the whole band at once",
    )

    odd_lines: bool = Field(
        default=False,
        description="of mechanics by a multisine: odd lines alone, which distinguish noise, "
        "even and odd distortion",
    )

    @property
    def inner(self) -> SweepSettings:
        """The same settings for the tool's inner layers."""
        return SweepSettings(
            self.envelope, self.kind, self.loop, self.f_min_hz, self.f_max_hz, self.share,
            self.realisations, self.base_motion, self.rated_torque_nm, excitation=self.excitation,
            odd_lines=self.odd_lines,
        )  # fmt: skip
