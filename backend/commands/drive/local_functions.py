"""``servodeck io``, ``faults`` and ``gear`` on a bus that the command opens."""

from __future__ import annotations

from backend.api.drive.models_axis import ActiveFault
from backend.axes.axis.axis import Axis
from backend.axes.axis.fault_history import history_of, read_history
from backend.axes.drive.faults import read_active_faults
from backend.axes.drive.terminals import read_terminals
from backend.axes.functions import gear as gears
from backend.axes.scales.gear_calculator import Mechanics
from backend.commands.base.options import Place
from backend.commands.base.session import drive_at
from backend.commands.drive.function_answers import Faults, Gear, Past, Terminal, of_plan
from drivers.texts.message import language


async def terminals(place: Place) -> tuple[str, list[Terminal]]:
    """The drive family and all terminals, read now."""
    async with drive_at(place.url, place.station, place.profile) as drive:
        states = await read_terminals(drive)
    return drive.profile.drive, [
        Terminal(
            state.terminal.name,
            state.terminal.direction,
            state.on,
            state.function,
            state.function_name,
            state.inverted,
            list(state.same_function),
        )
        for state in states
    ]


async def faults(place: Place) -> Faults:
    """Active faults and the drive's own fault history, read now."""
    async with drive_at(place.url, place.station, place.profile) as drive:
        active = await read_active_faults(drive)
        history = history_of(drive)
        readable = history is not None and history.kind != "unreadable"
        past = await read_history(Axis(drive)) if readable else []
    return Faults(
        [
            ActiveFault(
                code=fault.code, name=fault.name, kind=fault.kind, causes=list(fault.causes),
                remedies=list(fault.remedies), reset=fault.reset, source=fault.source,
            )
            for fault in active
        ],
        [
            Past(
                entry.name.words(language()), entry.code_text,
                entry.fault.name if entry.fault else None,
                {reading.key: reading.value for reading in entry.values},
                "" if entry.problem is None else entry.problem.words(language()),
            )
            for entry in past
        ],
        0 if history is None or readable else history.size, drive.profile.drive,
    )  # fmt: skip


async def gear(place: Place, mechanics: Mechanics, *, write: bool) -> Gear:
    """Plan the gear for the drive's encoder, and write it with ``write``."""
    async with drive_at(place.url, place.station, place.profile) as drive:
        axis = Axis(drive)
        plan = await gears.plan(axis, mechanics)
        reported = of_plan(plan, drive.profile.drive)
        if not write:
            return reported
        change = await gears.write_gear(axis, plan.values)
    return reported._replace(before=change.before, waits=change.waits)
