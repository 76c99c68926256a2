"""A drive that reports its motion in a non-standard way; see `RoughFeedbackSpec`."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from drivers.virtual.firmware.cia402.base import RPM, Units
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import Number
from drivers.virtual.mechanics.rough_feedback import RoughFeedbackSpec
from profiles.schema import Profile, Raw
from profiles.si_unit import decode_si_unit

if TYPE_CHECKING:
    from drivers.virtual.firmware.core import Core

_TWO_PI = 2.0 * math.pi
_KEPT = 512
#: Unit codes of a drive without options: increments, per second and per square second (CiA 303-2).
_USUAL = {"60A8:00": 0x00B50000, "60A9:00": 0x00B50300, "60AA:00": 0x00B55700}


def without_lacking(profile: Profile, rough: RoughFeedbackSpec) -> Profile:
    """Return the profile of a drive without some objects."""
    if not rough.lacks:
        return profile
    lacking = {name.upper() for name in rough.lacks}
    kept = tuple(p for p in profile.parameters if p.key.split(":")[0] not in lacking)
    keys = {p.key for p in kept}
    signals = tuple(signal for signal in profile.signals if signal.key in keys)
    copy = profile.model_copy(update={"parameters": kept, "signals": signals})
    # A copy of a model keeps what was computed of the original.
    for name in ("by_key", "by_role", "unit_keys"):
        copy.__dict__.pop(name, None)
    return copy


def unit_values(profile: Profile, rough: RoughFeedbackSpec) -> dict[str, Raw]:
    """Return the values of 60A8h to 60AAh, if the drive has them."""
    stated = {
        "60A8:00": rough.position_unit,
        "60A9:00": rough.velocity_unit,
        "60AA:00": rough.acceleration_unit,
    }
    return {
        key: usual if stated[key] is None else int(stated[key] or 0)
        for key, usual in _USUAL.items()
        if key in profile.by_key
    }


def rough_units(units: Units, rough: RoughFeedbackSpec) -> Units:
    """Return units of speeds and ramps by the drive's unit codes."""
    if rough.velocity_unit is not None:
        per = _per_turn(rough.velocity_unit, units.position_per_rad)
        sign = math.copysign(1.0, units.speed_per_rad_s)
        units = replace(units, speed_per_rad_s=sign * per)
    if rough.acceleration_unit is not None:
        per = _per_turn(rough.acceleration_unit, units.position_per_rad)
        units = replace(units, acceleration_per_rad_s2=per)
    return units


def _per_turn(code: int, position_per_rad: float) -> float:
    """Return raw units per rad/s, or per rad/s², for a code of 60A9h or 60AAh."""
    unit = decode_si_unit(code)
    if unit is None or not (unit.counts or unit.turns):
        raise ValueError(f"a virtual drive has no speeds in the unit {code:08X}h")
    seconds = unit.seconds or unit.square_seconds or 1.0
    per_rad = abs(position_per_rad) if unit.counts else 1.0 / (_TWO_PI * (unit.turns or 1.0))
    return per_rad * seconds / unit.factor


class RoughSpeed:
    """606Ch as this drive reports it: delayed, averaged, quantised, scaled."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._rough = core.axis.spec.rough_feedback
        self._past: deque[tuple[float, float]] = deque(maxlen=_KEPT)

    def __call__(self) -> Number:
        """Return the present 606Ch, raw."""
        rough, core = self._rough, self._core
        speed = self._speed_rad_s()
        if rough.speed_step_rpm:
            step = rough.speed_step_rpm * RPM
            speed = math.trunc(speed / step) * step
        return round(speed * core.units.speed_per_rad_s * rough.speed_factor)

    def _speed_rad_s(self) -> float:
        rough, item = self._rough, self._core.axis.s.item
        if not rough.speed_late_s and not rough.speed_mean_s:
            return float(item(k.S_OMEGA))
        now_s, angle = item(k.S_STEP) * k.STEP_S, item(k.S_THETA)
        if not self._past or now_s > self._past[-1][0]:
            self._past.append((now_s, angle))
        mean_s = max(rough.speed_mean_s, k.STEP_S)
        newer, older = now_s - rough.speed_late_s, now_s - rough.speed_late_s - mean_s
        return (self._angle(newer) - self._angle(older)) / mean_s

    def _angle(self, at_s: float) -> float:
        later = self._past[-1]
        for sample in reversed(self._past):
            if sample[0] <= at_s:
                span = later[0] - sample[0]
                share = (at_s - sample[0]) / span if span else 0.0
                return sample[1] + share * (later[1] - sample[1])
            later = sample
        return later[1]


def speed_value(core: Core, plain: Callable[[], Number]) -> Callable[[], Number]:
    """Return the getter of 606Ch; the plain one unless an option requires another."""
    usual = RoughFeedbackSpec()
    rough = core.axis.spec.rough_feedback
    same = ("speed_factor", "speed_step_rpm", "speed_late_s", "speed_mean_s")
    if all(getattr(rough, name) == getattr(usual, name) for name in same):
        return plain
    return RoughSpeed(core)


def position_value(core: Core, plain: Callable[[], Number]) -> Callable[[], Number]:
    """Return the getter of 6064h; a constant one if the option requires it."""
    if not core.axis.spec.rough_feedback.position_stands:
        return plain
    stood = plain()
    return lambda: stood
