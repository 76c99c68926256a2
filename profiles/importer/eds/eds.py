"""CANopen EDS and DCF files.

Source: CiA 306-1 v1.3. Manufacturers' files deviate in many ways; a reader that refuses them is
useless, and one that guesses silently is dangerous. Therefore everything repaired or left out is
reported.
"""

from __future__ import annotations

import re

from profiles.importer.description import (
    MAX_ENTRIES,
    DescribedEntry,
    Description,
)
from profiles.importer.eds.pdo import read_pdos
from profiles.importer.eds.sections import (
    COMMISSIONING,
    COMPACT,
    OBJECT,
    SUBOBJECT,
    Section,
    read_sections,
)
from profiles.importer.report import ImportFailed, ImportReport
from profiles.importer.texts import check_size, decode_text
from profiles.importer.values import (
    TYPE_BY_CODE,
    default_value,
    fit,
    named_type,
    parse_access,
    parse_number,
    real_of_bits,
    tidy,
    unit_of_name,
    without_remark,
)
from profiles.schema import DataType, PdoMapping, Raw

MAX_BYTES = 8 * 2**20
_LAST_SUBINDEX = 254
_DEFTYPE = re.compile(r"(?:0x)?([0-9a-f]{1,3})(?:sub([0-9a-f]{1,2}))?$")
_MODULE = re.compile(r"m\d+|supportedmodules|dynamicchannels")


def read_eds(data: bytes, name: str, report: ImportReport) -> Description:
    """Read an EDS or DCF file.

    Raises:
        ImportFailed: too large, or without an object of a known type.
    """
    check_size(data, MAX_BYTES, name)
    sections = read_sections(decode_text(data, name, report), name, report)
    device = sections.get("deviceinfo", Section(0))
    if "deviceinfo" not in sections:
        report.noted(name, "description.no-device-info")
    entries = _Entries(sections, name, report).read()
    if not entries:
        raise ImportFailed("description.no-eds-objects", file=name)
    return Description(
        file=name,
        link="canopen",
        maker=tidy(device.get("vendorname")) or "unknown maker",
        model=tidy(device.get("productname")) or tidy(name.rsplit(".", 1)[0]),
        vendor_id=_identity(device, "vendornumber", name, report)
        or _own_identity(entries, "1018:01"),
        product_code=_identity(device, "productnumber", name, report)
        or _own_identity(entries, "1018:02"),
        revision=_identity(device, "revisionnumber", name, report)
        or _own_identity(entries, "1018:03"),
        entries=tuple(entries),
        pdos=tuple(read_pdos(entries, sections, name, report)),
        baudrates=_bit_rates(device),
    )


def identity_of(
    sections: dict[str, Section], name: str, report: ImportReport
) -> tuple[int | None, int | None]:
    """Return vendor and product number of [DeviceInfo]; None where the file states none."""
    device = sections.get("deviceinfo", Section(0))
    return (
        _identity(device, "vendornumber", name, report),
        _identity(device, "productnumber", name, report),
    )


def _identity(device: Section, key: str, name: str, report: ImportReport) -> int | None:
    number = parse_number(device.get(key), f"{name}: {key}", report)
    return None if number is None else _real_identity(number)


#: Values that templates leave in these fields; vendor 0 does not exist.
_PLACEHOLDERS = (0, 0xFFFFFFFF)


def _real_identity(number: int | float) -> int | None:
    if number != int(number) or not 0 <= number < 2**32 or number in _PLACEHOLDERS:
        return None
    return int(number)


def _own_identity(entries: list[DescribedEntry], key: str) -> int | None:
    """Return a number of the identity object 1018h by its default; None without a default."""
    value = next((e.default_raw for e in entries if e.key == key), None)
    return _real_identity(value) if isinstance(value, int) else None


#: Keys of [DeviceInfo] and their bit rates in bit/s (CiA 306-1 clause 4.5.2).
_BIT_RATES = {f"baudrate_{kbit}": kbit * 1000 for kbit in (10, 20, 50, 125, 250, 500, 800, 1000)}


def _bit_rates(device: Section) -> tuple[int, ...]:
    return tuple(
        rate for key, rate in _BIT_RATES.items() if device.word(key) in ("1", "0x1", "0x01")
    )


class _Entries:
    """Converts object sections to entries."""

    def __init__(self, sections: dict[str, Section], name: str, report: ImportReport) -> None:
        self._sections = sections
        self._name = name
        self._report = report
        self._configured = 0
        self._of_machine = any(title in sections for title in COMMISSIONING)
        self._objects: dict[int, Section] = {}
        self._members: dict[int, dict[int, Section]] = {}
        self._compact: dict[tuple[int, str], Section] = {}
        self._deftypes: dict[tuple[int, int | None], Section] = {}
        self._sort()

    def _sort(self) -> None:
        modules = 0
        for title, section in self._sections.items():
            if match := SUBOBJECT.match(title):
                index, subindex = int(match[1], 16), int(match[2], 16)
                self._members.setdefault(index, {})[subindex] = section
            elif match := COMPACT.match(title):
                self._compact[int(match[1], 16), match[2]] = section
            elif match := OBJECT.match(title):
                self._objects[int(match[1], 16)] = section
            elif match := _DEFTYPE.match(title):
                subindex_text = match[2]
                key = (int(match[1], 16), int(subindex_text, 16) if subindex_text else None)
                self._deftypes[key] = section
            elif _MODULE.match(title):
                modules += 1
        if modules:
            self._report.left_out(self._name, "description.module-sections", sections=modules)

    def read(self) -> list[DescribedEntry]:
        entries: list[DescribedEntry] = []
        for index in sorted({*self._objects, *self._members}):
            if index < 0x1000:
                continue  # definitions of types, used below
            if len(entries) > MAX_ENTRIES:
                self._report.left_out(self._name, "description.too-many-objects", index=index)
                break
            entries += self._object(index)
        present = {e.index for e in entries}
        compare_with_lists(self._sections, self._name, present, self._report)
        if self._configured:
            self._report.noted(self._name, "description.configured-values", values=self._configured)
        return entries

    def _object(self, index: int) -> list[DescribedEntry]:
        parent = self._objects.get(index)
        members = self._members.get(index, {})
        if parent is None:
            line = min(s.line for s in members.values())
            self._report.repaired(f"{self._name}:{line}", "description.no-own-section", index=index)
            parent = Section(line)
        place = f"{self._name}:{parent.line} [{index:04X}]"
        compact = parse_number(parent.word("compactsubobj"), place, self._report)
        if compact and compact > 0 and not members:
            # Subindex 255 is reserved (CiA 301): 255 counts subindex 0 as well.
            return self._compact_object(index, parent, int(min(compact, _LAST_SUBINDEX)))
        if not members:
            return self._entry(index, 0, parent, parent, "")
        count = parse_number(parent.word("subnumber"), place, self._report)
        if count is not None and count != len(members):
            self._report.noted(
                place,
                "description.subindices-differ",
                announced=int(count),
                given=len(members),
            )
        title = tidy(parent.get("parametername"))
        return [
            entry
            for subindex, member in sorted(members.items())
            # Subindex 0 only contains the count (CiA 301 clause 7.4.4), as a byte. One of another
            # type is a value of its own: some manufacturers put 603Fh:00 next to further
            # subindices.
            if subindex > 0 or len(members) == 1 or self._is_value(member, parent)
            for entry in self._entry(index, subindex, member, parent, title)
        ]

    def _is_value(self, member: Section, parent: Section) -> bool:
        kind = self._type(member, parent, self._name)
        return kind is not None and kind not in ("UINT8", "INT8", "BOOL")

    def _compact_object(self, index: int, parent: Section, count: int) -> list[DescribedEntry]:
        names = self._compact.get((index, "name"), Section(0))
        values = self._compact.get((index, "value"), Section(0))
        title = tidy(parent.get("parametername"))
        entries = []
        for subindex in range(1, count + 1):
            member = Section(parent.line, dict(parent.values))
            member.values["parametername"] = names.get(str(subindex)) or f"{title}{subindex}"
            if value := values.get(str(subindex)):
                # In a DCF these are values of one machine (CiA 306-1 clause 5.3).
                member.values["parametervalue" if self._of_machine else "defaultvalue"] = value
            entries += self._entry(index, subindex, member, parent, title)
        return entries

    def _entry(
        self, index: int, subindex: int, section: Section, parent: Section, title: str
    ) -> list[DescribedEntry]:
        place = f"{self._name}:{section.line} [{index:04X}sub{subindex:X}]"
        data_type = self._type(section, parent, place)
        access_text = section.word("accesstype", "access") or parent.word("accesstype")
        if not access_text:
            self._report.repaired(place, "description.no-access")
            access_text = "ro"
        access = parse_access(access_text, place, self._report)
        own = tidy(section.get("denotation") or section.get("parametername"))
        plain, unit = unit_of_name(own)
        name = f"{title}: {plain}" if title and plain and not plain.startswith(title) else plain
        default: Raw | None = None
        remark = ""
        low = high = None
        if data_type is not None:
            default, remark = default_value(
                section.get("defaultvalue"), data_type, place, self._report
            )
            self._configured += bool(section.get("parametervalue"))
            low = self._limit(section, "LowLimit", data_type, place)
            high = self._limit(section, "HighLimit", data_type, place)
        entry = DescribedEntry(
            index=index,
            subindex=subindex,
            name=name or title or f"Object {index:04X}h",
            type=data_type,
            access=access,
            pdo=_mapping(section, parent, access_text),
            default_raw=default,
            min_raw=low,
            max_raw=high,
            unit=tidy(section.get("unit"), 20) or unit,
            group=tidy(section.get("group") or parent.get("group"), 60),
            help="; ".join(t for t in (tidy(section.get("description")), remark) if t),
            source=f"{self._name}:{section.line}",
        )
        return [entry]

    def _limit(
        self, section: Section, key: str, data_type: DataType, place: str
    ) -> int | float | None:
        text = section.get(key.lower())
        if re.search(r"node[-_ ]?id", text, re.I):
            return None
        number = parse_number(without_remark(text), f"{place} {key}", self._report)
        if data_type == "REAL32" and number is not None and text.strip()[:2].lower() == "0x":
            number = real_of_bits(int(number))
        return fit(number, data_type, key, place, self._report)

    def _type(self, section: Section, parent: Section, place: str) -> DataType | None:
        text = section.word("datatype")
        if not text and parse_number(section.word("objecttype"), place, self._report) == 2:
            return "OCTETS"  # a DOMAIN needs no data type
        text = text or parent.word("datatype")
        if named := named_type(text, None):
            self._report.repaired(place, "description.type-by-name", type=text[:30])
            return named
        number = parse_number(text, place, self._report)
        if number is None:
            return None
        code = int(number)
        found = TYPE_BY_CODE.get(code)
        if found is None:
            found = self._deftype(code, place)
        if found == "OCTETS" and code in (0x10, 0x11, 0x12, 0x13, 0x14, 0x16, 0x18, 0x19, 0x1A):
            self._report.noted(place, "description.type-as-bytes", type=code)
        return found

    def _deftype(self, code: int, place: str) -> DataType | None:
        """Return a type defined by the file itself, as editors do for values with limits."""
        member = self._deftypes.get((code, 2)) or self._members.get(code, {}).get(2)
        if member is not None:
            base = parse_number(member.word("datatype"), place, self._report)
            known = None if base is None else TYPE_BY_CODE.get(int(base))
            if known is not None:
                self._report.noted(place, "description.type-of-file", type=code)
                return known
        self._report.left_out(place, "description.type-code-unknown", type=code)
        return None


def compare_with_lists(
    sections: dict[str, Section], name: str, present: set[int], report: ImportReport
) -> None:
    """Note differences from the lists of objects, which are often wrong; the sections count."""
    for title in ("mandatoryobjects", "optionalobjects", "manufacturerobjects"):
        section = sections.get(title)
        if section is None:
            continue
        place = f"{name}:{section.line} [{title}]"
        listed = [
            int(number)
            for key, text in section.values.items()
            if key.isdecimal() and (number := parse_number(text, place, report)) is not None
        ]
        announced = parse_number(section.get("supportedobjects"), place, report)
        if announced is not None and announced != len(listed):
            report.noted(
                place, "description.objects-differ", announced=announced, listed=len(listed)
            )
        for index in sorted(set(listed) - present):
            if 0x1000 <= index <= 0xFFFF:
                report.noted(place, "description.listed-not-described", index=index)


def _mapping(section: Section, parent: Section, access_text: str) -> PdoMapping:
    text = (section.word("pdomapping") or parent.word("pdomapping")).lower()
    if text not in ("1", "0x1", "true", "yes", "0x01", "01"):
        return "none"
    access = access_text.strip().lower()
    if access in ("ro", "r", "rwr", "const"):
        return "tx"
    return "rx" if access in ("wo", "w", "rww") else "rxtx"
