"""Results of all tools, distinguished by their field ``tool``.

Separate from the tools, so that code that only reads results need not import the analysis.
"""

from __future__ import annotations

from typing import Annotated, TypeAlias

from pydantic import Field

from backend.tools.mechanics.brake.result import BrakeResult
from backend.tools.mechanics.first_power.result import FirstPowerResult
from backend.tools.mechanics.friction.result import FrictionResult
from backend.tools.mechanics.inertia.result import InertiaAnswer
from backend.tools.mechanics.load_side.result import LoadSideResult
from backend.tools.moving.dwell.result import DwellResult
from backend.tools.moving.step.result import StepAnswer
from backend.tools.tuning.autotune.result import AutotuneAnswer
from backend.tools.tuning.gantry.result import GantryResult
from backend.tools.tuning.shaping.result import ShapingResult
from backend.tools.tuning.sweep.result import SweepAnswer
from backend.tools.watching.cycle.result import CycleResult
from backend.tools.watching.health.result import HealthResult
from backend.tools.watching.safety_check.result import SafetyResult
from backend.tools.watching.vibration.result import VibrationResult

ToolOutcome: TypeAlias = Annotated[
    FrictionResult
    | InertiaAnswer
    | StepAnswer
    | LoadSideResult
    | GantryResult
    | BrakeResult
    | HealthResult
    | FirstPowerResult
    | SafetyResult
    | ShapingResult
    | VibrationResult
    | DwellResult
    | CycleResult
    | SweepAnswer
    | AutotuneAnswer,
    Field(discriminator="tool"),
]
