"""The schema of a drive profile.

Every model is frozen and refuses unknown fields, so that a typing error in a YAML file is an error
at load time and never a silently missing limit. The vocabulary is closed: a new literal is added
only for something a manual documents.
"""

from __future__ import annotations

import re
from collections import Counter
from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from profiles.bring_up import BringUp
from profiles.functions import Functions, referenced_keys
from profiles.motion.rule import Motion, MotionOrigin, MotionRule
from profiles.record import BadRecord, Frozen
from profiles.stopping import StopClear

DataType = Literal[
    "BOOL", "INT8", "UINT8", "INT16", "UINT16", "INT32", "UINT32",
    "INT64", "UINT64", "REAL32", "STRING", "OCTETS",
]  # fmt: skip
Access = Literal["ro", "rw", "wo"]
PdoMapping = Literal["none", "rx", "tx", "rxtx"]
Effective = Literal["now", "stopped", "reenable", "write_settings", "power_cycle"]
Settable = Literal["any", "stopped"]
LinkKind = Literal["ethercat", "canopen", "modbus", "mlink"]
#: ``command`` is the fault reset (6040h bit 7 or the family's own), ``automatic`` the end of the
#: cause itself, ``special`` a separate step described in the fault's ``reset`` text.
ResetBy = Literal["command", "power_cycle", "automatic", "special", "unknown"]
Raw = int | float | str

#: Limits of the integer types, inclusive (ETG.1000.6 table of basic data types).
INTEGER_RANGE: dict[str, tuple[int, int]] = {
    "BOOL": (0, 1),
    "INT8": (-(2**7), 2**7 - 1),
    "UINT8": (0, 2**8 - 1),
    "INT16": (-(2**15), 2**15 - 1),
    "UINT16": (0, 2**16 - 1),
    "INT32": (-(2**31), 2**31 - 1),
    "UINT32": (0, 2**32 - 1),
    "INT64": (-(2**63), 2**63 - 1),
    "UINT64": (0, 2**64 - 1),
}


class Parameter(Frozen):
    """One object-dictionary entry or numbered drive parameter.

    The engineering value is ``raw * scale + offset`` in ``unit``. Limits and default are raw
    values and are ``None`` where the manual prints none.
    """

    key: str = Field(pattern=r"^([0-9A-F]{4}:[0-9A-F]{2}|PA_[0-9A-F]+)$")
    number: str | None = None
    name: str
    group: str
    type: DataType
    access: Access = "rw"
    pdo: PdoMapping = "none"
    unit: str = ""
    scale: float = 1.0
    offset: float = 0.0
    min_raw: int | float | None = None
    max_raw: int | float | None = None
    default_raw: Raw | None = None
    enum: dict[int, str] = Field(default_factory=dict)
    bits: dict[str, str] = Field(
        default_factory=dict, description="'3' or '6-4' (high-low) to the field's meaning"
    )
    effective: Effective = "now"
    settable: Settable = "any"
    modbus_register: int | None = None
    motor_individual: bool = Field(
        default=False, description="belongs to one motor or station; never cloned by default"
    )
    motion: Motion | None = Field(
        default=None,
        description="whether writing it can cause motion; filled in from the motion rules, "
        "None for what cannot be written",
    )
    safe_in_motion: bool = Field(
        default=False, description="at_enable, and may be changed while the axis is enabled"
    )
    motion_origin: MotionOrigin | None = Field(
        default=None, description="who gave the motion class"
    )
    motion_reason: str = Field(default="", description="what gives it this motion class")
    help: str = ""
    source: str = Field(description="manual:line, for example 004:5432")
    also_printed: tuple[str, ...] = Field(
        default=(), description="what another place of the manual prints instead"
    )
    notes: str = ""

    @cached_property
    def index(self) -> int | None:
        """Object index, or None for a parameter that only Modbus can access."""
        return None if self.key.startswith("PA_") else int(self.key[:4], 16)

    @cached_property
    def subindex(self) -> int | None:
        """Object subindex, or None for a parameter that only Modbus can access."""
        return None if self.key.startswith("PA_") else int(self.key[5:], 16)

    @property
    def is_integer(self) -> bool:
        """True for BOOL and all INTn/UINTn types."""
        return self.type in INTEGER_RANGE

    @property
    def raw_limits(self) -> tuple[int | float | None, int | float | None]:
        """Printed limits, or those of the integer type where none are printed."""
        low, high = INTEGER_RANGE.get(self.type, (None, None))
        return (
            low if self.min_raw is None else self.min_raw,
            high if self.max_raw is None else self.max_raw,
        )

    def to_raw(self, value: float) -> int | float:
        """Convert an engineering value to the nearest raw value."""
        raw = (value - self.offset) / self.scale
        return round(raw) if self.is_integer else raw

    def to_value(self, raw: Raw) -> Raw:
        """Convert a raw value to an engineering value; text and unscaled numbers pass unchanged."""
        if isinstance(raw, str) or (self.scale == 1.0 and self.offset == 0.0):
            return raw
        # Scales such as 0.1 are not exact in binary: rounding to 12 digits hides only that.
        return float(f"{raw * self.scale + self.offset:.12g}")

    @model_validator(mode="after")
    def _limits_in_order(self) -> Parameter:
        if self.min_raw is not None and self.max_raw is not None and self.min_raw > self.max_raw:
            raise BadRecord(
                "profile.limits-reversed", key=self.key, low=self.min_raw, high=self.max_raw
            )
        return self


class Fault(Frozen):
    """A fault or warning with its remedies."""

    code: str = Field(description="as the drive reports it: 0x7305, Er.013, AL.101, 1001 …")
    name: str
    kind: Literal["fault", "warning"] = "fault"
    severity: str = Field(default="", description="the manual's own class of the fault")
    code_raw: int | None = Field(default=None, description="value of 603Fh, None where unprinted")
    match: tuple[BitMatch, ...] = Field(default=(), description="bits that also tell of it")
    led: str = Field(default="", description="what the drive's lamp or panel shows")
    causes: tuple[str, ...] = ()
    remedies: tuple[str, ...] = ()
    reset: str = Field(default="", description="when and how it can be reset")
    reset_by: ResetBy = Field(default="unknown", description="what ends it once its cause is gone")
    source: str
    also_printed: tuple[str, ...] = ()
    notes: str = ""


class BitMatch(Frozen):
    """``key`` has ``bit`` set."""

    key: str
    bit: int = Field(ge=0, le=63)


class WriteStep(Frozen):
    """Write a raw value."""

    do: Literal["write"]
    key: str
    raw: Raw


class WaitStep(Frozen):
    """Send nothing to the drive for this time (a drive that is storing to flash)."""

    do: Literal["wait"]
    seconds: float = Field(gt=0)


class PollStep(Frozen):
    """Read until ``(raw & mask) == equals``; a value in ``failed`` ends the procedure at once."""

    do: Literal["poll"]
    key: str
    equals: int
    mask: int = 0xFFFFFFFF
    failed: tuple[int, ...] = ()
    timeout_s: float = Field(default=10.0, gt=0)


class ConfirmStep(Frozen):
    """The user must confirm this text before anything further is written."""

    do: Literal["confirm"]
    text: str


class RewriteStep(Frozen):
    """Write every value again that was changed since the last save.

    For drives that store a value only while it is written (R6L, 002:11425).
    """

    do: Literal["rewrite"]


class ReconnectStep(Frozen):
    """The drive restarts; wait until it answers again."""

    do: Literal["reconnect"]
    timeout_s: float = Field(default=20.0, gt=0)


Step = Annotated[
    WriteStep | RewriteStep | WaitStep | PollStep | ConfirmStep | ReconnectStep,
    Field(discriminator="do"),
]


class Procedure(Frozen):
    """A named sequence. Well-known names have a fixed place on the page.

    Well-known: save, restore, reset, write_settings, zero_position, clear_history, fault_reset,
    tuning_begin, tuning_end, identify.
    """

    name: str = Field(pattern=r"^[a-z][a-z0-9_]*$")
    title: str
    help: str
    requires_stop: bool = True
    steps: tuple[Step, ...]
    warning: str = ""
    source: str
    notes: str = ""


class HomingMethod(Frozen):
    """One value of 6098h."""

    method: int
    name: str
    help: str
    direction: Literal["positive", "negative", "none"] = "none"
    signal: Literal["limit", "home", "index", "torque", "current_position", "other"] = "other"
    uses_index: bool = False
    uses_limit: bool = False
    parameters: tuple[str, ...] = ()
    source: str
    notes: str = ""


class IoFunction(Frozen):
    """A selectable function of a terminal."""

    code: int
    name: str
    help: str = ""


class IoTerminal(Frozen):
    """A digital terminal: the parameters that select its function and polarity."""

    name: str
    direction: Literal["in", "out"]
    function_key: str | None = None
    polarity_key: str | None = None
    functions: tuple[IoFunction, ...] = ()
    source: str
    notes: str = ""


class NotchSlot(Frozen):
    """Parameters of one notch in the drive; which of them exist depends on the encoding."""

    enable_key: str | None = None
    enable_bit: int | None = None
    frequency_key: str | None = None
    width_key: str | None = None
    depth_key: str | None = None
    a1_key: str | None = None
    a2_key: str | None = None
    b1_key: str | None = None
    b2_key: str | None = None


class NotchSpec(Frozen):
    """How this family represents notch filters."""

    encoding: Literal["coefficients", "hz_width", "hz_levels", "hz_width_db"]
    slots: tuple[NotchSlot, ...]
    sample_time_s: float | None = None
    apply_key: str | None = None
    apply_raw: int | None = None
    source: str
    notes: str = ""


class StiffnessTable(Frozen):
    """Rigidity or stiffness levels: level to raw values of ``columns`` (parameter keys)."""

    level_key: str
    mode_key: str | None = None
    manual_raw: int | None = None
    table_raw: int | None = None
    columns: tuple[str, ...]
    column_units: tuple[str, ...] = ()
    rows: dict[int, tuple[float, ...]] = Field(
        description="level to values: raw, or in ``column_units`` where those are given"
    )
    source: str
    notes: str = ""


class GainSpec(Frozen):
    """The parameters of the loop gains, and the meaning of their values.

    ``convention``: *bandwidth* (loop bandwidth in Hz), *gain* (1/s position, Hz speed, ms integral
    time), *unit* (numbers without a printed physical meaning).
    """

    convention: Literal["bandwidth", "gain", "unit"]
    position: str | None = None
    speed: str | None = None
    integral: str | None = None
    torque_filter: str | None = None
    current_bandwidth: str | None = None
    speed_filter: str | None = Field(
        default=None, description="low-pass of the speed that the loop and the bus see"
    )
    inertia: str | None = Field(default=None, description="load or total inertia parameter")
    inertia_meaning: Literal["ratio_percent", "ratio", "total", "load"] | None = None
    groups: tuple[str, ...] = Field(
        default=(), description="further groups of parameters that tuning sets, as feed-forward"
    )
    source: str
    notes: str = ""


class SlowVibrationSpec(Frozen):
    """The drive's own filter of the position command against one slow vibration.

    ``frequency`` holds the frequency of the vibration, ``period`` its period: the time of a moving
    average. ``also`` are raw values that belong to it. ``unstated`` are parameters of the filter
    whose unit or meaning the manual does not print, so that no value can be proposed for them.
    """

    frequency: str | None = None
    period: str | None = None
    also: dict[str, int] = Field(default_factory=dict)
    unstated: tuple[str, ...] = ()
    source: str


class Signal(Frozen):
    """A quantity that the scope, the axis and the tools use by role, and its parameter."""

    role: Literal[
        "status_word", "control_word", "mode", "mode_display", "error_code",
        "position_actual", "position_demand", "position_target", "position_offset",
        "load_position",
        "velocity_actual", "velocity_demand", "velocity_target", "velocity_offset",
        "torque_actual", "torque_demand", "torque_target", "torque_offset",
        "following_error", "dc_voltage", "temperature", "current_actual", "load_ratio",
        "digital_inputs", "digital_outputs", "rated_torque", "rated_current", "rated_speed",
        "max_torque", "torque_limit_positive", "torque_limit_negative",
        "profile_velocity", "profile_acceleration", "profile_deceleration",
        "quick_stop_deceleration", "max_speed", "homing_method", "home_offset",
        "homing_speed_switch", "homing_speed_zero", "homing_acceleration",
        "software_limit_min", "software_limit_max", "software_limits_on",
        "following_error_window",
        "following_error_time", "supported_modes", "motor_inertia", "load_inertia",
        "torque_constant",
    ]  # fmt: skip
    key: str
    notes: str = ""


UnitOrigin = Literal["manual", "makers_file", "standard"]
#: Objects of CiA 402-2 that state units and the encoder's resolution, in any drive that has them.
SCALE_KEYS = (
    "60A8:00", "60A9:00", "60AA:00", "608F:01", "608F:02", "6090:01", "6090:02", "6096:01",
    "6096:02", "6097:01", "6097:02",
)  # fmt: skip


class UnitSpec(Frozen):
    """Units of the motion objects and the source of the resolution.

    ``origins`` states the origin of each unit. A unit that is only the standard's default is not
    reliable: manufacturers use others.
    """

    position: str = "inc"
    velocity: str = Field(default="inc/s", description="inc/s, rpm, 0.1 rpm …")
    acceleration: str = Field(default="inc/s²", description="inc/s², rpm/s, ms (ramp time) …")
    torque: str = "‰ rated"
    counts_per_rev: int | None = Field(
        default=None, description="position increments per motor revolution with default gearing"
    )
    encoder_counts_per_rev: int | None = None
    gear_numerator: str | None = None
    gear_denominator: str | None = None
    gear_not_set_at_zero: bool = Field(
        default=False, description="both parts of the gear at 0 mean that none is set"
    )
    feed: str | None = None
    feed_revolutions: str | None = None
    ramp_reference_rpm: float | None = Field(
        default=None, description="speed that a ramp given as a time refers to"
    )
    origins: dict[Literal["position", "velocity", "acceleration"], UnitOrigin] = Field(
        default_factory=dict, description="who states each unit; the manual where not given"
    )
    source: str = ""
    notes: str = ""


class PdoPart(Frozen):
    """A part of a PDO: an object of which ``bits`` are mapped, or padding without a key."""

    key: str | None = None
    bits: int = Field(ge=1, le=64 * 8)


class PdoIdentifier(Frozen):
    """The default CAN identifier (COB-ID) of a PDO."""

    cob_id: int = Field(ge=1, le=0x7FF, description="with `of_node` the node-ID is added")
    of_node: bool
    fixed: bool = Field(default=False, description="14xxh:01 or 18xxh:01 cannot be written")

    def at(self, node: int) -> int:
        """Return the identifier for a node."""
        return (self.cob_id + node if self.of_node else self.cob_id) & 0x7FF


class PdoSet(Frozen):
    """One PDO: its mapping object and default contents as ``key`` list."""

    index: int
    direction: Literal["rx", "tx"]
    entries: tuple[str, ...]
    fixed: bool = False
    layout: tuple[PdoPart, ...] = Field(
        default=(), description="every stretch in its order, where there is padding or single bits"
    )
    sync_manager: int | None = Field(
        default=None, description="sync manager that it is assigned to without a master's doing"
    )
    mandatory: bool = False
    exclude: tuple[int, ...] = Field(
        default=(), description="PDOs that cannot be assigned together with this one"
    )
    identifier: PdoIdentifier | None = Field(
        default=None, description="CANopen: the COB-ID as delivered"
    )
    source: str

    @property
    def is_free(self) -> bool:
        """Whether its contents can be written."""
        return not self.fixed


class PdoSpec(Frozen):
    """Process data of one family."""

    sets: tuple[PdoSet, ...]
    default_rx: int
    default_tx: int
    max_entries: int
    max_bytes: int | None = None
    remappable: bool = True
    cycle_min_us: int | None = None
    cycle_max_us: int | None = None
    sync_modes: tuple[str, ...] = ()
    source: str
    notes: str = ""

    def free_set(self, direction: Literal["rx", "tx"]) -> int | None:
        """Return the PDO whose contents are written: the default, or another free one if that is
        fixed.

        None: nothing in this direction can be remapped.
        """
        if not self.remappable:
            return None
        default = self.default_rx if direction == "rx" else self.default_tx
        known = [s for s in self.sets if s.direction == direction]
        if all(s.index != default for s in known):
            return default
        free = [s.index for s in known if s.is_free]
        return default if default in free else next(iter(free), None)


class Watchdog(Frozen):
    """What stops the axis when the link fails."""

    present: bool
    key: str | None = None
    help: str = ""
    source: str = ""


class LinkSpec(Frozen):
    """How this family is accessed over one kind of link."""

    kind: LinkKind
    watchdog: Watchdog
    word_order: Literal["low_first", "high_first"] | None = None
    default_baudrate: int | None = None
    baudrates: tuple[int, ...] = ()
    default_parity: Literal["N", "E", "O"] | None = None
    default_station: int | None = None
    max_registers: int | None = Field(default=None, description="longest block one request reads")
    max_gap: int | None = Field(default=None, description="unused registers a block may bridge")
    complete_access: bool = False
    foe: bool = False
    wiring: str = ""
    source: str
    notes: str = ""


class Identity(Frozen):
    """Values in a scan that identify the family. None: not printed in the manual."""

    maker: str
    model: str
    vendor_id: int | None = None
    product_code: int | None = None
    revision: int | None = None
    name_patterns: tuple[str, ...] = Field(
        default=(), description="regular expressions on 1008h or the SII name"
    )
    source: str = ""
    notes: str = ""

    @field_validator("name_patterns")
    @classmethod
    def _patterns_can_be_read(cls, patterns: tuple[str, ...]) -> tuple[str, ...]:
        for pattern in patterns:
            try:
                re.compile(pattern)
            except re.error as error:
                raise BadRecord(
                    "profile.no-regular-expression", pattern=pattern, cause=str(error)
                ) from error
        return patterns


class Quirk(Frozen):
    """A documented deviation that code uses: each kind has a reader. See also `Note`."""

    kind: Literal[
        "write_settings", "limit_bits_swapped", "own_status_word", "enable_pause",
        "mode_change_at_standstill", "mode_before_enable", "error_code_low_byte", "warning_bit_7",
        "unit_switch", "write_protect", "quick_stop_word", "torque_stop_by_slope",
    ]  # fmt: skip
    key: str | None = None
    raw: int | None = None
    milliseconds: float | None = None
    help: str
    source: str


class Note(Frozen):
    """Information for users of the drive that no code uses."""

    key: str | None = None
    help: str
    source: str


class Conflict(Frozen):
    """Two contradictory places of the manual that do not concern a single parameter."""

    text: str
    source: str


class Chapter(Frozen):
    """A chapter of the manual by its lines, so that the check can count its use."""

    title: str
    first_line: int = Field(ge=1)
    last_line: int = Field(ge=1)
    taken: str = Field(description="what of it is in the profile, or why nothing is")
    empty: bool = Field(default=False, description="nothing of it belongs into a profile")


class Profile(Frozen):
    """All data on a drive family."""

    drive: str = Field(pattern=r"^[a-z][a-z0-9_]*$")
    title: str
    manual: str = Field(description="number of the manual in the sources, for example 004")
    partial: bool = False
    identity: Identity
    links: tuple[LinkSpec, ...]
    units: UnitSpec
    supported_modes: tuple[int, ...]
    parameters: tuple[Parameter, ...]
    faults: tuple[Fault, ...] = ()
    procedures: tuple[Procedure, ...] = ()
    homing_methods: tuple[HomingMethod, ...] = ()
    terminals: tuple[IoTerminal, ...] = ()
    signals: tuple[Signal, ...] = ()
    pdo: PdoSpec | None = None
    bring_up: BringUp | None = Field(
        default=None, description="what the maker's file prescribes between Init and Operational"
    )
    notch: NotchSpec | None = None
    stiffness: tuple[StiffnessTable, ...] = ()
    gains: GainSpec | None = None
    slow_vibration: SlowVibrationSpec | None = None
    quirks: tuple[Quirk, ...] = ()
    notes: tuple[Note, ...] = ()
    functions: Functions = Functions()
    motion_rules: tuple[MotionRule, ...] = Field(
        default=(), description="motion classes of the maker's objects; the first that fits counts"
    )
    stop_clears: tuple[StopClear, ...] = Field(
        default=(), description="what STOP writes to a drive that turns without being enabled"
    )
    conflicts: tuple[Conflict, ...] = ()
    manual_chapters: tuple[Chapter, ...] = Field(
        default=(), description="the whole manual, chapter behind chapter, without a gap"
    )
    chapters: dict[str, str] = Field(
        default_factory=dict,
        description="manual chapter to what of it is in the profile, for the coverage report",
    )

    @cached_property
    def by_key(self) -> dict[str, Parameter]:
        """Parameters by key."""
        return {p.key: p for p in self.parameters}

    @property
    def from_description(self) -> bool:
        """Made from a manufacturer's file or a drive's own dictionary, not from a manual."""
        return not (self.manual.isdigit() or self.manual == "CiA")

    @cached_property
    def unit_keys(self) -> frozenset[str]:
        """Parameters that change the size of a position increment or another motion unit."""
        units = self.units
        keys = [units.gear_numerator, units.gear_denominator, units.feed, units.feed_revolutions]
        keys += [quirk.key for quirk in self.quirks if quirk.kind == "unit_switch"]
        keys += [key for key in SCALE_KEYS if key in self.by_key]
        return frozenset(key for key in keys if key is not None)

    @cached_property
    def by_role(self) -> dict[str, Parameter]:
        """Parameters by signal role; only roles that this family has."""
        return {s.role: self.by_key[s.key] for s in self.signals}

    def parameter(self, key: str) -> Parameter | None:
        """Return the parameter with this key (in any case) or manufacturer's number, or None."""
        found = self.by_key.get(key) or self.by_key.get(key.upper())
        if found is None:
            found = next((p for p in self.parameters if p.number and p.number == key), None)
        return found

    def link(self, kind: str) -> LinkSpec | None:
        """Return how this family is accessed over ``kind``, or None."""
        return next((spec for spec in self.links if spec.kind == kind), None)

    def procedure(self, name: str) -> Procedure | None:
        """Return the procedure of this name, or None."""
        return next((p for p in self.procedures if p.name == name), None)

    def quirk(self, kind: str) -> Quirk | None:
        """Return the quirk of this kind, or None."""
        return next((q for q in self.quirks if q.kind == kind), None)

    @model_validator(mode="after")
    def _references_exist(self) -> Profile:
        if len(self.by_key) != len(self.parameters):
            counts = Counter(p.key for p in self.parameters)
            twice = sorted(key for key, count in counts.items() if count > 1)
            raise BadRecord("profile.keys-twice", keys=", ".join(twice))
        missing = sorted({key for key in _referenced_keys(self) if key not in self.by_key})
        if missing:
            raise BadRecord("profile.keys-missing", keys=", ".join(missing))
        return self


def _referenced_keys(profile: Profile) -> list[str]:
    """Return every parameter key that faults, procedures, tables and signals refer to."""
    found: list[str] = []

    def walk(node: Any) -> None:
        if isinstance(node, Frozen):
            for name in type(node).model_fields:
                value = getattr(node, name)
                if isinstance(value, str) and (name == "key" or name.endswith("_key")):
                    found.append(value)
                else:
                    walk(value)
        elif isinstance(node, tuple):
            for item in node:
                walk(item)

    for part in (
        profile.faults, profile.procedures, profile.terminals, profile.signals,
        profile.notch, profile.stiffness, profile.quirks, profile.notes, profile.links,
    ):  # fmt: skip
        walk(part)
    for table in profile.stiffness:
        found.extend(table.columns)
    for method in profile.homing_methods:
        found.extend(method.parameters)
    for pdo_set in profile.pdo.sets if profile.pdo else ():
        found.extend(pdo_set.entries)
    found.extend(referenced_keys(profile.functions))
    found.extend(each.key for each in profile.stop_clears)
    return found
