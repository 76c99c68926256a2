"""Parameter sets as device configuration files (CiA 306-1 v1.3), the format of CANopen tools."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import datetime

from backend.axes.drive.readings import Reading
from backend.axes.parameters.csv_list import LeftOut, ParameterList, first
from backend.axes.parameters.set_file import BadSet, Row
from drivers.texts.imports import failure_text, finding_line
from drivers.texts.message import Text, text
from profiles.importer import (
    ImportFailed,
    ImportReport,
    export_dcf,
    holds,
    read_dcf_identity,
    read_dcf_values,
)
from profiles.importer.values import default_value
from profiles.schema import INTEGER_RANGE, Parameter, Profile, Raw

#: No finite REAL32 is as large (IEEE 754).
_REAL32_END = 2**128


def write_dcf(
    profile: Profile, rows: Iterable[Row], *, file_name: str, node_name: str, created: datetime
) -> tuple[str, tuple[LeftOut, ...]]:
    """The file's text, and the rows that the format cannot hold."""
    values: dict[str, Raw] = {}
    left_out: list[LeftOut] = []
    for row in rows:
        why = _not_held(profile, row, values)
        if why is not None:
            left_out.append(LeftOut(row.key, why))
        elif row.raw is not None:
            values[row.key] = row.raw
    content = export_dcf(profile, values, created, file_name=file_name, node_name=node_name)
    return content, tuple(left_out)


def _not_held(profile: Profile, row: Row, earlier: Mapping[str, Raw]) -> Text | None:
    """Why a row cannot be in a DCF; None where it can."""
    parameter = profile.by_key.get(row.key)
    if row.raw is None:
        return row.problem or text("sets.left-out-no-value")
    if parameter is None:
        return text("sets.row-no-parameter", profile_title=profile.title, key=row.key)
    if row.key in earlier:
        return text("sets.row-twice")
    if parameter.index is None:
        return text("sets.left-out-no-object")
    if parameter.type == "OCTETS":
        return text("sets.left-out-octets")
    if not _of_type(parameter, row.raw):
        return text("sets.left-out-type", raw=str(row.raw)[:40], type=parameter.type)
    return None if holds(row.raw) else text("sets.left-out-text")


def _of_type(parameter: Parameter, raw: Raw) -> bool:
    if parameter.type == "STRING" or isinstance(raw, str):
        return parameter.type == "STRING" and isinstance(raw, str)
    if parameter.type == "REAL32":
        return abs(raw) < _REAL32_END
    low, high = INTEGER_RANGE[parameter.type]
    return isinstance(raw, int) and low <= raw <= high


def read_dcf(data: bytes, profile: Profile, name: str = "the file") -> ParameterList:
    """Values that a DCF configures, for drives of ``profile``.

    Raises:
        BadSet: too large, damaged, an EDS without values, or for another kind of drive.
    """
    report = ImportReport()
    readings: dict[str, Reading] = {}
    problems: list[Text] = []
    try:
        problems += _of_another_drive(data, profile, name)
        for value in read_dcf_values(data, name, report):
            key = f"{value.index:04X}:{value.subindex:02X}"
            parameter = profile.by_key.get(key)
            if parameter is None:
                unknown = text("sets.line-no-parameter", title=profile.title, word=key)
                problems.append(text("sets.line", line=value.line, cause=unknown))
                continue
            place = f"{name}:{value.line}"
            raw, _ = default_value(value.text, parameter.type, place, report, "ParameterValue")
            if raw is None:
                wrong = text("sets.line-wrong-type", key=key, word=value.text[:40])
                problems.append(text("sets.line", line=value.line, cause=wrong))
            else:
                readings[key] = Reading(key, raw, parameter.to_value(raw), None)
    except ImportFailed as error:
        raise BadSet(failure_text(error), remedy="sets.choose-dcf-or-csv") from error
    problems += [finding_line(finding) for finding in report.findings]
    if not readings:
        raise BadSet(
            "sets.no-value-choose-file",
            name=name,
            profile_title=profile.title,
            first=first(problems),
        )
    return ParameterList(tuple(readings.values()), tuple(problems))


def _of_another_drive(data: bytes, profile: Profile, name: str) -> list[Text]:
    """Compare the identity in the file with the profile; a warning for another product.

    The same objects have other meanings in another maker's drive.

    Raises:
        BadSet: the file is for another maker's drive.
        ImportFailed: too large.
    """
    vendor, product = read_dcf_identity(data, name)
    ours = profile.identity
    if vendor is not None and ours.vendor_id and vendor != ours.vendor_id:
        raise BadSet(
            "sets.drive-vendor",
            value=vendor,
            limit=f"{ours.vendor_id:08X}h",
            name=name,
            profile_title=profile.title,
            vendor_id=ours.vendor_id,
        )
    if product is not None and ours.product_code and product != ours.product_code:
        return [text("sets.other-product", name=name, product=product, ours=ours.product_code)]
    return []
