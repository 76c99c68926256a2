"""Numbers, types and texts in the notations of manufacturers. Pure.

Each function accepts what the files of many manufacturers contain, not only what the standards
allow: see ``docs/drives/not-listed.md`` for the list.
"""

from __future__ import annotations

import math
import re
import struct

from profiles.importer.report import ImportReport
from profiles.schema import INTEGER_RANGE, Access, DataType, Raw

#: CiA 301 v4.2.0 clause 7.4.7.1 table 44, as far as a parameter can hold them.
TYPE_BY_CODE: dict[int, DataType] = {
    0x01: "BOOL", 0x02: "INT8", 0x03: "INT16", 0x04: "INT32", 0x05: "UINT8", 0x06: "UINT16",
    0x07: "UINT32", 0x08: "REAL32", 0x09: "STRING", 0x0A: "OCTETS", 0x0B: "OCTETS",
    0x0C: "OCTETS", 0x0D: "OCTETS", 0x0F: "OCTETS", 0x10: "OCTETS", 0x11: "OCTETS",
    0x12: "OCTETS", 0x13: "OCTETS", 0x14: "OCTETS", 0x15: "INT64", 0x16: "OCTETS",
    0x18: "OCTETS", 0x19: "OCTETS", 0x1A: "OCTETS", 0x1B: "UINT64",
    # ETG.1000.6 clause 5.6.7.3: bit types and bit strings
    0x1E: "UINT8", 0x1F: "UINT16", 0x20: "UINT32", 0x2D: "UINT8", 0x2E: "UINT16",
    0x30: "BOOL", 0x31: "UINT8", 0x32: "UINT8", 0x33: "UINT8", 0x34: "UINT8", 0x35: "UINT8",
    0x36: "UINT8", 0x37: "UINT8",
}  # fmt: skip

_REAL_BITS = re.compile(r"0[xX]([0-9a-fA-F]{1,8})")
_NAMED: dict[str, DataType] = {
    "BOOL": "BOOL", "BOOLEAN": "BOOL", "BIT": "BOOL", "BIT1": "BOOL",
    "SINT": "INT8", "INT8": "INT8", "INTEGER8": "INT8", "CHAR": "INT8",
    "INT": "INT16", "INT16": "INT16", "INTEGER16": "INT16", "SHORT": "INT16",
    "DINT": "INT32", "INT32": "INT32", "INTEGER32": "INT32", "LONG": "INT32",
    "LINT": "INT64", "INT64": "INT64", "INTEGER64": "INT64",
    "USINT": "UINT8", "UINT8": "UINT8", "UNSIGNED8": "UINT8", "BYTE": "UINT8", "BITARR8": "UINT8",
    "UINT": "UINT16", "UINT16": "UINT16", "UNSIGNED16": "UINT16", "WORD": "UINT16",
    "BITARR16": "UINT16",
    "UDINT": "UINT32", "UINT32": "UINT32", "UNSIGNED32": "UINT32", "DWORD": "UINT32",
    "BITARR32": "UINT32",
    "ULINT": "UINT64", "UINT64": "UINT64", "UNSIGNED64": "UINT64", "LWORD": "UINT64",
    "REAL": "REAL32", "REAL32": "REAL32", "FLOAT": "REAL32",
    "LREAL": "OCTETS", "REAL64": "OCTETS", "DOUBLE": "OCTETS",
    "STRING": "STRING", "VISIBLE_STRING": "STRING", "VISIBLESTRING": "STRING",
    "OCTET_STRING": "OCTETS", "OCTETSTRING": "OCTETS", "UNICODE_STRING": "OCTETS",
    "TIME_OF_DAY": "OCTETS", "TIME_DIFFERENCE": "OCTETS", "DOMAIN": "OCTETS", "GUID": "OCTETS",
}  # fmt: skip

_SMALLEST: tuple[tuple[int, DataType], ...] = (
    (1, "BOOL"),
    (8, "UINT8"),
    (16, "UINT16"),
    (32, "UINT32"),
    (64, "UINT64"),
)

_ODD_BYTES = (3, 5, 6, 7)

_ACCESS: dict[str, Access] = {
    "ro": "ro", "r": "ro", "read": "ro", "readonly": "ro", "const": "ro", "c": "ro",
    "wo": "wo", "w": "wo", "write": "wo", "writeonly": "wo",
    "rw": "rw", "wr": "rw", "r/w": "rw", "readwrite": "rw", "rwr": "rw", "rww": "rw",
}  # fmt: skip

_UNITS = (
    "rpm", "r/min", "rev/min", "ms", "us", "µs", "s", "min", "h", "hz", "khz", "v", "mv", "a",
    "ma", "w", "kw", "nm", "mnm", "n", "%", "‰", "0.1%", "°c", "degc", "℃", "°", "deg", "mm",
    "µm", "um", "m/s", "mm/s", "rad/s", "kg·m²", "kg.cm2", "g·cm²", "ohm", "ω", "mohm", "mh",
    "inc", "inc/s", "inc/s²", "inc/s2", "inc/s^2", "counts", "cnt", "pulse", "pulses", "p",
    "rev", "rpm/s", "r/s", "rps", "mr/s", "user unit", "units", "1/s", "0.1hz", "0.1rpm", "0.1ms",
    "0.01ms", "0.1a", "0.01a", "0.1v", "bit",
)  # fmt: skip
#: Code of a unit, with or without a prefix: eight bare digits are never a unit's name.
_UNIT_CODE = re.compile(r"(?:#x|0x)([0-9a-fA-F]{1,8})|([0-9a-fA-F]{8})")
_PREFIXES = {0: "", 3: "k", 6: "M", -2: "c", -3: "m", -6: "µ", -9: "n"}
#: Units that are not used with prefixes: 0.001 rev, not mrev.
_WITHOUT_PREFIX = frozenset({"rev", "rpm", "inc", "°", "min", "h", "s²", "s³", "°C"})
_UNIT_CODES = {
    0x00: "", 0x01: "m", 0x02: "g", 0x03: "s", 0x04: "A", 0x05: "K", 0x10: "rad", 0x20: "Hz",
    0x21: "N", 0x22: "Pa", 0x23: "J", 0x24: "W", 0x26: "V", 0x28: "Ω", 0x2C: "H", 0x2D: "°C",
    0x41: "°", 0x47: "min", 0x48: "h", 0x56: "Nm", 0x57: "s²", 0xA0: "s³",
    0xB4: "rev", 0xB5: "inc",
}  # fmt: skip

_UNIT_IN_NAME = re.compile(r"[\[({（]\s*(?:unit\s*:?\s*)?([^\])}）]{1,12}?)\s*[\])}）]\s*$", re.I)
_NODE_ID = re.compile(r"NODE[-_ ]?ID", re.I)
_LONGEST_NUMBER = 40
#: Start of an editor's remark after a value: text may contain both, numbers and words of the
#: standard cannot. White space before it is not in the pattern: searching for it takes quadratic
#: time in its length, and a file may contain a megabyte of it.
_REMARK = re.compile(r";|//|(?<!\S)#(?![xX])")
#: Fields of ESI and EDS files with an upper limit.
_MAXIMA = ("MaxValue", "MaxData", "HighLimit")
_REAL32_MAX = 3.4028234e38
#: Blanks between a sign and its number; a thousand or a fraction of three digits.
_AFTER_SIGN = re.compile(r"^([+-])\s+")
_TWO_WAYS = re.compile(r"[+-]?\d{1,3},\d{3}")


def parse_number(text: str, place: str, report: ImportReport) -> int | float | None:
    """Parse a number in any of the notations found; None with a finding if it is not a number.

    Empty text is None without a finding: many files leave defaults empty. Blanks inside a number
    are not removed: ``1 2`` may be two numbers, or one with a thousands separator.
    """
    if text.isascii() and text.isdigit() and text[0] != "0" and len(text) <= _LONGEST_NUMBER:
        return int(text)
    bare = text.split(";", 1)[0].strip().strip("\"'").strip().replace("_", "")
    bare = _AFTER_SIGN.sub(r"\1", bare.replace("\N{MINUS SIGN}", "-"))
    if not bare or bare in ("-", "0x", "0X"):
        return None
    if len(bare) > _LONGEST_NUMBER:
        report.left_out(place, "description.number-too-long", value=bare[:20])
        return None
    if bare.lower() in ("true", "false"):
        return int(bare.lower() == "true")
    for prefix, base in (("0x", 16), ("#x", 16), ("&h", 16), ("16#", 16), ("0b", 2), ("2#", 2)):
        sign = -1 if bare.startswith("-") else 1
        body = bare.lstrip("+-").lower()
        if body.startswith(prefix):
            return _based(body[len(prefix) :], base, sign, text, place, report)
    return _decimal(bare, text, place, report)


def _based(
    digits: str, base: int, sign: int, text: str, place: str, report: ImportReport
) -> int | None:
    try:
        return sign * int(digits, base)
    except ValueError:
        report.left_out(place, "description.no-number", value=text.strip())
        return None


def _decimal(bare: str, text: str, place: str, report: ImportReport) -> int | float | None:
    if re.fullmatch(r"[+-]?\d+", bare):
        if re.fullmatch(r"[+-]?0\d+", bare):
            report.noted(place, "description.leading-zeros", value=bare)
        return int(bare)
    if re.fullmatch(r"[+-]?[0-9a-fA-F]+[hH]", bare):
        report.repaired(place, "description.hexadecimal", value=bare)
        return int(bare[:-1], 16)
    if _TWO_WAYS.fullmatch(bare):
        report.left_out(place, "description.two-ways", value=bare)
        return None
    if re.fullmatch(r"[+-]?\d+,\d+", bare):
        report.repaired(place, "description.decimal-comma", value=bare)
        bare = bare.replace(",", ".")
    try:
        value = float(bare)
    except ValueError:
        if re.fullmatch(r"[0-9a-fA-F]{2,16}", bare):
            report.repaired(place, "description.hexadecimal", value=bare)
            return int(bare, 16)
        report.left_out(place, "description.no-number", value=text.strip())
        return None
    if not math.isfinite(value):
        report.left_out(place, "description.not-finite", value=text.strip())
        return None
    return value


def without_remark(text: str) -> str:
    """Return a number or word of the standard without an editor's remark after it."""
    remark = _REMARK.search(text)
    return text if remark is None else text[: remark.start()].rstrip()


def node_relative(text: str, place: str, report: ImportReport) -> int | None:
    """Return the offset to the node-ID, as in ``$NODEID+0x200``; None if it is not in the text."""
    if not _NODE_ID.search(text):
        return None
    *before, last = _NODE_ID.split(text)
    rest = "".join(part.rstrip().removesuffix("$") for part in before) + last
    rest = rest.strip().strip("+").strip()
    number = parse_number(rest or "0", place, report)
    return int(number) if number is not None and number >= 0 else None


def whole_number(text: str, place: str, report: ImportReport) -> int | None:
    """Return a non-negative whole number, or None."""
    number = parse_number(text, place, report)
    return None if number is None or number != int(number) or number < 0 else int(number)


def fit(
    value: int | float | None, data_type: DataType, name: str, place: str, report: ImportReport
) -> int | float | None:
    """Convert ``value`` to a raw value of ``data_type``, or None with a finding.

    ``name`` is the name of the field in the file's format, such as ``MaxValue`` or ``HighLimit``. A
    positive number above a signed type's maximum that fits its width is two's complement: most
    manufacturers write negative limits in this form. As a maximum, the number just above the type's
    own and the greatest of the unsigned type mean "no limit", never a negative one.
    """
    if value is None or data_type in ("STRING", "OCTETS"):
        return None
    if data_type == "REAL32":
        if abs(value) > _REAL32_MAX:
            report.left_out(
                place, "description.does-not-fit", name=name, value=value, type=data_type
            )
            return None
        return float(value)
    if value != int(value):
        report.left_out(place, "description.not-whole", name=name, value=value, type=data_type)
        return None
    if isinstance(value, float):
        report.repaired(place, "description.decimal-point", name=name, value=value)
    low, high = INTEGER_RANGE[data_type]
    whole = int(value)
    if low < 0 and name in _MAXIMA and whole in (high + 1, 2 * high + 1):
        report.repaired(
            place, "description.maximum-taken", name=name, value=whole, type=data_type, taken=high
        )
        return high
    if whole > high and low < 0 and whole <= 2 * high + 1:
        return whole - 2 * (high + 1)
    if -(2**15) <= low < 0 and 2**32 + low <= whole < 2**32:
        report.repaired(place, "description.negative-32-bit", name=name, value=whole)
        return whole - 2**32
    if not low <= whole <= high:
        report.left_out(place, "description.does-not-fit", name=name, value=whole, type=data_type)
        return None
    return whole


def default_value(
    text: str,
    data_type: DataType,
    place: str,
    report: ImportReport,
    name: str = "DefaultValue",
) -> tuple[Raw | None, str]:
    """Return a default and a remark: a default that depends on the node number is not fixed.

    ``name`` is the name of the field in the file's format.
    """
    if data_type == "STRING":
        return text.strip() or None, ""
    if _NODE_ID.search(text):
        return None, f"default {text.strip()[:60]}"
    if data_type == "OCTETS":
        return None, ""
    text = without_remark(text)
    bits = _REAL_BITS.fullmatch(text.strip())
    if data_type == "REAL32" and bits is not None:
        # Real numbers are not written in hexadecimal: these are its bits.
        return real_of_bits(int(bits.group(1), 16)), ""
    number = parse_number(text, f"{place} {name}", report)
    return fit(number, data_type, name, place, report), ""


def real_of_bits(bits: int) -> float | None:
    """Convert the number of four bytes to a REAL32 (IEEE 754); None if it is not finite."""
    if not 0 <= bits <= 0xFFFFFFFF:
        return None
    value: float = struct.unpack(">f", bits.to_bytes(4, "big"))[0]
    return value if math.isfinite(value) else None


def named_type(name: str, bits: int | None) -> DataType | None:
    """Return a data type by one of its names (``UDINT``, ``UNSIGNED32``, ``STRING(20)`` …)."""
    bare = name.strip().upper()
    bare = re.sub(r"\s*[(\[].*$", "", bare)
    found = _NAMED.get(bare)
    if found is None and re.fullmatch(r"BIT[2-9]|BIT1[0-6]", bare):
        bits = int(bare[3:])
    elif found is not None or bare:
        return found
    if bits is None or bits < 1:
        return None
    if (bits + 7) // 8 in _ODD_BYTES:
        return "OCTETS"  # as a number it would be written with more bytes than the object has
    return next((kind for width, kind in _SMALLEST if bits <= width), None)


def parse_access(text: str, place: str, report: ImportReport) -> Access:
    """Parse access rights; unknown ones become read-only, the harmless choice."""
    access = _ACCESS.get(text.strip().lower().replace(" ", "").replace("-", ""))
    if access is None:
        report.repaired(place, "description.access-unknown", access=text.strip())
        return "ro"
    return access


def unit_of_name(name: str) -> tuple[str, str]:
    """Split name and unit if the name ends with a unit in brackets; else the name and ""."""
    match = _UNIT_IN_NAME.search(name)
    if match is None or match.group(1).strip().lower() not in _UNITS:
        return name, ""
    return name[: match.start()].rstrip(" ,:-") or name, match.group(1).strip()


def unit_of_code(text: str) -> str:
    """Return a unit from its number in CiA 303-2 (as used in ETG.1004), or "" if invalid.

    Bits 31-24 are the power of ten (signed), 23-16 the numerator, 15-8 the denominator.
    """
    match = _UNIT_CODE.fullmatch(text.strip())
    if match is None:
        return ""
    code = int(match[1] or match[2], 16)
    exponent = code >> 24 if code >> 24 < 0x80 else (code >> 24) - 0x100
    numerator = _UNIT_CODES.get(code >> 16 & 0xFF)
    denominator = _UNIT_CODES.get(code >> 8 & 0xFF)
    if not numerator or denominator is None or code & 0xFF or abs(exponent) > 12:
        return ""
    if (numerator, denominator) == ("rev", "min"):
        numerator, denominator = "rpm", ""
    prefix = _PREFIXES.get(exponent)
    if prefix is None or (exponent and numerator in _WITHOUT_PREFIX):
        prefix = f"{10.0**exponent:g} "
    return f"{prefix}{numerator}/{denominator}" if denominator else f"{prefix}{numerator}"


def tidy(text: str, longest: int = 200) -> str:
    """Return one line without control characters, at most ``longest`` characters."""
    plain = text.isprintable()
    cleaned = text if plain else "".join(c if c.isprintable() else " " for c in text)
    return " ".join(cleaned.split())[:longest]
