"""Reports of the import of a description file, as messages of the catalogue."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import cast

from drivers.texts.message import Text, joined, text
from profiles.importer.report import Fact, Finding, ImportFailed, Outcome


def message_of_import(message: Mapping[str, object]) -> Text:
    """Return the message that the import process wrote as ``code`` and ``params``."""
    return Text(str(message["code"]), cast(Mapping[str, Fact], message["params"]))


def failure_text(error: ImportFailed) -> Text:
    """Return why a file contains nothing usable."""
    return Text(error.code, error.params)


def finding_text(finding: Finding) -> Text:
    """Return an irregularity of a file, without its place."""
    return Text(finding.code, finding.params)


def finding_line(finding: Finding) -> Text:
    """Return an irregularity of a file with its place and how it was handled."""
    place, found = finding.place, finding_text(finding)
    match finding.outcome:
        case "repaired":
            return text("description.line-repaired", place=place, finding=found)
        case "left out":
            return text("description.line-left-out", place=place, finding=found)
        case "noted":
            return text("description.line-noted", place=place, finding=found)


def summary_text(outcomes: Iterable[Outcome], not_listed: int) -> Text:
    """Return the number of irregularities for a heading, ``not_listed`` beyond ``outcomes``."""
    counts = Counter(outcomes)
    parts: list[Text | str] = []
    if count := counts["repaired"]:
        parts.append(text("description.count-repaired", count=count))
    if count := counts["left out"]:
        parts.append(text("description.count-left-out", count=count))
    if count := counts["noted"]:
        parts.append(text("description.count-noted", count=count))
    if not_listed:
        parts.append(text("description.count-not-listed", count=not_listed))
    return joined(parts, ", ") if parts else text("description.nothing-odd")
