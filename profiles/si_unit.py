"""Unit codes of 60A8h to 60ABh: prefix << 24 | numerator << 16 | denominator << 8.

Sources: CiA 402-2 objects 60A8h to 60ABh, ETG.6010 clause 5.9, notation and dimension indices of
CiA 303-2. Pure; the meaning of a code for an axis also depends on its encoder and gear.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction


class Dimension(Enum):
    """Dimension indices of CiA 303-2 used in units of motion."""

    NONE = 0x00
    METRE = 0x01
    SECOND = 0x03
    RADIAN = 0x10
    DEGREE = 0x41
    ARC_MINUTE = 0x42
    ARC_SECOND = 0x43
    MINUTE = 0x47
    HOUR = 0x48
    SQUARE_SECOND = 0x57
    REVOLUTION = 0xB4
    INCREMENT = 0xB5


_SYMBOLS = {
    Dimension.METRE: "m", Dimension.SECOND: "s", Dimension.RADIAN: "rad", Dimension.DEGREE: "°",
    Dimension.ARC_MINUTE: "′", Dimension.ARC_SECOND: "″", Dimension.MINUTE: "min",
    Dimension.HOUR: "h", Dimension.SQUARE_SECOND: "s²", Dimension.REVOLUTION: "rev",
    Dimension.INCREMENT: "inc",
}  # fmt: skip
_PREFIX_NAMES = {3: "k", 6: "M", -3: "m", -6: "µ", -9: "n"}
_TURNS: dict[Dimension, float] = {
    Dimension.REVOLUTION: 1.0,
    Dimension.RADIAN: 1.0 / (2.0 * math.pi),
    Dimension.DEGREE: 1.0 / 360.0,
    Dimension.ARC_MINUTE: 1.0 / 21_600.0,
    Dimension.ARC_SECOND: 1.0 / 1_296_000.0,
}
_SECONDS = {Dimension.SECOND: 1.0, Dimension.MINUTE: 60.0, Dimension.HOUR: 3600.0}
#: Powers of ten with a notation index in CiA 303-2.
_EXPONENTS = range(-18, 19)


@dataclass(frozen=True, slots=True)
class SiUnit:
    """One raw step is ``10**exponent`` of numerator per denominator."""

    exponent: int
    numerator: Dimension
    denominator: Dimension

    @property
    def factor(self) -> float:
        """The power of ten."""
        return float(Fraction(10) ** self.exponent)

    @property
    def turns(self) -> float | None:
        """Revolutions per numerator, without the prefix; None if it is not an angle."""
        return _TURNS.get(self.numerator)

    @property
    def seconds(self) -> float | None:
        """Seconds in the denominator of a speed; None if it is not a time."""
        return _SECONDS.get(self.denominator)

    @property
    def square_seconds(self) -> float | None:
        """Square seconds in the denominator of an acceleration; None if it is not a time.

        A plain time is interpreted as a speed per second: rpm/s cannot be written otherwise.
        """
        if self.denominator is Dimension.SQUARE_SECOND:
            return 1.0
        return _SECONDS.get(self.denominator)

    @property
    def counts(self) -> bool:
        """Whether it counts position increments."""
        return self.numerator is Dimension.INCREMENT

    @property
    def name(self) -> str:
        """Printed form: ``rpm``, ``0.1 rpm``, ``inc/s``, ``0.1 °``, ``mrev/s``."""
        bare = _SYMBOLS[self.numerator]
        if (self.numerator, self.denominator) == (Dimension.REVOLUTION, Dimension.MINUTE):
            bare = "rpm"
        elif self.denominator is not Dimension.NONE:
            bare = f"{bare}/{_SYMBOLS[self.denominator]}"
        if not self.exponent:
            return bare
        prefix = _PREFIX_NAMES.get(self.exponent)
        if prefix is not None and bare != "rpm" and self.numerator is not Dimension.INCREMENT:
            return f"{prefix}{bare}"
        return f"{self.factor:g} {bare}"


def decode_si_unit(code: int) -> SiUnit | None:
    """Return the unit of a raw value of 60A8h to 60ABh; None if it is not a unit of motion.

    The prefix is a signed byte: FFh is 10⁻¹ (CiA 303-2 table 2). The lowest byte is reserved and 0.
    """
    if not 0 < code <= 0xFFFFFFFF or code & 0xFF:
        return None
    exponent = (code >> 24) - 256 if code >> 24 > 127 else code >> 24
    try:
        numerator, denominator = Dimension(code >> 16 & 0xFF), Dimension(code >> 8 & 0xFF)
    except ValueError:
        return None
    if exponent not in _EXPONENTS or numerator is Dimension.NONE:
        return None
    return SiUnit(exponent, numerator, denominator)
