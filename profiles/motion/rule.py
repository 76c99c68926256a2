"""One rule that assigns a motion class to a group of objects."""

from __future__ import annotations

import re
from functools import cached_property
from typing import Literal

from pydantic import Field, field_validator, model_validator

from profiles.record import Frozen

#: ``none``: cannot cause or change motion. ``at_enable``: changes how the axis moves or reacts
#: (limits, gains, units, option codes), so it is written while the axis is disabled. ``energises``:
#: can energise the motor or release the brake; the motion authority only.
Motion = Literal["none", "at_enable", "energises"]
#: Origin of the class: the standard's table, the profile's own data, a person of this station, or
#: none (then it counts as ``energises``).
MotionOrigin = Literal["standard", "profile", "person", "unclassified"]

_RANGE = re.compile(
    r"(?P<first>[0-9A-F]{4})(:(?P<sub>[0-9A-F]{2}))?(-(?P<last>[0-9A-F]{4})(:(?P<last_sub>[0-9A-F]{2}))?)?"
)
_OWN_NUMBERS = re.compile(r"PA_(?P<first>[0-9A-F]+)(-PA_(?P<last>[0-9A-F]+))?")
#: Keys without an object index sort after every object.
_BEHIND_OBJECTS = 1 << 32


def place_of(key: str) -> int:
    """Return the place of a parameter key as one number: index and subindex, own numbers last."""
    if key.startswith("PA_"):
        return _BEHIND_OBJECTS + int(key[3:], 16)
    return int(key[:4], 16) << 8 | int(key[5:], 16)


def span_of(text: str) -> tuple[int, int]:
    """Return first and last place of a key (``2003:02``), object (``2003``) or inclusive range.

    Raises:
        ValueError: the text is neither, or the range runs backwards.
    """
    if own := _OWN_NUMBERS.fullmatch(text):
        first = _BEHIND_OBJECTS + int(own["first"], 16)
        last = _BEHIND_OBJECTS + int(own["last"] or own["first"], 16)
    elif found := _RANGE.fullmatch(text):
        first = int(found["first"], 16) << 8 | int(found["sub"] or "00", 16)
        end, end_sub = found["last"], found["last_sub"]
        if end is None:
            end, end_sub = found["first"], found["sub"]
        last = int(end, 16) << 8 | int(end_sub or "FF", 16)
    else:
        raise ValueError(f"{text!r} is no key (2003:02), object (2003) or range (2003:02-2003:0A)")
    if last < first:
        raise ValueError(f"the range {text!r} runs backwards")
    return first, last


class MotionRule(Frozen):
    """The motion class of a group of objects, and why."""

    keys: tuple[str, ...] = Field(
        min_length=1, description="keys (2003:02), whole objects (2003) and inclusive ranges"
    )
    motion: Motion
    safe_in_motion: bool = Field(
        default=False, description="an at_enable object that may be changed while enabled"
    )
    reason: str = Field(min_length=1, description="what the object does that gives it this class")
    origin: Literal["profile", "person"] = "profile"

    @field_validator("keys")
    @classmethod
    def _keys_can_be_read(cls, keys: tuple[str, ...]) -> tuple[str, ...]:
        for key in keys:
            span_of(key)
        return keys

    @model_validator(mode="after")
    def _safe_only_at_enable(self) -> MotionRule:
        if self.safe_in_motion and self.motion != "at_enable":
            raise ValueError("safe_in_motion is for at_enable objects only")
        return self

    @cached_property
    def spans(self) -> tuple[tuple[int, int], ...]:
        """First and last place of each of ``keys``."""
        return tuple(span_of(key) for key in self.keys)

    def covers(self, key: str) -> bool:
        """Return whether the rule applies to this parameter key."""
        place = place_of(key)
        return any(first <= place <= last for first, last in self.spans)
