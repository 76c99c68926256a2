"""Import of a profile from a maker's file or from a drive's own object dictionary."""

from __future__ import annotations

import asyncio
import json
import pickle
from collections.abc import Sequence
from typing import Any, Protocol

from backend.foundation.work.child import run_child
from drivers.errors import NotAllowed, Rejected
from drivers.link import Address, Found, Link, Progress
from drivers.objects.dictionary import Described, ObjectInfo
from drivers.texts.imports import message_of_import
from profiles.importer import (
    ImportedProfile,
    ImportReport,
    build_profile,
    describe_dictionary,
    import_file,
)
from profiles.importer.dictionary import DictionaryEntry
from profiles.importer.process import DescriptionTask, FileTask
from profiles.loader import user_folder

#: Time limit of an import [s]: the largest permitted file takes a few seconds.
IMPORT_LIMIT_S = 120.0
#: Address space of an import [MiB]: a file of 4 MiB takes 90 MiB, and 32 MiB is the largest file.
IMPORT_LIMIT_MIB = 768
#: Imports at the same time, of all users: each may use a processor and that memory.
IMPORTS_AT_ONCE = 2
_at_once: dict[asyncio.AbstractEventLoop, asyncio.Semaphore] = {}
#: Objects 1021h "Store EDS" and 1022h "Store format"; 0: plain text (CiA 301 clauses 7.5.2.24
#: and 7.5.2.25).
_STORED_EDS = Address(0x1021, 0, "OCTETS")
_STORED_FORMAT = Address(0x1022, 0, "UINT16")


class BadDescription(NotAllowed):
    """No profile can be made from a description file or dictionary; the message states why."""

    kind = "bad-description"


class Work(Protocol):
    """Task of an import process; it is pickled to be passed there."""

    def run(self) -> dict[str, object]:
        """Carry out the task; the answer consists of JSON values."""
        ...


async def import_in_process(
    task: Work, limit_s: float = IMPORT_LIMIT_S, limit_mib: int = IMPORT_LIMIT_MIB
) -> dict[str, Any]:
    """Carry out an import in a separate process, which ends with the caller's task.

    Raises:
        BadDescription: nothing usable in the file, the name is in use, or the import exceeds its
            limit of time or memory.
    """
    loop = asyncio.get_running_loop()
    async with _at_once.setdefault(loop, asyncio.Semaphore(IMPORTS_AT_ONCE)):
        return await _imported_apart(task, limit_s, limit_mib)


async def _imported_apart(task: Work, limit_s: float, limit_mib: int) -> dict[str, Any]:
    try:
        given = await run_child(
            "backend.station.drives.import_process",
            str(limit_mib),
            sent=await asyncio.to_thread(pickle.dumps, task),
            limit_s=limit_s,
        )
    except TimeoutError:
        raise BadDescription("station.import-ended-after", limit_s=limit_s) from None
    try:
        answer: dict[str, Any] = await asyncio.to_thread(json.loads, given.out)
    except ValueError:
        raise BadDescription(
            "station.import-failed-exit-code", returncode=given.exit_code, last=given.last_line
        ) from None
    if "refused" in answer:
        raise BadDescription(
            "station.file-not-imported", cause=message_of_import(answer["refused"])
        )
    if "error" in answer:
        raise BadDescription("station.file-not-imported", cause=str(answer["error"]))
    result: dict[str, Any] = answer["ok"]
    return result


async def drive_task(
    link: Link, found: Found, name: str, progress: Progress
) -> FileTask | DescriptionTask:
    """Task that makes a profile called ``name`` from a drive's report of its own objects.

    An EtherCAT drive lists them (SDO information); a CANopen drive may hold its own EDS (1021h).

    Raises:
        NotAllowed: this drive, or this kind of bus, offers no description.
        ImportFailed: the drive offers a list, but it is empty.
    """
    if link.traits.description == "stored_eds":
        eds = await _stored_eds(link, found)
        return FileTask(eds, f"1021h-station{found.station}.eds", user_folder(), name)
    report = ImportReport()
    description = describe_dictionary(
        dictionary_entries(await link.enumerate(found.station, progress)),
        name=found.name or name,
        report=report,
        vendor_id=found.vendor_id,
        product_code=found.product_code,
        revision=found.revision,
        link=link.kind,
    )
    return DescriptionTask(description, report, user_folder(), name)


async def profile_of_drive(
    link: Link, found: Found, name: str, progress: Progress
) -> ImportedProfile:
    """A generic profile called ``name`` for a drive that a scan found; not yet stored.

    Raises:
        NotAllowed: see `drive_task`.
        ImportFailed: nothing that this drive reports can be used.
    """
    task = await drive_task(link, found, name, progress)
    if isinstance(task, FileTask):
        return import_file(task.data, task.file, drive=name)
    return build_profile(task.description, task.report, drive=name)


async def _stored_eds(link: Link, found: Found) -> bytes:
    """The EDS that a CANopen drive holds in 1021h.

    Raises:
        NotAllowed: it holds none, or one in a maker-specific format.
    """
    remedy = "station.import-eds-or-generic"
    try:
        data = await link.read(found.station, _STORED_EDS)
    except Rejected as error:
        raise NotAllowed(
            "station.drive-station-cannot-list",
            remedy=remedy,
            station=found.station,
            cause=error.text,
        ) from error
    try:
        packed = int.from_bytes(await link.read(found.station, _STORED_FORMAT), "little")
    except Rejected:
        packed = 0  # without 1022h, 1021h holds plain text
    if packed:
        raise NotAllowed(
            "station.drive-station-carries-eds", remedy=remedy, station=found.station, packed=packed
        )
    return data


def dictionary_entries(
    reported: Sequence[Described],
) -> list[DictionaryEntry]:
    """Dictionary entries as the drive reported them, each with the name of its object."""
    objects = {item.index: item for item in reported if isinstance(item, ObjectInfo)}
    entries = []
    for item in reported:
        if isinstance(item, ObjectInfo):
            continue
        owner = objects.get(item.index)
        entries.append(
            DictionaryEntry(
                index=item.index,
                subindex=item.subindex,
                name=item.name,
                type_code=item.data_type,
                bit_length=item.bit_length,
                access=item.access,
                object_name=owner.name if owner is not None else "",
                members=owner.max_subindex + 1 if owner is not None else 0,
                unit=item.unit,
                default=item.default,
                minimum=item.minimum,
                maximum=item.maximum,
            )
        )
    return entries
