"""A profile from a drive's own dictionary."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from drivers.errors import NotAllowed
from drivers.ethercat.coe import EntryDescription, ObjectInfo
from drivers.link import Found, Link, Progress
from profiles.importer import (
    ImportedProfile,
    ImportReport,
    build_profile,
    describe_dictionary,
)
from profiles.importer.dictionary import DictionaryEntry


@runtime_checkable
class ListsObjects(Protocol):
    """A link whose drives can list their own objects (SDO information)."""

    async def enumerate(
        self, station: int, progress: Progress
    ) -> list[EntryDescription | ObjectInfo]:
        """Objects and entries, each object before its entries."""


async def profile_of_drive(
    link: Link, found: Found, name: str, progress: Progress
) -> ImportedProfile:
    """A generic profile called ``name`` of the drive that a scan found.

    Raises:
        NotAllowed: drives on this kind of bus cannot list their objects.
        ImportFailed: this drive lists none.
    """
    if not isinstance(link, ListsObjects):
        raise NotAllowed(
            f"a drive on {link.kind} cannot list its own objects",
            remedy="import the maker's EDS file, or use the generic profile",
        )
    report = ImportReport()
    described = describe_dictionary(
        dictionary_entries(await link.enumerate(found.station, progress)),
        name=found.name or name,
        report=report,
        vendor_id=found.vendor_id,
        product_code=found.product_code,
        revision=found.revision,
        link=link.kind,
    )
    return build_profile(described, report, drive=name)


def dictionary_entries(
    told: Sequence[EntryDescription | ObjectInfo],
) -> list[DictionaryEntry]:
    """What the drive told, each entry with the name of its object."""
    objects = {item.index: item for item in told if isinstance(item, ObjectInfo)}
    entries = []
    for item in told:
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
