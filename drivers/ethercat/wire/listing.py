"""Reading a list of objects through a mailbox, in parts that let other requests in between."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Awaitable, Callable, Sequence
from typing import TypeAlias

from drivers.errors import DriveError, LinkTimeout, NotAllowed, NotAsked, ProtocolError
from drivers.ethercat.process.protocol import Message, error_from_wire
from drivers.link import Address
from drivers.objects.codec import size_of

Item: TypeAlias = tuple[int, int, int | None]
"""Index, subindex, and size in bytes if known."""

Ask: TypeAlias = Callable[[list[Item], float], Awaitable[list[bytes | Message]]]
"""Request items, with a time-out longer by this many seconds; errors in their wire form."""

_CHUNK, _CHUNKS_AHEAD = 32, 2
#: After this many consecutive parts without an answer, the rest of a list is not requested.
_SILENT_CHUNKS = 2


async def read_list(
    station: int, addresses: Sequence[Address], ask: Ask
) -> list[bytes | DriveError]:
    """Read ``addresses`` in order; an error stands for each value that was not read.

    Raises:
        DriveError: the process that owns the segment did not answer, or does not know the station.
    """
    items = [(*object_of(address), size_of(address.type)) for address in addresses]
    reported: dict[Item, bytes | Message | NotAsked] = {}
    silent: list[list[Item]] = []
    # One part is in progress while the next one waits, so that the drive is never idle; a third
    # reader comes in between, and a write or a stop before them.
    ahead = asyncio.Semaphore(_CHUNKS_AHEAD)

    async def part(chunk: list[Item]) -> None:
        async with ahead:
            if len(silent) >= _SILENT_CHUNKS:
                reported.update(dict.fromkeys(chunk, _not_asked(station)))
                return
            answers = await ask(chunk, 1.5 * _CHUNKS_AHEAD * len(chunk))
        reported.update(zip(chunk, answers, strict=True))
        if len(chunk) > 1 and all(_late(answer) for answer in answers):
            silent.append(chunk)
        else:
            silent.clear()

    try:
        async with asyncio.TaskGroup() as group:
            for chunk in _chunks(items):
                group.create_task(part(chunk))
    except* DriveError as errors:
        raise errors.exceptions[0] from None
    results: list[bytes | DriveError] = []
    for address, item in zip(addresses, items, strict=True):
        try:
            results.append(fitted(address, _value(reported[item])))
        except DriveError as error:
            results.append(error.at(parameter=str(address)))
    return results


def object_of(address: Address) -> tuple[int, int]:
    """Return index and subindex.

    Raises:
        NotAllowed: the value exists only on other links.
    """
    if address.index is None:
        raise NotAllowed(
            "ethercat.no-object-index-ethercat", parameter=str(address), address=str(address)
        )
    return address.index, address.subindex


def fitted(address: Address, data: bytes) -> bytes:
    """Return exactly the bytes of the type; a longer answer is cut only if the rest is padding.

    Raises:
        ProtocolError: the data are not a value of the type.
    """
    size = size_of(address.type)
    if size is None or len(data) == size:
        return data
    if len(data) > size and not any(data[size:]):
        return data[:size]
    raise ProtocolError(
        "ethercat.came-bytes-type",
        parameter=str(address),
        address=str(address),
        bytes=len(data),
        type=address.type,
        size=size,
    )


def _chunks(items: Sequence[Item]) -> list[list[Item]]:
    """Split into parts of some dozens, objects kept whole, to let other requests in between."""
    chunks: list[list[Item]] = [[]]
    for _, members in itertools.groupby(sorted(set(items), key=lambda i: i[:2]), lambda i: i[0]):
        if len(chunks[-1]) >= _CHUNK:
            chunks.append([])
        chunks[-1].extend(members)
    return [chunk for chunk in chunks if chunk]


def _late(answer: bytes | Message) -> bool:
    return not isinstance(answer, bytes) and answer["kind"] == LinkTimeout.kind


def _not_asked(station: int) -> NotAsked:
    return NotAsked("ethercat.station-left-much-unanswered", station=station)


def _value(answer: bytes | Message | NotAsked) -> bytes:
    if isinstance(answer, bytes):
        return answer
    if isinstance(answer, NotAsked):
        # A separate instance for every place, as the caller adds the parameter to it.
        raise NotAsked(answer.text, remedy=answer.remedy_text)
    raise error_from_wire(answer)  # type: ignore[arg-type]
