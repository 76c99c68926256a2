"""What the audit keeps of one event, and its form as text that is hashed."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Literal

Kind = Literal[
    "write", "procedure", "motion", "job", "stop", "lease", "login", "account", "invitation",
    "file", "station", "audit",
]  # fmt: skip
KINDS: tuple[Kind, ...] = (
    "write", "procedure", "motion", "job", "stop", "lease", "login", "account", "invitation",
    "file", "station", "audit",
)  # fmt: skip

Value = int | float | str | bool | None
_MAX_TEXT = 2000


@dataclass(frozen=True, slots=True)
class Fact:
    """One event. ``person`` is filled in from who is acting where it is None.

    ``action`` is a verb ("written", "started", "given"), ``target`` what it was done to (a
    parameter's key, a file's name, a person), ``old`` and ``new`` raw values, ``outcome`` empty
    for success, else what went wrong.
    """

    kind: Kind
    action: str
    axis: str = ""
    target: str = ""
    old: Value = None
    new: Value = None
    outcome: str = ""
    person: str | None = None
    detail: Mapping[str, Value] = field(default_factory=dict)


def body_of(fact: Fact, *, moment: datetime, station: str, person: str) -> str:
    """Canonical JSON: sorted keys, no spaces, UTF-8, numbers as Python writes them."""
    content = {
        "time": stamp(moment),
        "station": station,
        "person": person,
        "kind": fact.kind,
        "action": fact.action,
        "axis": _plain(fact.axis),
        "target": _plain(fact.target),
        "old": _plain(fact.old),
        "new": _plain(fact.new),
        "outcome": _plain(fact.outcome),
        "detail": {str(key): _plain(value) for key, value in fact.detail.items()},
    }
    return json.dumps(
        content, ensure_ascii=False, sort_keys=True, separators=(",", ":"), allow_nan=False
    )


def stamp(moment: datetime) -> str:
    """ISO 8601 in UTC with microseconds and Z: sorts as text."""
    return moment.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def _plain(value: Value) -> Value:
    """A value that JSON and both databases hold: no NaN, no NUL, no half characters, no novels."""
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, str):
        text = value.encode("utf-8", "replace").decode("utf-8").replace("\0", "\N{SYMBOL FOR NULL}")
        return text if len(text) <= _MAX_TEXT else text[: _MAX_TEXT - 1] + "…"
    return value
