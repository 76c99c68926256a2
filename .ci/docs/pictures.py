"""Pictures of the documentation, and the figures that its texts quote: all of one run.

``make pictures`` commissions an axis of the demo and writes the pictures and `FIGURES`. A page
quotes a figure as ``<span data-figure="settling">32 ms</span>``: the name in the file, and what
the reader sees. The checks fail where a quoted figure is not that of the file, and where a picture
is missing, not used, or not of the run that the file describes.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import prose

IMAGES = prose.DOCS / "images"
FIGURES = IMAGES / "figures.json"
README = prose.ROOT / "README.md"
#: Made by other commands: `python -m benchmarks.module_graph`, and the import of a real recording.
OTHERS = frozenset({"module-graph.svg", "module-graph.txt", "imported-bench.svg"})
#: What may stand after a number: the unit, with a space before it or not (45°).
_QUOTED = re.compile(r'<span data-figure="([^"]*)">([^<]*)</span>')
_SHOWN = re.compile(r"!\[[^\]]*\]\(([^)\s]+)[^)]*\)")


class Run(NamedTuple):
    """What one run left: pictures by file name with their SHA-256, figures by name."""

    id: str
    pictures: dict[str, str]
    figures: dict[str, dict[str, Any]]


def load() -> Run:
    """The run that made the present pictures.

    Raises:
        OSError: there is no such file. ValueError: it is not whole.
    """
    found = json.loads(FIGURES.read_text("utf-8"))
    try:
        return Run(found["run"]["id"], found["pictures"], found["figures"])
    except (KeyError, TypeError) as error:
        raise ValueError(f"{FIGURES.name} lacks {error}") from error


def digest(file: Path) -> str:
    """The SHA-256 of a picture."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def texts(figure: dict[str, Any]) -> tuple[str, str]:
    """How a page may write a figure: with its unit, and as the number alone."""
    number, unit = str(figure["text"]), str(figure["unit"])
    return number + ("" if unit in {"", "°"} else " ") + unit, number


def pages() -> list[Path]:
    """Every page that may quote or show something."""
    return [*prose.pages(), *([README] if README.is_file() else [])]


def findings() -> Iterator[prose.Finding]:
    """What is wrong with quoted figures and pictures."""
    try:
        run = load()
    except (OSError, ValueError) as error:
        yield prose.Finding(FIGURES, 1, f"cannot be read: {error}")
        return
    yield from _figures(run)
    yield from _pictures(run)


def _figures(run: Run) -> Iterator[prose.Finding]:
    quoted: set[str] = set()
    for page in pages():
        for number, line in enumerate(page.read_text("utf-8").splitlines(), 1):
            found = _QUOTED.findall(line)
            if len(found) != line.count("data-figure"):
                yield prose.Finding(page, number, "a quoted figure is not written as one span")
            for name, text in found:
                quoted.add(name)
                if name not in run.figures:
                    yield prose.Finding(page, number, f"there is no figure “{name}”")
                elif text not in texts(run.figures[name]):
                    wanted = texts(run.figures[name])[0]
                    yield prose.Finding(page, number, f"{name} is {wanted}, not {text}")
    for name in sorted(run.figures.keys() - quoted):
        yield prose.Finding(FIGURES, 1, f"no page quotes “{name}”")


def _pictures(run: Run) -> Iterator[prose.Finding]:
    used: set[Path] = set()
    for page in pages():
        chinese = page.is_relative_to(prose.DOCS / "zh")
        for number, line in enumerate(page.read_text("utf-8").splitlines(), 1):
            for target in _SHOWN.findall(line):
                file = (page.parent / target).resolve()
                used.add(file)
                if chinese and file.suffix != ".svg" and not file.stem.endswith("-zh"):
                    yield prose.Finding(page, number, f"{file.name} shows the English page")
    for name, wanted in sorted(run.pictures.items()):
        file = IMAGES / name
        if not file.is_file():
            yield prose.Finding(FIGURES, 1, f"the picture {name} of run {run.id} is missing")
        elif digest(file) != wanted:
            yield prose.Finding(file, 1, f"not the picture that run {run.id} made")
    for file in sorted(IMAGES.iterdir()):
        known = file.name in run.pictures or file.name in OTHERS or file == FIGURES
        if not known:
            yield prose.Finding(file, 1, f"not made by run {run.id}: run `make pictures`")
        elif file.suffix in {".webp", ".png", ".svg"} and file.resolve() not in used:
            yield prose.Finding(file, 1, "no page shows this picture")


def rewrite(run: Run) -> list[Path]:
    """Write the figures of a run into the pages that quote them; returns the changed pages.

    A figure that stands without its unit stays so.
    """
    changed = []
    for page in pages():
        before = page.read_text("utf-8")

        def new(found: re.Match[str]) -> str:
            figure = run.figures.get(found[1])
            if figure is None:
                return found[0]
            whole, number = texts(figure)
            alone = not found[2].endswith(str(figure["unit"]))
            return f'<span data-figure="{found[1]}">{number if alone else whole}</span>'

        after = _QUOTED.sub(new, before)
        if after != before:
            page.write_text(after, "utf-8")
            changed.append(page)
    return changed
