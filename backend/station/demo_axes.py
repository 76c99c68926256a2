"""The axes that the demo shows from its start: connected, and with what they move."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import ValidationError

from backend.scales.gear_calculator import Mechanics
from drivers.errors import DriveError, NotAllowed

if TYPE_CHECKING:
    from backend.station.bench import Bench
    from drivers.virtual.bench import AxisSpec, BenchSpec


def mechanics_of(axis: AxisSpec) -> Mechanics | None:
    """What an axis of a bench file moves; None where the file does not say.

    Raises:
        NotAllowed: the mechanics are not valid; the message names the field.
    """
    if not axis.moves:
        return None
    try:
        return Mechanics.model_validate(axis.moves)
    except ValidationError as error:
        first = error.errors()[0]
        raise NotAllowed(
            "virtual.bench-file-see-docs",
            value=axis.name,
            path=axis.name,
            place=".".join(["moves", *(str(part) for part in first["loc"])]),
            first=first["msg"],
        ) from error


async def connect_axes(bench: Bench, spec: BenchSpec) -> list[str]:
    """Connect the axes that a bench file marks as connected, in the order of the file.

    A bench with drives is left as it is: its list was kept from an earlier run. Nothing is
    enabled and nothing is written to a drive. An axis that cannot be connected is logged.

    Returns:
        The ids of the axes that were connected.
    """
    if bench.connected_drives:
        return []
    made: list[str] = []
    for axis in spec.axis:
        if not axis.connected or axis.on not in bench.buses.wires:
            continue
        try:
            mechanics = mechanics_of(axis)
            seen = await bench.buses.scan(axis.on, [axis.station], lambda _fraction, _step: None)
            found = next((each for each in seen if each.station == axis.station), None)
            connected = await bench.connect(
                axis.on, axis.station, axis.drive, axis.name, found=found
            )
        except DriveError as error:
            bench.journal.add(f"{axis.name}: not connected: {error}", level="warning")
            continue
        drive = connected.drive.id
        if mechanics is not None:
            record = bench.axis_records.get(drive)
            bench.axis_records.put(drive, record.model_copy(update={"mechanics": mechanics}))
        made.append(drive)
    return made
