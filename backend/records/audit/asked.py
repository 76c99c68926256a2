"""Settings of the current request or message, recorded in the audit without code in every route."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from contextvars import ContextVar

from backend.records.audit.facts import Value

#: Largest body that is recorded; larger ones are files, whose names are in the path.
MOST_BYTES = 8192
_MAX_TEXT = 300
#: Fields that are never recorded in the audit.
_SECRET = frozenset({"password", "present", "code", "secret", "link", "token"})


class Asked:
    """One request. ``fields`` returns its fields when needed; ``before``: the replaced values."""

    def __init__(self, fields: Callable[[], Mapping[str, object]]) -> None:
        self._fields = fields
        self.before: Mapping[str, object] = {}

    @property
    def settings(self) -> dict[str, Value]:
        """All fields but secrets: plain values as they are, others as shortened JSON."""
        return {
            key: _bare(value)
            for key, value in self._fields().items()
            if value is not None and key not in _SECRET
        }

    @property
    def old(self) -> str | None:
        """The replaced values as text; None where they were not recorded."""
        return _text(self.before) if self.before else None

    @property
    def new(self) -> str | None:
        """The requested settings as text; None without any."""
        settings = self.settings
        return _text(settings) if settings else None


#: The present request or message; jobs that it starts inherit it.
asked: ContextVar[Asked | None] = ContextVar("asked", default=None)


def settings_now() -> dict[str, Value]:
    """Settings of the current request; empty without one."""
    now = asked.get()
    return {} if now is None else now.settings


def note_before(**values: object) -> None:
    """Record for the audit the values that a change replaces."""
    if (now := asked.get()) is not None:
        now.before = values


def fields_of(body: bytes) -> Mapping[str, object]:
    """Fields of a JSON body; empty where it is not a JSON object."""
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
