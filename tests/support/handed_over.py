"""Drives whose values were changed, as sets; and fresh drives that get a start-up list."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.axes.motion.classes import motion_of
from backend.axes.parameters.set_file import ParameterSet, dump, parse, storable
from backend.records.handover.listed import ControllerList
from backend.records.handover.model import is_lock
from drivers.errors import DriveError
from drivers.link import Found
from drivers.objects.codec import decode, encode, size_of
from drivers.virtual.device import Device, SdoAbort
from drivers.virtual.firmware.factory import make_device
from profiles import load_profile
from profiles.importer import import_file
from profiles.schema import INTEGER_RANGE, Parameter, Profile, Raw

MAKERS = Path(__file__).resolve().parents[1] / "data" / "makers"
MAKERS_FILES = ("maker_a.xml", "maker_b.eds", "maker_c.xml")
OWN_FAMILIES = ("mms7", "m6l", "r6l", "ep3e", "ds_c", "el7")
EVERY = (*OWN_FAMILIES, *MAKERS_FILES)
SAVED = datetime(2026, 3, 4, 5, 6, tzinfo=UTC)
VENDOR, PRODUCT, REVISION = 0x0000_0A88, 0x0010_0001, 7


def profile_of(family: str) -> Profile:
    """Profile of a family of ours, or of what a maker's file describes."""
    if family in OWN_FAMILIES:
        return load_profile(family)
    data = (MAKERS / family).read_bytes()
    return import_file(data, family, drive=family.partition(".")[0]).profile


def settings(profile: Profile) -> list[Parameter]:
    """What belongs into a set and has an object of a fixed size."""
    return [
        p
        for p in storable(profile, motor_individual=False)
        if p.index is not None and size_of(p.type) is not None and motion_of(p) != "energises"
    ]


def values(device: Device, parameters: Iterable[Parameter]) -> dict[str, Raw]:
    """What the drive holds."""
    found: dict[str, Raw] = {}
    for p in parameters:
        assert p.index is not None
        assert p.subindex is not None
        found[p.key] = decode(p.type, device.read(p.index, p.subindex))
    return found


def _another(parameter: Parameter, raw: Raw) -> Raw:
    """A value that differs from ``raw`` and is legal by the profile, or ``raw`` itself."""
    if parameter.type not in INTEGER_RANGE:
        return 2.5 if isinstance(raw, float) else raw
    assert isinstance(raw, int)
    if parameter.enum:
        return next((value for value in sorted(parameter.enum) if value != raw), raw)
    low, high = parameter.raw_limits
    for value in (raw + 3, raw - 3, raw + 1, raw - 1):
        if (low is None or value >= low) and (high is None or value <= high):
            return value
    return raw


def tuned_device(profile: Profile, *, leave: Iterable[str] = ()) -> Device:
    """A virtual drive in which every setting that takes another value was given one."""
    device = make_device(profile)
    device.advance(0)
    kept = set(leave)
    # What locks the other parameters is written last.
    for p in sorted(settings(profile), key=lambda p: is_lock(profile, p)):
        if p.key in kept:
            continue
        assert p.index is not None
        assert p.subindex is not None
        raw = decode(p.type, device.read(p.index, p.subindex))
        try:
            device.write(p.index, p.subindex, encode(p.type, _another(p, raw)))
        except (SdoAbort, DriveError):
            continue
    return device


def set_of_device(profile: Profile, device: Device) -> ParameterSet:
    """The drive's parameter set, as `servodeck params dump` writes it."""
    drive = Drive("a", "axis one", profile, [])
    ident = profile.identity
    drive.found = Found(
        1,
        vendor_id=ident.vendor_id or VENDOR,
        product_code=ident.product_code or PRODUCT,
        revision=ident.revision or REVISION,
    )
    read = values(device, settings(profile))
    readings = [Reading(key, raw, raw, None) for key, raw in read.items()]
    return parse(dump(drive, readings, author="", notes="", saved=SAVED))


def replay(device: Device, listed: ControllerList) -> None:
    """Nothing but the writes of the list, in its order. A refusal fails the test."""
    for write in listed.writes:
        try:
            device.write(write.index, write.subindex, write.data)
        except SdoAbort as abort:
            raise AssertionError(f"{write.place}: {write.key}: {abort}") from abort
