"""Limits that an error states with its value, as codes and facts: a bound, a number, a unit.

Plain figures with a unit, choices and forms of addresses need no translation and are passed
unchanged.
"""

from __future__ import annotations

from drivers.texts.message import Text, text


def at_least(value: float, unit: str = "") -> Text:
    """Return "this or more"."""
    if unit:
        return text("limit.at-least", value=value, unit=unit)
    return text("limit.at-least-number", value=value)


def below(value: float, unit: str) -> Text:
    """Return "less than this"."""
    return text("limit.below", value=value, unit=unit)


def above_zero() -> Text:
    """Return "more than zero"."""
    return text("limit.above-zero")


def between(low: float, high: float, unit: str = "") -> Text:
    """Return a range, both ends included."""
    if unit:
        return text("limit.between", low=low, high=high, unit=unit)
    return text("limit.between-numbers", low=low, high=high)


def size(count: int) -> Text:
    """Return a maximum number of bytes."""
    return text("limit.bytes", count=count)


def signs(count: int) -> Text:
    """Return a maximum number of characters."""
    return text("limit.characters", count=count)


def stays_free(count: int) -> Text:
    """Return the disk space that is kept free; ``count`` in bytes."""
    return text("limit.stays-free", mebibytes=count >> 20)


def from_start(distance: str) -> Text:
    """Return the maximum distance from the start of the axis; the distance with its unit."""
    return text("limit.from-start", distance=distance)


def one_of(names: str) -> Text | str:
    """Return the list of valid names, or that there is none."""
    return names or text("limit.none")
