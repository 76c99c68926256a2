"""A drive as a description file reports it, whatever the file's format."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from profiles.bring_up import BringUp
from profiles.schema import Access, DataType, LinkKind, PdoIdentifier, PdoMapping, Raw

MAX_ENTRIES = 20_000
"""More entries than any drive has: a larger file is broken or hostile."""


@dataclass(frozen=True, slots=True)
class DescribedEntry:
    """One object-dictionary entry. ``type`` None: not stated in the file, or unknown."""

    index: int
    subindex: int
    name: str
    type: DataType | None
    access: Access = "ro"
    pdo: PdoMapping = "none"
    default_raw: Raw | None = None
    min_raw: int | float | None = None
    max_raw: int | float | None = None
    unit: str = ""
    group: str = ""
    enum: dict[int, str] = field(default_factory=dict)
    help: str = ""
    source: str = ""
    at: str = ""
    """Its place, for findings; empty if ``source`` states it."""

    @property
    def place(self) -> str:
        """Place for findings about it."""
        return self.at or self.source

    @property
    def key(self) -> str:
        """As `profiles.schema.Parameter.key`."""
        return f"{self.index:04X}:{self.subindex:02X}"


@dataclass(frozen=True, slots=True)
class DescribedPdo:
    """One PDO with its entries as keys."""

    index: int
    direction: Literal["rx", "tx"]
    entries: tuple[str, ...]
    fixed: bool
    source: str
    layout: tuple[tuple[str | None, int], ...] = ()
    """Key (None: padding) and bits of every part; empty if all entries are whole objects."""
    sync_manager: int | None = None
    mandatory: bool = False
    exclude: tuple[int, ...] = ()
    identifier: PdoIdentifier | None = None
    """CANopen: the default COB-ID."""


@dataclass(frozen=True, slots=True)
class Description:
    """Everything taken from one file or drive."""

    file: str
    link: LinkKind
    maker: str
    model: str
    vendor_id: int | None
    product_code: int | None
    revision: int | None
    entries: tuple[DescribedEntry, ...]
    pdos: tuple[DescribedPdo, ...] = ()
    complete_access: bool = False
    foe: bool = False
    bring_up: BringUp | None = None
    baudrates: tuple[int, ...] = ()
    """Bit rates of a CANopen drive in bit/s."""
    at: str = ""
    """Name of the file or drive, for findings; empty if ``file`` is that name."""

    @property
    def place(self) -> str:
        """Place for findings about the whole."""
        return self.at or self.file
