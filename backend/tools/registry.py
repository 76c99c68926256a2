"""Every tool that has a descriptor; routes, commands and reports are made from this list."""

from __future__ import annotations

from backend.tools.mechanics.brake.run import TOOL as BRAKE_TEST
from backend.tools.mechanics.first_power.run import TOOL as FIRST_POWER
from backend.tools.mechanics.friction.run import TOOL as FRICTION
from backend.tools.mechanics.inertia.run import TOOL as INERTIA
from backend.tools.mechanics.load_side.run import TOOL as LOAD_SIDE
from backend.tools.moving.dwell.run import TOOL as DWELL
from backend.tools.moving.step.run import TOOL as STEP
from backend.tools.tool import AnyTool
from backend.tools.tuning.autotune.tool import TOOL as AUTOTUNE
from backend.tools.tuning.gantry.run import TOOL as GANTRY
from backend.tools.tuning.shaping.run import TOOL as SHAPING
from backend.tools.tuning.sweep.run import TOOL as SWEEP
from backend.tools.watching.cycle.run import TOOL as CYCLE
from backend.tools.watching.health.run import TOOL as HEALTH
from backend.tools.watching.safety_check.run import TOOL as SAFETY_CHECK
from backend.tools.watching.vibration.run import TOOL as VIBRATION

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
