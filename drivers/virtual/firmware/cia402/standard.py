"""CiA 402 drives whose conventions are in the profile: gains, notches, units, faults.

Data that a profile cannot contain are in the family's module (`drivers.virtual.firmware.families`);
data that no manual prints (thresholds of the power stage) are specific to this virtual drive and
marked below.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.firmware.cia402 import power
from drivers.virtual.firmware.cia402.base import (
    RPM,
    BrakeTimes,
    Traits,
    Units,
    Wiring,
)
from drivers.virtual.firmware.cia402.conversions import (
    MS,
    TWO_PI,
    per_rad_s,
    si_factor,
    volt_factor,
)
from drivers.virtual.firmware.cia402.loops import UNIT_GAIN, LoopReader
from drivers.virtual.firmware.cia402.reports import faults_of
from drivers.virtual.firmware.cia402.terminals import TerminalTable
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import Number, ObjectDictionary
from drivers.virtual.firmware.objects.settings import LoopSettings, MotorData, ProtectionSettings
from drivers.virtual.firmware.rough.rough_feedback import unit_values
from drivers.virtual.mechanics import MechanicsSpec
from profiles.schema import Profile, Raw

if TYPE_CHECKING:
    from drivers.virtual.firmware.objects.monitors import Sources


class Cia402:
    """A family described by its profile; see `drivers.virtual.firmware.cia402.base.Family`.

    A family's module derives from it: it states its traits and terminals, and overrides what its
    manual prints differently.
    """

    TRAITS: ClassVar[Traits] = Traits()
    TERMINALS: ClassVar[TerminalTable | None] = None
    supply_v: float | None = None

    def __init__(self, profile: Profile) -> None:
        self.name = profile.drive
        self._profile = profile
        self.terminals = self._table(profile)
        base = self.TRAITS
        self.traits = replace(base, faults=base.faults or faults_of(profile, base.protections))

    def _table(self, profile: Profile) -> TerminalTable | None:
        """Return the family's terminals, if this profile has their parameters."""
        table = self.TERMINALS
        if table is None:
            return None
        keys = [t.function_key for t in table.inputs if t.function_key is not None]
        return table if all(key in profile.by_key for key in keys) else None

    # --- values ----------------------------------------------------------------------------
    def factory_values(self, spec: MechanicsSpec, motor: MotorData) -> dict[str, Raw]:
        """Return ratings if the profile has the objects, in the objects' own scale."""
        known = {
            "rated_torque": motor.rated_torque_nm,
            "rated_current": motor.rated_current_a,
            "rated_speed": spec.motor.rated_speed_rpm,
            "motor_inertia": spec.motor.inertia_kgm2,
        }
        values: dict[str, Raw] = {}
        for role, value in known.items():
            parameter = self._profile.by_role.get(role)
            if parameter is not None:
                values[parameter.key] = parameter.to_raw(value * si_factor(parameter.unit))
        resolution = self._profile.by_key.get("608F:01")
        if resolution is not None and resolution.default_raw is None:
            values[resolution.key] = spec.encoder.counts_per_rev  # as the drive reads it
        return values | unit_values(self._profile, spec.rough_feedback)

    def fallback_values(self, motor: MotorData) -> dict[str, Raw]:
        """Return a moderate axis: 10 rev/s, 50 rev/s², windows of 1/360 revolution."""
        units = self._units(1.0, motor)
        turn = units.position_per_rad * TWO_PI
        speed = units.speed_per_rad_s * TWO_PI
        ramp = 200.0 if units.ramps_are_times_ms else units.acceleration_per_rad_s2 * TWO_PI * 50
        window = round(turn / 360)
        slow = round(speed)
        fallback: dict[str, Raw] = {
            "6065:00": round(turn), "6066:00": 100, "6067:00": window, "6068:00": 10,
            "606D:00": min(slow, 65535), "606E:00": 10, "606F:00": min(slow, 65535), "6070:00": 10,
            "6072:00": 3000, "6073:00": 3000, "60E0:00": 3000, "60E1:00": 3000,
            "607D:01": -(2**31), "607D:02": 2**31 - 1,
            "6081:00": round(10 * speed), "6083:00": round(ramp), "6084:00": round(ramp),
            "6085:00": round(ramp), "609A:00": round(ramp), "6087:00": 3000,
            "6099:01": round(2 * speed), "6099:02": max(1, round(speed / 4)),
            "6091:01": 1, "6091:02": 1, "6092:01": round(turn), "6092:02": 1, "608F:02": 1,
            "60C2:01": 1, "60C2:02": -3, "605A:00": 2, "605D:00": 1, "605E:00": 2, "6007:00": 1,
            "6502:00": sum(1 << (mode - 1) for mode in self._profile.supported_modes if mode > 0),
        }  # fmt: skip
        if self.traits.torque_limits is not None:
            positive, negative = self.traits.torque_limits
            for key, percent in ((positive, 300.0), (negative, 300.0)):
                limit = self._profile.by_key.get(key)
                if limit is not None:
                    below = limit.max_raw is not None and limit.max_raw <= 0
                    fallback[key] = limit.to_raw(-percent if below else percent)
        turns_per_s = {"606D:00": 1.0, "606F:00": 1.0, "6099:01": 2.0, "6099:02": 0.25}
        for key, turns in turns_per_s.items():
            parameter = self._profile.by_key.get(key)
            if parameter is not None and parameter.unit == "rpm":
                fallback[key] = round(parameter.to_raw(60.0 * turns))
        gains = self._profile.gains
        if gains is not None and gains.convention == "unit":
            keys = (gains.position, gains.speed, gains.integral)
            fallback |= {key: UNIT_GAIN for key in keys if key is not None}
        mode = self._profile.by_key.get("6060:00")
        if mode is not None and mode.enum and 0 not in mode.enum:
            # A drive without "no mode" starts in one of its modes (003:230).
            fallback["6060:00"] = min(self._profile.supported_modes)
        if self.traits.positive_limit_first:
            fallback |= {"607D:01": 2**31 - 1, "607D:02": -(2**31)}
        return fallback | self._start_gains()

    def _start_gains(self) -> dict[str, Raw]:
        """Return the gains that `loops` uses where none are printed, so that they can be read."""
        gains = self._profile.gains
        if gains is None or gains.convention == "unit":
            return {}
        values: dict[str, Raw] = {}
        wanted = ((gains.speed, 40.0), (gains.integral, 20.0), (gains.position, 40.0))
        for key, value in wanted:
            parameter = self._profile.by_key.get(key or "")
            if parameter is None:
                continue
            in_hertz = "Hz" in parameter.unit or gains.convention == "bandwidth"
            as_hertz = key == gains.position and in_hertz
            values[parameter.key] = parameter.to_raw(value / TWO_PI if as_hertz else value)
        return values

    # --- units -----------------------------------------------------------------------------
    def units(self, od: ObjectDictionary, motor: MotorData) -> Units:
        """Return default increments per revolution, scaled by the gear relative to its default."""
        spec = self._profile.units
        factor = self._ratio(od, spec.gear_denominator, spec.gear_numerator)
        factor *= self._ratio(od, spec.feed, spec.feed_revolutions)
        if spec.feed is not None and spec.feed not in self._profile.by_key:
            # Without a feed constant an increment is one of the encoder (CiA 402-2 clause 7).
            factor *= od.number("608F:01", self._default_turn()) / self._default_turn()
        polarity = int(od.number("607E:00"))
        return self._units(
            factor, motor, -1.0 if polarity & 0x80 else 1.0, -1.0 if polarity & 0x40 else 1.0
        )

    def _ratio(self, od: ObjectDictionary, above: str | None, below: str | None) -> float:
        """Return the present (above/below) relative to its default."""
        result = 1.0
        for key, exponent in ((above, 1.0), (below, -1.0)):
            parameter = self._profile.by_key.get(key or "")
            if key is None or parameter is None:
                continue
            printed = parameter.default_raw
            # As in `fallback_values` where the manual prints no default.
            start = self._default_turn() if key == self._profile.units.feed else 1.0
            default = float(printed) if isinstance(printed, (int, float)) and printed else start
            now = float(od.number(key, default))
            if now > 0:
                result *= (now / default) ** exponent
        return result

    def _default_turn(self) -> float:
        """Return increments per revolution with the default gear."""
        spec = self._profile.units
        return float(spec.counts_per_rev or spec.encoder_counts_per_rev or 10000)

    def _units(
        self, factor: float, motor: MotorData, position_sign: float = 1.0, speed_sign: float = 1.0
    ) -> Units:
        spec = self._profile.units
        turn = self._default_turn() * factor
        per_rad = turn / TWO_PI
        speed = per_rad_s(spec.velocity, per_rad)
        times = spec.acceleration.strip().startswith("ms")
        reference = spec.ramp_reference_rpm or motor.rated_speed_rad_s / RPM
        return Units(
            position_per_rad=per_rad * position_sign,
            speed_per_rad_s=speed * speed_sign,
            acceleration_per_rad_s2=1.0 if times else per_rad_s(spec.acceleration, per_rad),
            torque_per_nm=1000.0 / motor.rated_torque_nm,
            ramps_are_times_ms=times,
            ramp_reference_rad_s=reference * RPM,
        )

    # --- loops -----------------------------------------------------------------------------
    def loops(
        self,
        od: ObjectDictionary,
        profile: Profile,  # noqa: ARG002 - the seam's signature
        motor: MotorData,
        units: Units,
    ) -> LoopSettings:
        """Return gains by the profile's convention; see `drivers.virtual.firmware.cia402.loops`."""
        return LoopReader(self._profile, self.traits, od, motor, units).settings()

    def protections(
        self,
        od: ObjectDictionary,
        motor: MotorData,
        units: Units,  # noqa: ARG002 - the seam's signature
    ) -> ProtectionSettings:
        """Return the virtual drive's own protections, refined by the parameters of the family."""
        base = self.refined(od, motor, power.own(motor))
        window = self._profile.by_role.get("following_error_window")
        size = od.number("6065:00" if window is None else window.key)
        unlimited = size in (0, 2**32 - 1) and window is not None
        limited = k.F_FOLLOWING in self.traits.faults and not unlimited
        wait_s = od.number("6066:00", 0 if window is not None else 100) * MS
        return replace(base, following_error_s=wait_s if limited else math.inf)

    def refined(
        self,
        od: ObjectDictionary,  # noqa: ARG002 - for families with parameters
        motor: MotorData,  # noqa: ARG002
        base: ProtectionSettings,
    ) -> ProtectionSettings:
        """Return the protections set by the family's parameters; ``base`` without parameters."""
        return base

    def refusal(self, od: ObjectDictionary, mode: int) -> str | None:  # noqa: ARG002 - the seam's
        """Return None: nothing is refused."""
        return None

    def gear_fault(self, od: ObjectDictionary) -> str | None:  # noqa: ARG002 - the seam's
        """Return None: no such fault is printed."""
        return None

    def in_place_s(self, od: ObjectDictionary) -> float:
        """Return the time in 6068h [s]."""
        return od.number("6068:00", 10) * MS

    def brake(self, od: ObjectDictionary) -> BrakeTimes | None:  # noqa: ARG002 - the seam's
        """Return None: no brake times are printed."""
        return None

    def monitors(self, sources: Sources) -> dict[str, Callable[[], float]]:  # noqa: ARG002
        """Return no monitors: a profile cannot describe any."""
        return {}

    def readings(self, axis: VirtualAxis) -> dict[str, Callable[[], Number]]:
        """Return objects that a profile assigns by role but that have no number in CiA 402."""
        item = axis.s.item
        sources: dict[str, tuple[int, float]] = {
            "dc_voltage": (k.S_VOLTAGE, 1.0),
            "temperature": (k.S_TEMPERATURE, 1.0),
            "load_ratio": (k.S_LOAD_RATIO, 100.0),
        }
        values: dict[str, Callable[[], Number]] = {}
        for role, (state, factor) in sources.items():
            parameter = self._profile.by_role.get(role)
            if parameter is not None:
                scale = volt_factor(parameter.unit) * factor / parameter.scale
                values[parameter.key] = lambda s=state, f=scale: round(item(s) * f)  # type: ignore[misc]
        return values

    def wiring(self, od: ObjectDictionary) -> Wiring:
        """Return the wiring by terminal functions; a family without a table has all switches."""
        return Wiring() if self.terminals is None else self.terminals.wiring(od)
