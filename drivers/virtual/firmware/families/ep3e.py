"""Maxsine EP3E (manual 001)."""

from __future__ import annotations

import math

from drivers.virtual.firmware.cia402.base import RPM, BrakeTimes, Stops, Traits
from drivers.virtual.firmware.cia402.keys import FeedForward
from drivers.virtual.firmware.cia402.power import MAINS_V
from drivers.virtual.firmware.cia402.standard import Cia402
from drivers.virtual.firmware.cia402.terminals import Input, Output, TerminalTable
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import ObjectDictionary
from drivers.virtual.firmware.objects.monitors import Sources, Value
from profiles.schema import Profile

#: Maxsine EP3E: 1010h:01 saves and restores (001:1209); 6041h bit 15 (001:372); the home offset is
#: the position at home (001:687-691); stops and their states 001:870-945, EMG by P164.
TRAITS = Traits(
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

#: The parameters that select the functions precede the excerpt: EMG on DI1, POT on DI2, NOT on DI3
#: and HOME on DI4 are this virtual drive's own wiring; HDI1 and HDI2 as printed (001:752).
TERMINALS = TerminalTable(
    inputs=(
        Input("DI1", 19, fixed="emergency"),
        Input("DI2", 20, fixed="positive_limit"),
        Input("DI3", 21, fixed="negative_limit"),
        Input("DI4", 22, fixed="home"),
        Input("DI5", 23),
        Input("HDI1", 30, fixed="probe1"),
        Input("HDI2", 31, fixed="probe2"),
    ),
    outputs=(
        Output("DO1", 16, fixed="ready"),
        Output("DO2", 17, fixed="no_fault"),
        Output("DO3", 18, fixed="bus"),
        Output("DO4", 19, fixed="bus"),
        Output("DO5", 20, fixed="brake"),
    ),
    bus_outputs_need_function=True,
    masks_outputs=False,  # no mask for DO1 to DO5, only their function (001:988)
)


class Ep3e(Cia402):
    """Behaviour of these drives in addition to their profile."""

    TRAITS = TRAITS
    TERMINALS = TERMINALS
    supply_v = MAINS_V

    def refusal(self, od: ObjectDictionary, mode: int) -> str | None:  # noqa: ARG002 - the seam's
        """Refuse no mode, or a mode that the drive does not have (001:1538-1547)."""
        if mode == 0:
            return "Err88"
        return None if mode in self._profile.supported_modes else "Err89"

    def gear_fault(self, od: ObjectDictionary) -> str | None:
        """Return Err80 outside 1/1000 to 1000 (001:1035)."""
        parts = [od.number(key) for key in ("608F:01", "6091:01", "6092:02", "6091:02", "6092:01")]
        if 0 in parts:
            return "Err80"
        ratio = parts[0] * parts[1] * parts[2] / (parts[3] * parts[4])
        return None if 1e-3 <= ratio <= 1e3 else "Err80"

    def brake(self, od: ObjectDictionary) -> BrakeTimes | None:  # noqa: ARG002 - the seam's
        """Return a brake output without printed times (EP3E: BRK and BRKNET, 001:22, 001:27)."""
        return BrakeTimes()

    def monitors(self, sources: Sources) -> dict[str, Value]:
        """Return the monitors 2600h to 26A2h (001:77-130)."""
        f = sources
        motor = f.core.motor
        return {
            "2600:00": lambda: (
                0 if f.control.faults.error_code == 0xFF3C else f.control.faults.error_code & 0xFF
            ),
            "2601:00": lambda: f.turn_share() * 2**32,
            "2602:00": lambda: f.item(k.S_THETA) // (2 * math.pi) % 65536,
            "2603:00": lambda: 1,
            "2605:00": lambda: f.item(k.S_VOLTAGE),
            "2606:00": lambda: f.item(k.S_TEMPERATURE),
            "2670:00": lambda: 100 * f.item(k.S_LOAD_RATIO),
            "2671:00": lambda: 100 * f.item(k.S_BRAKE_DUTY),
            "2680:01": f.position(k.S_P_DEMAND),
            "2680:02": f.position(k.S_THETA),
            "2680:03": f.deviation,
            "2681:01": f.rpm(k.S_OMEGA),
            "2682:01": f.percent(k.S_TORQUE),
            "2682:03": lambda: f.item(k.S_CURRENT),
            "26A0:00": lambda: motor.rated_current_a,
            "26A1:00": lambda: motor.rated_torque_nm,
            "26A2:00": lambda: motor.rated_speed_rad_s / RPM,
        }


def family(profile: Profile) -> Ep3e:
    """Return the family described by this profile."""
    return Ep3e(profile)
