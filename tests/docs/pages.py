"""The commands that pages of the documentation name, and the output that they show."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import NamedTuple

DOCS = Path(__file__).resolve().parents[2] / "docs"


class Shown(NamedTuple):
    """A command of a page with the lines that the page shows below it."""

    page: str
    line: int
    words: tuple[str, ...]
    output: tuple[str, ...]

    def missing(self, output: str) -> str | None:
        """The first shown line that is not in the output after the ones before; … is any text."""
        rest = output.splitlines()
        for shown in self.output:
            pattern = ".*".join(map(re.escape, shown.strip().split("…")))
            for place, line in enumerate(rest):
                if re.fullmatch(pattern, line.strip()):
                    rest = rest[place + 1 :]
                    break
            else:
                return shown
        return None


def commands(page: Path) -> list[Shown]:
    """The commands of the ``console`` blocks of a page, in order."""
    found: list[Shown] = []
    inside = False
    for number, line in enumerate(page.read_text("utf-8").splitlines(), 1):
        bare = line.strip()
        if bare.startswith("```"):
            inside = bare == "```console"
        elif inside and bare.startswith("$ "):
            words = shlex.split(bare[2:], comments=True)
            found.append(Shown(page.relative_to(DOCS).as_posix(), number, tuple(words), ()))
        elif inside and bare:
            found[-1] = found[-1]._replace(output=(*found[-1].output, bare))
    return found


def named(page: Path) -> list[tuple[int, str]]:
    """Every call of servodeck that a page names: in blocks of code and inside lines."""
    found, inside = [], False
    for number, line in enumerate(page.read_text("utf-8").splitlines(), 1):
        if line.strip().startswith("```"):
            inside = not inside
        elif inside:
            calls = re.findall(r"^\s*(?:\$ )?servodeck (.+?)(?:   .*|\s*#.*)?$", line)
            found += [(number, one) for one in calls]
        else:
            found += [(number, one) for one in re.findall(r"`servodeck ([^`]+)`", line)]
    return found
