"""No folder of the product holds more entries than a reader can survey."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
MOST = 16
"""About 15: one more, so that a fix may add a module before the folder is regrouped."""
LARGER = {
    "drivers": 19,  # the modules of the seam next to one folder per bus
    "drivers/texts/catalogue": None,  # one file per subject, in two languages; see ADR 9
}


def _folders(top: str) -> Iterator[Path]:
    for folder in [ROOT / top, *(ROOT / top).rglob("*")]:
        if folder.is_dir() and "__pycache__" not in folder.parts:
            yield folder


def _entries(folder: Path) -> list[str]:
    """Files and folders; a folder in which only compiled files are left does not count."""
    kept = (e for e in folder.iterdir() if not e.name.startswith((".", "__")))
    return sorted(e.name for e in kept if e.is_file() or any(map(_is_source, e.rglob("*"))))


def _is_source(path: Path) -> bool:
    return path.is_file() and "__pycache__" not in path.parts


def _most(name: str) -> int | None:
    for larger, most in LARGER.items():
        if name == larger or (most is None and name.startswith(larger + "/")):
            return most
    return MOST


def test_no_folder_of_backend_and_drivers_has_more_than_about_15_entries():
    crowded = {}
    for folder in (*_folders("backend"), *_folders("drivers")):
        name, entries = folder.relative_to(ROOT).as_posix(), _entries(folder)
        most = _most(name)
        if most is not None and len(entries) > most:
            crowded[name] = len(entries)
    assert crowded == {}


def test_every_package_says_in_its_docstring_what_belongs_in_it():
    silent = [
        folder.relative_to(ROOT).as_posix()
        for folder in (*_folders("backend"), *_folders("drivers"))
        if (folder / "__init__.py").is_file()
        and not (folder / "__init__.py").read_text("utf-8").startswith('"""')
    ]
    assert silent == []
