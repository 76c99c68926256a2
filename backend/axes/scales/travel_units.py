"""The unit in which a person types and reads travel: motor revolutions, or mm or ° of the load.

The tools work in revolutions, rpm and rpm/s. A request in another unit is converted once, on
input (`backend.api.drive.convert_motion`), and its messages use the unit of the request.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from backend.axes.motion.travel_unit import REVOLUTIONS, TravelUnit
from backend.axes.scales.gear_calculator import Mechanics
from drivers.errors import NotAllowed

if TYPE_CHECKING:
    from backend.axes.scales.units import AxisUnits


def travel_unit(drive: str, name: str, mechanics: Mechanics | None, units: AxisUnits) -> TravelUnit:
    """The unit of travel with this name, where the axis has it.

    Raises:
        NotAllowed: the axis has no mechanics with this unit, or its increments per revolution are
            unknown.
        OutOfRange: the mechanics lack a dimension.
    """
    if name == REVOLUTIONS.name:
        return REVOLUTIONS
    known = mechanics.unit if mechanics is not None else ""
    if mechanics is None or known != name:
        raise NotAllowed(
            "scales.travel-needs-mechanics-say",
            drive=drive,
            value=name,
            limit=f"rev, {known}" if known else "rev",
        )
    if units.counts_per_rev is None:
        raise NotAllowed("scales.increments-per-revolution-unknown", drive=drive, value=name)
    return TravelUnit(name, float(mechanics.travel_per_motor_turn()))
