"""Three-way comparison: changes since a common base, in another set and in the drive."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.axes.parameters.set_file import Row, compare
from drivers.texts.message import Text
from profiles.schema import Parameter, Raw

Status = Literal[
    "same", "theirs", "drive", "both", "conflict",
    "not_in_theirs", "not_in_drive", "invalid", "read_only", "energises",
]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Triple:
    """One parameter in base, theirs and drive; raw values, None where absent.

    ``theirs``: changed only in the other set. ``drive``: changed only in the drive. ``both``:
    changed to the same value. ``conflict``: changed to different values, or not in the base; a
    person must choose.
    """

    parameter: Parameter | None
    key: str
    base: Raw | None
    theirs: Raw | None
    ours: Raw | None
    status: Status
    problem: Text | None = None
    selected: bool = False


def three_way(
    drive: Drive, base: Iterable[Row], theirs: Iterable[Row], ours: dict[str, Reading]
) -> list[Triple]:
    """Compare rows of two sets with readings of the drive; only status ``theirs`` is selected."""
    before = {row.key: row.raw for row in base}
    result = []
    for row in compare(drive, theirs, ours):
        known = before.get(row.key)
        status: Status
        match row.status:
            case "same":
                status = "same" if known is None or known == row.theirs else "both"
            case "differs" if known is not None and known == row.ours:
                status = "theirs"
            case "differs" if known is not None and known == row.theirs:
                status = "drive"
            case "differs":
                status = "conflict"
            case "not_in_file":
                status = "not_in_theirs"
            case other:
                status = other
        result.append(
            Triple(
                row.parameter,
                row.key,
                known,
                row.theirs,
                row.ours,
                status,
                row.problem,
                selected=row.selected and status == "theirs",
            )
        )
    return result
