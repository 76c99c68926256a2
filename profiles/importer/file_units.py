"""Units of the motion objects as stated in a manufacturer's file, each with its origin.

Source: CiA 402-2 objects 60A8h to 60AAh (unit codes), and the units that a file prints at the
objects themselves. The standard's own "increments" is only a default: manufacturers use others.
"""

from __future__ import annotations

from collections.abc import Iterable

from profiles.importer.description import DescribedEntry
from profiles.schema import UnitOrigin, UnitSpec
from profiles.si_unit import SiUnit, decode_si_unit

#: Object with the unit code, and the setpoint object whose printed unit is used without a code.
_QUANTITIES = {
    "position": ("60A8:00", "607A:00"),
    "velocity": ("60A9:00", "60FF:00"),
    "acceleration": ("60AA:00", "6083:00"),
}
#: Marks of the generic profile for objects in one of the motion units.
_MARKS = {"inc": "position", "inc/s": "velocity", "inc/s²": "acceleration"}
#: In encoder increments, whatever the unit of positions is (CiA 402-2).
_INTERNAL = frozenset({"6063:00", "60FC:00", "608F:01", "60E4:01"})


class FileUnits:
    """Units of position, velocity and acceleration in one file."""

    def __init__(self, entries: Iterable[DescribedEntry]) -> None:
        by_key = {entry.key: entry for entry in entries}
        self._codes: dict[str, int] = {}
        self._stated: dict[str, SiUnit] = {}
        self._printed: dict[str, str] = {}
        torque = by_key.get("6071:00")
        self._torque = torque.unit if torque is not None else ""
        self._held = {q for q, (key, _) in _QUANTITIES.items() if key in by_key}
        for quantity, (key, target) in _QUANTITIES.items():
            code = by_key[key].default_raw if key in by_key else None
            if isinstance(code, int) and code != 0:
                # A code has 32 bits, whatever the sign of its type in the file.
                self._codes[quantity] = code & 0xFFFFFFFF
                unit = decode_si_unit(code & 0xFFFFFFFF)
                if unit is not None and _is_of(quantity, unit):
                    self._stated[quantity] = unit
            elif target in by_key and by_key[target].unit:
                self._printed[quantity] = by_key[target].unit

    def of(self, key: str, printed: str, standard: str) -> tuple[str, float]:
        """Return the unit of an object, and the value of one raw step in it.

        ``printed`` is the unit that the file states at the object, ``standard`` that of the generic
        profile. A motion unit that is not stated is returned empty: the number is raw.
        """
        quantity = _MARKS.get(standard)
        if key in _INTERNAL or quantity is None:
            return printed or standard, 1.0
        unit = self._stated.get(quantity)
        if unit is not None:
            return _shown(unit)
        if quantity in self._codes:
            return "", 1.0
        if printed or self._printed.get(quantity):
            return printed or self._printed[quantity], 1.0
        return ("inc" if quantity == "position" and quantity not in self._held else ""), 1.0

    def spec(self, base: UnitSpec, present: frozenset[str]) -> UnitSpec:
        """Return the profile's units; ``base`` has the standard's, ``present`` existing keys."""

        def existing(key: str | None) -> str | None:
            return key if key in present else None

        origins: dict[str, UnitOrigin] = {}
        texts: dict[str, str] = {"torque": self._torque or base.torque}
        for quantity, (key, _) in _QUANTITIES.items():
            origins[quantity] = "makers_file"
            if quantity in self._stated:
                texts[quantity] = self._stated[quantity].name
            elif quantity in self._codes:
                # Kept unchanged: no reader takes it for a known unit.
                texts[quantity] = f"{key[:4]}h = {self._codes[quantity]:08X}h"
            elif quantity in self._printed:
                texts[quantity] = self._printed[quantity]
            else:
                texts[quantity] = getattr(base, quantity)
                origins[quantity] = "standard"
        return UnitSpec.model_validate(
            {
                **base.model_dump(),
                **texts,
                "origins": origins,
                "gear_numerator": existing(base.gear_numerator),
                "gear_denominator": existing(base.gear_denominator),
                "feed": existing(base.feed),
                "feed_revolutions": existing(base.feed_revolutions),
            }
        )


def _is_of(quantity: str, unit: SiUnit) -> bool:
    """Return whether the unit has the quantity's dimension: a speed is not a position."""
    if quantity == "position":
        return unit.denominator.value == 0
    if quantity == "velocity":
        return unit.seconds is not None
    return unit.square_seconds is not None


def _shown(unit: SiUnit) -> tuple[str, float]:
    """Return a unit without a number in its name, and the step that the number represents."""
    bare = SiUnit(0, unit.numerator, unit.denominator)
    if unit.name.endswith(f" {bare.name}"):
        return bare.name, unit.factor
    return unit.name, 1.0
