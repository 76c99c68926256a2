"""Texts that people enter: only printable characters, so that lists and logs can show them."""

from __future__ import annotations

import unicodedata
from typing import Annotated

from pydantic import AfterValidator

from drivers.texts.message import Unsuitable, text


def _printable(sign: str) -> bool:
    # Includes spaces of another width, such as U+3000 of a Chinese keyboard.
    return sign.isprintable() or unicodedata.category(sign) == "Zs"


def _require(words: str, allowed: str = "") -> str:
    for place, sign in enumerate(words, 1):
        if sign not in allowed and not _printable(sign):
            raise Unsuitable(
                text("input.unprintable", number=place, character=f"U+{ord(sign):04X}")
            )
    return words


#: One line of printable characters.
PrintedName = Annotated[str, AfterValidator(_require)]
#: Lines of printable characters, separated by line feeds (U+000A).
PrintedLines = Annotated[str, AfterValidator(lambda words: _require(words, "\n"))]
