"""Results of all tools that have a descriptor, distinguished by their field ``tool``.

Apart from the tools themselves, so that who only reads results imports no analysis.
"""

from __future__ import annotations

from typing import Annotated, TypeAlias

from pydantic import Field

from backend.tools.brake.result import BrakeResult
from backend.tools.friction.result import FrictionResult
from backend.tools.health.result import HealthResult
from backend.tools.inertia.result import InertiaAnswer

ToolOutcome: TypeAlias = Annotated[
    FrictionResult | InertiaAnswer | BrakeResult | HealthResult, Field(discriminator="tool")
]
