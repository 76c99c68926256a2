"""The pages of the viewer behind a path of a proxy."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import backend.records.recording

FOLDER = Path(backend.records.recording.__file__).parent / "viewer"


@pytest.mark.parametrize("name", ["index.html", "viewer.js", "viewer.css"])
def test_the_viewer_names_no_address_from_the_root(name: str) -> None:
    content = (FOLDER / name).read_text("utf-8")
    absolute = re.findall(
        r"""(?:src|href)="/\S*|fetch\([`'"]/\S*|location\.origin[^,)]*/\S*""", content
    )
    assert absolute == []
