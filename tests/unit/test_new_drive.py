"""What `make new-drive` writes loads, passes the check and turns a virtual motor."""

from __future__ import annotations

import importlib.util
import runpy
from pathlib import Path
from typing import Any

import pytest

from drivers.virtual.firmware.servo import VirtualServo
from drivers.virtual.mechanics import standard_mechanics
from profiles.check import check
from profiles.loader import parse_profile

ROOT = Path(__file__).parents[2]
SCAFFOLD: dict[str, Any] = runpy.run_path(str(ROOT / ".ci" / "new_drive" / "__main__.py"))


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A project with what a family begins from."""
    generic = tmp_path / "profiles" / "generic402"
    generic.mkdir(parents=True)
    for name in ("parameters.yaml", "homing.yaml"):
        (generic / name).write_text((ROOT / "profiles" / "generic402" / name).read_text("utf-8"))
    return tmp_path


def test_a_new_family_is_sound_from_the_start(root: Path) -> None:
    SCAFFOLD["create"]("my_drive", "Maker MY-1", root)
    folder = root / "profiles" / "my_drive"
    profile = parse_profile({p.name: p.read_text("utf-8") for p in folder.glob("*.yaml")})
    assert (profile.drive, profile.title) == ("my_drive", "Maker MY-1")
    assert check(profile) == []
    module = root / "drivers" / "virtual" / "firmware" / "families" / "my_drive.py"
    spec = importlib.util.spec_from_file_location("my_drive", module)
    assert spec is not None
    assert spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    servo = VirtualServo(profile, loaded.family(profile), standard_mechanics())
    servo.advance(10_000_000)
    status = int.from_bytes(servo.read(0x6041, 0), "little")
    assert status & 0x4F == 0x40  # switch on disabled (CiA 402-2)


def test_nothing_that_exists_is_changed(root: Path) -> None:
    SCAFFOLD["create"]("my_drive", "Maker MY-1", root)
    module = root / "drivers" / "virtual" / "firmware" / "families" / "my_drive.py"
    module.write_text("mine")
    with pytest.raises(FileExistsError, match=r"my_drive\.py"):
        SCAFFOLD["create"]("my_drive", "Another", root)
    assert module.read_text() == "mine"


@pytest.mark.parametrize("name", ["My drive", "7up", "", "../up"])
def test_a_name_that_no_module_can_have_is_refused(root: Path, name: str) -> None:
    with pytest.raises(ValueError, match="small letters"):
        SCAFFOLD["create"](name, "Maker", root)
    assert list(root.glob("drivers/**/*.py")) == []
