"""How much of the profiles' texts is there in Chinese."""

from __future__ import annotations

from collections.abc import Iterator

from profiles.language.overlay import load_overlay
from profiles.language.texts import overlay_coverage
from profiles.loader import drive_names, load_profile


def lines() -> Iterator[str]:
    """One line per drive: kinds of texts, how many of each are translated."""
    for drive in drive_names():
        found = ", ".join(overlay_coverage(load_profile(drive), load_overlay(drive, "zh")))
        yield f"{drive}: {found}"
