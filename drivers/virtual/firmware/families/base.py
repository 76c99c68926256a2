"""The seam between the CiA 402 firmware and one drive family."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, Protocol

from drivers.virtual.firmware import kernel as k
from drivers.virtual.firmware.axis import VirtualAxis
from drivers.virtual.firmware.dictionary import Number, ObjectDictionary
from drivers.virtual.firmware.settings import LoopSettings, MotorData, ProtectionSettings
from drivers.virtual.mechanics import MechanicsSpec
from profiles.schema import Profile, Raw

RPM = math.pi / 30
"""rad/s per rpm."""


@dataclass(frozen=True, slots=True)
class Units:
    """User units per SI unit; the signs carry the polarity settings."""

    position_per_rad: float
    speed_per_rad_s: float
    acceleration_per_rad_s2: float
    torque_per_nm: float
    max_motor_speed_per_rad_s: float = 1 / RPM
    ramps_are_times_ms: bool = False
    ramp_reference_rad_s: float = 0.0

    def ramp(self, raw: float) -> float:
        """Magnitude of an acceleration [rad/s²]; zero counts as the smallest step above it."""
        if self.ramps_are_times_ms:
            return self.ramp_reference_rad_s / max(raw, 1.0) * 1000.0
        return max(raw, 1.0) / abs(self.acceleration_per_rad_s2)


@dataclass(frozen=True, slots=True)
class FaultInfo:
    """How a family reports one protection: 603Fh, and whether 605Eh may shape the reaction."""

    code: int
    fixed: bool = False
    error_register: int = 0x01


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


@dataclass(frozen=True, slots=True)
class FeedForward:
    """Parameters of the feed-forwards: gains in %, filter times in ms, selections (1 is on)."""

    speed_gain: str
    speed_filter: str
    torque_gain: str
    torque_filter: str
    speed_select: str | None = None
    torque_select: str | None = None


StatusStyle = Literal["cia402", "echo"]


@dataclass(frozen=True, slots=True)
class TorqueHoming:
    """Homing against the mechanical limit.

    ``methods`` gives the direction of each method and whether it goes back to the index;
    ``torque_key`` is in ‰ of the rated torque, ``time_key`` in ms.
    """

    methods: dict[int, tuple[int, bool]]
    torque_key: str
    time_key: str


#: MMS7 (004:3840-3842, 2070h).
_MMS7_TORQUE_HOMING = TorqueHoming({-3: (-1, False), -2: (1, False)}, "2070:01", "2070:02")


@dataclass(frozen=True, slots=True)
class Traits:
    """Documented behaviours that are a matter of yes or no, or of one number.

    ``commands`` names what writing a raw value to a parameter does: save, restore, reset, zero,
    clear_history, write_settings, fault_reset. ``self_clearing`` commands read 0 afterwards.
    ``communication_fault`` is 0 for a drive that does not watch its bus.
    """

    buffered_setpoints: bool = True
    limit_switch_faults: bool = True
    communication_fault: int = k.F_WATCHDOG
    faults: dict[int, FaultInfo] = field(default_factory=dict)
    commands: dict[str, dict[int, str]] = field(default_factory=dict)
    self_clearing: bool = True
    error_status_key: str | None = None
    status: StatusStyle = "cia402"
    home_found_bit: int | None = None
    position_at_home_is_offset: bool = False
    positive_limit_first: bool = False
    limit_bits_swapped: bool = False
    autosave: tuple[Autosave, ...] = ()
    torque_speed_limit_key: str | None = None
    feed_forward: FeedForward | None = None
    assigns_terminals: bool = False
    torque_homing: TorqueHoming = _MMS7_TORQUE_HOMING
    homing_timeout: tuple[str, float] = ("2070:03", 1.0)  # parameter and its unit [s]
    index_search_reverses: bool = False


class Family(Protocol):
    """Everything the firmware asks of a family. Implementations hold no state of a drive."""

    name: str
    traits: Traits

    def factory_values(self, spec: MechanicsSpec, motor: MotorData) -> dict[str, Raw]:
        """What the maker sets for this motor, whatever the manual prints."""

    def fallback_values(self, motor: MotorData) -> dict[str, Raw]:
        """Start values of parameters for which the manual prints none."""

    def units(self, od: ObjectDictionary, motor: MotorData) -> Units:
        """Units of the motion objects under the present gear settings."""

    def loops(
        self, od: ObjectDictionary, profile: Profile, motor: MotorData, units: Units
    ) -> LoopSettings:
        """Gains, filters and limits in SI units from the effective parameters."""

    def protections(
        self, od: ObjectDictionary, motor: MotorData, units: Units
    ) -> ProtectionSettings:
        """Thresholds in SI units from the effective parameters."""

    def wiring(self, od: ObjectDictionary) -> Wiring:
        """How the switches reach the drive."""

    def readings(self, axis: VirtualAxis) -> dict[str, Callable[[], Number]]:
        """Measured objects of the maker's own, by key."""


def inertia_kgm2(od: ObjectDictionary, key: str, fallback: float, scale: float = 1e-7) -> float:
    """Inertia parameter (g·cm² by default) in kg·m²; an unset one gives ``fallback``."""
    raw = od.number(key)
    return raw * scale if raw > 0 else fallback
