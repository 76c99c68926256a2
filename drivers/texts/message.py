"""A message independent of language: a code of the catalogue and its facts.

Messages are passed unchanged between modules, processes and over the API. Words are generated at
the edge, by `Text.words`, in the language of the reader.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal, TypeAlias, Union

Language = Literal["en", "zh"]
#: Types of a parameter; `None` for an unknown value.
Param: TypeAlias = Union[str, int, float, Enum, "Text", None]
#: A message as plain values: for JSON, and for other processes.
Wire: TypeAlias = dict[str, object]

_CODE = re.compile(r"[a-z][a-z0-9-]*(\.[a-z0-9][a-z0-9-]*)+(/remedy)?")
#: Codes of messages that are not in the catalogue.
PROSE, JOINED = "", "+"
#: Code of a text of a drive family's profile, by its English original; see `profile_text`.
OF_PROFILE = "="
#: Suffix of a code: its remedy, an attribute of the code's entry.
REMEDY = "/remedy"

#: The language of the present reader: set for each request, and for a whole command.
_language: ContextVar[Language] = ContextVar("language", default="en")


def language() -> Language:
    """Return the language of the present reader; English if none was chosen."""
    return _language.get()


@contextmanager
def speaking(chosen: Language) -> Iterator[None]:
    """Use this language inside the block."""
    token = _language.set(chosen)
    try:
        yield
    finally:
        _language.reset(token)


def speak(chosen: Language) -> None:
    """Use this language from now on, for a whole command."""
    _language.set(chosen)


def language_of(tag: str | None) -> Language:
    """Return the first available language in a locale or an ``Accept-Language`` header."""
    for part in (tag or "").replace(";", ",").split(","):
        name = part.strip().lower()
        if name.startswith("zh"):
            return "zh"
        if name.startswith("en"):
            return "en"
    return "en"


#: Present names of codes in files of earlier versions. The page has the same list
#: (`webui/src/i18n/message.ts`).
RENAMED = {
    "autotune.no-candidate-kept-promise": "autotune.no-candidate-verified",
    "autotune.promise-not-kept": "autotune.prediction-not-confirmed",
    "api-tuning.frequency-response": "sweep.title",
    "api-tuning.tune": "autotune.title",
}


@dataclass(frozen=True)
class Text:
    """A message of the catalogue, or (``code`` empty) unchanged words from another source.

    ``code`` is dotted: the room, then what happened, such as ``ethercat.cycle.out-of-range``.
    ``params`` are the facts of the message by name, with their unit in the name.
    """

    code: str
    params: Mapping[str, Param] = field(default_factory=dict)

    def words(self, language: Language = "en") -> str:
        """Return the sentence in one language."""
        from drivers.texts.render import render  # the catalogue's library is needed only for words

        return render(self, language)

    def remedy(self) -> Text | None:
        """Return the remedy in the catalogue; None if there is none."""
        from drivers.texts.render import has_text

        part = f"{self.code}{REMEDY}"
        return Text(part, self.params) if self.code and has_text(part) else None

    def __str__(self) -> str:
        return self.words()

    def to_wire(self) -> Wire:
        """Return plain values; a parameter that is itself a message becomes a map with its code."""
        return {"code": self.code, "params": {k: plain(v) for k, v in self.params.items()}}

    @classmethod
    def from_wire(cls, wire: Mapping[str, object]) -> Text:
        """Restore the message from a map made by `to_wire`.

        Raises:
            KeyError, TypeError: the map was not made by `to_wire`.
        """
        params = wire["params"]
        if not isinstance(params, Mapping):
            raise TypeError("params of a message are a map")
        code, mark, attribute = str(wire["code"]).partition("/")
        code = RENAMED.get(code, code) + mark + attribute
        return cls(code, {str(k): _from_plain(v) for k, v in params.items()})


def text(code: str, /, **params: Param) -> Text:
    """Return a message of the catalogue."""
    return Text(code, params)


class Unsuitable(ValueError):
    """A value or recording that a calculation cannot use; ``why`` as a message."""

    def __init__(self, why: Text) -> None:
        super().__init__(why)
        self.why = why

    def __str__(self) -> str:
        return self.why.words()


def prose(words: str) -> Text:
    """Return text from another source, such as a drive, an operating system or a person."""
    return Text(PROSE, {"words": words})


def profile_text(family: str, words: str) -> Text:
    """Return a name or help of a profile: of a parameter, fault, procedure or terminal.

    Its translations are those of the profile, not of the catalogue.
    """
    return Text(OF_PROFILE, {"profile": family, "words": words})


def joined(parts: Iterable[Text | str], joint: str = "; ") -> Text:
    """Join several messages."""
    named: dict[str, Param] = {f"part{n}": as_text(part) for n, part in enumerate(parts)}
    return Text(JOINED, {"joint": joint, **named})


def parts_of(message: Text | None) -> list[Text]:
    """Return the messages that were `joined`; a single message as a list; empty for None."""
    if message is None:
        return []
    if message.code != JOINED:
        return [message]
    return [part for part in message.params.values() if isinstance(part, Text)]


def is_code(words: str) -> bool:
    """Return whether a string has the form of a code rather than of a sentence."""
    return _CODE.fullmatch(words) is not None


def as_text(words: str | Text, params: Mapping[str, Param] | None = None) -> Text:
    """Convert a code to its message; a sentence remains unchanged."""
    if isinstance(words, Text):
        return words
    return Text(words, params or {}) if is_code(words) else prose(words)


def reason_of(error: Exception) -> Text:
    """Return why something failed: the error's message, else the text of a library."""
    return error.why if isinstance(error, Unsuitable) else prose(str(error))


def plain(value: Param) -> object:
    """Convert a parameter to a JSON value."""
    if isinstance(value, Text):
        return value.to_wire()
    if isinstance(value, Enum):
        return plain(value.value)
    if isinstance(value, float) and value - value != 0.0:
        return str(value)  # JSON has neither infinity nor "not a number"
    return value


def _from_plain(value: object) -> Param:
    if isinstance(value, Mapping):
        return Text.from_wire(value)
    return value if isinstance(value, (str, int, float)) or value is None else str(value)
