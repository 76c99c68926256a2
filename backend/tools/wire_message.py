"""Messages in results, as codes with parameters next to their English words."""

from __future__ import annotations

from collections.abc import Iterable

from pydantic import BaseModel, Field

from drivers.texts.message import Language, Text


class MessageInfo(BaseModel):
    """A message without words: a code of the catalogue and its parameters.

    An empty code carries text from elsewhere in ``params.words``; the code ``+`` joins the other
    params with ``params.joint``.
    """

    code: str
    params: dict[str, str | int | float | MessageInfo | None] = Field(default_factory=dict)


def wire_messages(texts: Iterable[Text]) -> tuple[MessageInfo, ...]:
    """Messages in the form that results contain."""
    return tuple(MessageInfo.model_validate(each.to_wire()) for each in texts)


def words_of(messages: Iterable[MessageInfo], language: Language) -> tuple[str, ...]:
    """The messages as texts in a language."""
    return tuple(Text.from_wire(each.model_dump()).words(language) for each in messages)
