"""Figures of the analysis as plain values, for results in files and pages."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def figures_of(record: DataclassInstance) -> dict[str, Any]:
    """The fields of a record by name; non-finite values become None, as JSON has none."""
    return {name: _plain(value) for name, value in asdict(record).items()}


def _plain(value: object) -> object:
    if isinstance(value, Mapping):
        return {name: _plain(each) for name, each in value.items()}
    if isinstance(value, (list, tuple)):
        return tuple(_plain(each) for each in value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value
