"""The axes that the demo shows from its start: connected, and with what they move."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from pydantic import ValidationError

from backend.scales.gear_calculator import Mechanics
from drivers.errors import DriveError, NotAllowed

if TYPE_CHECKING:
    from backend.station.bench import Bench
    from drivers.link import Found
    from drivers.virtual.bench import AxisSpec, BenchSpec

#: Searches of a bus until all of its drives have answered.
_TRIES = 10
#: Between them: the segment of a busy computer answers late after its start.
_PAUSE_S = 1.0


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
    found: dict[tuple[str, int], Found] = {}
    for url in spec.urls():
        stations = [at for axis, at in spec.on(url) if axis.connected and axis.on == url]
        if stations and url in bench.buses.wires:
            found |= {(url, each.station): each for each in await _search(bench, url, stations)}
    for axis in spec.axis:
        if not axis.connected or axis.on not in bench.buses.wires:
            continue
        try:
            made.append(await _connect(bench, axis, found.get((axis.on, axis.station))))
        except DriveError as error:
            bench.journal.add(f"{axis.name}: not connected: {error}", level="error")
    return made


async def _search(bench: Bench, url: str, stations: list[int]) -> list[Found]:
    """What answers; a busy computer may miss a drive, so it is asked again, but not often."""
    seen: list[Found] = []
    for attempt in range(_TRIES):
        if attempt:
            await asyncio.sleep(_PAUSE_S)
        try:
            seen = await bench.buses.scan(url, stations, lambda _fraction, _step: None)
        except DriveError as error:
            bench.journal.add(f"{url}: {error}", level="warning")
        if {each.station for each in seen} >= set(stations):
            break
    return seen


async def _connect(bench: Bench, axis: AxisSpec, found: Found | None) -> str:
    mechanics = mechanics_of(axis)
    if found is None:
        raise NotAllowed(
            "command.nothing-answers-station-check-power", station=axis.station, url=axis.on
        )
    connected = await bench.connect(axis.on, axis.station, axis.drive, axis.name, found=found)
    drive = connected.drive.id
    if mechanics is not None:
        record = bench.axis_records.get(drive)
        bench.axis_records.put(drive, record.model_copy(update={"mechanics": mechanics}))
    return drive
