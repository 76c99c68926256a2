"""Text in cells of a CSV file, which spreadsheets open."""

from __future__ import annotations

#: A cell that begins so is a formula to a spreadsheet, which may then fetch or run something.
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")


def as_text(text: str) -> str:
    """A cell that stays text: with an apostrophe in front where it would be a formula."""
    return f"'{text}" if text.lstrip(" \u00a0").startswith(_FORMULA) else text
