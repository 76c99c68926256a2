"""Library and audit through the page: versions, tags, three-way, roll-back, who did it."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser.conftest import LAPTOP, _open
from tests.browser.driving import Bench
from tests.store.test_sharing import NAME, measurement
from tests.support.postgres import Postgres, binaries
from tests.support.station import Station

GAIN = "2005:03"
FILE = "golden.sdset"


def save(station: Station, drive: str, name: str, *, overwrite: bool = False) -> None:
    body = {"file": name, "author": "Anna", "notes": "", "overwrite": overwrite}
    station.ok(station.http.post(f"/drives/{drive}/sets", json=body))


@pytest.fixture
def versions(station: Station, bench: Bench) -> tuple[int, int]:
    """A set with two versions that differ in one gain; the drive has the second."""
    first = int(bench.raw(GAIN))
    second = first + 10
    save(station, bench.drive, "golden", overwrite=True)
    bench.write(GAIN, second)
    save(station, bench.drive, "golden", overwrite=True)
    return first, second


def open_files(page: Page) -> None:
    page.evaluate("location.hash = '#/files'")
    expect(page.get_by_role("heading", name="Files", level=1)).to_be_visible()


@pytest.mark.long
def test_go_back_to_an_earlier_version(
    laptop: Page, station: Station, bench: Bench, versions: tuple[int, int]
) -> None:
    first, _ = versions
    open_files(laptop)
    row = laptop.get_by_role("article", name=FILE)
    row.get_by_text("Versions, tags and notes").click()
    # The number of versions grows with every test of this module.
    number = (
        int(
            station.ok(station.http.get("/library?kind=set&words=golden"))["entries"][0]["versions"]
        )
        - 1
    )
    row.get_by_role("button", name=f"Compare version {number}, or go back to it").click()
    panel = laptop.locator("section.panel", has_text="Compare with an axis")
    panel.get_by_role("button", name="Compare", exact=True).click()
    expect(panel.get_by_text("1 differs", exact=True)).to_be_visible()
    panel.get_by_role("button", name="Load (1)").click()
    dialog = laptop.get_by_role("dialog")
    dialog.get_by_role("button", name="Write now").click()
    expect(dialog.get_by_text("1 written and read back, 0 failed.")).to_be_visible()
    dialog.get_by_role("button", name="Close").last.click()
    assert bench.raw(GAIN) == first
    # The undo is a set of its own, out of sight until it is wanted.
    undo = laptop.get_by_role("article").filter(has_text="before load")
    expect(undo).to_have_count(0)
    laptop.get_by_label("Also sets made before loading").check()
    expect(undo.first).to_be_visible()


def test_three_way_tells_who_changed_what(
    laptop: Page, station: Station, bench: Bench, versions: tuple[int, int]
) -> None:
    first, second = versions
    bench.write(GAIN, second + 10)  # base, set and drive all differ
    open_files(laptop)
    laptop.get_by_role("button", name=f"Compare {FILE} with an axis").click()
    panel = laptop.locator("section.panel", has_text="Compare with an axis")
    newest = int(panel.get_by_label("Version").input_value())
    panel.get_by_label("Common base").select_option(label=f"Version {newest - 1}")
    panel.get_by_role("button", name="Compare", exact=True).click()
    expect(panel.get_by_text("1 in conflict")).to_be_visible()
    row = panel.get_by_role("row").filter(has_text=GAIN)
    expect(row).to_contain_text("conflict")
    assert not row.get_by_role("checkbox").is_checked()
    bench.write(GAIN, first)
    panel.get_by_role("button", name="Compare", exact=True).click()
    expect(row).to_contain_text("changed in the set")
    assert row.get_by_role("checkbox").is_checked()


@pytest.mark.long
def test_tags_search_and_putting_aside(
    phone: Page, station: Station, bench: Bench, versions: tuple[int, int]
) -> None:
    save(station, bench.drive, "other", overwrite=True)
    open_files(phone)
    row = phone.get_by_role("article", name=FILE)
    row.get_by_text("Versions, tags and notes").click()
    row.get_by_label("Tags").fill("machine 7")
    row.get_by_label("Tags").press("Enter")
    row.get_by_label("Notes").fill("<img src=x onerror=alert(1)>")
    row.get_by_role("button", name="Save tags and notes").click()
    expect(row.locator(".notes", has_text="<img src=x onerror=alert(1)>")).to_be_visible()
    phone.get_by_label("Search").fill("machine anna")
    expect(phone.get_by_role("article", name="other.sdset")).to_have_count(0)
    expect(row).to_be_visible()
    phone.get_by_label("Search").fill("")
    phone.get_by_role("button", name="Archive other.sdset").click()
    phone.get_by_role("dialog").get_by_role("button", name="Archive").click()
    expect(phone.get_by_role("article", name="other.sdset")).to_have_count(0)
    phone.get_by_label("Archived entries").check()
    phone.get_by_role("button", name="Restore other.sdset").click()
    phone.get_by_label("Archived entries").uncheck()
    expect(phone.get_by_role("article", name="other.sdset")).to_be_visible()


def test_the_audit_says_who_wrote_what(laptop: Page, bench: Bench) -> None:
    before = int(bench.raw(GAIN))
    bench.write(GAIN, before + 20)
    laptop.evaluate("location.hash = '#/audit'")
    laptop.get_by_label("Kind").select_option(label="Parameter")
    row = laptop.get_by_role("row").filter(has_text=f"{before} → {before + 20}")
    expect(row).to_contain_text("local user")
    expect(row).to_contain_text(GAIN)
    laptop.get_by_role("button", name="Check the chain").click()
    expect(laptop.get_by_text("The chain is complete")).to_be_visible()
    with laptop.expect_download() as download:
        laptop.get_by_role("link", name="Export as CSV").click()
    text = download.value.path().read_text("utf-8")
    assert f",{before},{before + 20}," in text
    laptop.get_by_role("main").get_by_label("Axis").select_option("X")
    laptop.get_by_label("Search").fill("no such words")
    expect(laptop.get_by_text("No entry matches.")).to_be_visible()


# --- stations that share one library -----------------------------------------------------


@pytest.fixture
def halls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Station, Station]]:
    """Two stations without drives on one database server; the first has a measurement."""
    found = binaries()
    if found is None:
        pytest.skip("PostgreSQL is not installed: a library cannot be shared")
    server = Postgres(found)
    database, running = server.new_database(), []
    try:
        for name in ("hall-1", "hall-2"):
            monkeypatch.setattr(socket, "gethostname", lambda name=name: name)
            station = Station(tmp_path / name, database=database, blobs=str(tmp_path / "blobs"))
            station.start_server()
            running.append(station)
        folder = tmp_path / "hall-1" / "state" / "measurements"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / NAME).write_bytes(measurement(samples=1000))
        yield running[0], running[1]
    finally:
        for station in running:
            station.stop_server()
        server.remove()


@pytest.mark.long
def test_a_measurement_is_shared_and_copied_by_the_buttons(
    browser: Browser, halls: tuple[Station, Station], tmp_path: Path
) -> None:
    one, two = halls
    for page in _open(browser, one.url, **LAPTOP):
        open_files(page)
        page.get_by_role("button", name=f"Copy {NAME} into the shared library").click()
        # The copy is an entry of its own, next to the file of this station.
        expect(page.get_by_role("article").filter(has_text=NAME)).to_have_count(2)
        expect(page.get_by_role("alert")).to_have_count(0)
    for page in _open(browser, two.url, **LAPTOP):
        open_files(page)
        page.get_by_role("button", name=f"{NAME} to this station, to open it").click()
        expect(page.get_by_role("button", name="into the shared library")).to_be_visible()
        expect(page.get_by_role("alert")).to_have_count(0)
    (copied,) = (tmp_path / "hall-2" / "state" / "measurements").glob("*.sdmeas")
    assert (
        copied.read_bytes() == (tmp_path / "hall-1" / "state" / "measurements" / NAME).read_bytes()
    )
