"""What a request or message asks for, so that the audit shows it without every route's help."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from contextvars import ContextVar

from backend.audit.facts import Value

#: Larger bodies are files; their names are in the path.
MOST_BYTES = 8192
_MAX_TEXT = 300
#: Never in the audit.
_SECRET = frozenset({"password", "present", "code", "secret", "link", "token"})


class Asked:
    """One request. ``fields`` gives what it says when it is needed; ``before`` what was there."""

    def __init__(self, fields: Callable[[], Mapping[str, object]]) -> None:
        self._fields = fields
        self.before: Mapping[str, object] = {}

    @property
    def settings(self) -> dict[str, Value]:
        """Everything asked for but secrets: bare values as they are, others as short JSON."""
        return {
            key: _bare(value)
            for key, value in self._fields().items()
            if value is not None and key not in _SECRET
        }

    @property
    def old(self) -> str | None:
        """What was there before as text, None where nobody said."""
        return _text(self.before) if self.before else None

    @property
    def new(self) -> str | None:
        """What is asked for as text, None for nothing."""
        settings = self.settings
        return _text(settings) if settings else None


#: The present request or message; jobs that it starts inherit it.
asked: ContextVar[Asked | None] = ContextVar("asked", default=None)


def settings_now() -> dict[str, Value]:
    """What is asked for at present."""
    now = asked.get()
    return {} if now is None else now.settings


def note_before(**values: object) -> None:
    """Report to the audit what a change replaces."""
    if (now := asked.get()) is not None:
        now.before = values


def fields_of(body: bytes) -> Mapping[str, object]:
    """Fields of a JSON body; nothing where it is none."""
    try:
        content = json.loads(body) if body else None
    except (ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def _bare(value: object) -> Value:
    return value if isinstance(value, (int, float, str, bool)) else _text(value)


def _text(value: object) -> str:
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), default=str)
    return text if len(text) <= _MAX_TEXT else text[: _MAX_TEXT - 1] + "…"
