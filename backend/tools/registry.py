"""Every tool that has a descriptor; routes, commands and reports are made from this list."""

from __future__ import annotations

from backend.tools.autotune.tool import TOOL as AUTOTUNE
from backend.tools.brake.run import TOOL as BRAKE_TEST
from backend.tools.cycle.run import TOOL as CYCLE
from backend.tools.dwell.run import TOOL as DWELL
from backend.tools.first_power.run import TOOL as FIRST_POWER
from backend.tools.friction.run import TOOL as FRICTION
from backend.tools.gantry.run import TOOL as GANTRY
from backend.tools.health.run import TOOL as HEALTH
from backend.tools.inertia.run import TOOL as INERTIA
from backend.tools.load_side.run import TOOL as LOAD_SIDE
from backend.tools.safety_check.run import TOOL as SAFETY_CHECK
from backend.tools.shaping.run import TOOL as SHAPING
from backend.tools.step.run import TOOL as STEP
from backend.tools.sweep.run import TOOL as SWEEP
from backend.tools.tool import AnyTool
from backend.tools.vibration.run import TOOL as VIBRATION

TOOLS: tuple[AnyTool, ...] = (
    FIRST_POWER,
    INERTIA,
    SWEEP,
    STEP,
    FRICTION,
    LOAD_SIDE,
    GANTRY,
    BRAKE_TEST,
    HEALTH,
    SAFETY_CHECK,
    SHAPING,
    VIBRATION,
    DWELL,
    CYCLE,
    AUTOTUNE,
)
BY_KIND: dict[str, AnyTool] = {tool.kind: tool for tool in TOOLS}
