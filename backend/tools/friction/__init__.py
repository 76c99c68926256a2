"""Friction map: torque over speed and over position, both directions."""

from __future__ import annotations

from backend.tools.friction.evaluate import reevaluate
from backend.tools.friction.result import FrictionResult
from backend.tools.friction.run import run
from backend.tools.friction.settings import FrictionSettings
from backend.tools.friction.texts import TEXTS, report
from backend.tools.tool import Tool

TOOL = Tool(
    kind="friction",
    settings=FrictionSettings,
    result=FrictionResult,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
)
