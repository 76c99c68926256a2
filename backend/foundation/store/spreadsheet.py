"""Text for cells of CSV files that are opened in spreadsheets."""

from __future__ import annotations

#: Beginnings that make a spreadsheet treat a cell as a formula, which can fetch or run something.
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")


def as_text(text: str) -> str:
    """Text that a spreadsheet keeps as text: a possible formula gets an apostrophe in front."""
    return f"'{text}" if text.lstrip(" \u00a0").startswith(_FORMULA) else text
