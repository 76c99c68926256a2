"""Parameter sets as device configuration files (CiA 306-1 v1.3), the format of CANopen tools."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime

from backend.axes.drive.readings import Reading
from backend.axes.parameters.csv_list import ParameterList, first
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
from profiles.schema import Profile, Raw


def write_dcf(
    profile: Profile, rows: Iterable[Row], *, file_name: str, node_name: str, created: datetime
) -> tuple[str, int]:
    """The file's text, and the number of rows left out.

    They have no object, or are texts that the format cannot hold.
    """
    values: dict[str, Raw] = {}
    left_out = 0
    for row in rows:
        parameter = profile.by_key.get(row.key)
        if row.raw is None:
            continue
        no_object = parameter is None or parameter.index is None or parameter.type == "OCTETS"
        if no_object or not holds(row.raw):
            left_out += 1
        else:
            values[row.key] = row.raw
    text = export_dcf(profile, values, created, file_name=file_name, node_name=node_name)
    return text, left_out


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
