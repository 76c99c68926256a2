"""Settings of an automatic tuning."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from backend.analysis.loop.loop_goals import LoadClass, Mark
from backend.tools.mechanics.inertia.evaluation import Scheme
from backend.tools.tool import Option, ToolSettings
from backend.tools.tuning.autotune.run import AutotuneSettings
from backend.tools.tuning.sweep.evaluation import Loop


class AutotuneRequest(ToolSettings):
    """Settings of a tuning; all its steps are one job."""

    mark: Mark = Field(default="balanced", description="the design to apply")
    load: LoadClass | None = Field(default=None, description="judged from the response if not said")
    loop: Loop = Field(default="auto", description="which loop is closed meanwhile")
    scheme: Scheme = Field(default="free", description="how the axis may travel")
    ends_rev: Annotated[tuple[float, float] | None, Option(("--end-low-rev", "--end-high-rev"))] = (
        Field(default=None, description="taught end")
    )
    apply: bool = Field(default=True, description="write the design and verify it")
    motor_inertia_kgm2: float | None = Field(
        default=None, gt=0, description="inertia of the motor alone"
    )

    @property
    def inner(self) -> AutotuneSettings:
        """The same settings for the tool's inner layers."""
        return AutotuneSettings(
            self.envelope, self.mark, self.load, self.loop, self.scheme, self.ends_rev, self.apply,
            self.rated_torque_nm, self.motor_inertia_kgm2,
        )  # fmt: skip
