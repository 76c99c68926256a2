"""Texts that people enter: only printable characters, so that lists and logs can show them."""

from __future__ import annotations

import unicodedata
from typing import Annotated

from pydantic import AfterValidator


def _printable(sign: str) -> bool:
    # Includes spaces of another width, such as U+3000 of a Chinese keyboard.
    return sign.isprintable() or unicodedata.category(sign) == "Zs"


def _require(text: str, allowed: str = "") -> str:
    for place, sign in enumerate(text, 1):
        if sign not in allowed and not _printable(sign):
            raise ValueError(
                f"sign {place} (U+{ord(sign):04X}) cannot be printed: leave out control characters"
            )
    return text


#: One line of printable characters.
PrintedName = Annotated[str, AfterValidator(_require)]
#: Lines of printable characters, separated by line feeds (U+000A).
PrintedLines = Annotated[str, AfterValidator(lambda text: _require(text, "\n"))]
