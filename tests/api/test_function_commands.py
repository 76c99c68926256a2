"""The commands about terminals, faults, gear and braking, on a virtual drive."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from backend.cli import app
from backend.station.demo import DemoBench
from drivers.texts.message import speaking

CHINESE = re.compile("[\u4e00-\u9fff]")
runner = CliRunner()


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = Path(tmp_path_factory.mktemp("commands"))
    bench = folder / "bench.toml"
    bench.write_text('[[axis]]\nname = "X"\ndrive = "mms7"\non = "mlink://virtual0"\nstation = 1\n')
    with DemoBench(bench, folder / "wires", folder / "nvm") as drives:
        yield drives.addresses["mlink://virtual0"]


def call(*arguments: str, code: int = 0) -> str:
    result = runner.invoke(app, arguments)
    assert result.exit_code == code, result.output
    return result.output


@pytest.mark.long
def test_terminals(url: str) -> None:
    found = json.loads(call("io", url, "--profile", "mms7", "--json"))
    assert [terminal["name"] for terminal in found] == ["DI1", "DI2", "DI3", "DI4", "DO1", "DO2"]
    assert found[0]["function_name"] == "not used"
    assert "DI1" in call("io", url, "--profile", "mms7")


def test_faults(url: str) -> None:
    found = json.loads(call("faults", url, "--profile", "mms7", "--json"))
    assert found == {"active": [], "past": []}
    assert "20 past faults" in call("faults", url, "--profile", "mms7")


def test_texts_of_the_profile_are_chinese_in_chinese(url: str) -> None:
    """They were English in the middle of Chinese lines; JSON for programs keeps the originals."""
    with speaking("zh"):
        shown = call("io", url, "--profile", "mms7")
        assert "未使用" in shown
        assert "not used" not in shown
        value = call("params", "get", url, "6092:01", "--profile", "mms7")
        gear = call("gear", "r6l", "--kind", "screw", "--lead", "8")
        plain = json.loads(call("params", "get", url, "6092:01", "--profile", "mms7", "--json"))
    assert "Feed" not in value
    assert CHINESE.search(value)
    assert "Electronic gear" not in gear
    assert plain[0]["name"] == "Feed"


def test_gear_of_a_drive_is_written(url: str) -> None:
    common = ("--station", "1", "--profile", "mms7", "--kind", "screw", "--lead", "10")
    assert "6092:01 Feed: 10000" in call("gear", url, *common)
    get = ("params", "get", url, "6092:01", "--profile", "mms7")
    assert "65536" in call(*get)
    assert "'6092:01': 65536" in call("gear", url, *common, "--write")
    assert "10000" in call(*get)


def test_gear_of_a_family() -> None:
    text = call("gear", "r6l", "--kind", "screw", "--lead", "8")
    # 131072 increments of the encoder over 8000 of the user.
    assert "6091:01 Electronic gear ratio numerator: 2048" in text
    assert "6091:02 Electronic gear ratio denominator: 125" in text


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("mms7", "--kind", "screw"), "lead mm is missing"),
        (("mms7", "--kind", "screw", "--lead", "-1"), "lead_mm"),
        (("mms7", "--kind", "rotary", "--write"), "bus URL"),
    ],
)
def test_bad_gears_are_explained(
    arguments: tuple[str, ...], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert words in call("gear", *arguments, code=1) + capsys.readouterr().err


def test_braking() -> None:
    cycle = ("--inertia", "5e-4", "--speed", "3000", "--time", "0.1", "--cycle", "1")
    result = json.loads(call("braking", *cycle, "--drive", "mms7", "--model", "400 W"))
    # Equation 9 of manual 004.
    assert result["kinetic_j"] == pytest.approx(24.674, abs=1e-3)
    assert result["verdict"] == "beyond"
    assert "400 W" in call("braking", *cycle, "--drive", "mms7", "--model", "9 W", code=1)
