"""Output of the command line, in its chosen language."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from unicodedata import east_asian_width

from drivers.texts.message import Param, language, text


def words_of(code: str, /, **params: Param) -> str:
    """A message of the catalogue as text."""
    return text(code, **params).words(language())


def print_text(code: str, /, **params: Param) -> None:
    """Print a message of the catalogue."""
    print(words_of(code, **params), flush=True)


def note(code: str, /, **params: Param) -> None:
    """Print a message of the catalogue on standard error."""
    print(words_of(code, **params), file=sys.stderr)


def table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows as aligned lines: the first column to the left, all others to the right."""
    widths = [max(map(_columns, column)) for column in zip(*rows, strict=True)]
    lines = []
    for first, *rest in rows:
        cells = [first + " " * (widths[0] - _columns(first))]
        cells += [
            " " * (width - _columns(each)) + each
            for each, width in zip(rest, widths[1:], strict=True)
        ]
        lines.append("  ".join(cells).rstrip())
    return lines


def _columns(shown: str) -> int:
    """Width of a text in terminal columns; Chinese characters take two."""
    return sum(2 if east_asian_width(sign) in "WF" else 1 for sign in shown)
