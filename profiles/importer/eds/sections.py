"""Sections of EDS and DCF files, and the meaning of their headings (CiA 306-1 v1.3)."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from profiles.importer.report import ImportReport
from profiles.importer.values import parse_number, without_remark

_MAX_LINES = 400_000
#: Other characters that Python treats as line ends occur within texts.
LINE_END = re.compile(r"\r\r\n|\r\n|\n|\r")

OBJECT = re.compile(r"(?:0x)?([0-9a-f]{4})h?$")
SUBOBJECT = re.compile(r"(?:0x)?([0-9a-f]{4})h?\s*_?sub\s*_?(?:0x)?([0-9a-f]{1,2})$")
COMPACT = re.compile(r"(?:0x)?([0-9a-f]{4})(name|value|denotation)$")
#: The section that distinguishes a DCF from an EDS; the standard spells it with one m.
COMMISSIONING = ("devicecomissioning", "devicecommissioning")


@dataclass(slots=True)
class Section:
    """A section's values by lower-case key, and the line it starts on."""

    line: int
    values: dict[str, str] = field(default_factory=dict)

    def get(self, *names: str) -> str:
        """Return the first of these values that is not empty: editors write keys without values."""
        return next((self.values[n] for n in names if self.values.get(n)), "")

    def word(self, *names: str) -> str:
        """Return the same without a trailing remark, for numbers and words of the standard."""
        return without_remark(self.get(*names))


def read_sections(text: str, name: str, report: ImportReport) -> dict[str, Section]:
    """Return sections by lower-case heading; of duplicates the first counts."""
    sections: dict[str, Section] = {}
    current: Section | None = None
    for number, raw in enumerate(LINE_END.split(text)[:_MAX_LINES], start=1):
        line = raw.strip().strip("\ufeff\0\x1a")
        place = f"{name}:{number}"
        if not line or line[0] in ";#" or line.startswith("//"):
            continue
        if line[0] == "[":
            title = line[1:].partition("]")[0].strip().lower()
            if "]" not in line:
                report.repaired(place, "description.heading-not-closed", heading=line[:40])
            if title in sections:
                report.noted(place, "description.section-twice", section=title[:40])
            # Two descriptions of one object are never mixed.
            current = Section(number)
            if title not in sections or not sections[title].values:
                sections[title] = current
            continue
        key, equals, value = line.partition("=")
        if not equals:
            report.left_out(place, "description.no-section-no-value", line=line[:60])
        elif current is None:
            report.left_out(place, "description.before-first-section", key=key.strip()[:40])
        else:
            key = key.strip().lower().replace(" ", "")
            if key in current.values and current.values[key] != value.strip():
                report.noted(place, "description.key-twice", key=key[:40])
            current.values.setdefault(key, value.strip())
    return sections


def node_id_of(sections: dict[str, Section], name: str) -> int | None:
    """Return the node-ID for which a DCF was made."""
    for title in COMMISSIONING:
        if title in sections:
            text = sections[title].word("nodeid")
            number = parse_number(text, f"{name}: NodeID", ImportReport())
            if isinstance(number, int) and 1 <= number <= 127:
                return number
    return None
