"""Controllers of slaves out of makers' ESI files, with the errors of a hand-over."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from backend.parameters.set_file import BadSet
from drivers.errors import NotAllowed
from drivers.texts.imports import failure_text, message_of_import
from drivers.texts.message import Text
from profiles.importer import ImportFailed
from profiles.importer.esi_controller import (
    NoController,
    SlaveController,
    SyncManager,
    Wanted,
    read_controllers,
)


def controllers_of(
    sources: Iterable[tuple[bytes, str]], wanted: Sequence[Wanted]
) -> tuple[SlaveController, ...]:
    """See `read_controllers`, in this process: for files of who has started it.

    Raises:
        BadSet: a file is no ESI file, or one that is damaged.
        NotAllowed: no file has such a device, or one without CoE mailboxes.
    """
    try:
        return read_controllers(sources, wanted)
    except ImportFailed as error:
        sound = isinstance(error, NoController)
        raise _refusal(failure_text(error), sound=sound) from error


def controller_of(
    data: bytes, name: str, vendor: int, product: int, revision: int | None
) -> SlaveController:
    """The controller of one drive; see `controllers_of`."""
    return controllers_of([(data, name)], [(vendor, product, revision)])[0]


def reported_controllers(answer: Mapping[str, Any]) -> tuple[SlaveController, ...]:
    """What `ControllersTask` answered; raises what `controllers_of` raises."""
    if "refused" in answer:
        raise _refusal(message_of_import(answer["refused"]), sound=answer["sound"])
    return tuple(
        SlaveController(
            **each | {"sync_managers": tuple(SyncManager(**m) for m in each["sync_managers"])}
        )
        for each in answer["controllers"]
    )


def _refusal(why: Text, *, sound: bool) -> NotAllowed:
    return NotAllowed(why) if sound else BadSet(why, remedy="handover.choose-esi")
