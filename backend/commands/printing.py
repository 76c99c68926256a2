"""Words of the command line, in the language that was chosen for it."""

from __future__ import annotations

import sys

from drivers.texts.message import Param, language, text


def words_of(code: str, /, **params: Param) -> str:
    """A message of the catalogue in words."""
    return text(code, **params).words(language())


def print_text(code: str, /, **params: Param) -> None:
    """Print a message of the catalogue."""
    print(words_of(code, **params), flush=True)


def note(code: str, /, **params: Param) -> None:
    """Print a message of the catalogue beside the output of the command."""
    print(words_of(code, **params), file=sys.stderr)
