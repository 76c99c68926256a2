"""Asking a drive for many parameters, until it leaves too many without an answer."""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence

from backend.drive.exclusive import ExclusiveAccess, ExclusiveAccessHeld
from backend.drive.ports import Port, address_of
from drivers.errors import DriveError, LinkTimeout, NotAsked
from profiles.schema import Parameter

#: A drive that left so many objects in a row without an answer, in two batches at least, is asked
#: for nothing more of a list.
_SILENT_OBJECTS = 64

Answers = Sequence[bytes | DriveError]


async def asked_in_batches(
    port: Port, parameters: Sequence[Parameter], access: ExclusiveAccess
) -> AsyncIterator[tuple[Sequence[Parameter], Answers]]:
    """Parameters with what came of asking for each, in batches.

    A drive that leaves several batches in a row without an answer is not asked for the access. What
    the link left out because the drive was slow comes once more at the end.

    Raises:
        LinkLost: the bus is gone.
    """
    silent: list[Answers] = []
    left_out: list[Parameter] = []
    for chunk in port.batches(parameters):
        if len(silent) < 2 or sum(map(len, silent)) < _SILENT_OBJECTS:
            answers = await _ask(port, chunk, access)
            silent = [*silent, answers] if _silence(answers) else []
        else:
            answers = [silent[-1][-1]] * len(chunk)
        pairs = zip(chunk, answers, strict=True)
        left_out += [parameter for parameter, answer in pairs if isinstance(answer, NotAsked)]
        yield chunk, answers
    for chunk in port.batches(left_out) if not silent else []:
        yield chunk, await _ask(port, chunk, access)


async def _ask(port: Port, chunk: Sequence[Parameter], access: ExclusiveAccess) -> Answers:
    try:
        async with access.asking():
            return await port.link.read_many(port.station, [address_of(p) for p in chunk])
    except ExclusiveAccessHeld as error:
        return [error] * len(chunk)


def _silence(answers: Answers) -> bool:
    """Whether nothing of a batch was answered; one object alone shows nothing."""
    return len(answers) > 1 and all(isinstance(answer, LinkTimeout) for answer in answers)
