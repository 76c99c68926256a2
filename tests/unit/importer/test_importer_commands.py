"""The command line around the importer, and the user's own folder of profiles."""

from __future__ import annotations

from pathlib import Path

import pytest
from importer_samples import GOOD_EDS, GOOD_ESI
from typer.testing import CliRunner

from backend.commands.drive.profile import app
from profiles.check import check
from profiles.loader import drive_names, load_profile


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SERVODECK_PROFILES", str(tmp_path / "mine"))
    monkeypatch.setenv("SERVODECK_CACHE", str(tmp_path / "cache"))
    return tmp_path


def test_an_imported_file_is_a_drive_like_any_other(folder: Path) -> None:
    source = folder / "good.eds"
    source.write_text(GOOD_EDS, "utf-8")
    done = CliRunner().invoke(app, ["import", str(source), "--name", "my_servo_eds"])
    assert done.exit_code == 0, done.output
    assert "use it as my_servo_eds" in done.output
    assert "my_servo_eds" in drive_names()
    assert load_profile("my_servo_eds").by_key["2010:00"].unit == "1/s"
    assert check(load_profile("my_servo_eds")) == []
    again = CliRunner().invoke(app, ["import", str(source), "--name", "my_servo_eds"])
    assert again.exit_code != 0
    assert "my_servo_eds" in again.output
    out = folder / "out.eds"
    assert CliRunner().invoke(app, ["export-eds", "my_servo_eds", str(out)]).exit_code == 0
    assert "[2010]" in out.read_text("utf-8")


def test_a_device_of_an_esi_file_is_chosen(folder: Path) -> None:
    source = folder / "good.xml"
    source.write_text(GOOD_ESI, "utf-8")
    arguments = ["import", str(source), "--name", "my_servo_esi", "--product-code", "0x191"]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    assert load_profile("my_servo_esi").identity.product_code == 0x191


def test_a_broken_file_is_refused_in_words(folder: Path) -> None:
    source = folder / "broken.xml"
    source.write_text("<EtherCATInfo>", "utf-8")
    done = CliRunner().invoke(app, ["import", str(source)])
    assert done.exit_code == 1
    assert "not well-formed" in done.output


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["show", "nosuch"], "no profile named 'nosuch'"),
        (["import", "@none.eds"], "none.eds: No such file"),
        (["import", "@good.eds", "--name", "a/b"], "'a/b' cannot be the name of a profile"),
        (["import", "@good.eds", "--name", "mms7"], "there is a profile 'mms7' already"),
        (
            ["import", "@good.xml", "--product-code", "many"],
            "--product-code 'many' is not a number",
        ),
        (["from-drive", "mlink:///x", "--name", "A"], "'A' cannot be the name"),
        (["export-eds", "mms7", "@"], "could not be written: Is a directory"),
    ],
)
def test_errors_are_one_sentence_and_exit_code_1(folder: Path, words: list[str], says: str) -> None:
    (folder / "good.eds").write_text(GOOD_EDS, "utf-8")
    (folder / "good.xml").write_text(GOOD_ESI, "utf-8")
    done = CliRunner().invoke(app, [w.replace("@", f"{folder}/") for w in words])
    assert done.exit_code == 1, done.output
    assert done.stderr.startswith("error: ")
    assert says in done.stderr
    assert "Usage" not in done.stderr


def test_the_generic_profile_is_sound() -> None:
    assert check(load_profile("generic402")) == []
