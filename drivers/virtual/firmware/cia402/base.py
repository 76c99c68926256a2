"""The interface between the CiA 402 firmware and one drive family."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol

from drivers.virtual.firmware.axis import VirtualAxis
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
from drivers.virtual.firmware.kernel import layout as k
from drivers.virtual.firmware.objects.dictionary import Number, ObjectDictionary
from drivers.virtual.firmware.objects.settings import LoopSettings, MotorData, ProtectionSettings
from drivers.virtual.mechanics import MechanicsSpec
from profiles.schema import Profile, Raw

if TYPE_CHECKING:
    from drivers.virtual.firmware.cia402.terminals import TerminalTable
    from drivers.virtual.firmware.objects.monitors import Sources

RPM = math.pi / 30
"""rad/s per rpm."""
_NO_TIME_MS = 1e-3


@dataclass(frozen=True, slots=True)
class Units:
    """User units per SI unit; the signs contain the polarity settings."""

    position_per_rad: float
    speed_per_rad_s: float
    acceleration_per_rad_s2: float
    torque_per_nm: float
    max_motor_speed_per_rad_s: float = 1 / RPM
    ramps_are_times_ms: bool = False
    ramp_reference_rad_s: float = 0.0

    def ramp(self, raw: float) -> float:
        """Return an acceleration as a magnitude [rad/s²]; zero counts as the smallest step above
        it.

        A time of zero means no ramp (003:318 allows it).
        """
        if self.ramps_are_times_ms:
            return self.ramp_reference_rad_s / (raw or _NO_TIME_MS) * 1000.0
        return max(raw, 1.0) / abs(self.acceleration_per_rad_s2)


@dataclass(frozen=True, slots=True)
class FaultInfo:
    """How a family reports one protection: 603Fh, and whether 605Eh determines the reaction."""

    code: int
    fixed: bool = False
    error_register: int = 0x01
    fault: str = ""
    """The entry's code in the profile's table of faults."""

    @property
    def name(self) -> str:
        """Unique name of this fault."""
        return self.fault or f"{self.code:#06x}"


@dataclass(frozen=True, slots=True)
class Wiring:
    """Switch signals after terminal functions, polarity and simulation; SIG_* bits."""

    forced: int = 0
    forced_on: int = 0
    inverted: int = 0


@dataclass(frozen=True, slots=True)
class Autosave:
    """While ``key & mask`` is set, writes to these indices are stored at once."""

    key: str
    mask: int
    first_index: int
    last_index: int


StatusStyle = Literal["cia402", "echo"]


Action = Literal["fault", "warning", "stop"]


@dataclass(frozen=True, slots=True)
class Choice:
    """A protection whose action a parameter selects; ``warning`` is shown instead of the fault.

    *fault* coasts, *warning* continues, *stop* brakes and holds.
    """

    key: str
    actions: dict[int, Action]
    default: Action = "fault"
    warning: str = ""


@dataclass(frozen=True, slots=True)
class LimitSwitches:
    """Action of the limit switches: faults and warnings are (negative, positive) codes."""

    action: Action = "stop"
    choice: Choice | None = None
    faults: tuple[str, str] = ("", "")
    warnings: tuple[str, str] = ("", "")


@dataclass(frozen=True, slots=True)
class BrakeTimes:
    """Sequence of the holding brake; see the brake sections of 000:1360 and 002:8117."""

    release_s: float = 0.0
    command_s: float = 0.0
    hold_s: float = 0.0
    hold_moving_s: float = 0.0
    moving_s: float = 0.0
    speed_rad_s: float = math.inf


#: How the axis is stopped at servo off or after a fault: (while moving, afterwards).
OffStop = tuple[Literal["coast", "dynamic", "ramp"], Literal["free", "dynamic", "hold"]]


@dataclass(frozen=True, slots=True)
class Stops:
    """How a family stops, apart from the ramps 6084h and 6085h of options 1 and 2.

    ``ramps`` assigns other options their own deceleration parameter. ``slope_in_torque`` reduces
    the torque by 6087h in torque modes. With ``waits`` a state is left only at standstill, also
    when coasting. ``off`` selects by a parameter how the servo goes off, ``first`` and ``second``
    how faults of the first and second kind stop (R6L).
    """

    ramps: dict[int, str] = field(default_factory=dict)
    slope_in_torque: bool = False
    waits: bool = False
    disable_voltage_key: str | None = None
    torque_key: str | None = None
    quick_ramp_key: str = "6085:00"
    reaction: Literal["605E", "off"] = "605E"
    off: tuple[str, dict[int, OffStop]] | None = None
    first: tuple[str, dict[int, OffStop]] | None = None
    second: tuple[str, dict[int, OffStop]] | None = None
    emergency: tuple[str | None, dict[int, int]] | None = None
    """Emergency stop input: a parameter, and the quick stop option for each of its values: −1 none,
    −2 that of 605Ah. Without a parameter the option is under 0.
    """


@dataclass(frozen=True, slots=True)
class Traits:
    """Documented behaviours that are a yes or no, or one number.

    ``commands`` names what writing a raw value to a parameter does: save, restore, reset, zero,
    clear_history, write_settings, fault_reset. ``self_clearing`` commands read 0 afterwards.
    ``communication_fault`` is 0 for a drive that does not monitor its bus. ``protections`` names
    the entries of the fault table that the protections report; a protection without one is off.
    ``disabled_bits`` are the state bits of "switch on disabled" (EP3E shows 0270h, 001:296).

    ``index_at_once``: an axis at the index accepts it without moving (000:2677). ``homing_alarms``
    are the warning and the fault of a homing that failed or timed out. ``home_offset``: the zero
    position lies the offset beyond home (CiA 402-2), or the position at home is the offset, or a
    parameter selects (M6-L, 000:2213).
    """

    buffered_setpoints: bool = True
    limits: LimitSwitches = LimitSwitches()
    stops: Stops = Stops()
    protections: dict[int, str] = field(default_factory=dict)
    choices: dict[int, Choice] = field(default_factory=dict)
    history_size: int = 20
    disabled_bits: int = 0x40
    listed_options_only: bool = False
    acts_with_network: bool = False
    slow_store: bool = False
    eeprom_writes: float = math.inf
    """Endurance of the memory in writes; an assumed number if the manual only warns of wear."""
    write_protect: tuple[str, dict[int, frozenset[str]]] | None = None
    """A parameter, and the manufacturer's objects that stay writable for each of its values."""
    communication_fault: int = k.F_WATCHDOG
    faults: dict[int, FaultInfo] = field(default_factory=dict)
    commands: dict[str, dict[int, str]] = field(default_factory=dict)
    self_clearing: bool = True
    error_status_key: str | None = None
    status: StatusStyle = "cia402"
    home_found_bit: int | None = None
    home_offset: Literal["zero_beyond", "at_home", "by_parameter"] = "zero_beyond"
    home_offset_key: str | None = None
    positive_limit_first: bool = False
    limit_bits_swapped: bool = False
    autosave: tuple[Autosave, ...] = ()
    torque_speed_limit_key: str | None = None
    zero_speed_key: str | None = None
    torque_limits: tuple[str, str] | None = None
    """The drive's own limits (positive, negative) besides those of CiA 402, in % by their scale."""
    second_gains: GainKeys | None = None
    switching: SwitchKeys | None = None
    compensation: CompensationKeys | None = None
    third_gains: GainKeys | None = None
    swing: SwingKeys | None = None
    quadrant: QuadrantKeys | None = None
    jog: JogKeys | None = None
    own_homing: OwnHomingKeys | None = None
    identifies_poles: bool = False
    brake_by_bus: bool = False
    """Bit 0 of 60FEh applies the holding brake while process data contain it (EP3E, 001:970)."""
    speed_filter: tuple[str, str] | None = None
    """Low-pass of the speed feedback: parameter and "Hz", "ms" or "µs"."""
    feed_forward: FeedForward | None = None
    assigns_terminals: bool = False
    torque_homing: TorqueHoming | None = None
    rigidity: RigidityKeys | None = None
    found_notches: FoundNotchKeys | None = None
    load_identification: LoadKeys | None = None
    homing_timeout: tuple[str, float] = ("2070:03", 1.0)  # parameter and its unit [s]
    index_search_reverses: bool = False
    index_at_once: bool = False
    home_side_reverses: bool = False
    homing_alarms: tuple[str, str] = ("", "")
    software_limits: tuple[str, dict[int, Literal["off", "on", "homed"]]] | None = None
    unknown_faults_end: bool = False
    """A reset ends faults with an unknown kind of reset, as in CiA 402-2 (transition 15)."""
    reset_after_s: dict[str, float] = field(default_factory=dict)
    """Faults that a reset ends only after this time [s]."""
    emergency_warning: str = ""


class Family(Protocol):
    """Interface of the firmware to a family. Implementations hold no state of a drive."""

    name: str
    traits: Traits
    terminals: TerminalTable | None
    """None for a family with the terminals of the MMS7, or without terminals."""
    supply_v: float | None
    """Supply of its power stage [V], None to use that of the bench."""

    def factory_values(self, spec: MechanicsSpec, motor: MotorData) -> dict[str, Raw]:
        """Return the factory settings for this motor, whatever the manual prints."""

    def fallback_values(self, motor: MotorData) -> dict[str, Raw]:
        """Return start values of parameters for which the manual prints none."""

    def units(self, od: ObjectDictionary, motor: MotorData) -> Units:
        """Return the units of the motion objects for the present gear settings."""

    def loops(
        self, od: ObjectDictionary, profile: Profile, motor: MotorData, units: Units
    ) -> LoopSettings:
        """Return gains, filters and limits in SI units from the effective parameters."""

    def protections(
        self, od: ObjectDictionary, motor: MotorData, units: Units
    ) -> ProtectionSettings:
        """Return thresholds in SI units from the effective parameters."""

    def monitors(self, sources: Sources) -> dict[str, Callable[[], float]]:
        """Return the manufacturer's monitor parameters and fault records, in engineering values."""

    def wiring(self, od: ObjectDictionary) -> Wiring:
        """Return how the switches are connected to the drive."""

    def refusal(self, od: ObjectDictionary, mode: int) -> str | None:
        """Return the code of the fault with which the drive refuses enabling, or None."""

    def gear_fault(self, od: ObjectDictionary) -> str | None:
        """Return the code of the fault for a gear that the drive cannot realise, or None."""

    def in_place_s(self, od: ObjectDictionary) -> float:
        """Return how long the axis must be within its window to be in position [s]."""

    def brake(self, od: ObjectDictionary) -> BrakeTimes | None:
        """Return the sequence of the holding brake, None without a brake or timing."""

    def readings(self, axis: VirtualAxis) -> dict[str, Callable[[], Number]]:
        """Return the manufacturer's measured objects, by key."""


def inertia_kgm2(od: ObjectDictionary, key: str, fallback: float, scale: float = 1e-7) -> float:
    """Return an inertia parameter (g·cm² by default) in kg·m²; ``fallback`` if it is not set."""
    raw = od.number(key)
    return raw * scale if raw > 0 else fallback
