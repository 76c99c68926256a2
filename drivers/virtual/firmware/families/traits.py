"""Traits of the families that are otherwise shown by their profiles, with manual lines."""

from __future__ import annotations

from drivers.virtual.firmware.families.base import (
    Autosave,
    Choice,
    CompensationKeys,
    FeedForward,
    GainKeys,
    JogKeys,
    LimitSwitches,
    OffStop,
    OwnHomingKeys,
    QuadrantKeys,
    Stops,
    SwingKeys,
    SwitchKeys,
    TorqueHoming,
    Traits,
)
from drivers.virtual.firmware.kernel import layout as k

#: P08.09 (000:3399). What the level of each condition is counted in is not printed: torque in %,
#: speeds in rpm, the change of speed in 10 rpm/s and the deviation in command units are assumed.
_M6L_CONDITIONS = {
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
#: P06.51 (002:10800); the same is said of its levels as above.
_R6L_CONDITIONS = {
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

#: Megmeet M6-L: parameters of the bus go to the EEPROM while P17.24 is 1 (000:3669-3673), saving
#: and restoring by P17.26 (000:3675), history and defaults by P02.22 (000:3254), feed-forward by
#: P08.14 to P08.17 with the selections P05.16 and P06.18 (000:3407-3410, 000:3310, 000:3360).
#: Homing -1 to -4 by P23.20 and P23.21 (000:2701-2756), 33 and 34 turn round at a limit switch
#: (000:2679, 000:2693), time limit P12.09 (000:3635). P12.11 says what the home offset does
#: (000:2213-2222). Stops 000:3006-3030; what faults do P10.01, P10.04 and P10.06 say
#: (000:3471-3476). Default 2 of P10.04 is not among the printed meanings: taken as 1.
M6L = Traits(
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
        kinds=_M6L_CONDITIONS,
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
)

#: P01.06 (002:8147), P01.08 (002:8193), P01.09 (002:8220).
_R6L_OFF: dict[int, OffStop] = {
    0: ("coast", "free"),
    1: ("ramp", "hold"),
    2: ("coast", "dynamic"),
    3: ("dynamic", "dynamic"),
    4: ("ramp", "dynamic"),
}
_R6L_SECOND: dict[int, OffStop] = {
    0: ("coast", "free"),
    1: ("coast", "dynamic"),
    2: ("dynamic", "dynamic"),
    3: ("ramp", "free"),
    4: ("ramp", "dynamic"),
    5: ("dynamic", "free"),
}
_R6L_FIRST: dict[int, OffStop] = {
    0: ("coast", "free"),
    1: ("coast", "dynamic"),
    2: ("dynamic", "dynamic"),
    5: ("dynamic", "free"),
}

#: Rtelligent R6L: 200Ch (002:11782 on); what 2008h:0C permits is stored when written;
#: feed-forward in 2006h (002:10669-10705). The position at home is the home offset (002:4344).
#: 605Ah and 605Dh are printed without meanings (002:12828): those of CiA 402-2, current limit by
#: P05.50. Which of its alarms an EtherCAT watchdog raises is not printed: AL.293 is assumed.
R6L = Traits(
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
        off=("2001:07", _R6L_OFF),
        first=("2001:0A", _R6L_FIRST),
        second=("2001:09", _R6L_SECOND),
        emergency=(None, {0: -2}),
    ),
    second_gains=GainKeys("2006:06", "2006:04", "2006:05", "2005:32"),
    switching=SwitchKeys(
        mode="2006:33",
        on_raw=(1,),
        condition="2006:34",
        kinds=_R6L_CONDITIONS,
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
)

#: Maxsine EP3E: 1010h:01 saves and restores (001:1209); 6041h bit 15 (001:372); the home offset
#: is the position at home (001:687-691); stops and their states 001:870-945, EMG by P164.
EP3E = Traits(
    commands={"1010:01": {0x45534554: "save", 0x45444546: "restore"}},
    self_clearing=True,
    home_found_bit=15,
    home_offset="at_home",
    protections={
        k.F_OVER_CURRENT: "Err12",
        k.F_UNDER_VOLTAGE: "Err27",
        k.F_POWER_STAGE: "Err11",
        k.F_OVERLOAD: "Err16",
        k.F_SENSOR: "Err40",
        k.F_MEMORY: "Err20",
        k.F_OVER_TEMPERATURE: "Err18",
        k.F_OVER_VOLTAGE: "Err2",
        k.F_OVER_SPEED: "Err1",
        k.F_WATCHDOG: "Err60",
        k.F_FOLLOWING: "Err4",
    },
    stops=Stops(
        ramps={3: "60C6:00"},
        slope_in_torque=True,
        waits=True,
        disable_voltage_key="605B:00",
        reaction="off",
        emergency=("20A4:00", {0: 0, 1: 2}),
    ),
    speed_filter=("2013:00", "ms"),
    feed_forward=FeedForward(speed_gain="2015:00", speed_filter="2016:00"),
    acts_with_network=True,
    slow_store=True,
    brake_by_bus=True,
    torque_limits=("2041:00", "2042:00"),
    disabled_bits=0x60,
    zero_speed_key="20A0:00",
    listed_options_only=True,
)

#: Xinlichuan DS_C: 2200h to 2203h are triggers that stay until they are written back to 0
#: (003:411-422); own status word (003:298-308); 607Dh:01 is the positive limit. The manual prints
#: no watchdog of any kind: with the line cut, the drive goes on with what it was reported. Control
#: word 11 is an emergency stop (003:296); its ramp is not printed, 6084h is assumed.
DS_C = Traits(
    commands={
        "2200:00": {1: "zero"},
        "2201:00": {1: "save"},
        "2202:00": {1: "restore"},
        "2203:00": {1: "fault_reset"},
    },
    self_clearing=False,
    status="echo",
    home_found_bit=8,
    positive_limit_first=True,
    torque_speed_limit_key="2406:00",
    software_limits=("2405:00", {0: "off", 1: "homed"}),
    communication_fault=0,
    protections={
        k.F_OVER_CURRENT: "1001",
        k.F_UNDER_VOLTAGE: "1002",
        k.F_OVER_VOLTAGE: "1001",
        k.F_OVERLOAD: "1007",
        k.F_SENSOR: "1003",
        k.F_MEMORY: "1012",
        k.F_FOLLOWING: "1008",
    },
    second_gains=GainKeys("PA_39", "PA_3E", "PA_40"),
    switching=SwitchKeys(mode="PA_46", always_raw=(1,)),
    stops=Stops(quick_ramp_key="6084:00", reaction="off", emergency=(None, {0: 2})),
)

#: Any other CiA 402 drive: 1010h and 1011h with the texts of CiA 301.
GENERIC = Traits(
    commands={"1010:01": {0x65766173: "save"}, "1011:01": {0x64616F6C: "restore"}},
)

TRAITS: dict[str, Traits] = {
    "m6l": M6L,
    "r6l": R6L,
    "ep3e": EP3E,
    "ds_c": DS_C,
    "generic402": GENERIC,
}
