"""Default names of drives, and their ids in the API."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping


class PlaceNames:
    """Default names by bus URL and station, as a bench of virtual drives states them."""

    def __init__(self, names: Mapping[tuple[str, int], str]) -> None:
        self._names = dict(names)

    def unused(self, url: str, station: int, taken: Collection[str]) -> str:
        """The name for this station; empty where it has none or the name is in use."""
        name = self._names.get((url, station), "")
        return "" if name in taken else name


def new_id(name: str, taken: Collection[str]) -> str:
    """``name`` as lower-case letters, digits and hyphens, with a number where that is in use."""
    stem = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "drive"
    number, drive_id = 2, stem
    while drive_id in taken:
        drive_id, number = f"{stem}-{number}", number + 1
    return drive_id
