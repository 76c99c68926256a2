"""What STOP writes to end a motion that a drive does by itself, as data of a profile."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from profiles.record import Frozen


class StopClear(Frozen):
    """One object and the value at which it moves nothing.

    Without ``bits`` the whole value becomes ``raw``; with it only these bits become those of
    ``raw``. With ``only`` it is written where the object has one of these values, as of an input
    whose function jogs.
    """

    key: str
    kind: Literal["jog", "homing", "identification", "virtual_input", "input_function", "brake"]
    raw: int = 0
    bits: int | None = Field(default=None, gt=0)
    only: tuple[int, ...] = ()
    source: str
    notes: str = ""

    def neutral(self, present: int) -> int | None:
        """What is to be written over this value; None where it is harmless as it is."""
        if self.only and present not in self.only:
            return None
        if self.bits is None:
            # A trigger that clears itself reads as neutral while its motion goes on.
            return self.raw
        wanted = present & ~self.bits | self.raw & self.bits
        return None if wanted == present else wanted
