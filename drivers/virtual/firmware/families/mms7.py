"""EZmotion MMS7xxxxBE: bandwidth gains, coefficient notches, protections of 200Bh and 2042h."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.firmware.cia402.base import (
    RPM,
    BrakeTimes,
    FaultInfo,
    LimitSwitches,
    Stops,
    Traits,
    Units,
    Wiring,
    inertia_kgm2,
)
from drivers.virtual.firmware.cia402.keys import TorqueHoming
from drivers.virtual.firmware.cia402.terminals import TerminalTable
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import Number, ObjectDictionary
from drivers.virtual.firmware.objects.settings import (
    Biquad,
    GainSet,
    LoopSettings,
    MotorData,
    ProtectionSettings,
    Switching,
)
from drivers.virtual.mechanics import MechanicsSpec
from profiles.schema import Profile, Raw, StiffnessTable

if TYPE_CHECKING:
    from drivers.virtual.firmware.objects.monitors import Sources

TWO_PI = 2 * math.pi
_SIGNAL_OF_FUNCTION = {1: k.SIG_NEGATIVE, 2: k.SIG_POSITIVE, 3: k.SIG_HOME}  # 004:6476-6509


class Mms7:
    """See `drivers.virtual.firmware.cia402.base.Family`."""

    name = "mms7"
    supply_v: float | None = None
    terminals: TerminalTable | None = None
    traits = Traits(
        # Bit 5 is "not used" and bit 4 alone takes a new target (004:3748-3752).
        buffered_setpoints=False,
        # Table 29, 004:2390-2403.
        commands={
            "200D:00": {
                0x65766173: "save",
                0x64616F6C: "restore",
                0x686F6F6D: "zero",
                0x11111120: "clear_history",
                0x626E6E74: "reset",
                0xAAB555AA: "write_settings",
            }
        },
        limits=LimitSwitches(action="fault"),
        stops=Stops(torque_key="2002:05"),
        error_status_key="200B:0B",
        torque_homing=TorqueHoming(
            {-3: (-1, False), -2: (1, False)}, "2070:01", "2070:02"
        ),  # 004:3840
        assigns_terminals=True,
        # Codes 004:4705-4917; fixed reactions 004:4951-4955.
        faults={
            k.F_OVER_CURRENT: FaultInfo(0x2300, fixed=True, error_register=0x03, fault="0x2300"),
            k.F_UNDER_VOLTAGE: FaultInfo(0x3220, error_register=0x05, fault="0x3220"),
            k.F_LOCKED: FaultInfo(0x7121, fault="0x7121"),
            k.F_POWER_STAGE: FaultInfo(0x5400, fixed=True, fault="0x5400"),
            k.F_OVERLOAD: FaultInfo(0x3230, fault="0x3230"),
            k.F_POSITION_LIMIT: FaultInfo(0, fault="POS_LIMIT"),
            k.F_SENSOR: FaultInfo(0, fixed=True, fault="SENSOR_ERR"),
            k.F_MEMORY: FaultInfo(0, fault="MEM_ERR"),
            k.F_OVER_TEMPERATURE: FaultInfo(
                0x4210, fixed=True, error_register=0x09, fault="0x4210"
            ),
            k.F_OVER_VOLTAGE: FaultInfo(0x3210, error_register=0x05, fault="0x3210"),
            k.F_OVER_SPEED: FaultInfo(0x8400, fixed=True, fault="0x8400"),
            k.F_SPEED_ERROR: FaultInfo(0x8401, fixed=True, fault="0x8401"),
            k.F_WATCHDOG: FaultInfo(0x7500, error_register=0x11, fault="0x7500"),
        },
    )

    def factory_values(self, spec: MechanicsSpec, motor: MotorData) -> dict[str, Raw]:
        """Return motor data (2001h) and ratings; inertia is the rotor's until it is identified."""
        return {
            "2001:01": round(motor.resistance_ohm * 1e3),
            "2001:02": round(motor.inductance_h * 1e6),
            "2001:03": round(motor.inductance_h * 1e6),
            "2001:04": motor.pole_pairs,
            "2001:05": round(motor.torque_constant * 1e3),
            "2001:06": round(spec.motor.inertia_kgm2 * 1e7),
            "2001:07": round(spec.supply.voltage_v * 1e3),
            "2001:08": round(motor.rated_current_a * 1e3),
            "2001:09": round(spec.motor.rated_speed_rpm),
        }

    def fallback_values(self, motor: MotorData) -> dict[str, Raw]:  # noqa: ARG002 - the seam's
        """Return none: all relevant parameters have a printed default."""
        return {}

    def units(self, od: ObjectDictionary, motor: MotorData) -> Units:
        """Apply gear ratio and feed constant (004:1853-1948) and polarity (004:7261-7272)."""
        feed = od.number("6092:01", 65536) / max(od.number("6092:02", 1), 1)
        gear = od.number("6091:01", 1) / max(od.number("6091:02", 1), 1)
        per_rad = max(feed, 1) / (gear or 1) / TWO_PI
        polarity = int(od.number("607E:00"))
        speed_sign = -1.0 if polarity & 0x40 else 1.0
        return Units(
            position_per_rad=per_rad * (-1.0 if polarity & 0x80 else 1.0),
            speed_per_rad_s=per_rad * speed_sign,
            acceleration_per_rad_s2=per_rad,
            torque_per_nm=1000.0 / motor.rated_torque_nm,
        )

    def loops(
        self, od: ObjectDictionary, profile: Profile, motor: MotorData, units: Units
    ) -> LoopSettings:
        """Read 2001h, 2003h to 2008h; see the sections of 004:2847-3511."""
        number = od.number
        inertia = inertia_kgm2(od, "2001:06", 1e-5)
        feed_forward = int(number("2004:01"))
        position_limit = number("2005:06", 3000)
        in_rpm = "rpm" in profile.by_key["2005:06"].unit if "2005:06" in profile.by_key else True
        rated = motor.rated_torque_nm
        return LoopSettings(
            first=self._gains(od, profile, inertia, ("2005:01", "2005:03", "2005:04"), 0),
            second=self._gains(od, profile, inertia, ("2005:02", "2005:0C", "2005:0D"), 1),
            homing=_bandwidth_gains(
                number("2005:13"), number("2005:14"), number("2005:15"), inertia
            )
            if number("2005:12") == 1
            else None,
            switching=Switching(
                k.SWITCH_SMALL_ERROR if number("2005:09") == 1 else k.SWITCH_OFF,
                level=number("2005:0A") / abs(units.position_per_rad),
                ramp_s=number("2005:0B", 1) * 1e-3,
            ),
            current_loop_hz=max(number("2005:05", 10000), 1) * 0.1,
            speed_feed_forward=number("2004:06", 100) / 100 if feed_forward & 4 else 0.0,
            speed_feed_forward_s=number("2004:07") * 1e-4,
            torque_feed_forward=number("2004:04", 100) / 100 if feed_forward & 2 else 0.0,
            torque_feed_forward_s=number("2004:05") * 1e-4,
            position_filter_hz=max(number("2007:01", 2000), 1) * 0.1,
            speed_filter_hz=max(number("2007:02", 10000), 1) * 0.1,
            observer_hz=max(number("2007:05", 10000), 1) * 0.1,
            use_observer=number("2003:06") == 1,
            inertia_kgm2=inertia,
            viscous_nms=number("2001:0A") * 1e-6,
            coulomb_nm=number("2001:0B") * 1e-3,
            notches=self._notches(od),
            speed_output_nm=number("2005:07", 3000) / 1000 * rated,
            position_output_rad_s=position_limit * RPM
            if in_rpm
            else position_limit / abs(units.speed_per_rad_s),
            torque_mode_speed_rad_s=number("2005:08", 3000) * RPM,
            brake_speed_rad_s=max(number("2002:06", 10), 1) * RPM,
            brake_torque_nm=number("2002:05", 200) / 1000 * rated,
        )

    @staticmethod
    def _gains(
        od: ObjectDictionary,
        profile: Profile,
        inertia: float,
        keys: tuple[str, str, str],
        table_index: int,
    ) -> GainSet:
        """Return manual gains, or a row of the stiffness table (table 38, 004:3001-3034)."""
        values = [float(od.number(key)) for key in keys]
        mode, level = (("2005:0E", "2005:0F"), ("2005:10", "2005:11"))[table_index]
        if od.number(mode) == 1 and profile.stiffness:
            table = profile.stiffness[min(table_index, len(profile.stiffness) - 1)]
            row = table.rows.get(int(od.number(level)))
            if row is not None:
                values = _raw_row(profile, table, row)
        return _bandwidth_gains(values[0], values[1], values[2], inertia)

    @staticmethod
    def _notches(od: ObjectDictionary) -> tuple[Biquad, ...]:
        """Read coefficients stored as round(c × 10000) + 32768 (004:3494-3499)."""
        enabled = int(od.number("2008:01"))
        notches = []
        for slot in range(4):
            if enabled >> slot & 1:
                first = 2 + 4 * slot
                raw = [od.number(f"2008:{first + i:02X}") for i in range(4)]
                a1, a2, b1, b2 = ((value - 32768) / 10000 for value in raw)
                notches.append(Biquad(a1, a2, b1, b2))
        return tuple(notches)

    def protections(
        self, od: ObjectDictionary, motor: MotorData, units: Units
    ) -> ProtectionSettings:
        """Return the protections.

        The enable bits (004:6177-6187) apply to the protections they name; others are always
        active.
        """
        number, off = od.number, math.inf
        enabled = int(number("200B:01"))
        upper = number("200B:09", 56)
        return ProtectionSettings(
            over_current_a=number("200B:02", 20) if enabled & 1 else off,
            under_voltage_v=number("200B:03", 12) if enabled & 2 else 0.0,
            over_voltage_v=upper + 1.0,
            brake_on_v=upper,
            brake_off_v=number("200B:0A", 52),
            brake_enabled=bool(enabled & 8),
            locked_angle_rad=number("200B:04", 182) / abs(units.position_per_rad),
            locked_s=number("200B:06", 1000) * 1e-3 if enabled & 4 else off,
            overload_nm=number("2042:02", 3000) / 1000 * motor.rated_torque_nm,
            overload_s=number("2042:03", 1000) * 1e-3 if number("2042:01") else off,
            over_temperature_c=number("2041:00", 85) if enabled & 16 else off,
            over_speed_rad_s=number("200B:0C", 3600) * RPM,
            speed_error_rad_s=number("200B:0D", 1000) * RPM,
            speed_error_s=number("200B:0E", 10) * 1e-3,
            holding_brake=number("2108:01") == 1,
        )

    def refusal(self, od: ObjectDictionary, mode: int) -> str | None:  # noqa: ARG002 - the seam's
        """Return None: nothing is refused."""
        return None

    def gear_fault(self, od: ObjectDictionary) -> str | None:  # noqa: ARG002 - the seam's
        """Return None: no such fault is printed."""
        return None

    def in_place_s(self, od: ObjectDictionary) -> float:
        """Return the time in 6068h [s]."""
        return od.number("6068:00", 10) * 1e-3

    def brake(self, od: ObjectDictionary) -> BrakeTimes | None:  # noqa: ARG002 - the seam's
        """Return None: the brake follows the power stage; no times are printed (004:2604)."""
        return None

    def readings(self, axis: VirtualAxis) -> dict[str, Callable[[], Number]]:
        """Return servo internal information 200Eh and temperature (004:6407-6469, 004:6580)."""
        item = axis.s.item
        inc_per_rad = 65536 / TWO_PI
        return {
            "200E:01": lambda: 0,
            "200E:02": lambda: round(item(k.S_CURRENT) * 1e3),
            "200E:03": lambda: 0,
            "200E:04": lambda: round(item(k.S_UQ) * 1e3),
            "200E:05": lambda: round(item(k.S_TORQUE) * 1e3),
            "200E:06": lambda: round(item(k.S_THETA) * inc_per_rad),
            "200E:07": lambda: round(item(k.S_THETA_FILTERED) * inc_per_rad),
            "200E:09": lambda: round(item(k.S_OMEGA) * inc_per_rad),
            "200E:0B": lambda: round(item(k.S_LOAD_RATIO) * 1000),
            "200E:0C": lambda: round(item(k.S_BRAKE_DUTY) * 100),
            "2040:00": lambda: round(item(k.S_TEMPERATURE)),
        }

    def monitors(self, sources: Sources) -> dict[str, Callable[[], float]]:  # noqa: ARG002
        """Return none: all of them are in `readings`."""
        return {}

    def wiring(self, od: ObjectDictionary) -> Wiring:
        """Apply terminal functions 2030h, polarity and simulation 2031h (004:6470-6579).

        The virtual switches have normally closed contacts, the printed default: a polarity of
        normally open inverts their meaning.
        """
        forced, forced_on, inverted = k.SIG_NEGATIVE | k.SIG_POSITIVE | k.SIG_HOME, 0, 0
        polarity = int(od.number("2031:01"))
        simulated, values = int(od.number("2031:02")), int(od.number("2031:03"))
        for terminal in range(4):
            signal = _SIGNAL_OF_FUNCTION.get(int(od.number(f"2030:{terminal + 1:02X}")))
            if signal is None:
                continue
            if simulated >> terminal & 1:
                forced_on |= signal if values >> terminal & 1 else 0
            else:
                forced &= ~signal
                inverted |= signal if polarity >> terminal & 1 else 0
        return Wiring(forced=forced, forced_on=forced_on & forced, inverted=inverted)


def _raw_row(profile: Profile, table: StiffnessTable, row: tuple[float, ...]) -> list[float]:
    """Return a row in raw values; with ``column_units`` it is printed in engineering values."""
    if not table.column_units:
        return list(row)
    return [
        float(profile.by_key[key].to_raw(value))
        for key, value in zip(table.columns, row, strict=True)
    ]


def _bandwidth_gains(
    position: float, speed: float, integral: float, inertia_kgm2: float
) -> GainSet:
    """Convert bandwidths in 0.1 Hz to gains: the crossover of the rigid plant 1/(J·s)."""
    kp = inertia_kgm2 * TWO_PI * speed * 0.1
    return GainSet(TWO_PI * position * 0.1, kp, kp * TWO_PI * integral * 0.1)


def family(profile: Profile) -> Mms7:  # noqa: ARG001 - all of it stands here
    """Return the family."""
    return Mms7()
