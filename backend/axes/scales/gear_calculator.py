"""Electronic gear from the mechanics, with the rounding that the drive's parameters require.

A *user increment* is the travel of one count of the position objects, 0.001 mm for example. The
wanted number of user increments per motor revolution follows from the mechanics; the drive's gear
parameters hold it exactly or approximately, and the difference is reported.

Sources: CiA 402-2 clause 7 (608Fh, 6091h, 6092h); 001:1011 to 001:1080 (EP3E, the same objects
with worked examples); 002:2557 (R6L, 6091h is encoder increments over user increments);
000:1276 to 000:1330 (M6-L, P05.05 is user increments per motor revolution).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from drivers.errors import OutOfRange
from drivers.texts.message import Text, text
from profiles.schema import Parameter, Profile

_Length = Annotated[float, Field(gt=1e-6, le=1e6, allow_inf_nan=False)]
_Teeth = Annotated[int, Field(ge=1, le=100_000)]
#: Largest denominator with which a length or π is written as a fraction.
_FINEST = 1_000_000
#: Relative error that is negligible on every axis: 0.1 µm in a kilometre.
_EXACT = Fraction(1, 10**10)


class Mechanics(BaseModel):
    """Mechanics that convert a motor revolution into travel.

    *screw*: ``lead_mm`` per turn. *belt*: ``diameter_mm`` of the pulley, or ``pitch_mm`` times its
    ``teeth``. *rack*: ``module_mm`` or ``pitch_mm`` of the pinion, times its ``teeth``. *rotary*: a
    table of 360°. The gearbox makes ``load_turns`` from ``motor_turns``.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    kind: Literal["screw", "belt", "rack", "rotary"]
    lead_mm: _Length | None = None
    diameter_mm: _Length | None = None
    pitch_mm: _Length | None = None
    module_mm: _Length | None = None
    teeth: _Teeth | None = None
    motor_turns: _Teeth = 1
    load_turns: _Teeth = 1
    resolution: _Length = Field(default=0.001, description="mm or degrees of one user increment")

    @property
    def unit(self) -> str:
        """Unit of travel."""
        return "°" if self.kind == "rotary" else "mm"

    def travel_per_load_turn(self) -> Fraction:
        """Travel of one turn of screw, pulley, pinion or table, in `unit`.

        Raises:
            OutOfRange: a dimension is missing.
        """
        match self.kind:
            case "rotary":
                return Fraction(360)
            case "screw":
                return _exact(self._needed("lead_mm"))
            case "belt" if self.diameter_mm is not None:
                return _fine(math.pi * self.diameter_mm)
            case "rack" if self.module_mm is not None:
                return _fine(math.pi * self.module_mm * self._needed("teeth"))
            case _:
                return _exact(self._needed("pitch_mm")) * int(self._needed("teeth"))

    def travel_per_motor_turn(self) -> Fraction:
        """Travel of one motor revolution, in `unit`."""
        return self.travel_per_load_turn() * Fraction(self.load_turns, self.motor_turns)

    def increments_per_load_turn(self) -> Fraction:
        """User increments of one turn of the load."""
        return self.travel_per_load_turn() / _exact(self.resolution)

    def _needed(self, name: str) -> float:
        value: float | None = getattr(self, name)
        if value is None:
            raise OutOfRange(
                "scales.missing", value=name, kind=self.kind, replace=name.replace("_", " ")
            )
        return value


def _exact(number: float) -> Fraction:
    """The decimal number as a person typed it."""
    return Fraction(repr(number)).limit_denominator(10**9)


def _fine(number: float) -> Fraction:
    return Fraction(number).limit_denominator(_FINEST)


@dataclass(frozen=True, slots=True)
class GearValue:
    """One parameter to write."""

    parameter: Parameter
    raw: int


@dataclass(frozen=True, slots=True)
class GearPlan:
    """Parameters that would be written, and the resulting resolution and range.

    ``wanted`` and ``reached``: user increments per motor revolution. ``error_ppm``: relative error
    of every distance [ppm]. ``encoder_travel``: travel of one encoder increment, ``range_travel``:
    travel of 2³¹ user increments, in ``unit``.
    """

    unit: str
    values: tuple[GearValue, ...]
    wanted: float
    reached: float
    error_ppm: float
    travel_per_motor_turn: float
    encoder_counts: int
    encoder_travel: float
    range_travel: float
    warnings: tuple[Text, ...]


def plan_gear(profile: Profile, mechanics: Mechanics, encoder_counts: int | None) -> GearPlan:
    """Gear parameters for these mechanics.

    ``encoder_counts``: increments per motor revolution of the connected encoder; None where the
    drive does not report them, and then the figure of the profile is used.

    Raises:
        OutOfRange: a dimension is missing, the numbers do not fit the drive's parameters, or the
            ratio is outside the drive's bounds.
    """
    spec = profile.units
    counts = encoder_counts or spec.encoder_counts_per_rev or spec.counts_per_rev
    if counts is None or spec.gear_numerator is None or spec.gear_denominator is None:
        raise OutOfRange("scales.no-electronic-gear-known", profile_title=profile.title)
    wanted = mechanics.increments_per_load_turn() * Fraction(
        mechanics.load_turns, mechanics.motor_turns
    )
    if spec.feed is not None and spec.feed_revolutions is not None:
        raws = _standard(profile, mechanics)
    elif spec.feed is not None:
        raws = _by_feed(profile, wanted)
    else:
        raws = _by_ratio(profile, Fraction(counts) / wanted)
    values = tuple(GearValue(profile.by_key[key], raw) for key, raw in raws.items())
    reached = _reached(profile, raws, counts)
    uncertainty = _check_bounds(profile, Fraction(counts) / reached)
    travel = mechanics.travel_per_motor_turn()
    return GearPlan(
        unit=mechanics.unit,
        values=values,
        wanted=float(wanted),
        reached=float(reached),
        error_ppm=float((reached - wanted) / wanted * 1_000_000),
        travel_per_motor_turn=float(travel),
        encoder_counts=counts,
        encoder_travel=float(travel / counts),
        range_travel=float(2**31 * _exact(mechanics.resolution)),
        warnings=tuple(
            found
            for found in (uncertainty, *_warnings(mechanics, wanted, reached, counts))
            if found is not None
        ),
    )


def _standard(profile: Profile, mechanics: Mechanics) -> dict[str, int]:
    """6091h holds the gearbox, 6092h the user increments of one turn of the load."""
    spec = profile.units
    gearbox = Fraction(mechanics.motor_turns, mechanics.load_turns)
    feed = _fit(profile, mechanics.increments_per_load_turn(), spec.feed, spec.feed_revolutions)
    return {
        str(spec.gear_numerator): gearbox.numerator,
        str(spec.gear_denominator): gearbox.denominator,
        str(spec.feed): feed.numerator,
        str(spec.feed_revolutions): feed.denominator,
    }


def _by_feed(profile: Profile, wanted: Fraction) -> dict[str, int]:
    """The feed holds the user increments of a motor turn; 6091h their denominator, if not 1."""
    spec = profile.units
    fitted = _fit(profile, wanted, spec.feed, spec.gear_numerator)
    return {
        str(spec.feed): fitted.numerator,
        str(spec.gear_numerator): fitted.denominator,
        str(spec.gear_denominator): 1,
    }


def _by_ratio(profile: Profile, ratio: Fraction) -> dict[str, int]:
    """Numerator and denominator hold encoder increments over user increments."""
    spec = profile.units
    fitted = _fit(profile, ratio, spec.gear_numerator, spec.gear_denominator)
    return {
        str(spec.gear_numerator): fitted.numerator,
        str(spec.gear_denominator): fitted.denominator,
    }


def _fit(profile: Profile, value: Fraction, above: str | None, below: str | None) -> Fraction:
    """The nearest fraction whose numerator and denominator fit the two parameters.

    Raises:
        OutOfRange: even the nearest one is 0, or too large for the parameter.
    """
    most_above, most_below = (_most(profile, key) for key in (above, below))
    room = min(most_below, int(most_above / value)) if value > 0 else 0
    fitted = _simplest(value, room) if room >= 1 else Fraction(0)
    if not 1 <= fitted.numerator <= most_above or fitted.denominator > most_below:
        raise OutOfRange(
            "scales.ratio-not-fit",
            value=float(value),
            limit=text("limit.up-to-over", above=most_above, below=most_below),
            profile_title=profile.title,
            above=above,
            below=below,
        )
    return fitted


def _simplest(value: Fraction, room: int) -> Fraction:
    """A fraction with small numbers whose error is negligible; otherwise the nearest one."""
    finest = 1
    while finest < room:
        fitted = value.limit_denominator(finest)
        if abs(fitted - value) <= _EXACT * value:
            return fitted
        finest *= 10
    return value.limit_denominator(room)


def _most(profile: Profile, key: str | None) -> int:
    if key is None:
        return 1
    high = profile.by_key[key].raw_limits[1]
    return int(high) if high is not None else 2**31 - 1


def _reached(profile: Profile, raws: dict[str, int], counts: int) -> Fraction:
    """User increments per motor revolution, by the rule of `units.read_units`."""
    spec = profile.units
    ratio = Fraction(raws[str(spec.gear_numerator)], raws[str(spec.gear_denominator)])
    if spec.feed is None:
        return Fraction(counts) / ratio
    turns = raws[spec.feed_revolutions] if spec.feed_revolutions is not None else 1
    return Fraction(raws[spec.feed], turns) / ratio


def _check_bounds(profile: Profile, ratio: Fraction) -> Text | None:
    """Check encoder increments per user increment against the drive's bounds; a warning or None.

    Raises:
        OutOfRange: outside strict bounds; the message names the fault that the drive would report.
    """
    gear = profile.functions.gear
    low, high = gear.min_ratio, gear.max_ratio
    if (low is None or ratio >= low) and (high is None or ratio <= high):
        return None
    limit = f"{low or 0:g} to {high or math.inf:g}"
    if not gear.strict:
        return text(
            "scales.gear-ratio-unusual",
            value=float(ratio),
            limit=limit,
            fault=gear.fault,
            notes=gear.notes,
        )
    raise OutOfRange(
        "scales.gear-ratio-outside",
        value=float(ratio),
        limit=limit,
        profile=profile.title,
        fault=gear.fault,
    )


def _warnings(mechanics: Mechanics, wanted: Fraction, reached: Fraction, counts: int) -> list[Text]:
    found: list[Text] = []
    if reached > counts:
        found.append(text("scales.gear-finer-than-encoder", reached=float(reached), counts=counts))
    if abs(reached - wanted) > 10 * _EXACT * wanted:
        drift = float(abs(reached - wanted) / wanted)
        over = 1000.0 if mechanics.unit == "mm" else 360.0
        found.append(
            text("scales.gear-not-exact", over=over, unit=mechanics.unit, drift=drift * over)
        )
    elif mechanics.kind in ("belt", "rack") and (
        mechanics.diameter_mm is not None or mechanics.module_mm is not None
    ):
        found.append(text("scales.gear-pi"))
    return found
