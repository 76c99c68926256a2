"""docs/architecture.md says of every folder of the page's sources what belongs in it."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
SOURCES = ROOT / "webui/src"
ROW = re.compile(r"^\| `([a-z0-9/-]+)/` \| (\S.*\.) \|$", re.M)
MOST = 15  # entries of a folder, CONTRIBUTING.md
#: `pages/` has one folder per page of the product, and nothing else.
PAGES = 16


def folders() -> dict[str, int]:
    """Entries of each folder that holds something."""
    found = (each for each in SOURCES.rglob("*") if each.is_dir())
    counted = {str(each.relative_to(SOURCES)): len(list(each.iterdir())) for each in found}
    return {name: count for name, count in counted.items() if count}


def test_every_folder_has_its_sentence() -> None:
    text = (ROOT / "docs/architecture.md").read_text("utf-8")
    section = text.split("## The folders of `webui/src/`\n")[1].split("\n## ")[0]
    rows = [name for name, _ in ROW.findall(section)]
    assert rows == sorted(folders())


@pytest.mark.parametrize("folder", [".", *sorted(folders())])
def test_a_folder_has_few_entries(folder: str) -> None:
    entries = list((SOURCES / folder).iterdir())
    if folder == "pages":
        assert all(each.is_dir() for each in entries)
    assert len(entries) <= (PAGES if folder == "pages" else MOST)
