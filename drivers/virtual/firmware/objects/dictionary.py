"""The object dictionary of a virtual drive: storage and the rules of access.

Aborts follow CiA 301 table 22: no object or subindex, read-only, write-only, wrong length, out of
range. A parameter that takes effect later has two values: the written one (which is read back) and
the one in use.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Protocol, cast

from drivers.virtual.device import (
    ABORT_NO_OBJECT,
    ABORT_NO_SUBINDEX,
    ABORT_READ_ONLY,
    ABORT_TOO_HIGH,
    ABORT_TOO_LONG,
    ABORT_TOO_LOW,
    ABORT_TOO_SHORT,
    ABORT_UNSUPPORTED,
    ABORT_WRITE_ONLY,
    EntryInfo,
    SdoAbort,
)
from profiles.schema import INTEGER_RANGE, Parameter, Profile, Raw

_STRUCT = {
    name: struct.Struct(form)
    for name, form in {
        "BOOL": "<B", "INT8": "<b", "UINT8": "<B", "INT16": "<h", "UINT16": "<H",
        "INT32": "<i", "UINT32": "<I", "INT64": "<q", "UINT64": "<Q", "REAL32": "<f",
    }.items()
}  # fmt: skip
Number = int | float


class Cell(Protocol):
    """The effective value of a number, for code that reads it in every cycle."""

    @property
    def active(self) -> Number:
        """Its present value."""


@dataclass(frozen=True, slots=True)
class _Constant:
    """Replaces an entry that this drive does not have."""

    active: Number


def code_of(index: int, subindex: int) -> int:
    """Return one number for index and subindex."""
    return index << 8 | subindex


class Entry:
    """One object: its description, written and effective value, and its getter and setter."""

    __slots__ = ("active", "getter", "key", "parameter", "setter", "storage", "value", "wrap")

    def __init__(self, parameter: Parameter) -> None:
        self.parameter = parameter
        self.key = parameter.key
        self.storage = _STRUCT.get(parameter.type)
        low, high = INTEGER_RANGE.get(parameter.type, (0, 0))
        self.wrap = (low, high - low + 1) if high else None
        self.value: Raw = self.default()
        self.active: Raw = self.value
        self.getter: Callable[[], Number] | None = None
        self.setter: Callable[[Raw], None] | None = None

    @property
    def size(self) -> int:
        """Size in bytes; for text and octets their present length."""
        return self.storage.size if self.storage else len(self.encoded())

    def default(self) -> Raw:
        """Return the printed default, limited to the type's range, or 0 or "" without one."""
        raw = self.parameter.default_raw
        if self.storage is None:
            return raw if isinstance(raw, str) else ""
        if isinstance(raw, str) or raw is None:
            raw = 0
        if self.parameter.type == "REAL32":
            return float(raw)
        low, high = INTEGER_RANGE[self.parameter.type]
        return min(max(int(raw), low), high)

    def fit(self, number: Number) -> int:
        """Return an integer that fits the type, wrapping around as a counter does."""
        low, span = self.wrap or (0, 1)
        return (int(number) - low) % span + low

    def current(self) -> Raw:
        """Return the value for a reader."""
        if self.getter is None:
            return self.value
        number = self.getter()
        return number if self.wrap is None else self.fit(number)

    def encoded(self) -> bytes:
        """Return the value for a reader, little endian."""
        value = self.current()
        if self.storage is not None:
            return self.storage.pack(value)
        if self.parameter.type == "OCTETS":
            return bytes.fromhex(str(value))
        return str(value).encode("utf-8")

    def decode(self, data: bytes) -> Raw:
        """Convert a writer's bytes to a value inside the printed range, or raise SdoAbort."""
        if self.storage is None:
            return data.hex(" ") if self.parameter.type == "OCTETS" else data.decode("utf-8")
        if len(data) != self.storage.size:
            raise SdoAbort(ABORT_TOO_LONG if len(data) > self.storage.size else ABORT_TOO_SHORT)
        number: Number = self.storage.unpack(data)[0]
        self.check(number)
        return number

    def check(self, number: Number) -> None:
        """Refuse a number outside the printed range."""
        low, high = self.parameter.raw_limits
        if high is not None and number > high:
            raise SdoAbort(ABORT_TOO_HIGH)
        if low is not None and number < low:
            raise SdoAbort(ABORT_TOO_LOW)


class ObjectDictionary:
    """Every entry of a profile, plus those required by CiA 301 that are not in the manual."""

    def __init__(self, profile: Profile, station: int) -> None:
        self.entries: dict[int, Entry] = {}
        self.numbered: dict[str, Entry] = {}
        self.writes = 0
        """Number of accesses that wrote, so that process data detect changes."""
        for parameter in profile.parameters:
            self._add(parameter)
        for parameter in _standard_objects(profile, station):
            if code_of(parameter.index or 0, parameter.subindex or 0) not in self.entries:
                self._add(parameter)
        self._add_counts()
        self._subindices: dict[int, list[int]] = {}
        for code in sorted(self.entries):
            self._subindices.setdefault(code >> 8, []).append(code & 0xFF)

    def _add(self, parameter: Parameter) -> None:
        entry = Entry(parameter)
        self.numbered[parameter.key] = entry
        if parameter.index is not None and parameter.subindex is not None:
            self.entries[code_of(parameter.index, parameter.subindex)] = entry

    def _add_counts(self) -> None:
        highest: dict[int, int] = {}
        for code in self.entries:
            highest[code >> 8] = max(highest.get(code >> 8, 0), code & 0xFF)
        for index, last in highest.items():
            reported = self.entries.get(code_of(index, 0))
            if reported is None:
                self._add(_constant(index, 0, "Highest subindex", "UINT8", last))
            elif (
                last
                and reported.parameter.access == "ro"
                and reported.parameter.default_raw is None
            ):
                self._add(reported.parameter.model_copy(update={"default_raw": last}))

    def __iter__(self) -> Iterator[Entry]:
        return iter(self.numbered.values())

    def __contains__(self, code: int) -> bool:
        return code in self.entries

    def find(self, index: int, subindex: int) -> Entry:
        """Return an entry, or raise SdoAbort with the code for a missing object or subindex."""
        entry = self.entries.get(index << 8 | subindex)
        if entry is None:
            raise SdoAbort(ABORT_NO_SUBINDEX if index in self._subindices else ABORT_NO_OBJECT)
        return entry

    def indices(self) -> list[int]:
        """Return all indices, ascending."""
        return list(self._subindices)

    def subindices(self, index: int) -> list[int]:
        """Return all subindices of an object, ascending."""
        if index not in self._subindices:
            raise SdoAbort(ABORT_NO_OBJECT)
        return list(self._subindices[index])

    def info(self, index: int, subindex: int) -> EntryInfo:
        """Return the description for the SDO information service."""
        entry = self.find(index, subindex)
        parameter = entry.parameter
        return EntryInfo(
            name=parameter.name,
            type=parameter.type,
            bit_length=entry.size * 8,
            readable=parameter.access != "wo",
            writable=parameter.access != "ro",
            pdo_rx=parameter.pdo in ("rx", "rxtx"),
            pdo_tx=parameter.pdo in ("tx", "rxtx"),
        )

    def read(self, index: int, subindex: int) -> bytes:
        """Return the value of an object."""
        entry = self.find(index, subindex)
        if entry.parameter.access == "wo":
            raise SdoAbort(ABORT_WRITE_ONLY)
        return entry.encoded()

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Write an object; if its setter refuses, nothing changes."""
        self.write_entry(self.find(index, subindex), data)

    def write_entry(self, entry: Entry, data: bytes) -> None:
        """Write as `write`, for an entry that has been found."""
        if entry.parameter.access == "ro":
            raise SdoAbort(ABORT_READ_ONLY)
        try:
            value = entry.decode(data)
        except UnicodeDecodeError:
            raise SdoAbort(ABORT_UNSUPPORTED) from None
        self.assign(entry, value)

    def assign(self, entry: Entry, value: Raw) -> None:
        """Store a checked value and call the setter."""
        self.writes += 1
        before, before_active = entry.value, entry.active
        entry.value = value
        if entry.parameter.effective == "now":
            entry.active = value
        if entry.setter is not None:
            try:
                entry.setter(value)
            except SdoAbort:
                entry.value, entry.active = before, before_active
                raise

    def number(self, key: str, default: Number = 0) -> Number:
        """Return the effective value of a numeric entry, or ``default`` if this drive has none."""
        entry = self.numbered.get(key)
        if entry is None or isinstance(entry.active, str):
            return default
        return entry.active

    def cell(self, key: str, default: Number = 0) -> Cell:
        """Return the source of `number`, looked up once: numeric entries always stay numeric."""
        entry = self.numbered.get(key)
        if entry is None or isinstance(entry.active, str):
            return _Constant(default)
        return cast("Cell", entry)

    def put(self, key: str, value: Raw) -> None:
        """Change a value by the drive itself, in storage and in effect."""
        entry = self.numbered.get(key)
        if entry is not None:
            entry.value = entry.active = value

    def make_own(self, key: str, value: Raw) -> None:
        """Set a value of this particular drive from the factory, also used after every start."""
        entry = self.numbered.get(key)
        if entry is not None:
            entry.parameter = entry.parameter.model_copy(update={"default_raw": value})
            entry.value = entry.active = value

    def load(self, values: Mapping[str, Raw]) -> None:
        """Load stored values at power-on, all in effect; those that no longer fit are skipped."""
        for key, value in values.items():
            entry = self.numbered.get(key)
            if entry is None:
                continue
            if entry.storage is not None:
                if isinstance(value, str):
                    continue
                try:
                    entry.check(value)
                except SdoAbort:
                    continue
            entry.value = entry.active = value

    def activate(self, *effective: str) -> None:
        """Apply written values of these effective classes."""
        for entry in self:
            if entry.parameter.effective in effective:
                entry.active = entry.value


def _constant(index: int, subindex: int, name: str, kind: str, value: Raw) -> Parameter:
    return Parameter.model_validate(
        {
            "key": f"{index:04X}:{subindex:02X}",
            "name": name,
            "group": "Standard",
            "type": kind,
            "access": "ro",
            "default_raw": value,
            "source": "CiA 301",
        }
    )


def _revision(profile: Profile) -> int:
    """Return the printed revision, or a number specific to a family without printed identity.

    Masters treat slaves of one vendor, product and revision as equal: SOEM reads the EEPROM of the
    first only, and would use on an M6-L the complete access that an MMS7 before it offers.
    """
    identity = profile.identity
    if identity.revision is not None or identity.product_code is not None:
        return identity.revision or 0
    return zlib.crc32(profile.drive.encode()) & 0xFFFF


def _standard_objects(profile: Profile, station: int) -> list[Parameter]:
    """Return objects of CiA 301 and ETG.1000.6 that a master expects of every drive."""
    identity = profile.identity
    return [
        _constant(0x1000, 0, "Device type", "UINT32", 0x00020192),
        _constant(0x1001, 0, "Error register", "UINT8", 0),
        _constant(0x1008, 0, "Device name", "STRING", identity.model),
        _constant(0x1009, 0, "Hardware version", "STRING", "virtual"),
        _constant(0x100A, 0, "Software version", "STRING", "virtual 1.0"),
        _constant(0x1018, 0, "Identity", "UINT8", 4),
        _constant(0x1018, 1, "Vendor", "UINT32", identity.vendor_id or 0),
        _constant(0x1018, 2, "Product", "UINT32", identity.product_code or 0),
        _constant(0x1018, 3, "Revision", "UINT32", _revision(profile)),
        _constant(0x1018, 4, "Serial number", "UINT32", 0x56000000 | station),
        _constant(0x1C00, 0, "Sync manager types", "UINT8", 4),
        *(_constant(0x1C00, i + 1, f"Sync manager {i}", "UINT8", i + 1) for i in range(4)),
    ]
