"""The files of a hand-over, by format: the list itself and what lies beside it."""

from __future__ import annotations

from datetime import datetime
from typing import Literal, get_args

from backend.handover import text_lists, xml_lists
from backend.handover.model import AxisHandover
from drivers.errors import NotAllowed

Format = Literal["twincat", "codesys", "eni", "lcec", "ros2", "igh", "dcf", "csv", "python"]
FORMATS: tuple[str, ...] = get_args(Format)
_ETHERCAT_ONLY = ("twincat", "codesys", "eni", "lcec", "igh")


def files_of(
    axis: AxisHandover, form: Format, name: str, saved: datetime | None
) -> dict[str, bytes]:
    """File names and contents; the first one is the list, the last one the scaling sheet.

    Raises:
        NotAllowed: the drive is not on such a bus, or the format needs an identity that is unknown.
    """
    on_ethercat = axis.profile.link("ethercat") is not None
    if form in _ETHERCAT_ONLY and not on_ethercat:
        raise NotAllowed("handover.no-ethercat-drive", profile_title=axis.profile.title, form=form)
    if form == "ros2" and not on_ethercat and axis.profile.link("canopen") is None:
        raise NotAllowed("handover.neither-ethercat-nor-canopen", profile_title=axis.profile.title)
    files = _list(axis, form, name, saved, on_ethercat=on_ethercat)
    files[f"{name}.scaling.txt"] = text_lists.sheet(axis)
    return files


def _list(
    axis: AxisHandover, form: Format, name: str, saved: datetime | None, *, on_ethercat: bool
) -> dict[str, bytes]:
    match form:
        case "twincat":
            return {name: xml_lists.twincat(axis)}
        case "codesys":
            return {name: text_lists.codesys(axis)}
        case "eni":
            return {name: xml_lists.eni(axis)}
        case "lcec":
            return {name: xml_lists.lcec(axis), f"{name}.hal": xml_lists.hal_stub(axis, name)}
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
        case "ros2" if on_ethercat:
            return {name: text_lists.ros2(axis)}
        case "ros2":
            other = f"{name}.dcf"
            return {
                name: text_lists.bus_yml(axis, other),
                other: text_lists.dcf(axis, other, saved),
            }
