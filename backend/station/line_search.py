"""Search for the baud rate and parity of a serial bus that is not in use."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from backend.station.bench import Bench
from drivers.errors import Busy, NotAllowed
from drivers.modbus.search import LineFound, search_line_settings
from drivers.texts.message import Text, text
from drivers.urls import bus_kind, parse_url


async def search_line(
    bench: Bench, url: str, stations: Sequence[int], progress: Callable[[float, Text], None]
) -> LineFound | None:
    """Search for the line settings of a serial bus; the bus is closed first.

    See `drivers.modbus.search.search_line_settings`.

    Raises:
        OutOfRange: not a bus URL.
        NotAllowed: not a serial line.
        Busy: connected drives use this adapter.
        LinkLost: the adapter is missing.
    """
    wanted = parse_url(url)
    kind = bus_kind(wanted.scheme)
    if kind.serial is None or wanted.is_virtual or url in bench.buses.wires:
        raise NotAllowed("station.no-baud-rate-parity", value=url)
    same = [known for known in bench.buses.opened if parse_url(known).place == wanted.place]
    users = [
        connected.drive.name
        for connected in bench.connected_drives.values()
        if any(bench.buses.url_of(port) in same for port in connected.drive.ports)
    ]
    if users:
        raise Busy("station.used-take-drives", place=wanted.place, users=", ".join(users))
    for known in same:
        await bench.buses.close(known)
    found = await search_line_settings(wanted, kind, progress, stations=stations)
    line = (
        text("journal.line-settings", place=wanted.place, url=found.url)
        if found
        else text("journal.line-settings-not-found", place=wanted.place)
    )
    bench.journal.add(line)
    return found
