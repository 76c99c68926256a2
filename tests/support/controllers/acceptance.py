"""Every family in every format: what its controller makes of the list, and what the drive holds."""

from __future__ import annotations

import contextlib
import io
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any
from unittest import mock

import httpx

from backend.records.handover.files import FORMATS, Format, files_of, fitting
from backend.records.handover.model import AxisHandover, hand_over
from drivers.errors import NotAllowed
from drivers.objects.codec import decode, encode
from drivers.virtual.device import Device
from drivers.virtual.firmware.factory import make_device
from profiles.schema import Raw
from tests.support.controllers import text_files, xml_files
from tests.support.controllers.consumed import Consumed, need
from tests.support.controllers.segment import bring_up, in_every_cycle, with_esi
from tests.support.handed_over import (
    EVERY,
    SAVED,
    profile_of,
    set_of_device,
    settings,
    tuned_device,
    values,
)

_CONSUMERS: dict[str, Callable[[dict[str, bytes]], Consumed]] = {
    "twincat": lambda files: xml_files.twincat(files["list"]),
    "codesys": lambda files: text_files.codesys(files["list"]),
    "eni": lambda files: xml_files.eni(files["list"]),
    "lcec": lambda files: xml_files.lcec(files["list"]),
    "igh": lambda files: text_files.igh(files["list"]),
    "dcf": lambda files: text_files.dcf(files["list"]),
    "csv": lambda files: text_files.table(files["list"]),
}
NO_ETHERCAT = "–"


@dataclass(frozen=True)
class Outcome:
    """One family in one format."""

    family: str
    format: str
    writes: int
    """That the controller took, all of them as they were handed over; 0 where the drive is on
    no such bus."""
    replayed: str
    """How a fresh drive got them."""


@cache
def axis_of(family: str) -> AxisHandover:
    """A tuned drive's hand-over, with its ESI file where it is an EtherCAT drive."""
    profile = profile_of(family)
    if profile.link("ethercat") is not None:
        return with_esi(family)
    return hand_over(set_of_device(profile, tuned_device(profile)), profile)


@cache
def tuned(family: str) -> dict[str, Raw]:
    """What the tuned drive holds, and so its set."""
    profile = profile_of(family)
    return values(tuned_device(profile), settings(profile))


def consumed(form: Format, files: dict[str, bytes], axis: AxisHandover) -> Consumed:
    """What the format's controller understands of the files."""
    if form != "ros2":
        return _CONSUMERS[form](files)
    if axis.profile.link("ethercat") is not None:
        return text_files.ros2_ethercat(files["list"])
    return text_files.ros2_canopen(files)


def outcome(family: str, form: Format) -> Outcome:
    """Export, consume, compare with what was handed over, and replay.

    Raises:
        Refused: the controller does not take the file or understands something else.
    """
    whole = axis_of(family)
    try:
        files = files_of(whole, form, "list", SAVED)
    except NotAllowed:
        need(whole.profile.link("ethercat") is None, f"{family} in {form}")
        return Outcome(family, form, 0, NO_ETHERCAT)
    axis = fitting(whole, form)
    if form == "python":
        return Outcome(family, form, len(axis.writes), _by_script(files["list"], family, axis))
    taken = consumed(form, files, axis)
    _same(taken, axis)
    if form == "dcf":
        in_order = text_files.concise(files["list.1f22.bin"])
        _same(in_order, axis)
        taken = in_order
    if axis.profile.link("ethercat") is None:
        device = make_device(axis.profile)
        device.advance(0)
        for index, subindex, data, _ in taken.writes:
            device.write(index, subindex, data)
        _holds(values(device, settings(axis.profile)), family, axis, set())
        return Outcome(family, form, len(taken.writes), "SDO")
    states, now = bring_up(axis, taken)
    need(states == [8], f"AL states {states}")
    _holds(now, family, axis, in_every_cycle(axis))
    return Outcome(family, form, len(taken.writes), "to OP")


def _holds(now: dict[str, Raw], family: str, axis: AxisHandover, cyclic: set[str]) -> None:
    """The drive's dump is the set, but for what the hand-over names."""
    wanted = tuned(family)
    named = {each.key for each in axis.left_out} | cyclic
    different = {key for key in now if now[key] != wanted[key]}
    need(different <= named, f"other values in the drive: {sorted(different - named)}")
    need(cyclic <= {w.key for w in axis.writes}, "values of every cycle that are not written")


def _same(taken: Consumed, axis: AxisHandover) -> None:
    read = [(index, subindex, data) for index, subindex, data, _ in taken.writes]
    wanted = [(w.index, w.subindex, w.data) for w in axis.writes]
    need(
        (read if taken.ordered else sorted(read)) == (wanted if taken.ordered else sorted(wanted)),
        "other writes than those that were handed over",
    )
    need({each for *_, each in taken.writes} <= {"PS", ""}, "another transition")
    if taken.pdos:
        need(
            taken.pdos
            == {p.index: [(e.index, e.subindex, e.bits) for e in p.entries] for p in axis.pdos},
            "other process data",
        )
    need(taken.identity in (None, (axis.vendor_id, axis.product_code)), "another identity")
    need(taken.cycle_us in (None, axis.cycle_us), "another cycle")
    need(taken.assign_activate in (None, axis.assign_activate), "another clock")


def _by_script(script: bytes, family: str, axis: AxisHandover) -> str:
    """The script against a server that answers its two routes with a fresh drive."""
    device = make_device(axis.profile)
    device.advance(0)
    names: dict[str, Any] = {"__name__": "script"}
    exec(compile(script, "list.py", "exec"), names)
    client = httpx.Client

    def with_device(**options: Any) -> httpx.Client:
        return client(transport=httpx.MockTransport(_Server(axis, device)), **options)

    said = io.StringIO()
    with (
        mock.patch.object(httpx, "Client", with_device),
        mock.patch.object(sys, "argv", ["list.py", "http://server", "x"]),
        contextlib.redirect_stdout(said),
    ):
        code = names["main"]()
    need(code == 0, f"the script ended with {code}")
    _holds(values(device, settings(axis.profile)), family, axis, set())
    return "by API"


class _Server:
    def __init__(self, axis: AxisHandover, device: Device) -> None:
        self.axis, self.device = axis, device

    def __call__(self, request: httpx.Request) -> httpx.Response:
        if request.method == "GET":
            return httpx.Response(200, json=[{"id": "x", "profile": self.axis.profile.drive}])
        parameter = self.axis.profile.by_key[request.url.path.rpartition("/")[2]]
        assert parameter.index is not None
        assert parameter.subindex is not None
        raw = json.loads(request.content)["raw"]
        self.device.write(parameter.index, parameter.subindex, encode(parameter.type, raw))
        held = decode(parameter.type, self.device.read(parameter.index, parameter.subindex))
        return httpx.Response(200, json={"raw": held})


def table(found: list[Outcome]) -> str:
    """Families down, formats across: values taken and how they were replayed."""
    cells = {(each.family, each.format): each for each in found}
    lines = [
        "| | " + " | ".join(f"`{form}`" for form in FORMATS) + " |",
        "|---" * (len(FORMATS) + 1) + "|",
    ]
    for family in EVERY:
        row = [cells[family, form] for form in FORMATS]
        words = [f"{c.writes} {c.replayed}" if c.writes else c.replayed for c in row]
        lines.append(f"| {family} | " + " | ".join(words) + " |")
    return "\n".join(lines)
