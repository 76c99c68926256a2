"""Leadshine EL7-EC: the worked example of docs/drives/authoring.md, from public facts."""

from __future__ import annotations

from drivers.virtual.firmware.cia402.base import Traits
from drivers.virtual.firmware.cia402.keys import FeedForward, GainKeys
from drivers.virtual.firmware.cia402.power import MAINS_V
from drivers.virtual.firmware.cia402.standard import Cia402
from drivers.virtual.firmware.kernel import layout as k
from profiles.schema import Profile


class El7(Cia402):
    """Behaviour of these drives in addition to their profile.

    How the second gains are switched is not public, so the virtual drive keeps the first. The alarm
    of each protection is derived from the names in table 8.2 of the manual.
    """

    TRAITS = Traits(
        commands={"1010:01": {0x65766173: "save"}, "1011:01": {0x64616F6C: "restore"}},
        protections={
            k.F_OVER_CURRENT: "Er0E0",
            k.F_UNDER_VOLTAGE: "Er0d0",
            k.F_OVER_VOLTAGE: "Er0C0",
            k.F_LOCKED: "Er102",
            k.F_POWER_STAGE: "Er0E1",
            k.F_OVERLOAD: "Er100",
            k.F_SENSOR: "Er150",
            k.F_MEMORY: "Er240",
            k.F_OVER_TEMPERATURE: "Er0f0",
            k.F_OVER_SPEED: "Er1A0",
            k.F_WATCHDOG: "Er81b",
            k.F_FOLLOWING: "Er180",
        },
        unknown_faults_end=True,
        second_gains=GainKeys("2105:00", "2106:00", "2107:00", "2109:00"),
        feed_forward=FeedForward(
            speed_gain="2110:00",
            speed_filter="2111:00",
            torque_gain="2112:00",
            torque_filter="2113:00",
        ),
    )
    supply_v = MAINS_V


def family(profile: Profile) -> El7:
    """Return the family described by this profile."""
    return El7(profile)
