"""Answers of tools as plain values: each sentence next to its message, in any language.

A message is a code and facts under ``<name>_message``, several are a list under
``<name>_messages`` (a map where the sentences are one); their sentences stand under ``<name>``
(``<name>s`` of a list, where that is the plural) for programs that read sentences. Files of older
versions have the sentences alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from drivers.texts.message import Language, Text, prose

_ONE, _SEVERAL = "_message", "_messages"


def sentences(name: str, messages: Iterable[Text], stem: str | None = None) -> dict[str, object]:
    """A list of messages for an answer, with its sentences in English.

    ``stem`` is the name without its plural's s, where the messages are named by that.
    """
    listed = list(messages)
    return {
        name: [each.words() for each in listed],
        f"{stem or name}{_SEVERAL}": [each.to_wire() for each in listed],
    }


def sentence(name: str, message: Text | None) -> dict[str, object]:
    """A message for an answer, with its sentence in English, empty where there is none."""
    return {
        name: "" if message is None else message.words(),
        f"{name}{_ONE}": None if message is None else message.to_wire(),
    }


def message_in(answer: Mapping[str, object], name: str) -> Text | None:
    """What `sentence` put under this name; the words alone where an older version wrote them."""
    wire, words = answer.get(f"{name}{_ONE}"), answer.get(name)
    if isinstance(wire, Mapping) and "code" in wire and "params" in wire:
        return Text.from_wire(wire)
    return prose(str(words)) if words else None


def in_language(answer: Mapping[str, object], language: Language) -> dict[str, object]:
    """The same answer with its sentences in a language; what has no message stays as it is."""
    shown = {name: _in_language(value, language) for name, value in answer.items()}
    for name, value in answer.items():
        if name.endswith(_SEVERAL) and isinstance(value, (list, tuple)):
            stem = name.removesuffix(_SEVERAL)
            words = [Text.from_wire(each).words(language) for each in value]
            shown[stem if stem in shown else f"{stem}s"] = words
        elif name.endswith(_SEVERAL) and isinstance(value, Mapping):
            shown[name.removesuffix(_SEVERAL)] = {
                key: Text.from_wire(each).words(language) for key, each in value.items()
            }
        elif name.endswith(_ONE) and isinstance(value, Mapping) and "code" in value:
            shown[name.removesuffix(_ONE)] = Text.from_wire(value).words(language)
    return shown


def _in_language(value: object, language: Language) -> object:
    if isinstance(value, Mapping):
        return in_language(value, language)
    if isinstance(value, (list, tuple)) and value and isinstance(value[0], Mapping):
        return [_in_language(each, language) for each in value]
    return value
