"""Rtelligent R6L (manual 002)."""

from __future__ import annotations

import math
from dataclasses import replace

from drivers.virtual.firmware.cia402.base import (
    RPM,
    Autosave,
    BrakeTimes,
    LimitSwitches,
    OffStop,
    Stops,
    Traits,
)
from drivers.virtual.firmware.cia402.conversions import MS
from drivers.virtual.firmware.cia402.keys import (
    CompensationKeys,
    FeedForward,
    FoundNotchKeys,
    GainKeys,
    JogKeys,
    LoadKeys,
    RigidityKeys,
    SwitchKeys,
)
from drivers.virtual.firmware.cia402.power import I2T_S, MAINS_V
from drivers.virtual.firmware.cia402.standard import Cia402
from drivers.virtual.firmware.cia402.states import State
from drivers.virtual.firmware.cia402.terminals import Input, Logic, Output, TerminalTable
from drivers.virtual.firmware.control import DeviceControl
from drivers.virtual.firmware.failures.alarms import Record
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import ObjectDictionary
from drivers.virtual.firmware.objects.monitors import Sources, Value
from drivers.virtual.firmware.objects.settings import MotorData, ProtectionSettings
from profiles.schema import Profile, Raw

#: P06.51 (002:10800); units of the levels are assumed as for the M6-L.
_CONDITIONS = {
    1: k.SWITCH_INPUT,
    2: k.SWITCH_TORQUE,
    3: k.SWITCH_SPEED_DEMAND,
    4: k.SWITCH_ACCELERATION,
    5: k.SWITCH_SPEED_DEMAND,
    6: k.SWITCH_ERROR,
    7: k.SWITCH_COMMANDED,
    8: k.SWITCH_UNFINISHED,
    9: k.SWITCH_SPEED,
    10: k.SWITCH_COMMANDED_OR_FAST,
    11: k.SWITCH_COMMANDED_OR_FAST,
}

#: P01.06 (002:8147), P01.08 (002:8193), P01.09 (002:8220).
_OFF: dict[int, OffStop] = {
    0: ("coast", "free"),
    1: ("ramp", "hold"),
    2: ("coast", "dynamic"),
    3: ("dynamic", "dynamic"),
    4: ("ramp", "dynamic"),
}

_SECOND: dict[int, OffStop] = {
    0: ("coast", "free"),
    1: ("coast", "dynamic"),
    2: ("dynamic", "dynamic"),
    3: ("ramp", "free"),
    4: ("ramp", "dynamic"),
    5: ("dynamic", "free"),
}

_FIRST: dict[int, OffStop] = {
    0: ("coast", "free"),
    1: ("coast", "dynamic"),
    2: ("dynamic", "dynamic"),
    5: ("dynamic", "free"),
}

#: Rtelligent R6L: 200Ch (002:11782 on); indices enabled by 2008h:0C are stored when written;
#: feed-forward in 2006h (002:10669-10705). The position at home is the home offset (002:4344).
#: 605Ah and 605Dh are printed without meanings (002:12828): those of CiA 402-2, current limit by
#: P05.50. Which of its alarms an EtherCAT watchdog raises is not printed: AL.293 is assumed.
TRAITS = Traits(
    commands={
        "200C:01": {1: "restore", 2: "clear_history"},
        "200C:06": {1: "clear_encoder_fault", 2: "clear_encoder_fault"},
        "200C:08": {1: "reset"},
        "200C:09": {1: "fault_reset"},
        "200C:0C": {1: "identify"},
    },
    autosave=(
        Autosave("2008:0C", 2, 0x2000, 0x2FFF),
        Autosave("2008:0C", 4, 0x6000, 0x6FFF),
    ),
    limit_bits_swapped=True,
    torque_limits=("2005:09", "2005:0A"),
    zero_speed_key="2004:0C",
    home_found_bit=15,
    home_offset="at_home",
    feed_forward=FeedForward(
        speed_gain="2006:10",
        speed_filter="2006:0F",
        torque_gain="2006:12",
        torque_filter="2006:11",
        speed_select="2004:10",
        torque_select="2005:2D",
    ),
    protections={
        k.F_OVER_CURRENT: "AL.111",
        k.F_UNDER_VOLTAGE: "AL.211",
        k.F_LOCKED: "AL.247",
        k.F_POWER_STAGE: "AL.110",
        k.F_OVERLOAD: "AL.245",
        k.F_SENSOR: "AL.121",
        k.F_MEMORY: "AL.102",
        k.F_OVER_TEMPERATURE: "AL.248",
        k.F_OVER_VOLTAGE: "AL.210",
        k.F_OVER_SPEED: "AL.225",
        k.F_WATCHDOG: "AL.293",
        k.F_FOLLOWING: "AL.240",
    },
    limits=LimitSwitches(warnings=("AL.481", "AL.480")),
    stops=Stops(
        torque_key="2005:33",
        off=("2001:07", _OFF),
        first=("2001:0A", _FIRST),
        second=("2001:09", _SECOND),
        emergency=(None, {0: -2}),
    ),
    second_gains=GainKeys("2006:06", "2006:04", "2006:05", "2005:32"),
    switching=SwitchKeys(
        mode="2006:33",
        on_raw=(1,),
        condition="2006:34",
        kinds=_CONDITIONS,
        level="2006:36",
        hysteresis="2006:37",
        delay="2006:35",
        ramp="2006:38",
        third_delay="2006:39",
    ),
    jog=JogKeys("2004:05", "2004:06", "2004:07", trigger="200C:0B"),
    third_gains=GainKeys("2006:09", "2006:07", "2006:08"),
    compensation=CompensationKeys(bias="2007:1F", positive="2007:20", negative="2007:21"),
    speed_filter=("2006:15", "Hz"),
    history_size=10,
    homing_alarms=("AL.420", ""),
    software_limits=("2001:36", {0: "off", 1: "on", 2: "homed"}),
    emergency_warning="AL.440",
    rigidity=RigidityKeys(
        "2007:01", "2007:02", ("2006:03", "2006:01", "2006:02"), ("2006:06", "2006:04", "2006:05")
    ),
    found_notches=FoundNotchKeys(
        "2007:0C", (("2007:13", "2007:14"), ("2007:16", "2007:17")), 4000, 4, {1: 1, 2: 2}, 4
    ),
    load_identification=LoadKeys(
        "2007:07",
        "2007:08",
        "2007:09",
        "2006:0D",
        100.0,
        "200C:0C",
        revolutions="2007:0A",
        fault="AL.273",
    ),
)

TERMINALS = TerminalTable(
    inputs=tuple(
        Input(f"DI{n + 1}", 16 + n, f"2002:{2 * n + 1:02X}", Logic(f"2002:{2 * n + 2:02X}"))
        for n in range(8)
    ),
    outputs=tuple(
        Output(f"DO{n + 1}", 16 + n, f"2002:{0x21 + 2 * n:02X}", Logic(f"2002:{0x22 + 2 * n:02X}"))
        for n in range(4)
    ),
    input_uses={
        2: "reset",
        5: "positive_limit",
        6: "negative_limit",
        7: "gain",
        11: "emergency",
        23: "home",
        30: "probe1",
        31: "probe2",
        39: "jog_forward",
        40: "jog_backward",
    },
    output_uses={0: "brake", 1: "fault", 2: "in_position", 6: "homed", 31: "bus"},
    inputs_key="200D:14",
    outputs_key="200D:15",
    bus_outputs_need_function=True,  # the note at 002:14003
)


class R6l(Cia402):
    """Behaviour of these drives in addition to their profile."""

    TRAITS = TRAITS
    TERMINALS = TERMINALS
    supply_v = MAINS_V

    def fallback_values(self, motor: MotorData) -> dict[str, Raw]:
        """Add the highest speed of the motor."""
        highest_rpm = round(1.2 * motor.rated_speed_rad_s / RPM)
        return super().fallback_values(motor) | {"2000:16": highest_rpm}

    def refined(
        self, od: ObjectDictionary, motor: MotorData, base: ProtectionSettings
    ) -> ProtectionSettings:
        """Apply P01.24 to P01.27, P01.48, P01.49, P01.57 to P01.61, P01.80, P01.82 and P00.21."""
        resistor = int(od.number("2001:19", 1))
        limit = min(od.number("60E0:00", 3000), od.number("6072:00", 3000), 3000) / 1000
        own_level = od.number("2001:53", 2400) / 1000
        stall = {1: limit, 2: own_level, 3: max(limit, own_level)}.get(int(od.number("2001:3B", 1)))
        on_v = float(od.number("2001:1C", 380))
        fastest = float(od.number("2000:16"))
        return replace(
            base,
            over_voltage_v=float(od.number("2001:31", 420)),
            under_voltage_v=float(od.number("2001:32", 200)),
            brake_on_v=on_v,
            brake_off_v=0.97 * on_v,
            brake_enabled=resistor != 2,
            # 50 Ω built in (002:242), or P01.26 for an external one.
            braking_ohm=50.0 if resistor == 0 else max(float(od.number("2001:1B", 50)), 1.0),
            over_speed_rad_s=(fastest or 1.2 * motor.rated_speed_rad_s / RPM) * RPM
            if not od.number("2001:51")
            else math.inf,
            i2t_s=I2T_S if int(od.number("2001:3E", 3)) & 1 else math.inf,
            i2t_rated_nm=max(od.number("2001:3C", 100), 40) / 100 * motor.rated_torque_nm,
            locked_s=od.number("2001:3A", 200) * MS if stall is not None else math.inf,
            # Slightly below, so that a torque at its limit counts.
            locked_nm=0.99 * (stall or 0.0) * motor.rated_torque_nm,
            locked_angle_rad=0.02,
        )

    def brake(self, od: ObjectDictionary) -> BrakeTimes | None:
        """Return the brake times (002:8117-8273); None if no output has function 0.

        The times are in P01.04, P01.05 and P01.11 to P01.13.
        """
        if all(od.number(f"2002:{sub:02X}", -1) != 0 for sub in (0x21, 0x23, 0x25, 0x27)):
            return None
        hold = od.number("2001:0E", 200) * MS
        return BrakeTimes(
            release_s=od.number("2001:0C") * MS,
            command_s=od.number("2001:0D", 100) * MS,
            hold_s=hold,
            hold_moving_s=hold,
            moving_s=od.number("2001:05", 500) * MS,
            speed_rad_s=od.number("2001:06", 30) * RPM,
        )

    def monitors(self, sources: Sources) -> dict[str, Value]:
        """Return group P13 (002:12090-12685); 200Dh:24 selects one of the ten records."""
        f = sources

        def record() -> Record:
            return f.control.alarms.log.at(int(f.core.number("200D:24")))

        return {
            "200D:01": lambda: {State.FAULT: 0, State.OPERATION_ENABLED: 2}.get(f.control.state, 1),
            "200D:02": f.rpm(k.S_OMEGA),
            "200D:03": f.rpm(k.S_SPEED_REFERENCE),
            "200D:04": f.percent(k.S_TORQUE),
            "200D:05": f.percent(k.S_TORQUE_COMMAND),
            "200D:06": lambda: 100 * f.item(k.S_LOAD_RATIO),
            "200D:08": f.position(k.S_P_DEMAND),
            "200D:0A": f.position(k.S_THETA),
            "200D:0C": f.counts(k.S_THETA),
            "200D:0E": f.deviation,
            "200D:17": lambda: f.turn_share() * f.core.motor.pole_pairs % 1.0 * 360,
            "200D:18": lambda: f.item(k.S_VOLTAGE),
            "200D:21": lambda: f.item(k.S_STEP) * k.STEP_S,
            "200D:25": lambda: record().number,
            "200D:26": lambda: record().snapshot.current_u_a,
            "200D:27": lambda: record().snapshot.current_v_a,
            "200D:28": lambda: record().snapshot.inputs,
            "200D:29": lambda: record().snapshot.outputs,
            "200D:2A": lambda: record().snapshot.bus_v,
            "200D:2B": lambda: record().snapshot.speed_rpm,
            "200D:2C": lambda: record().snapshot.running_s,
            "200D:36": lambda: _newest_number(f.control),
            "200D:3C": lambda: record().number,
            "200D:3D": f.counts(k.S_THETA),
            "200D:4D": f.rpm(k.S_OMEGA),
        }


def _newest_number(control: DeviceControl) -> int:
    """Return the number of the newest active fault, 0 without one."""
    return control.alarms.log.at(0).number if control.alarms.active else 0


def family(profile: Profile) -> R6l:
    """Return the family described by this profile."""
    return R6l(profile)
