"""Gains, filters, switching and compensations of a family, from its parameters to SI units."""

from __future__ import annotations

import math

from drivers.virtual.firmware.cia402.base import RPM, Traits, Units
from drivers.virtual.firmware.cia402.conversions import MS, TWO_PI, si_factor
from drivers.virtual.firmware.cia402.keys import GainKeys
from drivers.virtual.firmware.cia402.notches import notches_of
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import ObjectDictionary
from drivers.virtual.firmware.objects.settings import (
    Compensation,
    GainSet,
    LoopSettings,
    MotorData,
    QuadrantCompensation,
    SwingFilter,
    Switching,
    ThirdGains,
)
from profiles.schema import Profile

UNIT_GAIN = 100
"""Start value of a gain for which the manual prints neither unit nor default."""


class LoopReader:
    """Reads the loop settings of one drive from its present parameters."""

    def __init__(
        self,
        profile: Profile,
        traits: Traits,
        od: ObjectDictionary,
        motor: MotorData,
        units: Units,
    ) -> None:
        self._profile = profile
        self._traits = traits
        self._od = od
        self._motor = motor
        self._units = units

    def settings(self) -> LoopSettings:
        """Return gains by the profile's convention; default: 40 Hz speed, 40 /s position loop."""
        inertia = self._inertia()
        gains = self._profile.gains
        first = GainKeys()
        current_hz = 1000.0
        if gains is not None:
            first = GainKeys(gains.position, gains.speed, gains.integral, gains.torque_filter)
            current_hz = self._value(gains.current_bandwidth, current_hz)
        second = self._traits.second_gains or first
        speed_ff, speed_ff_s, torque_ff, torque_ff_s = self._feed_forward()
        rated = self._motor.rated_torque_nm
        return LoopSettings(
            first=self._gain_set(first, inertia),
            second=self._gain_set(second, inertia),
            homing=None,
            switching=self._switching(),
            compensation=self._compensation(),
            third=self._third(inertia),
            swing=self._swing(),
            quadrant=self._quadrant(),
            current_loop_hz=current_hz if current_hz >= 100.0 else 1000.0,
            inertia_kgm2=inertia,
            torque_filter_s=self._value(first.torque_filter, 0.0) * MS,
            torque_filter_2_s=self._value(second.torque_filter, 0.0) * MS,
            speed_feed_forward=speed_ff,
            speed_feed_forward_s=speed_ff_s,
            torque_feed_forward=torque_ff,
            torque_feed_forward_s=torque_ff_s,
            speed_filter_hz=self._speed_filter(),
            notches=notches_of(self._profile, self._od),
            speed_output_nm=3.0 * rated,
            torque_mode_speed_rad_s=self._torque_mode_speed(),
            brake_speed_rad_s=10 * RPM,
            brake_torque_nm=rated,
        )

    def _value(self, key: str | None, default: float) -> float:
        """Return a parameter in its engineering unit; the default if it is 0 or missing."""
        parameter = self._profile.by_key.get(key or "")
        if parameter is None or key is None:
            return default
        return float(parameter.to_value(self._od.number(key))) or default

    def _gain_set(self, keys: GainKeys, inertia: float) -> GainSet:
        """Return gains; 40 Hz speed loop, 20 ms and 40 /s where a family has no such parameter."""
        gains = self._profile.gains
        hertz, integral_ms, position = 40.0, 20.0, 40.0
        if gains is not None and gains.convention == "unit":
            # No physical meaning is printed: the default values are treated as the moderate gains
            # above, and all others in proportion.
            hertz *= self._share(keys.speed)
            integral_ms /= self._share(keys.integral)
            position *= self._share(keys.position)
        elif gains is not None:
            hertz = self._value(keys.speed, hertz)
            integral_ms = self._value(keys.integral, integral_ms)
            position = self._value(keys.position, position)
            parameter = self._profile.by_key.get(keys.position or "")
            unit = parameter.unit if parameter is not None else ""
            if "Hz" in unit or gains.convention == "bandwidth":
                position *= TWO_PI
        kp = TWO_PI * hertz * inertia
        return GainSet(position, kp, kp / (integral_ms * MS))

    def _switching(self) -> Switching:
        keys = self._traits.switching
        if keys is None:
            return Switching()
        mode = int(self._od.number(keys.mode))
        if mode in keys.always_raw:
            return Switching(k.SWITCH_SMALL_ERROR, level=math.inf)
        kind = keys.kinds.get(int(self._od.number(keys.condition or "")), k.SWITCH_OFF)
        if mode not in keys.on_raw or kind == k.SWITCH_OFF:
            return Switching()
        unit = {
            k.SWITCH_TORQUE: 0.01 * self._motor.rated_torque_nm,
            k.SWITCH_ACCELERATION: 10 * RPM,
            k.SWITCH_ERROR: 1 / abs(self._units.position_per_rad),
        }.get(kind, RPM)
        return Switching(
            kind,
            level=self._value(keys.level, 0.0) * unit,
            hysteresis=self._value(keys.hysteresis, 0.0) * unit,
            delay_s=self._value(keys.delay, 0.0) * MS,
            ramp_s=max(self._value(keys.ramp, 0.0) * MS, k.STEP_S),
        )

    def _compensation(self) -> Compensation:
        keys = self._traits.compensation
        if keys is None:
            return Compensation()
        percent = 0.01 * self._motor.rated_torque_nm
        return Compensation(
            bias_nm=self._value(keys.bias, 0.0) * percent,
            positive_nm=self._value(keys.positive, 0.0) * percent,
            # R6L prints the reverse value with a sign of its own (002:11348), M6-L without.
            negative_nm=abs(self._value(keys.negative, 0.0)) * percent,
            viscous_nms=self._value(keys.viscous, 0.0) * percent * keys.viscous_per_rpm / RPM,
        )

    def _third(self, inertia: float) -> ThirdGains | None:
        """Return gains at standstill while gain switching is on (R6L, P06.06-P06.08, P06.56)."""
        keys, switching = self._traits.third_gains, self._traits.switching
        if keys is None or switching is None or switching.third_delay is None:
            return None
        if int(self._od.number(switching.mode)) not in switching.on_raw:
            return None
        delay_s = self._value(switching.third_delay, 0.0) * MS
        return ThirdGains(self._gain_set(keys, inertia), delay_s)

    def _swing(self) -> SwingFilter | None:
        """Return the notch of the position command against a load oscillation; 0 Hz is off."""
        keys = self._traits.swing
        hertz = 0.0 if keys is None else self._value(keys.frequency, 0.0)
        if keys is None or hertz <= 0.0:
            return None
        return SwingFilter(hertz, 0.5 + 0.05 * self._value(keys.width, 0.0))

    def _quadrant(self) -> QuadrantCompensation:
        keys = self._traits.quadrant
        if keys is None:
            return QuadrantCompensation()
        percent = 0.01 * self._motor.rated_torque_nm
        travel = self._value(keys.travel, 0.0) / abs(self._units.position_per_rad)
        return QuadrantCompensation(
            positive_nm=self._value(keys.positive, 0.0) * percent,
            negative_nm=self._value(keys.negative, 0.0) * percent,
            delay_s=self._value(keys.delay, 0.0) * MS,
            filter_s=self._value(keys.filter, 0.0) * MS,
            angle_rad=travel,
        )

    def _speed_filter(self) -> float:
        """Return the corner frequency of the speed feedback's low-pass [Hz]."""
        if self._traits.speed_filter is None:
            return 1000.0
        key, unit = self._traits.speed_filter
        number = self._value(key, 0.0)
        if number <= 0:
            return 1000.0
        return number if unit == "Hz" else 1.0 / (TWO_PI * number * MS)

    def _feed_forward(self) -> tuple[float, float, float, float]:
        """Return shares and time constants [s] of speed and torque feed-forward."""
        keys = self._traits.feed_forward
        if keys is None:
            return (0.0, 0.0, 0.0, 0.0)

        def value(key: str | None, per_unit: float) -> float:
            return self._value(key, 0.0) * per_unit

        def selected(key: str | None) -> bool:
            return key is None or self._od.number(key) == 1

        return (
            value(keys.speed_gain, 0.01) if selected(keys.speed_select) else 0.0,
            value(keys.speed_filter, MS),
            value(keys.torque_gain, 0.01) if selected(keys.torque_select) else 0.0,
            value(keys.torque_filter, MS),
        )

    def _share(self, key: str | None) -> float:
        """Return a gain without a unit, relative to its start value."""
        parameter = self._profile.by_key.get(key or "")
        if parameter is None:
            return 1.0
        printed = parameter.default_raw
        start = float(printed) if isinstance(printed, (int, float)) and printed else UNIT_GAIN
        return max(float(self._od.number(parameter.key)), 1e-3 * start) / start

    def _torque_mode_speed(self) -> float:
        key = self._traits.torque_speed_limit_key
        rpm = self._od.number(key) if key is not None else 0
        return rpm * RPM if rpm else 1.2 * self._motor.rated_speed_rad_s

    def _inertia(self) -> float:
        gains = self._profile.gains
        rotor = self._motor.rotor_inertia_kgm2
        parameter = self._profile.by_key.get(gains.inertia or "") if gains else None
        if gains is None or parameter is None or gains.inertia_meaning is None:
            return rotor  # the meaning of a ratio without a printed unit is unknown (003:711)
        number = float(parameter.to_value(self._od.number(parameter.key)))
        if gains.inertia_meaning == "ratio_percent":
            return rotor * (1 + number / 100)
        if gains.inertia_meaning == "ratio":
            return rotor * (1 + number)
        total = number / si_factor(parameter.unit)
        return max(total + (rotor if gains.inertia_meaning == "load" else 0.0), rotor * 0.1)
