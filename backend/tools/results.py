"""Results of all tools, distinguished by their field ``tool``.

Separate from the tools, so that code that only reads results need not import the analysis.
"""

from __future__ import annotations

from typing import Annotated, TypeAlias

from pydantic import Field

from backend.tools.autotune.result import AutotuneAnswer
from backend.tools.brake.result import BrakeResult
from backend.tools.cycle.result import CycleResult
from backend.tools.dwell.result import DwellResult
from backend.tools.first_power.result import FirstPowerResult
from backend.tools.friction.result import FrictionResult
from backend.tools.gantry.result import GantryResult
from backend.tools.health.result import HealthResult
from backend.tools.inertia.result import InertiaAnswer
from backend.tools.load_side.result import LoadSideResult
from backend.tools.safety_check.result import SafetyResult
from backend.tools.shaping.result import ShapingResult
from backend.tools.step.result import StepAnswer
from backend.tools.sweep.result import SweepAnswer
from backend.tools.vibration.result import VibrationResult

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
