"""What STOP writes to end a motion that a drive makes by itself, as data of a profile."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from profiles.record import Frozen


class StopClear(Frozen):
    """One object and the value at which it causes no motion.

    Without ``bits`` the whole value becomes ``raw``; with it only these bits become those of
    ``raw``. With ``only`` it is written only if the object has one of these values, for example an
    input with the jog function.
    """

    key: str
    kind: Literal["jog", "homing", "identification", "virtual_input", "input_function", "brake"]
    raw: int = 0
    bits: int | None = Field(default=None, gt=0)
    only: tuple[int, ...] = ()
    source: str
    notes: str = ""

    def neutral(self, present: int) -> int | None:
        """Return the value to write over the present one; None if that is harmless."""
        if self.only and present not in self.only:
            return None
        if self.bits is None:
            # A trigger that clears itself reads as neutral while its motion continues.
            return self.raw
        wanted = present & ~self.bits | self.raw & self.bits
        return None if wanted == present else wanted
