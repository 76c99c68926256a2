"""Data of one event of the audit, and its text form, which is hashed."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Literal

from drivers.texts.message import Text

Kind = Literal[
    "write", "procedure", "motion", "job", "stop", "lease", "login", "account", "invitation",
    "file", "station", "audit",
]  # fmt: skip
KINDS: tuple[Kind, ...] = (
    "write", "procedure", "motion", "job", "stop", "lease", "login", "account", "invitation",
    "file", "station", "audit",
)  # fmt: skip

Action = Literal[
    "written", "refused", "commanded", "started", "done", "failed", "cancelled",
    "pressed", "taken", "given back", "passed on", "saved", "annotated", "deleted", "taken back",
    "purged", "connected", "taken off the bench", "made", "changed", "logged in", "logged out",
    "left", "session ended", "password changed", "password set", "role changed", "token made",
    "token revoked", "joined", "granted", "grant withdrawn", "ended", "motion enabled",
    "motion ended", "asks", "gives", "keeps", "hands over", "overrides", "lost",
]  # fmt: skip
"""Kind of action; stored in entries, and shown as text by the page."""

Value = int | float | str | bool | None
_MAX_TEXT = 2000


@dataclass(frozen=True, slots=True)
class Fact:
    """One event. Where ``person`` is None, the acting person is used.

    ``target``: object of the action (a parameter's key, a file's name, a person). ``old``, ``new``:
    raw values. ``outcome``: what went wrong, None for success. ``title``: title of a job.
    ``reason``: why a manual motion ended. An entry stores messages as code and parameters, and also
    in English for searching and for reading without the catalogue.
    """

    kind: Kind
    action: Action
    axis: str = ""
    target: str = ""
    old: Value = None
    new: Value = None
    outcome: Text | None = None
    person: str | None = None
    title: Text | None = None
    reason: Text | None = None
    detail: Mapping[str, Value] = field(default_factory=dict)


def body_of(fact: Fact, *, moment: datetime, station: str, person: str) -> str:
    """Canonical JSON: sorted keys, no spaces, UTF-8, numbers as Python writes them."""
    shown = {"title": fact.title, "reason": fact.reason}
    detail = dict(fact.detail) | {n: str(each) for n, each in shown.items() if each is not None}
    content: dict[str, object] = {
        "time": stamp(moment),
        "station": station,
        "person": person,
        "kind": fact.kind,
        "action": fact.action,
        "axis": _plain(fact.axis),
        "target": _plain(fact.target),
        "old": _plain(fact.old),
        "new": _plain(fact.new),
        "outcome": "" if fact.outcome is None else _plain(str(fact.outcome)),
        "detail": {str(key): _plain(value) for key, value in detail.items()},
    }
    messages = {"outcome": fact.outcome, **shown}
    known = {name: each for name, each in messages.items() if each is not None and each.code}
    if known:
        content["messages"] = {name: _wire(each.to_wire()) for name, each in known.items()}
    return json.dumps(
        content, ensure_ascii=False, sort_keys=True, separators=(",", ":"), allow_nan=False
    )


def stamp(moment: datetime) -> str:
    """Time as ISO 8601 in UTC with microseconds and Z, which sorts as text."""
    return moment.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def _wire(value: object) -> object:
    """A message as plain values that JSON and both databases can store."""
    if isinstance(value, dict):
        return {str(name): _wire(each) for name, each in value.items()}
    return _plain(value) if isinstance(value, (int, float, str)) else value


def _plain(value: Value) -> Value:
    """A value that JSON and both databases can store: no NaN, NUL or surrogates, limited length."""
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, str):
        text = value.encode("utf-8", "replace").decode("utf-8").replace("\0", "\N{SYMBOL FOR NULL}")
        return text if len(text) <= _MAX_TEXT else text[: _MAX_TEXT - 1] + "…"
    return value
