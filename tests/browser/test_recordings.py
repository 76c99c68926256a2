"""Recordings and rerun in the real page: record, export, and the viewer receives data."""

from __future__ import annotations

import csv
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, Playwright, expect

from tests.browser.conftest import FLAGS
from tests.browser.driving import Bench
from tests.support.station import until

#: Loading and compiling 43 MB of WebAssembly on a busy machine.
VIEWER_MS = 90_000


@pytest.fixture(scope="module")
def browser(playwright: Playwright) -> Iterator[Browser]:
    """With WebGL, which the viewer needs; the other tests run without a GPU."""
    flags = [flag for flag in FLAGS if flag != "--disable-gpu"]
    running = playwright.chromium.launch(
        executable_path=shutil.which("chromium") or "/usr/bin/chromium",
        args=[*flags, "--enable-unsafe-swiftshader"],
    )
    yield running
    running.close()


@pytest.fixture
def page(browser: Browser, bench: Bench) -> Iterator[Page]:
    context = browser.new_context(locale="en", viewport={"width": 1280, "height": 800})
    page = context.new_page()
    page.set_default_timeout(15_000)
    defects: list[str] = []
    page.on("pageerror", lambda error: defects.append(str(error)))
    page.on("console", lambda message: defects.append(message.text) if _policy(message.text) else 0)
    page.goto(f"{bench.station.url}/#/rerun")
    expect(page.get_by_role("heading", name="Recordings", level=1)).to_be_visible()
    yield page
    context.close()
    for row in bench.station.ok(bench.station.http.get("/recordings"))["recordings"]:
        bench.station.http.post(f"/recordings/{row['name']}/stop")
        bench.station.http.delete(f"/recordings/{row['name']}")
    assert defects == []


def _policy(text: str) -> bool:
    """A violation of the policy by us. rerun's viewer asks its makers' servers for news of
    itself; that the policy refuses it is what it is there for."""
    foreign = re.match(r"(Connecting to '|Fetch API cannot load )https://", text)
    return "Content Security Policy" in text and foreign is None


def record(page: Page, bench: Bench, name: str) -> None:
    page.get_by_label("Name").fill(name)
    page.get_by_role("button", name="Record", exact=True).click()

    def recorded() -> bool:
        rows = bench.station.ok(bench.station.http.get("/recordings"))["recordings"]
        return any(row["name"] == f"{name}.sdrec" and row["samples"] > 50 for row in rows)

    until(recorded, 15, "samples are recorded")
    page.get_by_role("button", name="End").click()
    expect(page.get_by_text("complete", exact=False)).to_be_visible()


def test_record_and_export(page: Page, bench: Bench, tmp_path: Path) -> None:
    record(page, bench, "browser")
    info = bench.station.ok(bench.station.http.get("/recordings"))["recordings"][0]
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Export as CSV").click()
    waiting.value.save_as(tmp_path / "a.csv")
    with (tmp_path / "a.csv").open(newline="") as file:
        titles, *rows = list(csv.reader(file))
    assert len(rows) == info["samples"]
    assert len(titles) == 1 + len(info["channels"])
    page.get_by_role("button", name="Delete browser.sdrec").click()
    page.get_by_role("dialog").get_by_role("button", name="Delete", exact=True).click()
    expect(page.get_by_text("No recordings.")).to_be_visible()


def test_live_data_reach_the_viewer_and_escape_stops_from_there(page: Page, bench: Bench) -> None:
    page.get_by_role("button", name="Show live").click()
    status = page.locator("[data-phase]")
    expect(status).to_have_attribute("data-phase", "live", timeout=VIEWER_MS)
    until(lambda: int(status.get_attribute("data-blobs") or 0) > 20, 30, "blobs arrive")
    expect(page.frame_locator("iframe").locator("canvas")).to_be_visible()
    page.frame_locator("iframe").locator("canvas").click()
    with page.expect_request("**/api/v1/stop"):
        page.keyboard.press("Escape")
    page.get_by_role("button", name="Close the viewer").click()
    expect(page.locator("iframe")).to_have_count(0)


def test_a_stored_recording_opens_in_the_viewer(page: Page, bench: Bench) -> None:
    record(page, bench, "again")
    page.get_by_role("button", name="Open in rerun").click()
    status = page.locator("[data-phase]")
    expect(status).to_have_attribute("data-phase", "stored", timeout=VIEWER_MS)
    expect(status).to_contain_text("again.sdrec")
    page.wait_for_timeout(1500)  # a viewer that fails does so while it draws
    expect(status).to_have_attribute("data-phase", "stored")
