"""Merging of a description with the generic CiA 402 profile."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from profiles.importer.description import DescribedEntry, Description
from profiles.importer.esi.esi import EsiDevice
from profiles.importer.file_units import FileUnits
from profiles.importer.report import ImportFailed, ImportReport
from profiles.loader import STANDARD, load_profile
from profiles.motion.classify import classified
from profiles.schema import (
    INTEGER_RANGE,
    Access,
    DataType,
    Identity,
    LinkSpec,
    Parameter,
    PdoMapping,
    PdoPart,
    PdoSet,
    PdoSpec,
    Profile,
    Watchdog,
)

#: Objects of the axes of a device, each 800h after those of the axis before (CiA 402-1).
_AXES = range(0x6000, 0xA000)
_AXIS_STEP = 0x800

#: Objects of CiA 402 that every drive has.
_NEEDED = ("6040:00", "6041:00")

#: Objects that show that a mode exists (CiA 402-2 clause 8.5).
_MODE_OBJECTS: dict[int, tuple[str, ...]] = {
    1: ("607A:00", "6081:00"),
    3: ("60FF:00", "6083:00"),
    4: ("6071:00",),
    6: ("6098:00",),
    8: ("607A:00",),
    9: ("60FF:00",),
    10: ("6071:00",),
}

_SAME_WIDTH: dict[DataType, DataType] = {
    "INT8": "UINT8", "INT16": "UINT16", "INT32": "UINT32", "INT64": "UINT64",
    "UINT8": "INT8", "UINT16": "INT16", "UINT32": "INT32", "UINT64": "INT64",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class ImportedProfile:
    """The profile and the irregularities of its source."""

    profile: Profile
    report: ImportReport
    others: tuple[EsiDevice, ...] = ()
    """Further devices of the file, which could have been chosen instead."""


def build_profile(
    description: Description,
    report: ImportReport,
    *,
    drive: str | None = None,
    generic: Profile | None = None,
) -> ImportedProfile:
    """Merge ``description`` over the generic profile.

    The file's data on an object take precedence; the generic profile adds units, bit and value
    names, roles, homing methods and procedures for the standard objects that the drive has.

    Raises:
        ImportFailed: none of its objects has a known type.
    """
    base = generic or load_profile(STANDARD)
    parameters: dict[str, Parameter] = {}
    units = FileUnits(description.entries)
    for entry in description.entries:
        if entry.key in parameters:
            report.noted(entry.place, "description.object-twice", key=entry.key)
            continue
        parameter = _parameter(entry, _standard(base, entry), units, report)
        if parameter is not None:
            parameters[entry.key] = parameter
    if not parameters:
        raise ImportFailed("description.no-typed-object", file=description.place)
    for key in _NEEDED:
        if key not in parameters:
            report.noted(description.place, "description.cia402-object-missing", key=key)
    _note_further_axes(description, report)
    link = _link(description, parameters)
    profile = Profile(
        drive=drive or slug(description.model),
        title=f"{description.maker} {description.model}".strip(),
        manual=description.file,
        partial=True,
        identity=Identity(
            maker=description.maker,
            model=description.model,
            vendor_id=description.vendor_id,
            product_code=description.product_code,
            revision=description.revision,
            source=description.file,
            notes="The revision is the file's; the drive may have another.",
        ),
        links=(link,),
        units=units.spec(base.units, frozenset(parameters)),
        supported_modes=_modes(parameters),
        parameters=tuple(parameters.values()),
        faults=base.faults,
        procedures=tuple(
            p
            for p in base.procedures
            if all(getattr(step, "key", None) in (None, *parameters) for step in p.steps)
        ),
        homing_methods=tuple(
            m.model_copy(update={"parameters": tuple(k for k in m.parameters if k in parameters)})
            for m in (base.homing_methods if "6098:00" in parameters else ())
        ),
        signals=tuple(s for s in base.signals if s.key in parameters),
        pdo=_pdo_spec(description, parameters, report),
        bring_up=description.bring_up,
        chapters={description.file: "imported; not checked against a manual"},
    )
    return ImportedProfile(classified(profile), report)


def _note_further_axes(description: Description, report: ImportReport) -> None:
    """Note axes after the first, whose objects are 800h apart (CiA 402-1).

    Without a control word they are process data of the modules of an I/O device (ETG.5001).
    """
    indexes = {entry.index for entry in description.entries}
    further = [n for n in range(1, 8) if 0x6040 + _AXIS_STEP * n in indexes]
    if further and 0x6040 in indexes:
        report.noted(description.place, "description.further-axes", axes=len(further) + 1)


def _standard(base: Profile, entry: DescribedEntry) -> Parameter | None:
    """Return the standard's object of this key; for a further axis that of the first one."""
    if entry.index in _AXES:
        first = _AXES.start + (entry.index - _AXES.start) % _AXIS_STEP
        return base.by_key.get(f"{first:04X}:{entry.subindex:02X}")
    return base.by_key.get(entry.key)


def slug(name: str) -> str:
    """Return a drive name that a profile may have."""
    bare = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
    return bare[:60] if re.match(r"[a-z]", bare) else f"drive_{bare[:54]}".rstrip("_")


def _parameter(
    entry: DescribedEntry, standard: Parameter | None, units: FileUnits, report: ImportReport
) -> Parameter | None:
    data_type = entry.type
    access, pdo = _rights(entry, standard, report)
    also: tuple[str, ...] = ()
    if data_type is None and standard is not None:
        report.repaired(entry.place, "description.type-of-standard", key=entry.key)
        data_type = standard.type
    if data_type is None:
        report.left_out(entry.place, "description.type-unknown", key=entry.key, name=entry.name)
        return None
    if standard is not None and data_type != standard.type:
        if _SAME_WIDTH.get(data_type) == standard.type and _uses_sign(entry):
            report.noted(
                entry.place,
                "description.type-signed",
                key=entry.key,
                type=data_type,
                standard=standard.type,
            )
        elif _SAME_WIDTH.get(data_type) == standard.type:
            # A speed of -1 must not appear as 4294967295.
            report.repaired(
                entry.place,
                "description.type-replaced",
                key=entry.key,
                type=data_type,
                standard=standard.type,
            )
            also = (f"type {data_type} in {entry.source}",)
            data_type = standard.type
        else:
            report.noted(
                entry.place,
                "description.type-differs",
                key=entry.key,
                type=data_type,
                standard=standard.type,
            )
    low, high, default = _limits(entry, data_type, report)
    unit, scale = units.of(entry.key, entry.unit, standard.unit if standard else "")
    return Parameter(
        key=entry.key,
        name=entry.name,
        group=entry.group or (standard.group if standard else _group(entry.index)),
        type=data_type,
        access=access,
        pdo=pdo,
        unit=unit,
        scale=scale,
        min_raw=low,
        max_raw=high,
        default_raw=default,
        enum=entry.enum or (_within(standard.enum, data_type, low, high) if standard else {}),
        bits=dict(standard.bits) if standard else {},
        settable=standard.settable if standard else "any",
        motor_individual=standard.motor_individual if standard else False,
        help="; ".join(t for t in (entry.help, standard.help if standard else "") if t),
        source=entry.source or entry.key,
        also_printed=also,
    )


def _rights(
    entry: DescribedEntry, standard: Parameter | None, report: ImportReport
) -> tuple[Access, PdoMapping]:
    """Return access and mapping. Files mark read-only objects as outputs, and outputs as read-only.

    Objects that are read-only in the standard (603Fh, 6041h) remain so; objects that are writable
    in it and mapped as an output by the file are writable. For a manufacturer's object the file
    counts.
    """
    if entry.access != "ro" or entry.pdo not in ("rx", "rxtx") or standard is None:
        return entry.access, entry.pdo
    if standard.access == "ro":
        report.repaired(entry.place, "description.read-only-output", key=entry.key)
        return "ro", "tx" if entry.pdo == "rxtx" or standard.pdo == "tx" else "none"
    report.repaired(entry.place, "description.output-marked-read-only", key=entry.key)
    return "rw", entry.pdo


def _uses_sign(entry: DescribedEntry) -> bool:
    """Return whether the file itself states a negative value for the object."""
    values = (entry.default_raw, entry.min_raw)
    return any(isinstance(value, (int, float)) and value < 0 for value in values)


def _within(
    enum: dict[int, str], data_type: DataType, low: float | None, high: float | None
) -> dict[int, str]:
    """Return values of the standard's list that this drive's own limits allow."""
    bounds = INTEGER_RANGE.get(data_type)
    if bounds is None:
        return {}
    low = bounds[0] if low is None else low
    high = bounds[1] if high is None else high
    return {value: text for value, text in enum.items() if low <= value <= high}


def _limits(
    entry: DescribedEntry, data_type: DataType, report: ImportReport
) -> tuple[int | float | None, int | float | None, int | float | str | None]:
    low, high, default = entry.min_raw, entry.max_raw, entry.default_raw
    if data_type != entry.type and data_type in INTEGER_RANGE:
        low, high = _resigned(low, data_type), _resigned(high, data_type)
        default = _resigned(default, data_type) if isinstance(default, int) else default
    if low is not None and high is not None and low == high == 0:
        # Many tools write 0 for both if no limits were entered.
        report.noted(entry.place, "description.limits-zero", key=entry.key)
        low = high = None
    if low is not None and high is not None and low > high:
        report.repaired(
            entry.place, "description.limits-swapped", key=entry.key, minimum=low, maximum=high
        )
        low = high = None
    if isinstance(default, (int, float)) and (
        (low is not None and default < low) or (high is not None and default > high)
    ):
        report.noted(
            entry.place, "description.default-outside-limits", key=entry.key, default=default
        )
    return low, high, default


def _resigned(value: int | float | None, data_type: DataType) -> int | float | None:
    """Return the same bits with the other signedness."""
    if not isinstance(value, int):
        return value
    low, high = INTEGER_RANGE[data_type]
    if low <= value <= high:
        return value
    width = high - low + 1
    return value - width if value > high else value + width


def _group(index: int) -> str:
    if index < 0x2000:
        return "Communication"
    if index < 0x6000:
        return f"Maker's objects {index >> 8:02X}00h"
    if index < 0xA000:
        return "Device profile"
    return "Other objects"


def _modes(parameters: dict[str, Parameter]) -> tuple[int, ...]:
    """Return the modes in the default of 6502h, else those whose objects exist."""
    bits = {1: 0, 3: 2, 4: 3, 6: 5, 7: 6, 8: 7, 9: 8, 10: 9}
    supported = parameters.get("6502:00")
    default = supported.default_raw if supported is not None else None
    if isinstance(default, int) and default > 0:
        return tuple(mode for mode, bit in bits.items() if default >> bit & 1)
    return tuple(mode for mode, keys in _MODE_OBJECTS.items() if all(k in parameters for k in keys))


def _link(description: Description, parameters: dict[str, Parameter]) -> LinkSpec:
    if description.link == "canopen":
        has_consumer = "1016:01" in parameters
        watchdog = Watchdog(
            present=has_consumer,
            key="1016:01" if has_consumer else None,
            help="the drive's heartbeat consumer" if has_consumer else "the file names none",
            source=description.file,
        )
        return LinkSpec(
            kind="canopen",
            watchdog=watchdog,
            baudrates=description.baudrates,
            source=description.file,
        )
    watchdog = Watchdog(
        present=True,
        help="the process data watchdog of the EtherCAT slave controller",
        source="ETG.1000.4 clause 6.2",
    )
    return LinkSpec(
        kind=description.link,
        watchdog=watchdog,
        complete_access=description.complete_access,
        foe=description.foe,
        source=description.file,
    )


def _pdo_spec(
    description: Description, parameters: dict[str, Parameter], report: ImportReport
) -> PdoSpec | None:
    sets: list[PdoSet] = []
    for pdo in description.pdos:
        entries = tuple(key for key in pdo.entries if key in parameters)
        if len(entries) < len(pdo.entries):
            report.left_out(pdo.source, "description.pdo-objects-untyped", index=pdo.index)
        if (entries or not pdo.fixed) and pdo.index not in {s.index for s in sets}:
            sets.append(
                PdoSet(
                    index=pdo.index,
                    direction=pdo.direction,
                    entries=entries,
                    fixed=pdo.fixed,
                    layout=tuple(
                        PdoPart(key=key if key in parameters else None, bits=bits)
                        for key, bits in pdo.layout
                    ),
                    sync_manager=pdo.sync_manager,
                    mandatory=pdo.mandatory,
                    exclude=pdo.exclude,
                    identifier=pdo.identifier,
                    source=pdo.source,
                )
            )
    default_rx, default_tx = _default(sets, "rx"), _default(sets, "tx")
    if default_rx is None or default_tx is None:
        return None
    return PdoSpec(
        sets=tuple(sets),
        default_rx=default_rx,
        default_tx=default_tx,
        max_entries=max(8, *(len(s.layout or s.entries) for s in sets)),
        max_bytes=8 if description.link == "canopen" else None,
        remappable=not all(s.fixed for s in sets) and not _contents_locked(description),
        sync_modes=_sync_modes(description),
        source=description.file,
    )


def _contents_locked(description: Description) -> bool:
    """Return whether the file explicitly states that mapping objects cannot be written."""
    rules = description.bring_up
    return rules is not None and rules.coe.pdo_config is False


def _sync_modes(description: Description) -> tuple[str, ...]:
    """Return the sync modes of the file's operation modes; AssignActivate means DC."""
    modes = description.bring_up.clock_modes if description.bring_up is not None else ()
    kinds = {"DC-synchronous" if mode.assign_activate else "SM-synchronous" for mode in modes}
    return tuple(sorted(kinds))


def _default(sets: list[PdoSet], direction: Literal["rx", "tx"]) -> int | None:
    """Return the PDO assigned to a sync manager by default, else the first with contents."""
    own = [s for s in sets if s.direction == direction]
    assigned = [s for s in own if s.sync_manager is not None]
    filled = [s for s in own if s.entries]
    for group in ([s for s in assigned if s.entries], filled, assigned, own):
        if group:
            return group[0].index
    return None
