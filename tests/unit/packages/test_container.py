"""What the Containerfile declares; ``python -m benchmarks.station_rights`` starts it."""

from __future__ import annotations

import io
import re
import tarfile
from pathlib import Path

import pytest

from drivers.computer.permissions import NEEDED, USEFUL
from tests.support.contained import NUMBERS, Recipe

TEXT = (Path(__file__).resolve().parents[3] / ".ci/supply/Containerfile").read_text("utf-8")


def test_it_declares_the_capabilities_that_are_needed_and_no_others() -> None:
    assert list(Recipe.read(TEXT).capabilities) == [*NEEDED, *USEFUL]
    assert {f"CAP_{name}" for name in re.findall(r"--cap-add (\w+)", TEXT)} == {*NEEDED, *USEFUL}
    assert {**NEEDED, **USEFUL} == NUMBERS
    # Without these two an engine leaves its usual ones, and a way to others.
    assert "--cap-drop all" in TEXT
    assert "--security-opt no-new-privileges" in TEXT


def test_nothing_is_asked_of_a_registry() -> None:
    assert re.findall(r"^FROM (.*)$", TEXT, re.MULTILINE) == ["scratch"]
    with pytest.raises(ValueError, match="RUN"):
        Recipe.read(TEXT + "RUN true\n")


def test_its_files_are_laid_out_as_it_says(tmp_path: Path) -> None:
    folder = "servodeck-0.2.0-linux-x86_64"
    for name, inside in (
        ("container-base-linux-x86_64", "etc/passwd"),
        (folder, f"{folder}/bin/x"),
    ):
        (tmp_path / "dist").mkdir(exist_ok=True)
        with tarfile.open(tmp_path / f"dist/{name}.tar.gz", "w:gz") as packed:
            packed.addfile(tarfile.TarInfo(inside), io.BytesIO())
    recipe = Recipe.read(TEXT)
    recipe.unpack(tmp_path, tmp_path / "root")
    assert (tmp_path / "root/etc/passwd").is_file()
    assert (tmp_path / "root/opt/servodeck-0.2.0-linux-x86_64/bin/x").is_file()
    started = recipe.started(tmp_path / "root", tmp_path)
    assert started[started.index("--") + 1 :] == [
        "/usr/bin/python3", "-m", "backend", "serve", "--bind", "0.0.0.0", "--port", "8420",
        "--config", "/var/lib/servodeck",
    ]  # fmt: skip
