"""Answers of tools as plain values: each sentence together with its message.

A message is a code with facts under ``<name>_message``; several are a list under
``<name>_messages`` (a map if the sentences are a map). Their sentences are under ``<name>``
(``<name>s`` for a list whose plural is formed that way), for programs that read sentences. Files of
older versions contain only the sentences.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from drivers.texts.message import Language, Text, prose

_ONE, _SEVERAL = "_message", "_messages"


def sentences(name: str, messages: Iterable[Text], stem: str | None = None) -> dict[str, object]:
    """Return the entries of an answer for a list of messages, with English sentences.

    ``stem`` is the name without the plural's s, if the messages are named by it.
    """
    listed = list(messages)
    return {
        name: [each.words() for each in listed],
        f"{stem or name}{_SEVERAL}": [each.to_wire() for each in listed],
    }


def sentence(name: str, message: Text | None) -> dict[str, object]:
    """Return the entries of an answer for a message, with its English sentence or ""."""
    return {
        name: "" if message is None else message.words(),
        f"{name}{_ONE}": None if message is None else message.to_wire(),
    }


def message_in(answer: Mapping[str, object], name: str) -> Text | None:
    """Return the message that `sentence` stored; the plain sentence from an older version."""
    wire, words = answer.get(f"{name}{_ONE}"), answer.get(name)
    if isinstance(wire, Mapping) and "code" in wire and "params" in wire:
        return Text.from_wire(wire)
    return prose(str(words)) if words else None


def in_language(answer: Mapping[str, object], language: Language) -> dict[str, object]:
    """Return the answer with its sentences in a language; values without a message are kept."""
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
