"""A virtual drive of the user's own family ``mms7foe``: an MMS7 that takes firmware by FoE."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from pathlib import Path

from drivers.virtual.device import Device
from drivers.virtual.firmware.families.mms7 import Mms7
from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import standard_mechanics
from profiles.loader import load_profile

NAME = "mms7foe"
FACTORY = "tests.support.firmware_drive:make_device"


def write_profile(folder: Path) -> None:
    """The MMS7's profile under its own name, with FoE, into a folder of user profiles."""
    source = Path(__file__).resolve().parents[2] / "profiles" / "mms7"
    shutil.copytree(source, folder / NAME)
    path = folder / NAME / "profile.yaml"
    text = path.read_text("utf-8")
    changed = text.replace("drive: mms7", f"drive: {NAME}", 1).replace("foe: false", "foe: true", 1)
    assert changed.count(NAME) == 1
    assert "foe: true" in changed
    path.write_text(changed, "utf-8")


def make_device(
    drive: str, _mechanics: Mapping[str, object] | None, nvm: Path | None, station: int
) -> Device:
    """As `drivers.virtual.firmware.factory.make_device`, for this family alone."""
    assert os.environ["SERVODECK_PROFILES"]
    path = None if nvm is None else nvm / f"{drive}-{station}.json"
    return VirtualServo(
        load_profile(drive),
        Mms7(),
        standard_mechanics(),
        nvm_path=path,
        station=station,
        seed=station,
    )
