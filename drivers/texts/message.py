"""A message before it has a language: a code of the catalogue and the facts that go into it.

Messages travel as they are, between modules, processes and over the API. Words are made at the
edge, by `Text.words`, in the language of whoever reads them.
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
#: What a parameter may be; `None` where a value is not known.
Param: TypeAlias = Union[str, int, float, Enum, "Text", None]
#: A message as plain values: for JSON, and for other processes.
Wire: TypeAlias = dict[str, object]

_CODE = re.compile(r"[a-z][a-z0-9-]*(\.[a-z0-9][a-z0-9-]*)+(/remedy)?")
#: Codes of messages that the catalogue does not have.
PROSE, JOINED = "", "+"
#: Behind a code: what to do about it, an attribute of the code's entry.
REMEDY = "/remedy"

#: The language of whoever is being answered: set for each request, and for a whole command.
_language: ContextVar[Language] = ContextVar("language", default="en")


def language() -> Language:
    """The language of whoever is being answered here; English where nobody chose another."""
    return _language.get()


@contextmanager
def speaking(chosen: Language) -> Iterator[None]:
    """Answer in this language inside the block."""
    token = _language.set(chosen)
    try:
        yield
    finally:
        _language.reset(token)


def speak(chosen: Language) -> None:
    """Answer in this language from here on, as a command does."""
    _language.set(chosen)


def language_of(tag: str | None) -> Language:
    """The language of a locale or an ``Accept-Language`` header: the first one that there is."""
    for part in (tag or "").replace(";", ",").split(","):
        name = part.strip().lower()
        if name.startswith("zh"):
            return "zh"
        if name.startswith("en"):
            return "en"
    return "en"


#: Codes of files that earlier versions wrote, by what the same message is called now. The page has
#: the same list (`webui/src/i18n/message.ts`).
RENAMED = {
    "autotune.no-candidate-kept-promise": "autotune.no-candidate-verified",
    "autotune.promise-not-kept": "autotune.prediction-not-confirmed",
    "api-tuning.frequency-response": "sweep.title",
    "api-tuning.tune": "autotune.title",
}


@dataclass(frozen=True)
class Text:
    """A message of the catalogue, or (``code`` empty) words that came from elsewhere as they are.

    ``code`` is dotted: the room, then what happened, such as ``ethercat.cycle.out-of-range``.
    ``params`` are the facts of the message by name, with their unit in the name.
    """

    code: str
    params: Mapping[str, Param] = field(default_factory=dict)

    def words(self, language: Language = "en") -> str:
        """The sentence in one language."""
        from drivers.texts.render import render  # the catalogue's library is needed for words alone

        return render(self, language)

    def remedy(self) -> Text | None:
        """What the catalogue says to do about it; None where it says nothing."""
        from drivers.texts.render import has_text

        part = f"{self.code}{REMEDY}"
        return Text(part, self.params) if self.code and has_text(part) else None

    def __str__(self) -> str:
        return self.words()

    def to_wire(self) -> Wire:
        """As plain values; a parameter that is a message itself is a map with its code."""
        return {"code": self.code, "params": {k: plain(v) for k, v in self.params.items()}}

    @classmethod
    def from_wire(cls, wire: Mapping[str, object]) -> Text:
        """The same message again.

        Raises:
            KeyError, TypeError: the map is none that `to_wire` made.
        """
        params = wire["params"]
        if not isinstance(params, Mapping):
            raise TypeError("params of a message are a map")
        code, mark, attribute = str(wire["code"]).partition("/")
        code = RENAMED.get(code, code) + mark + attribute
        return cls(code, {str(k): _from_plain(v) for k, v in params.items()})


def text(code: str, /, **params: Param) -> Text:
    """A message of the catalogue."""
    return Text(code, params)


class Unsuitable(ValueError):
    """A value or recording that a calculation cannot use; ``why`` as a message."""

    def __init__(self, why: Text) -> None:
        super().__init__(why)
        self.why = why

    def __str__(self) -> str:
        return self.why.words()


def prose(words: str) -> Text:
    """Words that others made, such as a drive, an operating system or a person."""
    return Text(PROSE, {"words": words})


def joined(parts: Iterable[Text | str], joint: str = "; ") -> Text:
    """Several messages after one another."""
    named: dict[str, Param] = {f"part{n}": as_text(part) for n, part in enumerate(parts)}
    return Text(JOINED, {"joint": joint, **named})


def parts_of(message: Text | None) -> list[Text]:
    """The messages that were `joined`; the message itself where it is one; none of None."""
    if message is None:
        return []
    if message.code != JOINED:
        return [message]
    return [part for part in message.params.values() if isinstance(part, Text)]


def is_code(words: str) -> bool:
    """Whether this is the form of a code rather than a sentence."""
    return _CODE.fullmatch(words) is not None


def as_text(words: str | Text, params: Mapping[str, Param] | None = None) -> Text:
    """A code becomes its message; a sentence stays as it is."""
    if isinstance(words, Text):
        return words
    return Text(words, params or {}) if is_code(words) else prose(words)


def reason_of(error: Exception) -> Text:
    """Why something failed: the message that the error carries, else the words of a library."""
    return error.why if isinstance(error, Unsuitable) else prose(str(error))


def plain(value: Param) -> object:
    """A parameter as a value of JSON."""
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
