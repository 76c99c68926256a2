"""Contents of a hand-over: start-up writes of one axis, with process data and cycle time.

Computed from a parameter set and the family's profile, without I/O.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from backend.axes.motion.classes import motion_of
from backend.axes.parameters.set_file import ParameterSet
from drivers.errors import DriveError, NotAllowed
from drivers.objects.codec import encode, size_of
from drivers.texts.message import Text, joined, prose, text
from profiles.importer.esi.controller import SlaveController
from profiles.schema import DataType, Parameter, Profile, Raw

Transition = Literal["PS", "SO"]
Consequence = Literal["motion", "unit", "limit", "gain", "other"]
Choice = Literal["all", "tuned", "not_default"]

#: CoE start-up values are written from Pre-Operational to Safe-Operational (ETG.1000.6: SDO works
#: from Pre-Operational on), before process data are exchanged. No profile has an object that must
#: be written later.
DEFAULT_TRANSITION: Transition = "PS"
#: Code of the note about values that process data overwrite.
OVERWRITTEN = "handover.note-process-data-overwrite"
#: Codes of the notes about values that do not take effect at once, by the event they need.
_ACT_AFTER = {
    "power_cycle": "handover.note-act-after-power-cycle",
    "write_settings": "handover.note-act-after-write-settings",
}
#: Proposed cycle time [µs], unless the profile's minimum is longer.
PROPOSED_CYCLE_US = 1000
#: SYNC0 without SYNC1 (ETG.1020 AssignActivate); the value of the drive's ESI file has priority.
ASSIGN_ACTIVATE = 0x0300

_UNITS = {"607E", "608F", "6091", "6092", "6093", "6096", "6097", "60A8", "60A9", "60AA", "60AB"}
_LIMITS = {
    "6065", "6066", "6067", "6068", "6072", "6073", "607B", "607D", "607F", "6080", "60C5", "60C6",
    "60E0", "60E1",
}  # fmt: skip
_RANK: dict[Consequence, int] = {"unit": 0, "limit": 1, "motion": 2, "other": 2, "gain": 3}


@dataclass(frozen=True, slots=True)
class StartupWrite:
    """One SDO download of a start-up list. ``raw`` is sent little endian in the type's size."""

    index: int
    subindex: int
    type: DataType
    raw: Raw
    key: str
    name: str
    transition: Transition = DEFAULT_TRANSITION
    comment: str = ""

    @property
    def data(self) -> bytes:
        """Bytes as transferred (CiA 301 clause 7.1.4)."""
        return encode(self.type, self.raw)

    @property
    def number(self) -> int:
        """The bytes as one unsigned number."""
        return int.from_bytes(self.data, "little")


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A row of the set that is not handed over, and the reason."""

    key: str
    reason: Text


@dataclass(frozen=True, slots=True)
class MappedEntry:
    """An object of a PDO; ``index`` 0 is padding."""

    index: int
    subindex: int
    bits: int
    name: str
    type: DataType | None


@dataclass(frozen=True, slots=True)
class MappedPdo:
    """One PDO that the controller assigns."""

    index: int
    direction: Literal["rx", "tx"]
    fixed: bool
    entries: tuple[MappedEntry, ...]


@dataclass(frozen=True, slots=True)
class AxisHandover:
    """All data about one axis that a format may contain."""

    name: str
    profile: Profile
    vendor_id: int | None
    product_code: int | None
    revision: int | None
    writes: tuple[StartupWrite, ...]
    left_out: tuple[LeftOut, ...]
    pdos: tuple[MappedPdo, ...]
    cycle_us: int
    distributed_clock: bool
    notes: tuple[Text, ...] = ()
    controller: SlaveController | None = None
    """Slave controller of the drive's ESI file, where one was given."""

    @property
    def assign_activate(self) -> int:
        """AssignActivate word for distributed clocks, of the ESI file or proposed; 0 for none."""
        if self.controller is not None:
            return self.controller.assign_activate
        return ASSIGN_ACTIVATE if self.distributed_clock else 0

    def identity(self) -> tuple[int, int]:
        """Vendor ID and product code, which a controller compares with the drive.

        Raises:
            NotAllowed: neither the set nor the profile states them.
        """
        if self.vendor_id is None or self.product_code is None:
            raise NotAllowed("handover.set-states-neither-vendor", drive=self.name)
        return self.vendor_id, self.product_code


def gain_keys(profile: Profile) -> frozenset[str]:
    """Keys that tuning changes.

    These are the profile's groups of loop gains, feedforward and filters, notches and stiffness.
    """
    found: set[str] = set()
    if (gains := profile.gains) is not None:
        speed = profile.by_key.get(gains.speed or "")
        groups = {*gains.groups, speed.group if speed is not None else ""} - {""}
        found |= {p.key for p in profile.parameters if p.group in groups}
        found |= {
            key
            for key in (
                gains.position,
                gains.speed,
                gains.integral,
                gains.torque_filter,
                gains.current_bandwidth,
                gains.speed_filter,
                gains.inertia,
            )
            if key
        }
    if (notch := profile.notch) is not None:
        for slot in notch.slots:
            found |= {
                value for field, value in slot if field.endswith("_key") and isinstance(value, str)
            }
    for table in profile.stiffness:
        found |= {table.level_key, *table.columns}
        found |= {table.mode_key} if table.mode_key else set()
    return frozenset(found)


def consequence(profile: Profile, parameter: Parameter) -> Consequence:
    """What a wrong value of this parameter affects, according to the profile."""
    if motion_of(parameter) == "energises":
        return "motion"
    units = profile.units
    gearing = {units.gear_numerator, units.gear_denominator, units.feed, units.feed_revolutions}
    if parameter.key in gearing or parameter.key[:4] in _UNITS:
        return "unit"
    if parameter.key in gain_keys(profile):
        return "gain"
    limits = {s.key for s in profile.signals if "limit" in s.role or s.role.startswith("max_")}
    limits |= {s.key for s in profile.signals if s.role.startswith("following_error_")}
    if parameter.key in limits or parameter.key[:4] in _LIMITS:
        return "limit"
    return "other"


def rank(profile: Profile, parameter: Parameter) -> int:
    """Place in the order of writing: write protection, units, limits, others, gains."""
    return -1 if is_lock(profile, parameter) else _RANK[consequence(profile, parameter)]


def is_lock(profile: Profile, parameter: Parameter) -> bool:
    """Whether the parameter is the write protection of the others."""
    quirk = profile.quirk("write_protect")
    return quirk is not None and quirk.key == parameter.key


def locks(profile: Profile, parameter: Parameter, raw: Raw) -> bool:
    """Whether this value makes the drive refuse later writes."""
    quirk = profile.quirk("write_protect")
    return quirk is not None and quirk.key == parameter.key and raw != (quirk.raw or 0)


def hand_over(
    content: ParameterSet,
    profile: Profile,
    *,
    choice: Choice = "all",
    only: Collection[str] = (),
    motor_individual: bool = False,
) -> AxisHandover:
    """The start-up writes of a set.

    Raises:
        NotAllowed: the set is for another family, a key of ``only`` is not in it, or nothing is
            left to write.
    """
    if content.profile != profile.drive:
        raise NotAllowed(
            "handover.set-drive-not", profile=content.profile, profile_drive=profile.drive
        )
    missing = sorted(set(only) - {row.key for row in content.rows})
    if missing:
        raise NotAllowed("handover.set-no-value", missing=", ".join(missing))
    tuned = gain_keys(profile)
    writes: list[StartupWrite] = []
    left: list[LeftOut] = []
    seen: set[str] = set()
    for row in content.rows:
        parameter = profile.by_key.get(row.key)
        if only and row.key not in only:
            continue
        if choice == "tuned" and row.key not in tuned:
            continue
        if choice == "not_default" and parameter and row.raw == parameter.default_raw:
            continue
        why = _why_not(parameter, row.raw, motor_individual=motor_individual)
        if row.key in seen:
            why = text("handover.left-out-twice")
        if parameter and row.raw is not None and locks(profile, parameter, row.raw):
            why = text("handover.left-out-locks")
        seen.add(row.key)
        if row.problem or why is not None or parameter is None or row.raw is None:
            bad = row.problem or text("handover.left-out-bad-row")
            left.append(LeftOut(row.key, bad if row.problem or why is None else why))
            continue
        writes.append(write_of(parameter, row.raw))
    if not writes:
        if left:
            raise NotAllowed("handover.nothing-but-left-out", key=left[0].key, why=left[0].reason)
        raise NotAllowed("handover.nothing-to-hand-over")
    writes.sort(key=lambda w: (rank(profile, profile.by_key[w.key]), w.index, w.subindex))
    return _axis(content, profile, writes, left)


def write_of(parameter: Parameter, raw: Raw, transition: Transition = "PS") -> StartupWrite:
    """The write of a value; ``parameter`` must have an index."""
    assert parameter.index is not None
    assert parameter.subindex is not None
    return StartupWrite(
        parameter.index,
        parameter.subindex,
        parameter.type,
        raw,
        parameter.key,
        " ".join(parameter.name.split()),
        transition,
    )


def _why_not(
    parameter: Parameter | None, raw: Raw | None, *, motor_individual: bool
) -> Text | None:
    """Why a row cannot be in a start-up list; None where it can."""
    if parameter is None:
        return text("handover.left-out-no-parameter")
    if raw is None:
        return text("handover.left-out-bad-row")
    if parameter.index is None:
        return text("handover.left-out-modbus")
    if parameter.access == "ro":
        return text("handover.left-out-read-only")
    if motion_of(parameter) == "energises":
        return text("handover.left-out-energises")
    if parameter.motor_individual and not motor_individual:
        return text("handover.left-out-motor")
    if size_of(parameter.type) is None:
        return text("handover.left-out-no-size")
    low, high = parameter.raw_limits
    try:
        encode(parameter.type, raw)
    except DriveError as error:
        return error.text
    if not isinstance(raw, str) and (
        (low is not None and raw < low) or (high is not None and raw > high)
    ):
        return text("handover.left-out-range", raw=raw, low=low, high=high)
    return None


def _axis(
    content: ParameterSet, profile: Profile, writes: list[StartupWrite], left: list[LeftOut]
) -> AxisHandover:
    notes: list[Text] = []
    quirk = profile.quirk("write_settings")
    if quirk is not None:
        notes.append(joined([prose(quirk.key or ""), prose(" ".join(quirk.help.split()))], ": "))
    late: dict[str, list[str]] = {}
    for write in writes:
        effective = profile.by_key[write.key].effective
        if effective in _ACT_AFTER:
            late.setdefault(effective, []).append(write.key)
    for when, keys in late.items():
        notes.append(text(_ACT_AFTER[when], keys=", ".join(keys)))
    ident = profile.identity
    pdo = profile.pdo
    pdos = _pdos(profile)
    mapped = {
        f"{e.index:04X}:{e.subindex:02X}" for p in pdos if p.direction == "rx" for e in p.entries
    }
    cyclic = sorted({write.key for write in writes} & mapped)
    if cyclic:
        notes.append(text(OVERWRITTEN, keys=", ".join(cyclic)))
    return AxisHandover(
        name=content.drive_name or profile.title,
        profile=profile,
        vendor_id=content.vendor_id if content.vendor_id is not None else ident.vendor_id,
        product_code=(
            content.product_code if content.product_code is not None else ident.product_code
        ),
        revision=content.revision,
        writes=tuple(writes),
        left_out=tuple(left),
        pdos=pdos,
        cycle_us=max(PROPOSED_CYCLE_US, (pdo.cycle_min_us or 0) if pdo else 0),
        distributed_clock=bool(pdo and "DC-synchronous" in pdo.sync_modes),
        notes=tuple(notes),
    )


def _pdos(profile: Profile) -> tuple[MappedPdo, ...]:
    """The two PDOs that are assigned by default, according to the profile."""
    if profile.pdo is None:
        return ()
    found = []
    for pdo in profile.pdo.sets:
        if pdo.index not in (profile.pdo.default_rx, profile.pdo.default_tx):
            continue
        entries = []
        for part in pdo.layout:
            entries.append(_entry(profile, part.key, part.bits))
        for key in () if pdo.layout else pdo.entries:
            entries.append(_entry(profile, key, 8 * (size_of(profile.by_key[key].type) or 0)))
        found.append(MappedPdo(pdo.index, pdo.direction, pdo.fixed, tuple(entries)))
    return tuple(found)


def _entry(profile: Profile, key: str | None, bits: int) -> MappedEntry:
    if key is None:
        return MappedEntry(0, 0, bits, "padding", None)
    parameter = profile.by_key[key]
    name = " ".join(parameter.name.split())
    return MappedEntry(parameter.index or 0, parameter.subindex or 0, bits, name, parameter.type)
