"""What a drive is called when nobody says, and the id that the interface knows it by."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping


class PlaceNames:
    """Names that belong to places: a bench of virtual drives knows what hangs where.

    ``names`` are by bus URL and station.
    """

    def __init__(self, names: Mapping[tuple[str, int], str]) -> None:
        self._names = dict(names)

    def unused(self, url: str, station: int, taken: Collection[str]) -> str:
        """The name of this place; empty where it has none, or a drive is called so already."""
        name = self._names.get((url, station), "")
        return "" if name in taken else name


def new_id(name: str, taken: Collection[str]) -> str:
    """``name`` as small letters, digits and hyphens, with a number where that is taken."""
    stem = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "drive"
    number, drive_id = 2, stem
    while drive_id in taken:
        drive_id, number = f"{stem}-{number}", number + 1
    return drive_id
