"""Reading many parameters of a drive, until too many requests in a row time out."""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence

from backend.axes.drive.exclusive import ExclusiveAccess, ExclusiveAccessHeld
from backend.axes.drive.ports import Port, address_of
from drivers.errors import DriveError, LinkTimeout, NotAsked
from profiles.schema import Parameter

#: Number of consecutive objects without an answer, in at least two batches, after which the rest
#: of a list is not requested.
_SILENT_OBJECTS = 64

Answers = Sequence[bytes | DriveError]


async def asked_in_batches(
    port: Port, parameters: Sequence[Parameter], access: ExclusiveAccess
) -> AsyncIterator[tuple[Sequence[Parameter], Answers]]:
    """Read parameters in batches; yields each batch with one answer or error per parameter.

    After several batches in a row without an answer, the rest is not requested. Parameters that the
    link left out because the drive was slow are yielded once more at the end.

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
    """Whether no object of a batch was answered; False for a batch of one object."""
    return len(answers) > 1 and all(isinstance(answer, LinkTimeout) for answer in answers)
