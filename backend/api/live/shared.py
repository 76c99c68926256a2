"""Messages for many pages, made and encoded once however many look."""

from __future__ import annotations

from collections.abc import Callable

from pydantic import BaseModel


class Shared:
    """A message that the first page to send it makes; the others take the same text.

    ``make`` may return None where there is nothing to report any more.
    """

    def __init__(self, make: Callable[[], BaseModel | None]) -> None:
        self._make: Callable[[], BaseModel | None] | None = make
        self._text: str | None = None

    @property
    def text(self) -> str | None:
        """As it goes over the line."""
        if self._make is not None:
            message, self._make = self._make(), None
            self._text = None if message is None else message.model_dump_json()
        return self._text


def only(message: BaseModel) -> Shared:
    """A message that is there already."""
    return Shared(lambda: message)
