"""A description merged over the generic CiA 402 profile."""

from __future__ import annotations

import re
from dataclasses import dataclass

from profiles.importer.description import DescribedEntry, Description
from profiles.importer.report import ImportFailed, ImportReport
from profiles.loader import load_profile
from profiles.motion.classify import classified
from profiles.schema import (
    INTEGER_RANGE,
    DataType,
    Identity,
    LinkSpec,
    Parameter,
    PdoSet,
    PdoSpec,
    Profile,
    UnitSpec,
    Watchdog,
)

GENERIC = "generic402"

#: Objects of CiA 402 without which a drive is none.
_NEEDED = ("6040:00", "6041:00")

#: Objects that tell that a mode exists (CiA 402-2 clause 8.5).
_MODE_OBJECTS: dict[int, tuple[str, ...]] = {
    1: ("607A:00", "6081:00"), 3: ("60FF:00", "6083:00"), 4: ("6071:00",), 6: ("6098:00",),
    8: ("607A:00",), 9: ("60FF:00",), 10: ("6071:00",),
}  # fmt: skip

_SAME_WIDTH: dict[DataType, DataType] = {
    "INT8": "UINT8", "INT16": "UINT16", "INT32": "UINT32", "INT64": "UINT64",
    "UINT8": "INT8", "UINT16": "INT16", "UINT32": "INT32", "UINT64": "INT64",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class ImportedProfile:
    """The profile and what was odd about its source."""

    profile: Profile
    report: ImportReport


def build_profile(
    description: Description,
    report: ImportReport,
    *,
    drive: str | None = None,
    generic: Profile | None = None,
) -> ImportedProfile:
    """Merge ``description`` over the generic profile.

    What the file says of an object counts; the generic profile adds units, bit and value names,
    roles, homing methods and procedures for the standard objects that the drive has.

    Raises:
        ImportFailed: nothing in it has a known type.
    """
    base = generic or load_profile(GENERIC)
    parameters: dict[str, Parameter] = {}
    for entry in description.entries:
        if entry.key in parameters:
            report.noted(entry.source, f"{entry.key} comes twice, the first one counts")
            continue
        parameter = _parameter(entry, base.by_key.get(entry.key), report)
        if parameter is not None:
            parameters[entry.key] = parameter
    if not parameters:
        raise ImportFailed(f"{description.file}: no object has a known type")
    for key in _NEEDED:
        if key not in parameters:
            report.noted(description.file, f"{key} is missing: this may not be a CiA 402 drive")
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
        units=_units(base, parameters),
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
        chapters={description.file: "imported; not checked against a manual"},
    )
    return ImportedProfile(classified(profile), report)


def slug(name: str) -> str:
    """A drive name that a profile may have."""
    bare = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
    return bare[:60] if re.match(r"[a-z]", bare) else f"drive_{bare[:54]}".rstrip("_")


def _parameter(
    entry: DescribedEntry, standard: Parameter | None, report: ImportReport
) -> Parameter | None:
    data_type = entry.type
    also: tuple[str, ...] = ()
    if data_type is None and standard is not None:
        report.repaired(entry.source, f"{entry.key} has no type, taken from CiA 402")
        data_type = standard.type
    if data_type is None:
        report.left_out(entry.source, f"{entry.key} {entry.name!r} has no known type")
        return None
    if standard is not None and data_type != standard.type:
        if _SAME_WIDTH.get(data_type) == standard.type:
            # A speed of -1 must not appear as 4294967295.
            report.repaired(
                entry.source,
                f"{entry.key} is {data_type} in the file, CiA 402 says {standard.type}",
            )
            also = (f"type {data_type} in {entry.source}",)
            data_type = standard.type
        else:
            report.noted(entry.source, f"{entry.key} is {data_type}, CiA 402 says {standard.type}")
    low, high, default = _limits(entry, data_type, report)
    return Parameter(
        key=entry.key,
        name=entry.name,
        group=entry.group or (standard.group if standard else _group(entry.index)),
        type=data_type,
        access=entry.access,
        pdo=entry.pdo,
        unit=entry.unit or (standard.unit if standard else ""),
        min_raw=low,
        max_raw=high,
        default_raw=default,
        enum=entry.enum or (dict(standard.enum) if standard else {}),
        bits=dict(standard.bits) if standard else {},
        settable=standard.settable if standard else "any",
        motor_individual=standard.motor_individual if standard else False,
        help="; ".join(t for t in (entry.help, standard.help if standard else "") if t),
        source=entry.source or entry.key,
        also_printed=also,
    )


def _limits(
    entry: DescribedEntry, data_type: DataType, report: ImportReport
) -> tuple[int | float | None, int | float | None, int | float | str | None]:
    low, high, default = entry.min_raw, entry.max_raw, entry.default_raw
    if data_type != entry.type and data_type in INTEGER_RANGE:
        low, high = _resigned(low, data_type), _resigned(high, data_type)
        default = _resigned(default, data_type) if isinstance(default, int) else default
    if low is not None and high is not None and low == high == 0:
        # Many tools write both as 0 where nobody gave any.
        report.noted(entry.source, f"{entry.key}: limits 0 and 0 are taken as not given")
        low = high = None
    if low is not None and high is not None and low > high:
        report.repaired(entry.source, f"{entry.key}: minimum {low} above maximum {high}, ignored")
        low = high = None
    if isinstance(default, (int, float)) and (
        (low is not None and default < low) or (high is not None and default > high)
    ):
        report.noted(entry.source, f"{entry.key}: default {default} is outside its own limits")
    return low, high, default


def _resigned(value: int | float | None, data_type: DataType) -> int | float | None:
    """The same bits under the other sign."""
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


def _units(base: Profile, parameters: dict[str, Parameter]) -> UnitSpec:
    """Units as the file gives them on the motion objects, else the standard's."""
    units = base.units

    def unit_of(key: str, otherwise: str) -> str:
        parameter = parameters.get(key)
        return parameter.unit if parameter is not None and parameter.unit else otherwise

    def present(key: str | None) -> str | None:
        return key if key in parameters else None

    return units.model_copy(
        update={
            "position": unit_of("607A:00", units.position),
            "velocity": unit_of("60FF:00", units.velocity),
            "acceleration": unit_of("6083:00", units.acceleration),
            "torque": unit_of("6071:00", units.torque),
            "gear_numerator": present(units.gear_numerator),
            "gear_denominator": present(units.gear_denominator),
            "feed": present(units.feed),
            "feed_revolutions": present(units.feed_revolutions),
        }
    )


def _modes(parameters: dict[str, Parameter]) -> tuple[int, ...]:
    """Modes that the drive's 6502h default names, else those whose objects it has."""
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
        return LinkSpec(kind="canopen", watchdog=watchdog, source=description.file)
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
            report.left_out(pdo.source, f"PDO {pdo.index:04X}h names objects without a type")
        if entries and pdo.index not in {s.index for s in sets}:
            sets.append(
                PdoSet(
                    index=pdo.index,
                    direction=pdo.direction,
                    entries=entries,
                    fixed=pdo.fixed,
                    source=pdo.source,
                )
            )
    receive = [s.index for s in sets if s.direction == "rx"]
    transmit = [s.index for s in sets if s.direction == "tx"]
    if not receive or not transmit:
        return None
    return PdoSpec(
        sets=tuple(sets),
        default_rx=receive[0],
        default_tx=transmit[0],
        max_entries=max(8, *(len(s.entries) for s in sets)),
        max_bytes=8 if description.link == "canopen" else None,
        remappable=not all(s.fixed for s in sets),
        source=description.file,
    )
