"""A virtual drive by the name of its family."""

from __future__ import annotations

from pathlib import Path

from drivers.virtual.device import Device
from drivers.virtual.firmware.families.base import Family
from drivers.virtual.firmware.families.mms7 import Mms7
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import MechanicsSpec
from profiles.loader import load_profile

FAMILIES: dict[str, Family] = {"mms7": Mms7()}


def make_device(
    drive: str, mechanics: MechanicsSpec, nvm_dir: Path | None = None, station: int = 1
) -> Device:
    """A drive of this family with its own NVM file ``<drive>-<station>.json`` in ``nvm_dir``.

    Raises:
        ValueError: no virtual drive of this family.
        ProfileError: the profile is missing or wrong.
    """
    family = FAMILIES.get(drive)
    if family is None:
        raise ValueError(f"no virtual {drive!r}; there are: {', '.join(sorted(FAMILIES))}")
    return VirtualServo(
        load_profile(drive),
        family,
        mechanics,
        nvm_path=None if nvm_dir is None else nvm_dir / f"{drive}-{station}.json",
        station=station,
        seed=station,
    )
