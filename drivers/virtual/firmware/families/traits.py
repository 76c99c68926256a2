"""Traits of the families that are otherwise told by their profiles, with manual lines."""

from __future__ import annotations

from drivers.virtual.firmware.families.base import Autosave, FeedForward, TorqueHoming, Traits

#: Megmeet M6-L: parameters of the bus go to the EEPROM while P17.24 is 1 (000:3669-3673), saving
#: and restoring by P17.26 (000:3675), history and defaults by P02.22 (000:3254), feed-forward by
#: P08.14 to P08.17 with the selections P05.16 and P06.18 (000:3407-3410, 000:3310, 000:3360).
#: Homing -1 to -4 by P23.20 and P23.21 (000:2701-2756), 33 and 34 turn round at a limit switch
#: (000:2679, 000:2693), time limit P12.09 (000:3635).
M6L = Traits(
    commands={
        "2011:1B": {1: "restore", 2: "save"},
        "2002:17": {1: "clear_history", 2: "restore"},
    },
    autosave=(Autosave("2011:19", 1, 0x2000, 0x6FFF),),
    torque_homing=TorqueHoming(
        {-1: (1, False), -2: (-1, False), -3: (-1, True), -4: (1, True)}, "2017:15", "2017:16"
    ),
    homing_timeout=("200C:0A", 1e-3),
    index_search_reverses=True,
    feed_forward=FeedForward(
        speed_gain="2008:10",
        speed_filter="2008:0F",
        torque_gain="2008:12",
        torque_filter="2008:11",
        speed_select="2005:11",
        torque_select="2006:13",
    ),
)

#: Rtelligent R6L: 200Ch (002:11782 on); what 2008h:0C permits is stored when written;
#: feed-forward in 2006h (002:10669-10705).
R6L = Traits(
    commands={
        "200C:01": {1: "restore", 2: "clear_history"},
        "200C:08": {1: "reset"},
        "200C:09": {1: "fault_reset"},
    },
    autosave=(
        Autosave("2008:0C", 2, 0x2000, 0x2FFF),
        Autosave("2008:0C", 4, 0x6000, 0x6FFF),
    ),
    limit_bits_swapped=True,
    feed_forward=FeedForward(
        speed_gain="2006:10",
        speed_filter="2006:0F",
        torque_gain="2006:12",
        torque_filter="2006:11",
    ),
)

#: Maxsine EP3E: 1010h:01 saves and restores (001:1209); 6041h bit 15 (001:372); the home offset
#: is the position at home (001:687-691).
EP3E = Traits(
    commands={"1010:01": {0x45534554: "save", 0x45444546: "restore"}},
    home_found_bit=15,
    position_at_home_is_offset=True,
)

#: Xinlichuan DS_C: 2200h to 2203h are triggers that stay until they are written back to 0
#: (003:411-422); own status word (003:298-308); 607Dh:01 is the positive limit. The manual prints
#: no watchdog of any kind: with the line cut, the drive goes on with what it was told.
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
    communication_fault=0,
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
