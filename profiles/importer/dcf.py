"""Values in a device configuration file (CiA 306-1 v1.3 clause 5.3)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from profiles.importer.eds import MAX_BYTES, device_identity, object_values
from profiles.importer.report import ImportFailed, ImportReport
from profiles.importer.texts import check_size, decode_text


@dataclass(frozen=True, slots=True)
class ConfiguredValue:
    """One ``ParameterValue`` as it stands in the file."""

    index: int
    subindex: int
    text: str
    line: int


def is_dcf(data: bytes) -> bool:
    """Whether the bytes look like a DCF or EDS: a list in another format has no such sections."""
    start = data[:8192].lower()
    if start[:2] in (b"\xff\xfe", b"\xfe\xff"):
        start = start.replace(b"\0", b"")
    return b"[fileinfo]" in start or b"[deviceinfo]" in start


def read_dcf_values(data: bytes, name: str, report: ImportReport) -> Iterator[ConfiguredValue]:
    """Values to be configured, in the file's order; EDS defaults are not among them.

    Raises:
        ImportFailed: too big, or no object of it has a value.
    """
    check_size(data, MAX_BYTES, name)
    found = [
        ConfiguredValue(index, subindex, text, line)
        for index, subindex, text, line in object_values(
            decode_text(data, name, report), name, report
        )
    ]
    if not found:
        raise ImportFailed(f"{name} sets no values: an EDS describes a drive, a DCF configures it")
    return iter(found)


def read_dcf_identity(data: bytes, name: str) -> tuple[int | None, int | None]:
    """Vendor and product number of the drive that the file was made for, None where not given.

    Raises:
        ImportFailed: too big.
    """
    check_size(data, MAX_BYTES, name)
    quiet = ImportReport()
    return device_identity(decode_text(data, name, quiet), name, quiet)
