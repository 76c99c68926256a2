"""Limits that an error names next to its value, as codes and facts: a bound, a number, a unit.

Bare figures with a unit, choices and forms of addresses have no words, and are given as they are.
"""

from __future__ import annotations

from drivers.texts.message import Text, text


def at_least(value: float, unit: str = "") -> Text:
    """This or more."""
    if unit:
        return text("limit.at-least", value=value, unit=unit)
    return text("limit.at-least-number", value=value)


def below(value: float, unit: str) -> Text:
    """Less than this."""
    return text("limit.below", value=value, unit=unit)


def above_zero() -> Text:
    """More than nothing."""
    return text("limit.above-zero")


def between(low: float, high: float, unit: str = "") -> Text:
    """From one to the other, both allowed."""
    if unit:
        return text("limit.between", low=low, high=high, unit=unit)
    return text("limit.between-numbers", low=low, high=high)


def size(count: int) -> Text:
    """At most so many bytes."""
    return text("limit.bytes", count=count)


def signs(count: int) -> Text:
    """At most so many characters."""
    return text("limit.characters", count=count)


def stays_free(count: int) -> Text:
    """So many bytes of the disk are kept free."""
    return text("limit.stays-free", mebibytes=count >> 20)


def from_start(distance: str) -> Text:
    """No farther from where the axis began; the distance with its unit."""
    return text("limit.from-start", distance=distance)


def one_of(names: str) -> Text | str:
    """One of these names, or that there is none."""
    return names or text("limit.none")
