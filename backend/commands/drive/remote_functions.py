"""``servodeck io``, ``faults`` and ``gear`` for a drive of a running server."""

from __future__ import annotations

from backend.api.drive.models_axis import ActiveFault
from backend.api.drive.models_functions import FaultHistoryInfo, GearPlanInfo, GearWritten, IoInfo
from backend.axes.scales.gear_calculator import Mechanics
from backend.commands.base.options import Place
from backend.commands.drive.function_answers import Faults, Gear, Past, Terminal
from backend.commands.drive.remote_params import remote_drive


async def terminals(place: Place) -> tuple[str, list[Terminal]]:
    """The drive family and all terminals, read now."""
    async with remote_drive(place) as (at, drive):
        reported = await at.ask("GET", f"/drives/{drive.id}/io", IoInfo)
    return drive.profile, [
        Terminal(
            state.name,
            state.direction,
            state.on,
            state.function,
            state.function_name,
            state.inverted,
            state.same_function,
        )
        for state in reported.terminals
    ]


async def faults(place: Place) -> Faults:
    """Active faults and the drive's own fault history, read now."""
    async with remote_drive(place) as (at, drive):
        here = f"/drives/{drive.id}"
        active = await at.ask("GET", f"{here}/faults", list[ActiveFault])
        history = await at.ask("GET", f"{here}/fault-history", FaultHistoryInfo)
        if history.kind == "selected":
            # Records behind a selector are read only on request, as selecting is a write.
            history = await at.ask("POST", f"{here}/fault-history/read", FaultHistoryInfo)
    return Faults(
        active,
        [
            Past(
                entry.name,
                entry.code,
                entry.title if entry.known else None,
                {reading.key: reading.value for reading in entry.values},
                entry.error,
            )
            for entry in history.entries
        ],
        history.size if history.kind == "unreadable" else 0,
        drive.profile,
    )


async def gear(place: Place, mechanics: Mechanics, *, write: bool) -> Gear:
    """Plan the gear for the drive's encoder, and write it with ``write``."""
    body = mechanics.model_dump(mode="json")
    async with remote_drive(place) as (at, drive):
        here = f"/drives/{drive.id}/gear"
        plan = await at.ask("POST", f"{here}/plan", GearPlanInfo, body=body)
        reported = Gear(
            [(value.key, value.name, value.raw) for value in plan.values],
            plan.travel_per_motor_turn,
            plan.unit,
            plan.reached,
            plan.error_ppm,
            plan.warnings,
            drive.profile,
        )
        if not write:
            return reported
        done = await at.ask("POST", f"{here}/write", GearWritten, body=body)
    return reported._replace(before=done.before, waits=done.waits)
