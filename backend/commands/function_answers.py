"""What `servodeck io`, ``faults`` and ``gear`` print, whoever was asked."""

from __future__ import annotations

from typing import NamedTuple

from backend.api.drive.models_axis import ActiveFault
from backend.scales.gear_calculator import GearPlan
from drivers.texts.message import language
from profiles.schema import Raw


class Terminal(NamedTuple):
    """One terminal as it is; None where the drive does not report."""

    name: str
    direction: str
    on: bool | None
    function: int | None
    function_name: str
    inverted: bool | None
    same_function: list[str]


class Past(NamedTuple):
    """One fault that the drive remembers; ``name`` is None where its code is not known."""

    record: str
    code: str
    name: str | None
    values: dict[str, Raw | None]
    error: str


class Faults(NamedTuple):
    """Present and past. ``hidden`` past ones can only be read by the maker."""

    active: list[ActiveFault]
    past: list[Past]
    hidden: int


class Gear(NamedTuple):
    """A gear as planned: key, name and raw value of each parameter; ``before`` once written."""

    values: list[tuple[str, str, int]]
    travel_per_motor_turn: float
    unit: str
    reached: float
    error_ppm: float
    warnings: list[str]
    before: dict[str, int] | None = None
    waits: dict[str, str] | None = None


def of_plan(plan: GearPlan) -> Gear:
    """A plan that was made here."""
    return Gear(
        [(v.parameter.key, v.parameter.name, v.raw) for v in plan.values],
        plan.travel_per_motor_turn,
        plan.unit,
        plan.reached,
        plan.error_ppm,
        [each.words(language()) for each in plan.warnings],
    )
