"""Data shared by all parts of the firmware: dictionary, axis, family and units."""

from __future__ import annotations

import math

from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.firmware.cia402.base import RPM, Family, Units
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import Number, ObjectDictionary
from drivers.virtual.firmware.rough.rough_feedback import rough_units
from drivers.virtual.firmware.schedule import Schedule
from profiles.schema import Profile

_INT32 = (-(2**31), 2**31 - 1)


class Core:
    """Dictionary and axis with the conversions between user units and SI units.

    ``zero_rad`` is the encoder angle at which the user's position is zero; homing and zeroing move
    it, and like an absolute encoder's zero it survives a power cycle. ``torque_cap_nm`` is a limit
    below those of the parameters (homing against a stop).
    """

    def __init__(
        self, profile: Profile, family: Family, od: ObjectDictionary, axis: VirtualAxis
    ) -> None:
        self.profile = profile
        self.family = family
        self.od = od
        self.axis = axis
        self.motor = axis.motor
        self.zero_rad = 0.0
        self.torque_cap_nm = math.inf
        self.homed = False
        self.units: Units = rough_units(family.units(od, axis.motor), axis.spec.rough_feedback)
        self.schedule = Schedule(axis)
        self._limits = od.cell("607D:01", _INT32[0]), od.cell("607D:02", _INT32[1])
        self._modulo = od.cell("607B:01"), od.cell("607B:02")
        self._swapped_limits = family.traits.positive_limit_first and "607D:01" in od.numbered

    def number(self, key: str, default: Number = 0) -> Number:
        """Return the effective value of a parameter."""
        return self.od.number(key, default)

    def angle_of(self, position: float) -> float:
        """Convert a user position to an encoder angle."""
        return position / self.units.position_per_rad + self.zero_rad

    def position_of(self, angle_rad: float) -> float:
        """Convert an encoder angle to a user position, not rounded."""
        return (angle_rad - self.zero_rad) * self.units.position_per_rad

    def speed_of(self, raw: float) -> float:
        """Convert a user speed to rad/s, with the sign of the polarity."""
        return raw / self.units.speed_per_rad_s

    def speed_at(self, key: str, default: Number = 0) -> float:
        """Return a speed parameter in rad/s; its unit may be rpm (M6-L, 000:2167)."""
        return self.number(key, default) / self.speed_raw_per_rad_s(key)

    def speed_raw_per_rad_s(self, key: str) -> float:
        """Return raw units of a speed object per rad/s, by its own unit if that is rpm."""
        parameter = self.profile.by_key.get(key)
        if parameter is not None and parameter.unit == "rpm":
            return 1.0 / (RPM * parameter.scale)
        return self.units.speed_per_rad_s

    def torque_of(self, raw: float) -> float:
        """Convert ‰ of rated torque to Nm."""
        return raw / self.units.torque_per_nm

    def deceleration(self, key: str) -> float:
        """Return a ramp parameter in rad/s², limited to the largest deceleration 60C6h."""
        if key not in self.od.numbered:
            key = "6084:00"
        braking = self.units.ramp(self.number(key, 3276800))
        limit = self.number("60C6:00")
        return min(braking, self.units.ramp(limit)) if limit else braking

    def acceleration(self, key: str) -> float:
        """Return a ramp parameter in rad/s², limited to the largest acceleration 60C5h."""
        rising = self.units.ramp(self.number(key, 3276800))
        limit = self.number("60C5:00")
        return min(rising, self.units.ramp(limit)) if limit else rising

    def max_speed(self) -> float:
        """Return the largest motor speed 6080h in rad/s."""
        raw = self.number("6080:00")
        return raw / self.units.max_motor_speed_per_rad_s if raw else math.inf

    def max_profile_speed(self) -> float:
        """Return the smaller of 607Fh and 6080h in rad/s."""
        raw = self.number("607F:00")
        profile = abs(self.speed_of(raw)) if raw else math.inf
        return min(profile, self.max_speed())

    def software_limits(self) -> tuple[float, float]:
        """Return 607Dh in user units; equal or crossed limits mean none (CiA 402-2)."""
        choice = self.family.traits.software_limits
        if choice is not None and choice[0] in self.od.numbered:
            way = choice[1].get(int(self.number(choice[0])), "off")
            if way == "off" or (way == "homed" and not self.homed):
                return _INT32
        low, high = self._limits[0].active, self._limits[1].active
        if self._swapped_limits:
            low, high = high, low
        return (low, high) if low < high else _INT32

    def modulo(self) -> tuple[float, float] | None:
        """Return lower end and span of the position range 607Bh; None without a valid range.

        The printed defaults are the whole 32-bit range (004:7210-7225).
        """
        low, high = self._modulo[0].active, self._modulo[1].active
        span = high - low
        return (low, span) if 0 < span < 2**32 - 1 else None

    def shown_position(self, angle_rad: float) -> float:
        """Return the user position inside the modulo range, if there is one (004:2085-2098)."""
        position = self.position_of(angle_rad)
        modulo = self.modulo()
        if modulo is None:
            return position
        low, span = modulo
        return low + (position - low) % span

    def modulo_target(self, target: float, base: float) -> float:
        """Return the goal for ``target`` from unwrapped position ``base`` (table 24,
        004:2104-2157).

        Bits 7 and 6 of 60F2h: 0 as a linear axis, 1 negative only, 2 positive only, 3 shortest.
        """
        modulo = self.modulo()
        if modulo is None:
            return target
        low, span = modulo
        here, wanted = (base - low) % span, (target - low) % span
        way = int(self.number("60F2:00")) >> 6 & 3
        if way == 0:
            return base + wanted - here
        forwards = (wanted - here) % span
        if way == 1:
            return base + (forwards - span if forwards else 0.0)
        if way == 2 or forwards <= span / 2:
            return base + forwards
        return base + forwards - span

    def apply_settings(self) -> None:
        """Apply parameters that act through the loops."""
        od, motor = self.od, self.motor
        self.units = rough_units(self.family.units(od, motor), self.axis.spec.rough_feedback)
        self.axis.apply_loops(self.family.loops(od, self.profile, motor, self.units))
        self.axis.apply_protections(self.family.protections(od, motor, self.units))
        wiring = self.family.wiring(od)
        self.axis.set_signals(
            forced=wiring.forced, forced_on=wiring.forced_on, inverted=wiring.inverted
        )
        self.apply_motion()

    def _own_torque_limits(self) -> tuple[float, float]:
        """Return the family's own limits, ‰ of the rated torque."""
        keys = self.family.traits.torque_limits
        if keys is None or any(key not in self.profile.by_key for key in keys):
            return (math.inf, math.inf)
        first, second = (
            abs(float(self.profile.by_key[key].to_value(self.number(key)))) * 10 for key in keys
        )
        return (first, second)

    def _zero_speed(self) -> float:
        """Return 606Fh or the family's own threshold (R6L P04.11, EP3E P160); default 10 rpm."""
        key = self.family.traits.zero_speed_key
        speed = self.number(key) * RPM if key is not None else abs(self.speed_at("606F:00"))
        return speed or 10 * RPM

    def limit_mode(self) -> float:
        """Return the action of a limit switch outside a search (LIMIT_*)."""
        limits = self.family.traits.limits
        action = limits.action
        if limits.choice is not None:
            chosen = int(self.number(limits.choice.key, -1))
            action = limits.choice.actions.get(chosen, limits.choice.default)
        return float(k.LIMIT_FAULT if action == "fault" else k.LIMIT_HOLDS)

    def apply_motion(self) -> None:
        """Apply windows and limits of the motion objects, which act at once."""
        per_rad = abs(self.units.position_per_rad)
        window = self.profile.by_role.get("following_error_window")
        following = self.number("6065:00" if window is None else window.key, 2**32 - 1)
        if window is None and "6065:00" not in self.od.numbered:
            following = per_rad * 2 * math.pi  # no parameter: one revolution
        in_place = "2501:00" if "2501:00" in self.od.numbered else "6067:00"
        self.axis.apply_windows(
            self.number(in_place) / per_rad,
            abs(self.speed_at("606D:00")),
            self._zero_speed(),
            math.inf if following == 2**32 - 1 else following / per_rad,
        )
        self.axis.p[k.P_LIMIT_DEC] = self.deceleration(self.family.traits.stops.quick_ramp_key)
        largest = min(self.number("6072:00", 3000), self.number("6073:00", 3000))
        positive, negative = (
            min(self.torque_of(min(largest, self.number(key, 3000), own)), self.torque_cap_nm)
            for key, own in zip(("60E0:00", "60E1:00"), self._own_torque_limits(), strict=True)
        )
        self.axis.set_limits(positive, negative, self.max_speed())
