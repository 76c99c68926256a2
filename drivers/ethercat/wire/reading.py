"""Reading many entries of one slave with as few requests as it allows.

Transactions of steps; no I/O. Source: ETG.1000.6 clauses 5.6.2 (complete access) and 5.6.7.4
(process-data lists: subindex 0 is the number of entries).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from drivers.errors import (
    DriveError,
    LinkLost,
    LinkTimeout,
    NotInUse,
    ProtocolError,
    Rejected,
)
from drivers.ethercat.process.stations.station import Station
from drivers.ethercat.wire import coe, information
from drivers.ethercat.wire.steps import Gap, Steps
from drivers.objects.dictionary import Described

_NO_COMPLETE_ACCESS = {0x05040001, 0x06010000, 0x06010004}
_LISTS = frozenset((*range(0x1600, 0x1C00), *range(0x1C10, 0x1C30)))
"""PDO mappings and their assignments."""

Item = tuple[int, int, int | None]
"""Index, subindex and length in bytes (None for text)."""


def read_items(
    station: Station, items: Sequence[Item], on_progress: Callable[[int], None]
) -> Steps[list[bytes | DriveError]]:
    """Read many entries; whole objects at once where that is possible and certain.

    A failure does not affect the other entries, except that a drive that does not answer at all is
    not queried for every single entry.
    """
    results: dict[Item, bytes | DriveError] = {}
    groups: dict[int, list[Item]] = {}
    for item in items:
        groups.setdefault(item[0], []).append(item)
    dead: DriveError | None = None
    for index, members in groups.items():
        sizes = _sizes_of_whole(station, index, members) if dead is None else {}
        single = index in station.single_only
        if sizes:
            yield Gap()
            whole = yield from _read_whole(station, index, sizes)
            results.update({item: _sized(item, whole) for item in members if item[1] in whole})
        # The count first: entries beyond it are not read.
        for item in sorted(members, key=lambda item: item[1]):
            if item in results:
                continue
            if dead is not None:
                results[item] = dead
                continue
            if (unused := _not_in_use(item, results, members)) is not None:
                results[item] = unused
                continue
            yield Gap()
            try:
                results[item] = yield from coe.upload(station.box, index, item[1])
            except DriveError as error:
                results[item] = error
                if isinstance(error, LinkLost | LinkTimeout):
                    dead = error
                    if not single:
                        # The drive answers nothing, which is no evidence about whole objects.
                        station.single_only.discard(index)
        if index in station.to_prove:
            read = {item[1]: results[item] for item in members}
            good = {sub: value for sub, value in read.items() if isinstance(value, bytes)}
            _prove(station, index, sizes, good)
        on_progress(len(results))
    return [results[item] for item in items]


def _not_in_use(
    item: Item, results: dict[Item, bytes | DriveError], members: Sequence[Item]
) -> NotInUse | None:
    """Return the error for an entry of a process-data list beyond its count, which is not read.

    It does not belong to the list: many drives report that it does not exist, others return old
    contents. A single read (`coe.upload`) still reads it from the drive.
    """
    index, subindex, _ = item
    if index not in _LISTS or not subindex:
        return None
    reported = next((results.get(member) for member in members if member[1] == 0), None)
    if not isinstance(reported, bytes) or subindex <= (count := int.from_bytes(reported, "little")):
        return None
    return NotInUse(
        "ethercat.not-use-00-counts",
        parameter=f"{index:04X}:{subindex:02X}",
        index=index,
        count=count,
    )


def _sized(item: Item, known: dict[int, bytes]) -> bytes:
    """Return a value of a whole object; a count in the width of its manual (1C12h: UINT16)."""
    _, subindex, size = item
    return known[subindex].ljust(size or 0, b"\0") if subindex == 0 else known[subindex]


def _sizes_of_whole(station: Station, index: int, members: Sequence[Item]) -> dict[int, int]:
    """Map subindex to length of the requested entries; empty if complete access is not worth it."""
    if not station.complete_access or index in station.single_only:
        return {}
    sizes = {sub: size for _, sub, size in members if sub and size is not None}
    return sizes if len(members) >= 2 else {}


def _read_whole(station: Station, index: int, sizes: dict[int, int]) -> Steps[dict[int, bytes]]:
    """Map subindex to bytes, as far as the drive and the certainty of the layout allow."""
    try:
        data = yield from coe.upload(station.box, index, 0, complete=True)
    except Rejected as error:
        station.single_only.add(index)
        if error.abort_code in _NO_COMPLETE_ACCESS and len(station.single_only) >= 3:
            station.complete_access = False
        return {}
    except DriveError:
        station.single_only.add(index)
        return {}
    proven = station.proven.get(index) == tuple(sorted(sizes.items()))
    parts = coe.split_complete(data, sizes, proven=proven)
    if parts:
        return parts
    parts = coe.split_complete(data, sizes, proven=True)
    if not parts:
        station.single_only.add(index)
    elif (yield from _is_all_there_is(station, index, sizes)):
        station.proven[index] = tuple(sorted(sizes.items()))
        return parts
    else:
        station.to_prove[index] = data
    return {}


def _is_all_there_is(station: Station, index: int, sizes: dict[int, int]) -> Steps[bool]:
    """Return whether the drive's own dictionary has no other subindices than these.

    An answer with the total length of all of them then contains each of them: one request instead
    of reading every entry again.
    """
    last = max(sizes)
    if not station.describes or sorted(sizes) != list(range(1, last + 1)):
        return False
    try:
        info = yield from information.describe_object(station.box, index)
    except DriveError:
        station.describes = False
        return False
    return info.max_subindex == last


def _prove(station: Station, index: int, sizes: dict[int, int], singles: dict[int, bytes]) -> None:
    """Compare an uncertain complete access with the single reads that followed it."""
    data = station.to_prove.pop(index)
    if {s: singles.get(s) for s in sizes} == {
        s: part for s, part in coe.split_complete(data, sizes, proven=True).items() if s
    }:
        station.proven[index] = tuple(sorted(sizes.items()))
    else:
        station.single_only.add(index)


def enumerate_objects(
    station: Station, on_progress: Callable[[int, int], None]
) -> Steps[list[Described]]:
    """Read every object and entry that the drive's own dictionary lists.

    What the drive refuses to describe, or describes in a way that cannot be read, is left out.
    """
    indices = yield from information.list_objects(station.box)
    found: list[Described] = []
    for number, index in enumerate(indices):
        on_progress(number, len(indices))
        try:
            info = yield from information.describe_object(station.box, index)
        except (Rejected, ProtocolError):
            continue
        found.append(info)
        for sub in range(info.max_subindex + 1):
            yield Gap()
            try:
                found.append((yield from information.describe_entry(station.box, index, sub)))
            except (Rejected, ProtocolError):
                continue
    return found
