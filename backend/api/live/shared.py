"""Messages for many pages, made and encoded once."""

from __future__ import annotations

from collections.abc import Callable

from backend.api.live.messages import ToPage


class Shared:
    """Message that is made when the first page sends it; the others send the same text.

    ``make`` may return None if there is nothing to report any more.
    """

    def __init__(self, make: Callable[[], ToPage | None]) -> None:
        self._make: Callable[[], ToPage | None] | None = make
        self._text: str | None = None

    @property
    def text(self) -> str | None:
        """The message as JSON text; None if there is nothing to send."""
        if self._make is not None:
            message, self._make = self._make(), None
            self._text = None if message is None else message.model_dump_json()
        return self._text


def only(message: ToPage) -> Shared:
    """Wrap a message that is made already."""
    return Shared(lambda: message)
