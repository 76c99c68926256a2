"""Begin a drive family: ``python .ci/new_drive NAME "Maker and model"`` (``make new-drive``).

Writes a profile with the objects of CiA 402, the module of its virtual drive, a test and a page of
the documentation, each with what is still to be filled in. All checks pass on what it writes; it
changes no other file, and never one that exists.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TEMPLATES = Path(__file__).parent / "templates"
GENERIC = Path("profiles") / "generic402"


def files(name: str, title: str, root: Path) -> dict[Path, str]:
    """What the family begins with, by its place below the root of the project.

    Objects of CiA 402 are those of the generic profile, with their sources marked as the
    standard's until a manual is named.
    """
    words = {"@NAME@": name, "@TITLE@": title, "@CLASS@": _class_name(name)}
    places = {
        "profile.yaml": Path("profiles") / name / "profile.yaml",
        "parameters_2_maker.yaml": Path("profiles") / name / "parameters_2_maker.yaml",
        "motion.yaml": Path("profiles") / name / "motion.yaml",
        "faults.yaml": Path("profiles") / name / "faults.yaml",
        "family.py": Path("drivers/virtual/firmware/families") / f"{name}.py",
        "test.py": Path("tests/profiles") / f"test_{name}.py",
        "page.md": Path("docs/drives") / f"{name}.md",
    }
    written = {
        place: _filled((TEMPLATES / f"{template}.txt").read_text("utf-8"), words)
        for template, place in places.items()
    }
    for copied in ("parameters.yaml", "homing.yaml"):
        text = (root / GENERIC / copied).read_text("utf-8")
        target = "parameters_6_cia402.yaml" if copied == "parameters.yaml" else copied
        written[Path("profiles") / name / target] = _of_manual(text)
    return written


def _filled(text: str, words: dict[str, str]) -> str:
    for mark, word in words.items():
        text = text.replace(mark, word)
    return text


def _of_manual(text: str) -> str:
    """Sources as the check wants them: the manual's name, then the place in it."""
    return text.replace('source: "CiA:', 'source: "manual:CiA ')


def _class_name(name: str) -> str:
    return "".join(part.capitalize() for part in name.split("_"))


def create(name: str, title: str, root: Path = ROOT) -> list[Path]:
    """Write the files.

    Raises:
        ValueError: the name is not that of a Python module.
        FileExistsError: one of the files exists; then none is written.
    """
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise ValueError(f"{name!r}: a family's name has small letters, digits and _, as in ds_c")
    content = files(name, title, root)
    there = [str(place) for place in content if (root / place).exists()]
    if there:
        raise FileExistsError(f"nothing was written, as there is already {', '.join(there)}")
    for place, text in content.items():
        (root / place).parent.mkdir(parents=True, exist_ok=True)
        (root / place).write_text(text, "utf-8")
    return list(content)


def main() -> int:
    """Command line; prints what was written and what comes next."""
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        written = create(sys.argv[1], sys.argv[2])
    except (ValueError, FileExistsError) as error:
        print(error, file=sys.stderr)
        return 2
    name = sys.argv[1]
    print("\n".join(str(place) for place in written))
    print(
        f"\nNext: .venv/bin/servodeck profile check {name}; fill in what the manual prints\n"
        "(docs/drives/authoring.md), and add to mkdocs.yml\n"
        f"  reference/parameters/{name}.md and drives/{name}.md"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
