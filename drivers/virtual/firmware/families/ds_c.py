"""Xinlichuan DS_C (manual 003)."""

from __future__ import annotations

import math
from dataclasses import replace

from drivers.virtual.firmware.cia402.base import BrakeTimes, Stops, Traits
from drivers.virtual.firmware.cia402.conversions import MS
from drivers.virtual.firmware.cia402.keys import GainKeys, SwitchKeys
from drivers.virtual.firmware.cia402.standard import Cia402
from drivers.virtual.firmware.cia402.terminals import Input, Logic, Output, TerminalTable
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import ObjectDictionary
from drivers.virtual.firmware.objects.settings import MotorData, ProtectionSettings
from profiles.schema import Profile, Raw

#: Xinlichuan DS_C: 2200h to 2203h are triggers that keep their value until they are written back to
#: 0 (003:411-422); own status word (003:298-308); 607Dh:01 is the positive limit. The manual prints
#: no watchdog of any kind: with the line cut, the drive continues with its last command. Control
#: word 11 is an emergency stop (003:296); its ramp is not printed, 6084h is assumed.
TRAITS = Traits(
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

TERMINALS = TerminalTable(
    inputs=tuple(Input(f"DI{n}", None, f"2400:{2 + n:02X}", Logic("2400:01", n)) for n in range(5)),
    outputs=tuple(
        Output(f"DO{n}", n, f"2400:{0x0D + n:02X}", Logic("2400:0C", n)) for n in range(3)
    ),
    input_uses={1: "home", 2: "positive_limit", 3: "negative_limit", 6: "emergency"},
    output_uses={1: "fault", 2: "running", 3: "homed", 4: "in_position", 6: "brake"},
    inputs_key="2100:00",
    outputs_key="2101:00",
)


class DsC(Cia402):
    """Behaviour of these drives in addition to their profile."""

    TRAITS = TRAITS
    TERMINALS = TERMINALS

    def fallback_values(self, motor: MotorData) -> dict[str, Raw]:
        """Return fallback values in addition to those of `Cia402`.

        In-position window and time, out-of-tolerance threshold; home and limits on DI0 to DI2.
        """
        values = super().fallback_values(motor)
        turn = values["6065:00"]
        return values | {
            "2500:00": min(turn, 65535),
            "2501:00": values["6067:00"],
            "2502:00": 10,
            "2400:02": 1,
            "2400:03": 2,
            "2400:04": 3,
        }

    def in_place_s(self, od: ObjectDictionary) -> float:
        """Return the time in 2502h [s] (003:577)."""
        return od.number("2502:00", 10) * MS

    def refined(
        self, od: ObjectDictionary, motor: MotorData, base: ProtectionSettings
    ) -> ProtectionSettings:
        """Apply 2506h (003:591), the continuous current; no over-speed fault is printed."""
        continuous = od.number("2506:00", 2500) / 1000
        return replace(
            base,
            over_speed_rad_s=math.inf,
            over_temperature_c=math.inf,
            i2t_rated_nm=max(continuous, 0.1) * motor.rated_torque_nm,
        )

    def brake(self, od: ObjectDictionary) -> BrakeTimes | None:
        """Return times by 2401h, 2402h and an output with function 6 (003:544-549)."""
        if all(od.number(f"2400:{sub:02X}", -1) != 6 for sub in (0x0D, 0x0E, 0x0F)):
            return None
        closing = od.number("2402:00") * MS
        return BrakeTimes(
            command_s=od.number("2401:00") * MS, hold_s=closing, hold_moving_s=closing
        )


def family(profile: Profile) -> DsC:
    """Return the family described by this profile."""
    return DsC(profile)
