"""Every tool that has a descriptor; what surrounds the tools is made from this list."""

from __future__ import annotations

from typing import TypeAlias

from backend.tools import friction
from backend.tools.friction.result import FrictionResult
from backend.tools.tool import AnyTool

TOOLS: tuple[AnyTool, ...] = (friction.TOOL,)
BY_KIND: dict[str, AnyTool] = {tool.kind: tool for tool in TOOLS}
ToolOutcome: TypeAlias = FrictionResult
