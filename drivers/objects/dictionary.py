"""Descriptions of objects as the drive's own object dictionary reports them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ObjectInfo:
    """One object as the drive's own dictionary describes it."""

    index: int
    name: str
    data_type: int
    object_code: int
    max_subindex: int


@dataclass(frozen=True, slots=True)
class EntryDescription:
    """One entry as the drive's own dictionary describes it.

    ``access`` is the bit field of ETG.1000.6 table 49: 0–2 readable and 3–5 writable in PREOP,
    SAFEOP and OP, 6 RxPDO, 7 TxPDO. ``unit``, ``default``, ``minimum`` and ``maximum`` are None
    where the drive reports none.
    """

    index: int
    subindex: int
    data_type: int
    bit_length: int
    access: int
    name: str
    unit: int | None = None
    default: bytes | None = None
    minimum: bytes | None = None
    maximum: bytes | None = None


Described = EntryDescription | ObjectInfo
