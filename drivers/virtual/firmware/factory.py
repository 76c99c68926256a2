"""Creation of a virtual drive by the name of its family."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from drivers.texts.message import Unsuitable, text
from drivers.virtual.device import Device
from drivers.virtual.firmware import families
from drivers.virtual.firmware.motion.load_encoder import without_load_encoder
from drivers.virtual.firmware.rough.rough_feedback import without_lacking
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import MechanicsSpec, standard_mechanics
from profiles.loader import load_profile
from profiles.schema import Profile


def make_device(
    drive: str | Profile,
    mechanics: MechanicsSpec | Mapping[str, object] | None = None,
    nvm_dir: Path | None = None,
    station: int = 1,
) -> Device:
    """Create a drive of this family with its own NVM file ``<drive>-<station>.json``.

    A drive of an imported profile behaves according to CiA 402 and has the objects of the
    manufacturer's file; the function of the manufacturer's own objects is not in the file, so they
    only keep their values.

    ``drive`` is a family's name or its loaded profile; ``mechanics`` a checked spec, the plain
    table of a bench file, or None for the standard axis. ``nvm_dir`` is the folder of the NVM file.

    Raises:
        ValueError: no virtual drive of this family, or mechanics that are not valid.
        ProfileError: the profile is missing or wrong.
    """
    profile = load_profile(drive) if isinstance(drive, str) else drive
    known = families.names()
    name = profile.drive
    if name not in known and profile.from_description:
        _require_known_units(profile)
        _require_whole_bytes(profile)
        name = "generic402"
    if name not in known:
        raise Unsuitable(text("mechanics.no-virtual", drive=profile.drive, known=", ".join(known)))
    if mechanics is None:
        mechanics = standard_mechanics()
    elif not isinstance(mechanics, MechanicsSpec):
        mechanics = MechanicsSpec.model_validate(dict(mechanics))
    profile = without_lacking(profile, mechanics.rough_feedback)
    # The family decides by the objects that this drive has.
    family = families.family_of(profile, name)
    profile = without_load_encoder(profile, mechanics.load_encoder)
    if family.supply_v is not None and "supply" not in mechanics.model_fields_set:
        supply = mechanics.supply.model_copy(update={"voltage_v": family.supply_v})
        mechanics = mechanics.model_copy(update={"supply": supply})
    return VirtualServo(
        profile,
        family,
        mechanics,
        nvm_path=None if nvm_dir is None else nvm_dir / f"{profile.drive}-{station}.json",
        station=station,
        seed=station,
    )


#: Units in which the virtual firmware computes; any other would silently be a wrong speed.
_POSITIONS = re.compile(r"inc")
_RATES = re.compile(r"inc/s²?|(0\.\d+ )?rpm(/s)?")


def _require_known_units(profile: Profile) -> None:
    """Raise ValueError if the file states units that this firmware does not support."""
    units = profile.units
    for quantity, unit, known in (
        ("position", units.position, _POSITIONS),
        ("velocity", units.velocity, _RATES),
        ("acceleration", units.acceleration, _RATES),
    ):
        if known.fullmatch(unit) is None:
            raise Unsuitable(
                text(
                    "mechanics.no-virtual-units",
                    drive=profile.drive,
                    quantity=quantity,
                    unit=unit,
                )
            )


def _require_whole_bytes(profile: Profile) -> None:
    """Raise ValueError if process data contain single bits, which this firmware cannot map."""
    for pdo in profile.pdo.sets if profile.pdo is not None else ():
        if any(part.bits % 8 for part in pdo.layout):
            raise Unsuitable(
                text("mechanics.no-virtual-bits", drive=profile.drive, index=pdo.index)
            )


def number_device(device: Device, serial: int) -> None:
    """Set the serial number (1018h:04) of a drive made here; other devices keep their own."""
    if isinstance(device, VirtualServo):
        device.od.make_own("1018:04", serial)
