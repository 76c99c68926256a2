"""What is known about a moment: everything that goes into a support bundle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from backend.work.journal import Entry
from drivers.link import ScopeBlock


@dataclass(frozen=True, slots=True)
class Value:
    """One reading of the history; ``time`` in epoch seconds."""

    time: float
    drive: str
    key: str
    value: float | int | str | None


@dataclass(frozen=True, slots=True)
class Evidence:
    """What goes into a bundle. ``axes``: identity, state and parameters of each."""

    reason: str
    time: float
    version: str
    axes: Sequence[dict[str, Any]]
    links: Sequence[dict[str, Any]]
    log: Sequence[Entry]
    history: Sequence[Value]
    streams: Sequence[dict[str, Any]]
    blocks: Sequence[tuple[int, ScopeBlock]]
    clock: dict[str, float]
    frames: Mapping[str, bytes] = field(default_factory=dict)
    """pcapng files of the opened buses, by the names they get in the bundle."""
    names: Mapping[tuple[str, str], str] = field(default_factory=dict)
    """What the values of the history are, by drive and key, with their units."""
