"""What is deleted by itself, and what never is."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from backend.records.recording.library import RecordingLibrary, Retention

DAY_S = 86_400.0
NOW = 1_700_000_000.0


@pytest.fixture
def library(tmp_path: Path) -> RecordingLibrary:
    """Three recordings of 1000 bytes: 3, 2 and half a day old."""
    for name, days in (("old", 3.0), ("newer", 2.0), ("fresh", 0.5)):
        path = tmp_path / f"{name}.sdrec"
        path.write_bytes(bytes(1000))
        os.utime(path, (NOW - days * DAY_S, NOW - days * DAY_S))
    return RecordingLibrary(tmp_path)


def names(library: RecordingLibrary) -> set[str]:
    return {path.stem for path in library.folder.glob("*.sdrec")}


def test_what_is_older_than_wanted_goes(library: RecordingLibrary) -> None:
    library.set_retention(Retention(max_total_bytes=None, keep_days=1.0))
    assert library.prune(now=NOW) == ["old.sdrec", "newer.sdrec"]
    assert names(library) == {"fresh"}
    # The bound outlives the server.
    assert RecordingLibrary(library.folder).retention.keep_days == 1.0


def test_the_oldest_go_first_until_the_rest_has_room(library: RecordingLibrary) -> None:
    library.set_retention(Retention(max_total_bytes=2500))
    assert library.prune(now=NOW) == ["old.sdrec"]


def test_what_is_kept_or_running_stays(library: RecordingLibrary) -> None:
    library.annotate("old.sdrec", notes=None, tags=None, kept=True)
    library.set_retention(Retention(max_total_bytes=0, keep_days=0.1))
    assert library.prune(busy=["fresh.sdrec"], now=NOW) == ["newer.sdrec"]
    assert names(library) == {"old", "fresh"}


@pytest.mark.parametrize("remarks", ["", '{"kept": tr', "[]", '{"kept": "yes"}', "\x00"])
def test_what_has_damaged_remarks_counts_as_kept(library: RecordingLibrary, remarks: str) -> None:
    (library.folder / "old.sdrec.json").write_text(remarks, "utf-8")
    (library.folder / "newer.sdrec.json").write_text('{"notes": "", "tags": []}', "utf-8")
    library.set_retention(Retention(max_total_bytes=0, keep_days=0.1))
    assert library.prune(now=NOW) == ["newer.sdrec", "fresh.sdrec"]
    # A person sees it, and may decide otherwise.
    assert library.describe("old.sdrec").remarks.kept
    library.annotate("old.sdrec", notes=None, tags=None, kept=False)
    assert library.prune(now=NOW) == ["old.sdrec"]


def test_remarks_that_cannot_be_read_count_as_kept(library: RecordingLibrary) -> None:
    (library.folder / "old.sdrec.json").mkdir()
    library.set_retention(Retention(max_total_bytes=0, keep_days=0.1))
    assert "old.sdrec" not in library.prune(now=NOW)


def test_without_bounds_everything_stays(library: RecordingLibrary) -> None:
    library.set_retention(Retention(max_total_bytes=None))
    assert library.prune(now=NOW + 1000 * DAY_S) == []
