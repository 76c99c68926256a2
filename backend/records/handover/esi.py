"""Slave controllers from makers' ESI files, with the errors of a hand-over."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from backend.axes.parameters.set_file import BadSet
from drivers.errors import NotAllowed
from drivers.texts.imports import failure_text, message_of_import
from drivers.texts.message import Text
from profiles.importer import ImportFailed
from profiles.importer.esi.controller import (
    NoController,
    SlaveController,
    SyncManager,
    Wanted,
    read_controllers,
)


def controllers_of(
    sources: Iterable[tuple[bytes, str]], wanted: Sequence[Wanted]
) -> tuple[SlaveController, ...]:
    """Read slave controllers in this process, for trusted files; see `read_controllers`.

    Raises:
        BadSet: a file is not an ESI file, or is damaged.
        NotAllowed: no file has such a device, or the device has no CoE mailboxes.
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
    """Slave controllers from the answer of `ControllersTask`; raises as `controllers_of`."""
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
