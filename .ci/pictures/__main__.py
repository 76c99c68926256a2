"""Makes every picture of the documentation and the figures that it quotes, in one run.

    make pictures
    python .ci/pictures jog fault          only these chapters (in the order of the story)

The run starts the demo, commissions one axis of it on the page (see `story.py`) and writes
screenshots, recordings and ``figures.json`` into ``docs/images``; then it writes the figures into
the pages that quote them. Nothing is changed unless the run comes to its end. A run of some
chapters replaces their pictures alone: all figures, and the other pictures, stay those of the
whole run before it.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "docs"))

import pictures
from demo import AXIS, Demo
from playwright.sync_api import Error, sync_playwright
from story import CHAPTERS, CYCLE_US, URL, Story

from tests.browser.conftest import FLAGS

#: How often a chapter is begun.
TRIES = 3
SUFFIXES = (".webp", ".png")


def photograph(
    folder: Path, state: Path, chapters: Sequence[Callable[[Story], None]] = CHAPTERS
) -> Story:
    """Commission the axis, as far as these chapters do; pictures go into ``folder``."""
    demo = Demo(state)
    try:
        with sync_playwright() as playwright:
            program = shutil.which("chromium") or "/usr/bin/chromium"
            browser = playwright.chromium.launch(executable_path=program, args=FLAGS)
            story = Story(demo, browser, folder)
            for chapter in chapters:
                began = time.monotonic()
                print(chapter.__name__, flush=True)
                through(story, chapter)
                print(f"  {time.monotonic() - began:.0f} s", flush=True)
            browser.close()
    finally:
        demo.close()
    return story


def through(story: Story, chapter: Callable[[Story], None]) -> None:
    """Run a chapter; one that a busy computer disturbed is begun again, without its figures.

    Raises:
        AssertionError, RuntimeError, ValueError, Error: it failed every time.
    """
    figures = dict(story.readings.figures)
    for attempt in range(TRIES):
        try:
            chapter(story)
        except (AssertionError, RuntimeError, ValueError, Error) as error:
            if attempt == TRIES - 1:
                raise
            print(f"  {chapter.__name__} begins again: {str(error)[:300]}", flush=True)
            story.repeated += 1
            story.readings.figures = dict(figures)
        else:
            return


def publish(folder: Path, story: Story, began: datetime) -> pictures.Run:
    """Put the pictures of the run in place of those of an earlier one."""
    made = sorted(each for each in folder.iterdir() if each.suffix in SUFFIXES)
    run = {
        "id": uuid.uuid4().hex[:12],
        "began": began.isoformat(timespec="seconds"),
        "servodeck": version("servodeck"),
        "axis": AXIS,
        "bus": URL,
        "cycle_us": CYCLE_US,
    }
    whole = {
        "run": run,
        "figures": dict(sorted(story.readings.figures.items())),
        "pictures": {each.name: pictures.digest(each) for each in made},
    }
    for old in pictures.IMAGES.iterdir():
        if old.suffix in SUFFIXES:
            old.unlink()
    for each in made:
        shutil.copy(each, pictures.IMAGES / each.name)
    pictures.FIGURES.write_text(json.dumps(whole, indent=1, ensure_ascii=False) + "\n", "utf-8")
    return pictures.load()


def publish_part(folder: Path, began: datetime, chapters: Sequence[str]) -> pictures.Run:
    """Put the pictures of some chapters in place of those of the whole run before."""
    whole = json.loads(pictures.FIGURES.read_text("utf-8"))
    made = sorted(each for each in folder.iterdir() if each.suffix in SUFFIXES)
    for each in made:
        shutil.copy(each, pictures.IMAGES / each.name)
        whole["pictures"][each.name] = pictures.digest(each)
    part = {"id": uuid.uuid4().hex[:12], "began": began.isoformat(timespec="seconds")}
    part |= {"chapters": list(chapters), "pictures": [each.name for each in made]}
    whole["pictures"] = dict(sorted(whole["pictures"].items()))
    whole["run"].setdefault("parts", []).append(part)
    pictures.FIGURES.write_text(json.dumps(whole, indent=1, ensure_ascii=False) + "\n", "utf-8")
    return pictures.load()


def main() -> int:
    """Run, publish, and write the figures into the pages."""
    names = [each.__name__ for each in CHAPTERS]
    parser = argparse.ArgumentParser(description="Pictures of the documentation.")
    parser.add_argument("chapters", nargs="*", help=", ".join(names), metavar="CHAPTER")
    wanted = parser.parse_args().chapters
    if unknown := [each for each in wanted if each not in names]:
        parser.error(f"no chapter {', '.join(unknown)}; there are: {', '.join(names)}")
    chosen = [each for each in CHAPTERS if not wanted or each.__name__ in wanted]
    began = datetime.now(UTC)
    with tempfile.TemporaryDirectory() as name:
        folder, state = Path(name) / "pictures", Path(name) / "state"
        folder.mkdir()
        state.mkdir()
        story = photograph(folder, state, chosen)
        if wanted:
            run = publish_part(folder, began, [each.__name__ for each in chosen])
        else:
            run = publish(folder, story, began)
    for page in pictures.rewrite(run):
        print(f"figures written: {page.relative_to(pictures.prose.ROOT)}")
    size = sum(each.stat().st_size for each in pictures.IMAGES.iterdir())
    print(f"{len(run.pictures)} pictures, {len(run.figures)} figures, {size / 1e3:.0f} kB in all")
    print(f"repeated because the computer was busy: {story.repeated}")
    found = list(pictures.findings())
    for finding in found:
        print(finding)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
