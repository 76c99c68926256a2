"""Answers printed by `servodeck io`, ``faults`` and ``gear``, from a bus or from a server."""

from __future__ import annotations

from typing import NamedTuple

from backend.api.drive.models_axis import ActiveFault
from backend.axes.scales.gear_calculator import GearPlan
from drivers.texts.message import language
from profiles.schema import Raw


class Terminal(NamedTuple):
    """Present state of one terminal; None where the drive does not report it."""

    name: str
    direction: str
    on: bool | None
    function: int | None
    function_name: str
    inverted: bool | None
    same_function: list[str]


class Past(NamedTuple):
    """One record of the fault history; ``name`` is None where its code is not known."""

    record: str
    code: str
    name: str | None
    values: dict[str, Raw | None]
    error: str


class Faults(NamedTuple):
    """Active and past faults. ``hidden``: number of records that only the maker can read.

    ``family``: the profile that their texts are of.
    """

    active: list[ActiveFault]
    past: list[Past]
    hidden: int
    family: str


class Gear(NamedTuple):
    """A planned gear: key, name and raw value of each parameter.

    Once written: ``before`` holds the earlier raw values, ``waits`` the keys not in effect yet.
    """

    values: list[tuple[str, str, int]]
    travel_per_motor_turn: float
    unit: str
    reached: float
    error_ppm: float
    warnings: list[str]
    family: str
    before: dict[str, int] | None = None
    waits: dict[str, str] | None = None


def of_plan(plan: GearPlan, family: str) -> Gear:
    """The answer for a plan that this command made."""
    return Gear(
        [(v.parameter.key, v.parameter.name, v.raw) for v in plan.values],
        plan.travel_per_motor_turn,
        plan.unit,
        plan.reached,
        plan.error_ppm,
        [each.words(language()) for each in plan.warnings],
        family,
    )
