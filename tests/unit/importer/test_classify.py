"""A person gives an object of an imported profile a motion class: what is kept, what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from backend.cli import app
from drivers.texts.motion_classes import refusal_text
from profiles import load_profile
from profiles.importer import import_file, write_profile
from profiles.motion.decisions import FILE_NAME, CannotClassify, classify, forget

EDS = b"""[DeviceInfo]
VendorName=Maker
ProductName=Drive
[6040]
ParameterName=Controlword
DataType=6
AccessType=rww
PDOMapping=1
[6041]
ParameterName=Statusword
DataType=6
AccessType=ro
[2005]
ParameterName=Gain
DataType=6
AccessType=rw
[2006]
ParameterName=Start
DataType=6
AccessType=rw
[2007]
ParameterName=State
DataType=6
AccessType=ro
"""
RUN = CliRunner()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    mine = tmp_path / "mine"
    monkeypatch.setenv("SERVODECK_PROFILES", str(mine))
    monkeypatch.setenv("SERVODECK_CACHE", str(tmp_path / "cache"))
    write_profile(import_file(EDS, "drive.eds", drive="my_drive").profile, mine)
    return mine / "my_drive"


def test_an_object_gets_a_class_and_loses_it(folder: Path) -> None:
    assert load_profile("my_drive").by_key["2005:00"].motion_origin == "unclassified"
    now = classify("my_drive", "2005:00", "at_enable", reason="page 12", safe_in_motion=True)
    assert (now.motion, now.safe_in_motion, now.motion_origin) == ("at_enable", True, "person")
    assert now.motion_reason == "page 12"
    again = classify("my_drive", "2005:00", "none", reason="page 13")
    assert (again.motion, again.safe_in_motion) == ("none", False)
    classify("my_drive", "2006:00", "at_enable", reason="tried")
    loaded = load_profile("my_drive")
    assert (loaded.by_key["2005:00"].motion, loaded.by_key["2006:00"].motion) == (
        "none",
        "at_enable",
    )
    assert forget("my_drive", "2005:00").motion == "energises"
    assert load_profile("my_drive").by_key["2006:00"].motion == "at_enable"
    forget("my_drive", "2006:00")
    assert not (folder / FILE_NAME).exists()


@pytest.mark.parametrize(
    ("drive", "key", "code"),
    [
        ("my_drive", "6040:00", "motion.class-of-standard"),
        ("my_drive", "2007:00", "motion.class-not-writable"),
        ("my_drive", "2999:00", "motion.class-of-no-parameter"),
        ("m6l", "2003:02", "motion.class-from-manual"),
        ("generic402", "6040:00", "motion.class-from-manual"),
    ],
)
def test_what_no_person_may_classify(folder: Path, drive: str, key: str, code: str) -> None:
    assert folder.exists()
    before = load_profile(drive).parameter(key)
    with pytest.raises(CannotClassify) as refused:
        classify(drive, key, "none", reason="I say so")
    assert refused.value.code == code
    assert key in refusal_text(refused.value).words("zh")
    assert load_profile(drive).parameter(key) == before


def test_a_class_needs_a_reason_and_only_at_enable_is_safe(folder: Path) -> None:
    with pytest.raises(CannotClassify, match="class-needs-reason"):
        classify("my_drive", "2005:00", "none", reason="  ")
    with pytest.raises(ValueError, match="at_enable"):
        classify("my_drive", "2005:00", "none", reason="x", safe_in_motion=True)
    assert not (folder / FILE_NAME).exists()


def test_the_command_line_classifies_with_an_audit_line(folder: Path, tmp_path: Path) -> None:
    state = tmp_path / "state"
    place = ["--config", str(state)]
    done = RUN.invoke(
        app,
        ["profile", "classify", "my_drive", "2005:00", "at_enable", "--reason", "page 12", *place],
    )
    assert done.exit_code == 0, done.output
    assert "2005:00 Gain: at_enable" in done.output
    exported = RUN.invoke(app, ["audit", "export", "--config", str(state)])
    assert exported.exit_code == 0, exported.output
    assert "/profiles/my_drive/parameters/2005:00/motion" in exported.output
    assert "page 12" in exported.output
    assert "energises" in exported.output  # what it was before
    refused = RUN.invoke(
        app, ["profile", "classify", "my_drive", "6040:00", "none", "--reason", "x", *place]
    )
    assert refused.exit_code != 0
    assert "standard" in refused.output
    unknown = RUN.invoke(
        app, ["profile", "classify", "my_drive", "2005:00", "harmless", "--reason", "x", *place]
    )
    assert unknown.exit_code != 0
    back = RUN.invoke(app, ["profile", "classify", "my_drive", "2005:00", "forget", *place])
    assert back.exit_code == 0, back.output
    assert load_profile("my_drive").by_key["2005:00"].motion == "energises"


def test_profile_check_counts_what_nobody_has_classified(folder: Path) -> None:
    assert folder.exists()
    done = RUN.invoke(app, ["profile", "check", "my_drive"])
    assert done.exit_code == 0, done.output
    assert "0 none, 0 at_enable, 3 energises; 2 not classified" in done.output
