"""Rendering of messages from the catalogue (Fluent), one file for each room and language.

The files of a room are read when its first message is shown. Numbers are written without grouping
of digits; ``NUM($x, format: ".1f")`` formats a number as in Python, ``QUOTED($x)`` puts a name in
quotes. The page renders the same files with the same functions (`webui/src/i18n/message.ts`).
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from functools import cache
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from fluent.runtime import FluentBundle, FluentResource
from fluent.runtime.resolver import Pattern
from fluent.runtime.types import FluentInt, FluentType

from drivers.texts.message import JOINED, OF_PROFILE, PROSE, Language, Param, Text

CATALOGUE = Path(__file__).with_name("catalogue")
_LONG = 10**18
_LOCALES: dict[Language, str] = {"en": "en", "zh": "zh-Hans"}


class _Real(FluentType):
    """A floating-point number, written as in Python."""

    def __init__(self, value: float) -> None:
        self.value = value

    def format(self, locale: object) -> str:  # noqa: ARG002
        return repr(self.value)


def _num(value: Any, format: str = "") -> str:  # noqa: A002 - Fluent's name of the option
    """Format a number; other values are returned as text."""
    if isinstance(value, _Real):
        return value.value.__format__(format)
    return int(value).__format__(format) if isinstance(value, int) else str(value)


def _quoted(value: Any) -> str:
    """Put a name in quotes; return a number as it is."""
    return repr(str(value)) if isinstance(value, str) else _num(value)


#: The library's type is narrower than its use: functions have options, and may return text.
_FUNCTIONS: dict[str, Any] = {"NUM": _num, "QUOTED": _quoted}


def identifier(code: str) -> str:
    """Return the identifier of a code in the catalogue's files, which cannot contain dots."""
    return code.replace(".", "_")


@cache
def files() -> dict[str, Path]:
    """Map each room to the path of its texts without language and extension."""
    found = sorted(CATALOGUE.rglob("*.en.ftl"))
    return {each.name.removesuffix(".en.ftl"): each.with_name(each.name[:-7]) for each in found}


@cache
def bundle(room: str, language: Language) -> FluentBundle | None:
    """Return all texts of one room in one language; None if the catalogue has no such room."""
    place = files().get(room)
    if place is None:
        return None
    made = FluentBundle([_LOCALES[language]], functions=_FUNCTIONS, use_isolating=False)
    file = place.with_name(f"{place.name}.{language}.ftl")
    if file.is_file():
        made.add_resource(FluentResource(file.read_text("utf-8")))
    return made


def render(message: Text, language: Language) -> str:
    """Return the sentence; a code missing in the catalogue is shown with its facts."""
    if message.code == PROSE:
        return _as_words(message.params.get("words"), language)
    if message.code == OF_PROFILE:
        return _of_profile(message.params, language)
    if message.code == JOINED:
        parts = [_as_words(v, language) for k, v in message.params.items() if k != "joint"]
        joint = str(message.params.get("joint", "; "))
        return (_CHINESE_JOINTS.get(joint, joint) if language == "zh" else joint).join(parts)
    return _pattern(message, language) or _bare(message, language)


def _of_profile(facts: Mapping[str, Param], language: Language) -> str:
    words = _as_words(facts.get("words"), language)
    if language == "en":
        return words
    from drivers.texts.profile_words import ProfileWords  # the profiles are needed only here

    return ProfileWords(_as_words(facts.get("profile"), language), language)(words)


def has_text(code: str) -> bool:
    """Return whether the catalogue has a text for this code, or this attribute of a code."""
    return _found(code, "en") is not None


_CHINESE_JOINTS = {"; ": "；", ": ": "：", ", ": "、", " ": ""}


def _found(code: str, language: Language) -> tuple[FluentBundle, Pattern] | None:
    own, _, attribute = code.partition("/")
    bundled = bundle(own.partition(".")[0], language)
    if bundled is None or not bundled.has_message(identifier(own)):
        return None
    entry = bundled.get_message(identifier(own))
    pattern = entry.attributes.get(attribute) if attribute else entry.value
    return None if pattern is None else (bundled, pattern)


def _pattern(message: Text, language: Language) -> str | None:
    # Text in another language is better than none.
    found = _found(message.code, language) or _found(message.code, "en")
    if found is None:
        return None
    bundled, pattern = found
    args = {name: _argument(value, language) for name, value in message.params.items()}
    shown, _problems = bundled.format_pattern(pattern, args)
    return str(shown)


def _argument(value: Param, language: Language) -> object:
    if isinstance(value, bool):
        return "true" if value else "false"
    # numpy's numbers are registered as these types, but are neither int nor float.
    number: object = value
    if isinstance(number, Enum):
        return _as_words(value, language)
    if isinstance(number, Integral):
        whole = int(number)
        # The library cannot write a number of more than 28 digits; some client may send one.
        return FluentInt(whole, useGrouping=False) if abs(whole) < _LONG else str(whole)
    if isinstance(number, Real):
        return _Real(float(number))
    return _as_words(value, language)


def _as_words(value: Param, language: Language) -> str:
    if isinstance(value, Text):
        return render(value, language)
    if isinstance(value, Enum):
        return str(value.value)
    return "" if value is None else str(value)


def _bare(message: Text, language: Language) -> str:
    facts = ", ".join(f"{k}={_as_words(v, language)}" for k, v in message.params.items())
    return f"{message.code} ({facts})" if facts else message.code
