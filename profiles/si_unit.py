"""Unit codes of CiA 303-2, as CiA 402-2 uses them in 60A8h to 60ABh. Pure.

A code is 32 bits: the power of ten (bits 31-24, signed), the numerator (23-16), the denominator
(15-8) and a reserved byte. The codes of revolution (B4h), increment (B5h), square second (57h)
and cubic second (A0h) come from CiA 402-2 (objects 60A8h, 60A9h, 60AAh, 60ABh).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

Quantity = Literal["position", "velocity", "acceleration", "jerk"]

#: Objects of CiA 402-2 that hold the unit of a quantity.
QUANTITY_OBJECTS: dict[Quantity, str] = {
    "position": "60A8:00",
    "velocity": "60A9:00",
    "acceleration": "60AA:00",
    "jerk": "60AB:00",
}

_REVOLUTION, _INCREMENT, _MINUTE, _SECOND = 0xB4, 0xB5, 0x47, 0x03
_SQUARE_SECOND, _CUBIC_SECOND = 0x57, 0xA0

#: Symbols by code (CiA 303-2 table of SI units; 40h-48h units beside the SI).
SYMBOLS: dict[int, str] = {
    0x00: "", 0x01: "m", 0x02: "g", _SECOND: "s", 0x04: "A", 0x05: "K", 0x06: "mol", 0x07: "cd",
    0x10: "rad", 0x11: "sr", 0x20: "Hz", 0x21: "N", 0x22: "Pa", 0x23: "J", 0x24: "W", 0x25: "C",
    0x26: "V", 0x27: "F", 0x28: "Ω", 0x29: "S", 0x2A: "Wb", 0x2B: "T", 0x2C: "H", 0x2D: "°C",
    0x40: "gon", 0x41: "°", 0x42: "′", 0x43: "″", _MINUTE: "min", 0x48: "h", 0x49: "d",
    0x56: "Nm", _SQUARE_SECOND: "s²", _CUBIC_SECOND: "s³",
    _REVOLUTION: "rev", _INCREMENT: "inc",
}  # fmt: skip

#: Revolutions in one of each unit of angle.
_REVOLUTIONS: dict[int, float] = {
    _REVOLUTION: 1.0,
    0x10: 1.0 / (2.0 * math.pi),
    0x40: 1.0 / 400.0,
    0x41: 1.0 / 360.0,
    0x42: 1.0 / 21_600.0,
    0x43: 1.0 / 1_296_000.0,
}
_METRE = 0x01

#: Seconds, square seconds or cubic seconds in each denominator that a quantity may have.
_DENOMINATORS: dict[Quantity, dict[int, float]] = {
    "position": {0x00: 1.0},
    "velocity": {_SECOND: 1.0, _MINUTE: 60.0, 0x48: 3600.0},
    "acceleration": {_SQUARE_SECOND: 1.0},
    "jerk": {_CUBIC_SECOND: 1.0},
}

_PREFIXES = {0: "", 3: "k", 6: "M", -2: "c", -3: "m", -6: "µ", -9: "n"}
#: Units that take no prefix in use: 0.001 rev, not mrev.
_WITHOUT_PREFIX = frozenset({
    "rev", "rpm", "inc", "°", "′", "″", "gon", "min", "h", "d", "", "s²", "s³",
})  # fmt: skip
#: The largest power of ten that a maker can mean; anything above is not a unit code.
_MAX_EXPONENT = 18


@dataclass(frozen=True, slots=True)
class SiUnit:
    """A unit of position, velocity, acceleration or jerk that is known for certain.

    ``factor`` is what one raw unit is in ``base`` per second to the quantity's power:
    revolutions for ``base`` "rev", metres for "m", the drive's own increments for "inc".
    """

    code: int
    quantity: Quantity
    text: str
    base: Literal["rev", "m", "inc"]
    factor: float

    @property
    def rpm_per_raw(self) -> float | None:
        """Revolutions per minute in one raw unit of a rotary velocity, else None."""
        if self.quantity != "velocity" or self.base != "rev":
            return None
        # 60 x 1/60 is not 1 in binary: 12 digits hide that, nothing else.
        return float(f"{self.factor * 60.0:.12g}")


def decode_si_unit(code: int, quantity: Quantity) -> SiUnit | None:
    """The unit that a value of 60A8h to 60ABh means, or None where that is not certain.

    Not certain are codes of another dimension than the quantity's, unknown codes, a used
    reserved byte and 0, which files hold where nobody gave a unit.

    Args:
        code: the object's value, 0 to FFFFFFFFh.
        quantity: of which the object is the unit.
    """
    parts = _parts(code)
    if parts is None:
        return None
    exponent, numerator, denominator = parts
    seconds = _DENOMINATORS[quantity].get(denominator)
    if seconds is None:
        return None
    base: Literal["rev", "m", "inc"]
    if numerator == _INCREMENT:
        base, size = "inc", 1.0
    elif numerator == _METRE:
        base, size = "m", 1.0
    elif numerator in _REVOLUTIONS:
        base, size = "rev", _REVOLUTIONS[numerator]
    else:
        return None
    factor = float(f"{size * 10.0**exponent / seconds:.15g}")
    return SiUnit(code, quantity, unit_text(code), base, factor)


def unit_text(code: int) -> str:
    """The unit of any code as text (``rpm``, ``0.1 rpm``, ``mA``), empty where it is unknown."""
    parts = _parts(code)
    if parts is None:
        return ""
    exponent, numerator, denominator = parts
    top, bottom = SYMBOLS.get(numerator), SYMBOLS.get(denominator)
    if not top or bottom is None:
        return ""
    if (numerator, denominator) == (_REVOLUTION, _MINUTE):
        top, bottom = "rpm", ""
    prefix = _PREFIXES.get(exponent)
    if exponent and (prefix is None or top in _WITHOUT_PREFIX):
        number = (
            f"{10.0**exponent:.{max(0, -exponent)}f}" if abs(exponent) <= 6 else f"1e{exponent}"
        )
        top = f"{number} {top}"
    else:
        top = f"{prefix}{top}"
    return f"{top}/{bottom}" if bottom else top


def _parts(code: int) -> tuple[int, int, int] | None:
    """Power of ten, numerator and denominator; None where it is no unit code."""
    if not 0 < code <= 0xFFFFFFFF or code & 0xFF:
        return None
    exponent = code >> 24
    if exponent > 0x7F:
        exponent -= 0x100
    if abs(exponent) > _MAX_EXPONENT:
        return None
    return exponent, code >> 16 & 0xFF, code >> 8 & 0xFF
