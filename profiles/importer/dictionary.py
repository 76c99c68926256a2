"""A drive's own dictionary, as enumerated by its SDO information service.

Source: ETG.1000.6 clause 5.6.3 (object access flags), clause 5.6.7.3 (data types).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from profiles.importer.description import MAX_ENTRIES, DescribedEntry, Description
from profiles.importer.report import ImportFailed, ImportReport
from profiles.importer.values import (
    TYPE_BY_CODE,
    named_type,
    real_of_bits,
    tidy,
    unit_of_code,
    unit_of_name,
)
from profiles.schema import INTEGER_RANGE, Access, DataType, LinkKind, PdoMapping


@dataclass(frozen=True, slots=True)
class DictionaryEntry:
    """One entry as enumerated.

    ``type_code`` is the CANopen data type number, ``access`` the 16 access flags: bits 0 to 2 read
    in Pre-Op, Safe-Op, Op; bits 3 to 5 write in the same states; bit 6 mappable as RxPDO, bit 7 as
    TxPDO. ``object_name`` is the name of the whole object if it has subindices, ``members`` their
    number. ``unit`` is a number of CiA 303-2; values are bytes as transferred. All of these are
    left out where the drive reports none.
    """

    index: int
    subindex: int
    name: str
    type_code: int
    bit_length: int
    access: int
    object_name: str = ""
    members: int = 0
    unit: int | None = None
    default: bytes | None = None
    minimum: bytes | None = None
    maximum: bytes | None = None


def describe_dictionary(
    entries: Iterable[DictionaryEntry],
    *,
    name: str,
    report: ImportReport,
    vendor_id: int | None = None,
    product_code: int | None = None,
    revision: int | None = None,
    link: LinkKind = "ethercat",
) -> Description:
    """Describe a drive by its own dictionary.

    Raises:
        ImportFailed: the dictionary is empty.
    """
    file = f"dictionary of {tidy(name)}"
    found: list[DescribedEntry] = []
    seen: set[tuple[int, int]] = set()
    for entry in entries:
        place = f"{entry.index:04X}:{entry.subindex:02X}"
        if (entry.index, entry.subindex) in seen:
            report.noted(place, "description.listed-twice")
            continue
        seen.add((entry.index, entry.subindex))
        if not 0x1000 <= entry.index <= 0xFFFF or not 0 <= entry.subindex <= 255:
            continue  # lower indices define types
        if entry.subindex == 0 and entry.members > 1:
            continue  # only contains the count
        if len(found) >= MAX_ENTRIES:
            report.left_out(place, "description.too-many-entries", entries=MAX_ENTRIES)
            break
        found.append(_described(entry, file, report))
    if not found:
        raise ImportFailed("description.no-objects-listed", name=name)
    return Description(
        file=file,
        link=link,
        maker="unknown maker",
        model=tidy(name),
        vendor_id=vendor_id,
        product_code=product_code,
        revision=revision,
        entries=tuple(found),
        at=tidy(name),
    )


def _described(entry: DictionaryEntry, file: str, report: ImportReport) -> DescribedEntry:
    place = f"{entry.index:04X}:{entry.subindex:02X}"
    data_type = TYPE_BY_CODE.get(entry.type_code)
    if data_type is None:
        data_type = named_type("", entry.bit_length)
        if data_type is not None:
            report.repaired(place, "description.type-by-length", type=entry.type_code)
    readable, writable = bool(entry.access & 0x07), bool(entry.access & 0x38)
    access: Access = "rw" if readable and writable else "wo" if writable else "ro"
    rx, tx = bool(entry.access & 0x40), bool(entry.access & 0x80)
    pdo: PdoMapping = "rxtx" if rx and tx else "rx" if rx else "tx" if tx else "none"
    plain, unit = unit_of_name(tidy(entry.name))
    title = tidy(entry.object_name)
    name = f"{title}: {plain}" if title and plain and title != plain else plain or title

    def value(data: bytes | None) -> int | float | None:
        return None if data is None or data_type is None else _number(data, data_type)

    return DescribedEntry(
        index=entry.index,
        subindex=entry.subindex,
        name=name or f"Object {place}",
        type=data_type,
        access=access,
        pdo=pdo,
        default_raw=value(entry.default),
        min_raw=value(entry.minimum),
        max_raw=value(entry.maximum),
        unit=(unit_of_code(f"{entry.unit:#x}") if entry.unit else "") or unit,
        source=f"{file}:{place}",
        at=place,
    )


def _number(data: bytes, data_type: DataType) -> int | float | None:
    """Return a value of this type, or None for text, for another length, infinity and NaN."""
    if data_type == "REAL32":
        return real_of_bits(int.from_bytes(data, "little")) if len(data) == 4 else None
    limits = INTEGER_RANGE.get(data_type)
    if limits is None or not data:
        return None
    value = int.from_bytes(data, "little", signed=limits[0] < 0)
    return value if limits[0] <= value <= limits[1] else None
