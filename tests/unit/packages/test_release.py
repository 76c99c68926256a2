"""The version of a release is the same wherever it is written, and the changelog has it."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]


def test_every_place_has_the_version_of_the_package() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    page = json.loads((ROOT / "webui" / "package.json").read_text("utf-8"))
    lock = json.loads((ROOT / "webui" / "package-lock.json").read_text("utf-8"))
    assert page["version"] == version
    assert (lock["version"], lock["packages"][""]["version"]) == (version, version)
    named = re.findall(
        r"servodeck[-_](\d+\.\d+\.\d+)", (ROOT / "docs/install.md").read_text("utf-8")
    )
    assert named
    assert set(named) == {version}


def test_the_changelog_goes_by_versions_newest_first() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    text = (ROOT / "CHANGELOG.md").read_text("utf-8")
    released = re.findall(r"^## \[(\d+\.\d+\.\d+)\] - \d{4}-\d\d-\d\d$", text, re.MULTILINE)
    assert released[0] == version
    assert released == sorted(released, reverse=True)
    newest = text.split(f"## [{version}]")[1].split("\n## [")[0]
    assert f"### Upgrade from {released[1]}" in newest
