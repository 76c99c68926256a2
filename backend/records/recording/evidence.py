"""The data of a support bundle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from backend.foundation.work.journal import Entry
from drivers.link import ScopeBlock
from drivers.texts.message import Text


@dataclass(frozen=True, slots=True)
class Value:
    """One reading of the history; ``time`` in seconds since 1970."""

    time: float
    drive: str
    key: str
    value: float | int | str | None


@dataclass(frozen=True, slots=True)
class Evidence:
    """Contents of a bundle. ``axes``: identity, state, parameters and past faults of each."""

    reason: Text
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
    """pcapng files of the opened buses, by their file names in the bundle."""
    names: Mapping[tuple[str, str], Text] = field(default_factory=dict)
    """Names of the values of the history with their units, by drive and key."""
