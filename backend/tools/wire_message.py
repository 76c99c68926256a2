"""A message as results carry it beside its English words."""

from __future__ import annotations

from pydantic import BaseModel, Field


class MessageInfo(BaseModel):
    """A message without words: a code of the catalogue and its facts.

    Empty codes carry words that others made in ``params.words``; the code ``+`` strings the other
    params together with ``params.joint``.
    """

    code: str
    params: dict[str, str | int | float | MessageInfo | None] = Field(default_factory=dict)
