"""The files of a hand-over, by format: the list itself and its accompanying files."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from typing import Literal, get_args

from backend.records.handover import ros2_files, text_lists, xml_lists
from backend.records.handover.eni import eni, is_complete
from backend.records.handover.model import AxisHandover
from drivers.errors import NotAllowed
from drivers.texts.message import Text, text
from profiles.importer.esi.controller import SlaveController, Wanted

Format = Literal["twincat", "codesys", "eni", "lcec", "ros2", "igh", "dcf", "csv", "python"]
FORMATS: tuple[str, ...] = get_args(Format)
#: Formats that can contain a whole segment.
SEGMENT_FORMATS: tuple[Format, ...] = ("eni", "lcec", "ros2")
#: Usual file suffix of each format, for a file without a given name.
SUFFIXES: dict[Format, str] = {
    "twincat": ".xml", "codesys": ".csv", "eni": ".xml", "lcec": ".xml", "ros2": ".yaml",
    "igh": ".sh", "dcf": ".dcf", "csv": ".csv", "python": ".py",
}  # fmt: skip
#: Formats by which a controller compares vendor ID and product code with the drive's own.
_WITH_IDENTITY = ("eni", "lcec", "ros2")
_ETHERCAT_ONLY = ("twincat", "codesys", "eni", "lcec", "igh")


def files_of(
    what: AxisHandover | Sequence[AxisHandover], form: Format, name: str, saved: datetime | None
) -> dict[str, bytes]:
    """File names and contents; the first is the list, the last ones are the scaling sheets.

    Several drives form a segment in the order of the cable.

    Raises:
        NotAllowed: the drive is not on such a bus, the format needs an identity that is unknown,
            or the format is for a single drive.
    """
    axes = [what] if isinstance(what, AxisHandover) else list(what)
    if not axes or (len(axes) > 1 and form not in SEGMENT_FORMATS):
        raise NotAllowed(
            "handover.holds-drive-not",
            value=form,
            axes=len(axes),
            segment_formats=", ".join(SEGMENT_FORMATS),
        )
    for axis in axes:
        _require_bus(axis, form)
    axes = [fitting(axis, form) for axis in axes]
    files = _list(axes, form, name, saved)
    for number, axis in enumerate(axes, 1):
        place = "" if len(axes) == 1 else f".{number}"
        files[f"{name}{place}.scaling.txt"] = text_lists.sheet(axis)
    return files


def fitting(axis: AxisHandover, form: Format) -> AxisHandover:
    """The axis with the writes that this format can express; others are left out, with the reason.

    Raises:
        NotAllowed: the format cannot express any of them.
    """
    return ros2_files.carried(axis) if form == "ros2" else axis


def remarks(axes: Sequence[AxisHandover], form: Format) -> tuple[Text, ...]:
    """Notes on this format that a person must know before using the file."""
    found = []
    if form == "eni" and not is_complete(axes):
        found.append(text("handover.note-incomplete-eni"))
    found += [
        text("handover.note-no-vendor", drive=axis.name)
        for axis in axes
        if form in _WITH_IDENTITY and axis.vendor_id == 0 and axis.profile.link("ethercat")
    ]
    return tuple(found)


def wanted_of(axes: Sequence[AxisHandover]) -> tuple[Wanted, ...]:
    """Identities by which the devices are found in ESI files.

    Raises:
        NotAllowed: an identity is unknown.
    """
    return tuple((*axis.identity(), axis.revision) for axis in axes)


def with_controllers(
    axes: Sequence[AxisHandover], controllers: Sequence[SlaveController]
) -> list[AxisHandover]:
    """Each axis with the slave controller of its own ESI file."""
    return [replace(axis, controller=found) for axis, found in zip(axes, controllers, strict=True)]


def digest(data: bytes) -> str:
    """SHA-256 of a file, by which a report identifies it."""
    return hashlib.sha256(data).hexdigest()


def _require_bus(axis: AxisHandover, form: Format) -> None:
    on_ethercat = axis.profile.link("ethercat") is not None
    if form in _ETHERCAT_ONLY and not on_ethercat:
        raise NotAllowed("handover.no-ethercat-drive", profile_title=axis.profile.title, form=form)
    if form == "ros2" and not on_ethercat and axis.profile.link("canopen") is None:
        raise NotAllowed("handover.neither-ethercat-nor-canopen", profile_title=axis.profile.title)


def _list(
    axes: list[AxisHandover], form: Format, name: str, saved: datetime | None
) -> dict[str, bytes]:
    axis = axes[0]
    match form:
        case "twincat":
            return {name: xml_lists.twincat(axis)}
        case "codesys":
            return {name: text_lists.codesys(axis)}
        case "eni":
            return {name: eni(axes)}
        case "lcec":
            return {name: xml_lists.lcec(axes), f"{name}.hal": xml_lists.hal_stub(axes, name)}
        case "igh":
            return {name: text_lists.igh(axis)}
        case "csv":
            return {name: text_lists.csv_table(axis)}
        case "python":
            return {name: text_lists.python(axis)}
        case "dcf":
            return {
                name: text_lists.dcf(axis, name, saved),
                f"{name}.1f22.bin": text_lists.concise_dcf(axis),
            }
        case "ros2":
            return _ros2(axes, name, saved)


def _ros2(axes: list[AxisHandover], name: str, saved: datetime | None) -> dict[str, bytes]:
    wired = [axis.profile.link("ethercat") is not None for axis in axes]
    if any(wired) and not all(wired):
        raise NotAllowed("handover.drives-ethercat-canopen-no")
    if len(axes) == 1 and all(wired):
        return {name: ros2_files.ros2(axes[0])}
    suffix = "yaml" if all(wired) else "dcf"
    others = [
        f"{name}.{suffix}" if len(axes) == 1 else f"{name}.{number}.{suffix}"
        for number in range(1, len(axes) + 1)
    ]
    if all(wired):
        files = {name: ros2_files.ros2_control(axes, others)}
        return files | {
            other: ros2_files.ros2(axis) for other, axis in zip(others, axes, strict=True)
        }
    files = {name: ros2_files.bus_yml(axes, others)}
    return files | {
        other: text_lists.dcf(axis, other, saved, reals_as_bits=True)
        for other, axis in zip(others, axes, strict=True)
    }
