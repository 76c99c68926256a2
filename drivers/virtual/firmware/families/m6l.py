"""Megmeet M6-L (manual 000)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from drivers.virtual.firmware.cia402.base import (
    RPM,
    Autosave,
    BrakeTimes,
    Choice,
    LimitSwitches,
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
    OwnHomingKeys,
    QuadrantKeys,
    RigidityKeys,
    SwingKeys,
    SwitchKeys,
    TorqueHoming,
)
from drivers.virtual.firmware.cia402.power import MAINS_V
from drivers.virtual.firmware.cia402.standard import Cia402
from drivers.virtual.firmware.cia402.states import State
from drivers.virtual.firmware.cia402.terminals import Input, Logic, Output, TerminalTable
from drivers.virtual.firmware.failures.alarms import Record
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import ObjectDictionary
from drivers.virtual.firmware.objects.monitors import Sources, Value
from drivers.virtual.firmware.objects.settings import MotorData, ProtectionSettings
from profiles.schema import Profile

#: P08.09 (000:3399). The unit of the level of each condition is not printed: torque in %, speeds in
#: rpm, the change of speed in 10 rpm/s and the deviation in command units are assumed.
_CONDITIONS = {
    1: k.SWITCH_INPUT,
    2: k.SWITCH_TORQUE,
    3: k.SWITCH_SPEED_DEMAND,
    4: k.SWITCH_SPEED,
    5: k.SWITCH_ACCELERATION,
    6: k.SWITCH_ERROR,
    7: k.SWITCH_SPEED_DEMAND,
    8: k.SWITCH_COMMANDED,
    9: k.SWITCH_UNFINISHED,
    10: k.SWITCH_COMMANDED_OR_FAST,
}

#: Megmeet M6-L: parameters written over the bus go to the EEPROM while P17.24 is 1 (000:3669-3673),
#: saving and restoring by P17.26 (000:3675), history and defaults by P02.22 (000:3254),
#: feed-forward by P08.14 to P08.17 with the selections P05.16 and P06.18 (000:3407-3410, 000:3310,
#: 000:3360). Homing -1 to -4 by P23.20 and P23.21 (000:2701-2756), 33 and 34 reverse at a limit
#: switch (000:2679, 000:2693), time limit P12.09 (000:3635). P12.11 selects the meaning of the home
#: offset (000:2213-2222). Stops 000:3006-3030; reactions to faults by P10.01, P10.04 and P10.06
#: (000:3471-3476). Default 2 of P10.04 is not among the printed meanings: treated as 1.
TRAITS = Traits(
    commands={
        "2011:1B": {1: "restore", 2: "save"},
        "2002:17": {1: "clear_history", 2: "restore"},
        "2009:01": dict.fromkeys(range(1, 0x10000), "identify"),
        "2001:15": {1: "identify_poles", 2: "identify_poles"},
    },
    eeprom_writes=1e5,
    write_protect=("2002:16", {1: frozenset({"2002:16", "2006:02"}), 2: frozenset({"2002:16"})}),
    autosave=(Autosave("2011:19", 1, 0x2000, 0x6FFF),),
    torque_homing=TorqueHoming(
        {-1: (1, False), -2: (-1, False), -3: (-1, True), -4: (1, True)}, "2017:15", "2017:16"
    ),
    homing_timeout=("200C:0A", 1e-3),
    index_search_reverses=True,
    torque_limits=("2006:0F", "2006:10"),
    index_at_once=True,
    home_side_reverses=True,
    home_offset="by_parameter",
    home_offset_key="200C:0C",
    feed_forward=FeedForward(
        speed_gain="2008:10",
        speed_filter="2008:0F",
        torque_gain="2008:12",
        torque_filter="2008:11",
        speed_select="2005:11",
        torque_select="2006:13",
    ),
    protections={
        k.F_OVER_CURRENT: "Er.001",
        k.F_UNDER_VOLTAGE: "Er.020",
        k.F_LOCKED: "Er.004",
        k.F_POWER_STAGE: "Er.010",
        k.F_OVERLOAD: "Er.012",
        k.F_SENSOR: "Er.019",
        k.F_MEMORY: "Er.013",
        k.F_OVER_TEMPERATURE: "Er.008",
        k.F_OVER_VOLTAGE: "Er.002",
        k.F_OVER_SPEED: "Er.027",
        k.F_WATCHDOG: "Er.036",
        k.F_FOLLOWING: "Er.032",
    },
    choices={
        k.F_OVERLOAD: Choice("200A:07", {0: "fault", 1: "warning", 2: "stop"}, warning="AL.012"),
        k.F_WATCHDOG: Choice("200A:02", {0: "fault", 1: "warning", 2: "stop"}),
    },
    limits=LimitSwitches(
        choice=Choice("200A:05", {0: "fault", 1: "stop", 2: "stop"}, default="stop"),
        faults=("Er.040", "Er.039"),
        warnings=("AL.040", "AL.039"),
    ),
    stops=Stops(
        slope_in_torque=True,
        reaction="off",
        emergency=("2002:0A", {0: -1, 1: -2}),
    ),
    second_gains=GainKeys("2008:07", "2008:05", "2008:06", "2008:08"),
    switching=SwitchKeys(
        mode="2008:09",
        on_raw=(1,),
        condition="2008:0A",
        kinds=_CONDITIONS,
        level="2008:0C",
        hysteresis="2008:0D",
        delay="2008:0B",
        ramp="2008:0E",
    ),
    compensation=CompensationKeys(
        bias="2009:1E", positive="2009:20", negative="2009:21", viscous="2009:1F"
    ),
    jog=JogKeys("2006:06", "2006:08", "2006:09"),
    own_homing=OwnHomingKeys("200C:01", (4, 5), "200C:02", "200C:06", "200C:09", "200C:0A"),
    identifies_poles=True,
    swing=SwingKeys(frequency="2009:1B", width="2009:1C", mode="2009:1A", threshold="2009:1D"),
    quadrant=QuadrantKeys(
        positive="2009:22", negative="2009:23", delay="2009:24", filter="2009:25", travel="2009:26"
    ),
    history_size=3,
    listed_options_only=True,
    homing_alarms=("", "Er.037"),
    reset_after_s={"Er.011": 60.0, "Er.012": 60.0},  # 000:3882
    emergency_warning="AL.038",
    rigidity=RigidityKeys(
        "2009:07", "2009:08", ("2008:03", "2008:01", "2008:02"), ("2008:07", "2008:05", "2008:06")
    ),
    found_notches=FoundNotchKeys(
        "2009:09",
        (("2009:0F", "2009:10"), ("2009:11", "2009:12")),
        0,
        100,
        {1: 1, 2: 2, 3: 0},
        4,
        result="2009:17",
    ),
    load_identification=LoadKeys(
        "2009:02",
        "2009:03",
        "2009:05",
        "2009:27",
        1.0,
        "2009:01",
        revolutions="2009:04",
        online="2009:06",
        fault="Er.018",
    ),
)

TERMINALS = TerminalTable(
    inputs=tuple(
        Input(
            f"DI{n + 1}", 16 + n, f"2003:{n + 1:02X}", Logic("2003:0E", n), virtual=("2003:0F", n)
        )
        for n in range(9)
    ),
    outputs=tuple(
        Output(f"DO{n + 1}", 16 + n, f"2003:{0x10 + n:02X}", Logic("2003:16", n)) for n in range(5)
    ),
    input_uses={
        2: "reset",
        3: "gain",
        17: "jog_forward",
        18: "jog_backward",
        32: "home",
        34: "emergency",
        35: "positive_limit",
        36: "negative_limit",
        38: "fault",
        49: "probe1",
        50: "probe2",
    },
    output_uses={
        0: "ready",
        1: "running",
        4: "zero_speed",
        5: "fault",
        6: "warning",
        11: "in_position",
        18: "brake",
        28: "bus",
    },
    inputs_key="200B:0D",
    outputs_key="200B:0E",
    bus_outputs_need_function=True,
    bus_outputs_need_cycles=True,
    keep_key="2014:1C",
    probe_bits=(26, 27),
)


class M6l(Cia402):
    """Behaviour of these drives in addition to their profile."""

    TRAITS = TRAITS
    TERMINALS = TERMINALS
    supply_v = MAINS_V

    def refined(
        self, od: ObjectDictionary, motor: MotorData, base: ProtectionSettings
    ) -> ProtectionSettings:
        """Apply P10.07, P10.09, P10.10, P10.12, P02.18, P02.20 (000:3480-3485, 000:3245-3247)."""
        resistor = int(od.number("2002:13"))
        external = float(od.number("2002:15"))
        over_speed = float(od.number("200A:0D"))
        return replace(
            base,
            i2t_rated_nm=max(od.number("200A:08", 1000), 200) / 1000 * motor.rated_torque_nm,
            over_speed_rad_s=over_speed * RPM if over_speed else math.inf,
            brake_enabled=resistor != 2,
            braking_ohm=external if resistor == 1 and external else 50.0,
            locked_s=od.number("200A:0B", 200) * MS if od.number("200A:0A") else math.inf,
            locked_angle_rad=0.02,
        )

    def brake(self, od: ObjectDictionary) -> BrakeTimes | None:
        """Return times by P01.17, P02.10-P02.13 and an output with function 18 (000:1360-1425)."""
        assigned = any(od.number(f"2003:{sub:02X}", -1) == 18 for sub in range(0x10, 0x15))
        if od.number("2001:12") != 1 or not assigned:
            return None
        return BrakeTimes(
            command_s=od.number("2002:0B", 250) * MS,
            hold_s=od.number("2002:0C", 150) * MS,
            hold_moving_s=0.04,  # 000:1405
            moving_s=od.number("2002:0E", 500) * MS,
            speed_rad_s=od.number("2002:0D", 10) * RPM,
        )

    def monitors(self, sources: Sources) -> dict[str, Value]:
        """Return P11 (000:3558-3615) and the three records of P10.18 to P10.59 (000:3497-3556)."""
        f = sources
        axis, control = f.core.axis, f.control
        values: dict[str, Value] = {
            "200B:01": f.rpm(k.S_SPEED_REFERENCE),
            "200B:02": f.rpm(k.S_OMEGA),
            "200B:03": lambda: abs(f.item(k.S_UQ)) * math.sqrt(3),
            "200B:04": lambda: abs(f.item(k.S_CURRENT)),
            "200B:05": f.percent(k.S_TORQUE),
            "200B:07": lambda: f.item(k.S_TORQUE),
            "200B:09": lambda: 100 * f.item(k.S_LOAD_RATIO),
            "200B:0A": lambda: f.item(k.S_VOLTAGE),
            "200B:0C": partial(_run_state, f),
            "200B:13": lambda: f.counts(k.S_THETA)() % axis.spec.encoder.counts_per_rev,
            "200B:18": f.counts(k.S_THETA),
            "200B:17": f.counts(k.S_P_DEMAND),
            "200B:19": lambda: f.counts(k.S_P_DEMAND)() - f.counts(k.S_THETA)(),
            "200B:1B": f.position(k.S_P_DEMAND),
            "200B:1C": f.position(k.S_THETA),
            "200B:1D": f.deviation,
            "200B:20": lambda: f.item(k.S_TEMPERATURE),
            "200B:21": lambda: f.turn_share() * 2**23,
            "200B:22": lambda: f.item(k.S_THETA) // (2 * math.pi) % 65536,
            "200B:23": lambda: f.core.number("2009:27", 100) * 0.01,
            "200B:24": f.position(k.S_THETA),
            "200B:2D": lambda: f.turn_share() * axis.motor.pole_pairs % 1.0 * 360,
            "200B:30": lambda: f.item(k.S_TEMPERATURE),
            "2011:04": lambda: control.modes.mode,
            "2011:05": lambda: control.control_word,
            "2011:12": control.status_word,
        }
        for age, first in ((0, 0x16), (1, 0x23), (2, 0x30)):
            values |= _record(f, age, 0x13 + age, first)
        return values


def _run_state(f: Sources) -> int:
    """Return P11.11: run, direction, zero speed (000:3569)."""
    speed = f.item(k.S_OMEGA)
    running = f.control.state is State.OPERATION_ENABLED
    return running | (speed >= 0) << 1 | (f.item(k.S_ZERO_T) > 0) << 2


def _record(f: Sources, age: int, code: int, first: int) -> dict[str, Value]:
    def record() -> Record:
        return f.control.alarms.log.at(age)

    fields: tuple[Callable[[Record], float], ...] = (
        lambda r: r.snapshot.bus_v,
        lambda r: r.snapshot.current_v_a,
        lambda r: r.snapshot.current_w_a,
        lambda _: 0.0,  # the d-axis current is kept at zero
        lambda r: r.snapshot.demand_q_a,
        lambda _: 0.0,
        lambda r: r.snapshot.current_q_a,
        lambda r: r.snapshot.speed_rpm,
        lambda r: r.snapshot.position,
        lambda r: r.snapshot.inputs,
        lambda r: r.snapshot.outputs,
        lambda r: r.snapshot.state_bits,
        lambda r: r.snapshot.temperature_c,
    )
    values: dict[str, Value] = {f"200A:{code:02X}": lambda: record().number}
    for place, read in enumerate(fields):
        values[f"200A:{first + place:02X}"] = lambda read=read: read(record())  # type: ignore[misc]
    return values


def family(profile: Profile) -> M6l:
    """Return the family described by this profile."""
    return M6l(profile)
