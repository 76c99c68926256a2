"""CiA 402 drives whose conventions the profile tells: gains, notches, units, faults.

What a profile cannot tell is in `Traits` of each family; what no manual prints (thresholds of
the power stage) is this virtual drive's own and said so below.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace

from drivers.virtual.firmware import kernel as k
from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.firmware.dictionary import Number, ObjectDictionary
from drivers.virtual.firmware.families import power
from drivers.virtual.firmware.families.base import (
    RPM,
    BrakeTimes,
    GainKeys,
    Traits,
    Units,
    Wiring,
)
from drivers.virtual.firmware.families.reports import faults_of
from drivers.virtual.firmware.families.terminals import TABLES, TerminalTable
from drivers.virtual.firmware.settings import (
    Biquad,
    Compensation,
    GainSet,
    LoopSettings,
    MotorData,
    ProtectionSettings,
    Switching,
    notch_biquad,
)
from drivers.virtual.mechanics import MechanicsSpec
from profiles.schema import NotchSlot, Profile, Raw

TWO_PI = 2 * math.pi
_MS = 1e-3
_UNIT_GAIN = 100
"""Start value of a gain for which the manual prints neither unit nor default."""


class Cia402:
    """A family described by its profile; see `drivers.virtual.firmware.families.base.Family`."""

    def __init__(self, profile: Profile, traits: Traits | None = None) -> None:
        self.name = profile.drive
        self._profile = profile
        self.terminals = self._table(profile)
        base = traits or Traits()
        self.traits = replace(base, faults=base.faults or faults_of(profile, base.protections))

    @staticmethod
    def _table(profile: Profile) -> TerminalTable | None:
        """The family's terminals, if this profile has their parameters."""
        table = TABLES.get(profile.drive)
        if table is None:
            return None
        keys = [t.function_key for t in table.inputs if t.function_key is not None]
        return table if all(key in profile.by_key for key in keys) else None

    # --- values ----------------------------------------------------------------------------
    def factory_values(self, spec: MechanicsSpec, motor: MotorData) -> dict[str, Raw]:
        """Ratings where the profile names the objects, in the objects' own scale."""
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
                values[parameter.key] = parameter.to_raw(value * _si_factor(parameter.unit))
        resolution = self._profile.by_key.get("608F:01")
        if resolution is not None and resolution.default_raw is None:
            values[resolution.key] = spec.encoder.counts_per_rev  # what the drive reads from it
        return values

    def fallback_values(self, motor: MotorData) -> dict[str, Raw]:
        """A moderate axis: 10 rev/s, 50 rev/s², windows of 1/360 revolution."""
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
            "6091:01": 1, "6091:02": 1, "6092:01": round(turn), "6092:02": 1,
            "60C2:01": 1, "60C2:02": -3, "605A:00": 2, "605D:00": 1, "605E:00": 2, "6007:00": 1,
            "6502:00": sum(1 << (mode - 1) for mode in self._profile.supported_modes if mode > 0),
        }  # fmt: skip
        if self.name == "ds_c":
            # In-place window and time, out-of-tolerance threshold; origin and limits on DI0 to DI2.
            fallback |= {
                "2500:00": min(round(turn), 65535), "2501:00": window, "2502:00": 10,
                "2400:02": 1, "2400:03": 2, "2400:04": 3,
            }  # fmt: skip
        if self.traits.torque_limits is not None:
            positive, negative = self.traits.torque_limits
            for key, percent in ((positive, 300.0), (negative, 300.0)):
                limit = self._profile.by_key.get(key)
                if limit is not None:
                    below = limit.max_raw is not None and limit.max_raw <= 0
                    fallback[key] = limit.to_raw(-percent if below else percent)
        if self.name == "r6l":
            fallback["2000:16"] = round(1.2 * motor.rated_speed_rad_s / RPM)
        turns_per_s = {"606D:00": 1.0, "606F:00": 1.0, "6099:01": 2.0, "6099:02": 0.25}
        for key, turns in turns_per_s.items():
            parameter = self._profile.by_key.get(key)
            if parameter is not None and parameter.unit == "rpm":
                fallback[key] = round(parameter.to_raw(60.0 * turns))
        gains = self._profile.gains
        if gains is not None and gains.convention == "unit":
            keys = (gains.position, gains.speed, gains.integral)
            fallback |= {key: _UNIT_GAIN for key in keys if key is not None}
        mode = self._profile.by_key.get("6060:00")
        if mode is not None and mode.enum and 0 not in mode.enum:
            # A drive without "no mode" starts in one of those that it has (003:230).
            fallback["6060:00"] = min(self._profile.supported_modes)
        if self.traits.positive_limit_first:
            fallback |= {"607D:01": 2**31 - 1, "607D:02": -(2**31)}
        return fallback | self._start_gains()

    def _start_gains(self) -> dict[str, Raw]:
        """The gains that `loops` takes where none are printed, so that they can be read."""
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
        """Default increments per revolution, scaled by how far the gear differs from default."""
        spec = self._profile.units
        factor = self._ratio(od, spec.gear_denominator, spec.gear_numerator)
        factor *= self._ratio(od, spec.feed, spec.feed_revolutions)
        polarity = int(od.number("607E:00"))
        return self._units(
            factor, motor, -1.0 if polarity & 0x80 else 1.0, -1.0 if polarity & 0x40 else 1.0
        )

    def _ratio(self, od: ObjectDictionary, above: str | None, below: str | None) -> float:
        """(above/below) now over (above/below) by default."""
        result = 1.0
        for key, exponent in ((above, 1.0), (below, -1.0)):
            parameter = self._profile.by_key.get(key or "")
            if key is None or parameter is None:
                continue
            printed = parameter.default_raw
            # As `fallback_values` starts where the manual prints no default.
            start = self._default_turn() if key == self._profile.units.feed else 1.0
            default = float(printed) if isinstance(printed, (int, float)) and printed else start
            now = float(od.number(key, default))
            if now > 0:
                result *= (now / default) ** exponent
        return result

    def _default_turn(self) -> float:
        """Increments per revolution with the gear as it starts."""
        spec = self._profile.units
        return float(spec.counts_per_rev or spec.encoder_counts_per_rev or 10000)

    def _units(
        self, factor: float, motor: MotorData, position_sign: float = 1.0, speed_sign: float = 1.0
    ) -> Units:
        spec = self._profile.units
        turn = self._default_turn() * factor
        per_rad = turn / TWO_PI
        speed = _per_rad_s(spec.velocity, per_rad)
        times = spec.acceleration.strip().startswith("ms")
        reference = spec.ramp_reference_rpm or motor.rated_speed_rad_s / RPM
        return Units(
            position_per_rad=per_rad * position_sign,
            speed_per_rad_s=speed * speed_sign,
            acceleration_per_rad_s2=1.0 if times else _per_rad_s(spec.acceleration, per_rad),
            torque_per_nm=1000.0 / motor.rated_torque_nm,
            ramps_are_times_ms=times,
            ramp_reference_rad_s=reference * RPM,
        )

    # --- loops -----------------------------------------------------------------------------
    def loops(
        self,
        od: ObjectDictionary,
        profile: Profile,
        motor: MotorData,
        units: Units,
    ) -> LoopSettings:
        """Gains by the profile's convention; without one, 40 Hz speed and 6 Hz position loop."""
        inertia = self._inertia(od, motor)
        gains = profile.gains
        first = GainKeys()
        current_hz = 1000.0
        if gains is not None:
            first = GainKeys(gains.position, gains.speed, gains.integral, gains.torque_filter)
            current_hz = self._value(od, gains.current_bandwidth, current_hz)
        second = self.traits.second_gains or first
        speed_ff, speed_ff_s, torque_ff, torque_ff_s = self._feed_forward(od)
        rated = motor.rated_torque_nm
        return LoopSettings(
            first=self._gain_set(od, first, inertia),
            second=self._gain_set(od, second, inertia),
            homing=None,
            switching=self._switching(od, motor, units),
            compensation=self._compensation(od, rated),
            current_loop_hz=current_hz if current_hz >= 100.0 else 1000.0,
            inertia_kgm2=inertia,
            torque_filter_s=self._value(od, first.torque_filter, 0.0) * _MS,
            torque_filter_2_s=self._value(od, second.torque_filter, 0.0) * _MS,
            speed_feed_forward=speed_ff,
            speed_feed_forward_s=speed_ff_s,
            torque_feed_forward=torque_ff,
            torque_feed_forward_s=torque_ff_s,
            speed_filter_hz=self._speed_filter(od),
            notches=self._notches(od),
            speed_output_nm=3.0 * rated,
            torque_mode_speed_rad_s=self._torque_mode_speed(od, motor),
            brake_speed_rad_s=10 * RPM,
            brake_torque_nm=rated,
        )

    def _value(self, od: ObjectDictionary, key: str | None, default: float) -> float:
        """A parameter in its engineering unit; 0 and a missing one give the default."""
        parameter = self._profile.by_key.get(key or "")
        if parameter is None or key is None:
            return default
        return float(parameter.to_value(od.number(key))) or default

    def _gain_set(self, od: ObjectDictionary, keys: GainKeys, inertia: float) -> GainSet:
        """40 Hz speed loop, 20 ms and 40 /s where a family has no such parameter."""
        gains = self._profile.gains
        hertz, integral_ms, position = 40.0, 20.0, 40.0
        if gains is not None and gains.convention == "unit":
            # No meaning is printed: what stands there by default is taken as the moderate gains
            # above, and everything else in proportion.
            hertz *= self._share(od, keys.speed)
            integral_ms /= self._share(od, keys.integral)
            position *= self._share(od, keys.position)
        elif gains is not None:
            hertz = self._value(od, keys.speed, hertz)
            integral_ms = self._value(od, keys.integral, integral_ms)
            position = self._value(od, keys.position, position)
            parameter = self._profile.by_key.get(keys.position or "")
            unit = parameter.unit if parameter is not None else ""
            if "Hz" in unit or gains.convention == "bandwidth":
                position *= TWO_PI
        kp = TWO_PI * hertz * inertia
        return GainSet(position, kp, kp / (integral_ms * _MS))

    def _switching(self, od: ObjectDictionary, motor: MotorData, units: Units) -> Switching:
        keys = self.traits.switching
        if keys is None:
            return Switching()
        mode = int(od.number(keys.mode))
        if mode in keys.always_raw:
            return Switching(k.SWITCH_SMALL_ERROR, level=math.inf)
        kind = keys.kinds.get(int(od.number(keys.condition or "")), k.SWITCH_OFF)
        if mode not in keys.on_raw or kind == k.SWITCH_OFF:
            return Switching()
        unit = {
            k.SWITCH_TORQUE: 0.01 * motor.rated_torque_nm,
            k.SWITCH_ACCELERATION: 10 * RPM,
            k.SWITCH_ERROR: 1 / abs(units.position_per_rad),
        }.get(kind, RPM)
        return Switching(
            kind,
            level=self._value(od, keys.level, 0.0) * unit,
            hysteresis=self._value(od, keys.hysteresis, 0.0) * unit,
            delay_s=self._value(od, keys.delay, 0.0) * _MS,
            ramp_s=max(self._value(od, keys.ramp, 0.0) * _MS, k.STEP_S),
        )

    def _compensation(self, od: ObjectDictionary, rated_nm: float) -> Compensation:
        keys = self.traits.compensation
        if keys is None:
            return Compensation()
        percent = 0.01 * rated_nm
        return Compensation(
            bias_nm=self._value(od, keys.bias, 0.0) * percent,
            positive_nm=self._value(od, keys.positive, 0.0) * percent,
            # R6L prints the reverse value with a sign of its own (002:11348), M6-L without.
            negative_nm=abs(self._value(od, keys.negative, 0.0)) * percent,
            viscous_nms=self._value(od, keys.viscous, 0.0) * percent * keys.viscous_per_rpm / RPM,
        )

    def _speed_filter(self, od: ObjectDictionary) -> float:
        """Corner frequency of the speed feedback's low-pass [Hz]."""
        if self.traits.speed_filter is None:
            return 1000.0
        key, unit = self.traits.speed_filter
        number = self._value(od, key, 0.0)
        if number <= 0:
            return 1000.0
        return number if unit == "Hz" else 1.0 / (TWO_PI * number * _MS)

    def _feed_forward(self, od: ObjectDictionary) -> tuple[float, float, float, float]:
        """Shares and time constants [s] of speed and torque feed-forward."""
        keys = self.traits.feed_forward
        if keys is None:
            return (0.0, 0.0, 0.0, 0.0)

        def value(key: str | None, per_unit: float) -> float:
            return self._value(od, key, 0.0) * per_unit

        def selected(key: str | None) -> bool:
            return key is None or od.number(key) == 1

        return (
            value(keys.speed_gain, 0.01) if selected(keys.speed_select) else 0.0,
            value(keys.speed_filter, _MS),
            value(keys.torque_gain, 0.01) if selected(keys.torque_select) else 0.0,
            value(keys.torque_filter, _MS),
        )

    def _share(self, od: ObjectDictionary, key: str | None) -> float:
        """A gain without a unit over its start value."""
        parameter = self._profile.by_key.get(key or "")
        if parameter is None:
            return 1.0
        printed = parameter.default_raw
        start = float(printed) if isinstance(printed, (int, float)) and printed else _UNIT_GAIN
        return max(float(od.number(parameter.key)), 1e-3 * start) / start

    def _torque_mode_speed(self, od: ObjectDictionary, motor: MotorData) -> float:
        key = self.traits.torque_speed_limit_key
        rpm = od.number(key) if key is not None else 0
        return rpm * RPM if rpm else 1.2 * motor.rated_speed_rad_s

    def _inertia(self, od: ObjectDictionary, motor: MotorData) -> float:
        gains = self._profile.gains
        rotor = motor.rotor_inertia_kgm2
        parameter = self._profile.by_key.get(gains.inertia or "") if gains else None
        if gains is None or parameter is None or gains.inertia_meaning is None:
            return rotor  # what a ratio without a printed unit means, nobody knows (003:711)
        number = float(parameter.to_value(od.number(parameter.key)))
        if gains.inertia_meaning == "ratio_percent":
            return rotor * (1 + number / 100)
        if gains.inertia_meaning == "ratio":
            return rotor * (1 + number)
        total = number / _si_factor(parameter.unit)
        return max(total + (rotor if gains.inertia_meaning == "load" else 0.0), rotor * 0.1)

    def _notches(self, od: ObjectDictionary) -> tuple[Biquad, ...]:
        spec = self._profile.notch
        if spec is None:
            return ()
        found = (self._notch(od, spec.encoding, slot) for slot in spec.slots)
        return tuple(notch for notch in found if notch is not None)[:4]

    def _notch(self, od: ObjectDictionary, encoding: str, slot: NotchSlot) -> Biquad | None:
        def value(key: str | None) -> float:
            parameter = self._profile.by_key.get(key or "")
            return 0.0 if parameter is None else float(parameter.to_value(od.number(parameter.key)))

        if slot.enable_key is not None:
            flags = int(od.number(slot.enable_key))
            on = flags if slot.enable_bit is None else flags >> slot.enable_bit & 1
            if not on:
                return None
        centre, width, depth = (
            value(slot.frequency_key), value(slot.width_key), value(slot.depth_key),
        )  # fmt: skip
        if encoding == "hz_levels":
            # No formula is printed: width level/20 of the centre, depth level in percent of the
            # amplitude that is left (0 is deepest). 4000 Hz switches the notch off.
            if centre >= 4000:
                return None
            width, depth = centre * max(width, 1) / 20, 20 * math.log10(max(depth, 1) / 100)
        elif encoding == "hz_width":
            depth = -40.0
        if not 0 < centre < 0.4 / k.STEP_S or width <= 0:
            return None
        return notch_biquad(centre, width, -abs(depth), k.STEP_S)

    def protections(
        self,
        od: ObjectDictionary,
        motor: MotorData,
        units: Units,  # noqa: ARG002 - the seam's signature
    ) -> ProtectionSettings:
        """The virtual drive's own, refined by the parameters that the family has."""
        base = power.own(motor)
        refine = power.REFINE.get(self.name)
        if refine is not None:
            base = refine(od, motor, base)
        window = self._profile.by_role.get("following_error_window")
        size = od.number("6065:00" if window is None else window.key)
        unlimited = size in (0, 2**32 - 1) and window is not None
        limited = k.F_FOLLOWING in self.traits.faults and not unlimited
        wait_s = od.number("6066:00", 0 if window is not None else 100) * _MS
        return replace(base, following_error_s=wait_s if limited else math.inf)

    def refusal(self, od: ObjectDictionary, mode: int) -> str | None:  # noqa: ARG002 - the seam's
        """EP3E: no mode or one that it has not (001:1538-1547), a gear out of range (001:1035)."""
        if self.name != "ep3e":
            return None
        if mode == 0:
            return "Err88"
        if mode not in self._profile.supported_modes:
            return "Err89"
        return None

    def gear_fault(self, od: ObjectDictionary) -> str | None:
        """EP3E: from 1/1000 to 1000 (001:1035), else Err80."""
        if self.name != "ep3e":
            return None
        parts = [od.number(key) for key in ("608F:01", "6091:01", "6092:02", "6091:02", "6092:01")]
        if 0 in parts:
            return "Err80"
        ratio = parts[0] * parts[1] * parts[2] / (parts[3] * parts[4])
        return None if 1e-3 <= ratio <= 1e3 else "Err80"

    def in_place_s(self, od: ObjectDictionary) -> float:
        """6068h, or the family's own (2502h of the DS_C, 003:577)."""
        return od.number("2502:00" if self.name == "ds_c" else "6068:00", 10) * _MS

    def brake(self, od: ObjectDictionary) -> BrakeTimes | None:
        """Course of the brake, for a motor that has one."""
        course = power.BRAKES.get(self.name)
        return None if course is None else course(od)

    def readings(self, axis: VirtualAxis) -> dict[str, Callable[[], Number]]:
        """Objects that a profile tells by role but that CiA 402 has no number for."""
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
                scale = _volt_factor(parameter.unit) * factor / parameter.scale
                values[parameter.key] = lambda s=state, f=scale: round(item(s) * f)  # type: ignore[misc]
        return values

    def wiring(self, od: ObjectDictionary) -> Wiring:
        """By the functions of the terminals; a family without a table sees all switches."""
        return Wiring() if self.terminals is None else self.terminals.wiring(od)


def _per_rad_s(unit: str, position_per_rad: float) -> float:
    """Raw units per rad/s (or rad/s²) of ``inc/s``, ``rpm``, ``0.1 rpm``, ``rpm/s``."""
    match = re.match(r"\s*([\d.]*)\s*(rpm|r/min)", unit)
    if match is None:
        return position_per_rad
    return 1 / RPM / float(match.group(1) or 1)


def _volt_factor(unit: str) -> float:
    return 1e3 if unit == "mV" else 1.0


def _si_factor(unit: str) -> float:
    """Engineering units per SI unit for the ratings that profiles print."""
    return {
        "mNm": 1e3, "Nm": 1.0, "mA": 1e3, "A": 1.0, "rpm": 1.0, "kg·m²": 1.0, "g·cm²": 1e7,
        "kg·cm²": 1e4, "1e-7 kg·m²": 1e7,
    }.get(unit, 1.0)  # fmt: skip
