"""Coverage by manual chapter: no gap, and no chapter without records or a reason."""

from __future__ import annotations

from pathlib import Path

import pytest

from profiles import load_profile
from profiles.check import check, counts_of, coverage
from profiles.schema import Chapter

FAMILIES = ("mms7", "m6l", "r6l", "ep3e", "ds_c")
#: Lines of each manual's text.
LENGTH = {"004": 7785, "000": 4075, "002": 14953, "001": 1756, "003": 1155}


@pytest.mark.parametrize("drive", FAMILIES)
def test_chapters_cover_the_whole_manual(drive: str) -> None:
    profile = load_profile(drive)
    assert profile.manual_chapters[0].first_line == 1
    assert profile.manual_chapters[-1].last_line == LENGTH[profile.manual]
    lines = coverage(profile)
    assert len(lines) > len(profile.manual_chapters)
    for chapter, line in zip(profile.manual_chapters, lines, strict=False):
        assert chapter.title in line
        assert str(chapter.first_line) in line


@pytest.mark.parametrize("drive", FAMILIES)
def test_sources_lie_within_the_manual(drive: str) -> None:
    profile = load_profile(drive)
    last = LENGTH[profile.manual]
    records = [*profile.parameters, *profile.faults, *profile.homing_methods]
    assert all(1 <= int(record.source.split(":")[1]) <= last for record in records)


def test_a_gap_and_an_unexplained_chapter_are_found() -> None:
    profile = load_profile("ep3e")
    first, second, *rest = profile.manual_chapters
    holes = (first, second.model_copy(update={"first_line": second.first_line + 3}), *rest)
    found = check(profile.model_copy(update={"manual_chapters": holes}))
    begins = [f.params for f in found if f.code == "profile-check.chapter-begin"]
    assert begins[0] == {"line": second.first_line}
    silent = Chapter(title="Silent", first_line=1757, last_line=1800, taken="")
    more = profile.model_copy(update={"manual_chapters": (*profile.manual_chapters, silent)})
    assert "profile-check.chapter-empty" in {finding.code for finding in check(more)}


def test_counts_look_at_notes_too() -> None:
    profile = load_profile("m6l")
    chapter = next(c for c in profile.manual_chapters if c.title.startswith("9 "))
    assert counts_of(profile, chapter)["faults"] >= 74


def test_folder_has_one_list_of_chapters_per_family() -> None:
    for drive in FAMILIES:
        assert (Path("profiles") / drive / "chapters.yaml").exists()
