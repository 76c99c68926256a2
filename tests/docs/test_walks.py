"""Every command that the first drives and the how-to pages name works on the virtual drives.

The pages are followed in order, command by command, and the output that they show must come.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from backend.cli import app
from tests.docs.pages import DOCS, Shown, commands
from tests.support.station import Station

#: In this order: the pages of a station begin where the ones before left it.
PAGES = [
    "first-drive/mms7-ethercat.md",
    "first-drive/mms7-rs485.md",
    "first-drive/ds-c-can-rs232.md",
    "how-to/save-restore-clone.md",
    "how-to/jog-and-home.md",
    "how-to/scope-and-record.md",
    "how-to/report-and-hand-over.md",
]
#: `params diff` ends with 1 where something differs, which a page may show.
MAY_END_WITH_1 = ("params", "diff")
#: What runs until it is ended; the station of the test stands for it.
SERVERS = {"demo", "serve"}


def call(shown: Shown) -> None:
    assert shown.words[0] == "servodeck", f"{shown.page}:{shown.line} is no command of ours"
    if shown.words[1] in SERVERS:
        return
    done = CliRunner().invoke(app, list(shown.words[1:]))
    where = f"{shown.page}:{shown.line} {' '.join(shown.words)}"
    allowed = {0, 1} if shown.words[1:3] == MAY_END_WITH_1 else {0}
    assert done.exit_code in allowed, f"{where}\nexit code {done.exit_code}\n{done.output}"
    missing = shown.missing(done.output)
    assert missing is None, f"{where}\nthe page shows: {missing}\nit printed:\n{done.output}"


@pytest.mark.long(keep=["how-to/jog-and-home.md"])
@pytest.mark.timeout(400)  # tuning computes for half a minute on a free machine
@pytest.mark.parametrize("page", PAGES)
def test_page_is_followed(
    page: str, station: Station, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.setenv("SERVODECK_SERVER", station.url)
    shown = commands(DOCS / page)
    assert shown, "the page names no command"
    for one in shown:
        call(one)


@pytest.mark.parametrize("page", PAGES[:3])
def test_the_chinese_page_has_the_same_commands(page: str) -> None:
    """So the replay of the English page is that of the Chinese one, wiring included."""
    english, chinese = DOCS / page, DOCS / "zh" / page
    assert [(one.words, one.output) for one in commands(chinese)] == [
        (one.words, one.output) for one in commands(english)
    ]
    sources = re.compile(r"00\d:\d+")
    assert sources.findall(chinese.read_text("utf-8")) == sources.findall(
        english.read_text("utf-8")
    )


def test_no_page_is_left_out() -> None:
    with_commands = {
        page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md") if commands(page)
    }
    assert with_commands == {*PAGES, *(f"zh/{page}" for page in PAGES[:3])}


def test_shown_lines_are_compared() -> None:
    shown = Shown("page", 1, ("servodeck",), ("Inertia: …", "written: x.json"))
    assert shown.missing("Inertia: 0.1\nother\nwritten: x.json\n") is None
    assert shown.missing("written: x.json\nInertia: 0.1\n") == "written: x.json"
