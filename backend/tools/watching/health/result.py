"""Result of a health check: quantities of the axis by round, with their intervals."""

from __future__ import annotations

from typing import Literal, get_args

from pydantic import BaseModel, ConfigDict, Field

from backend.tools.tool import ToolResult

Quantity = Literal[
    "resonance", "antiresonance", "friction", "inertia", "step_rise", "step_overshoot"
]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
Unit = Literal["Hz", "%", "kg·m²", "s"]
UNITS: dict[Quantity, Unit] = {
    "resonance": "Hz",
    "antiresonance": "Hz",
    "friction": "%",
    "inertia": "kg·m²",
    "step_rise": "s",
    "step_overshoot": "%",
}


class HealthValue(BaseModel):
    """One quantity of one round; ``low`` and ``high`` are its 95 % interval where known.

    ``number`` counts quantities of the same name from 1, by rising frequency. Friction is in % of
    rated torque: half the difference of both directions, averaged over the speeds.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    quantity: Quantity
    number: int = 1
    value: float
    low: float | None = None
    high: float | None = None

    @property
    def unit(self) -> Unit:
        """Unit of the value."""
        return UNITS[self.quantity]


class HealthRound(BaseModel):
    """All quantities of one round. ``missing``: measured, but without a result."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    values: tuple[HealthValue, ...]
    missing: tuple[Quantity, ...] = ()


class HealthResult(ToolResult):
    """Rounds in the order in which they were measured."""

    tool: Literal["health"] = "health"
    rounds: tuple[HealthRound, ...] = Field(default=())
