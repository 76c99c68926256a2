"""Alarms on the page: faults reported with cause and remedy, reset, refused reset, bundle."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.browser.driving import REPORTED_MS, Bench, open_axis
from tests.support.station import until


def inject(bench: Bench, what: str, **more: object) -> None:
    bench.station.drives.command(do="inject", axis="X", what=what, **more)


@pytest.mark.long
def test_a_fault_is_explained_and_reset(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "alarms")
    expect(page.get_by_text("No fault is active.")).to_be_visible()
    inject(bench, "over_current")
    fault = page.locator(".faults > li.fault").first
    expect(fault).to_contain_text(re.compile("over.?current", re.IGNORECASE), timeout=REPORTED_MS)
    for words in ("Possible causes", "What to do", "Reset:", "Source: manual 004:"):
        expect(fault).to_contain_text(words)
    # The tool's own log has it, with the time.
    expect(page.locator("ul.log li.error").first).to_contain_text("fault")
    page.get_by_role("button", name="Reset faults").click()
    expect(page.get_by_text("No fault is active.")).to_be_visible()
    assert bench.state()["state"] == "Switch on disabled"


@pytest.mark.long
def test_a_refused_reset_says_why(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "alarms")
    # The supply really is too high, so the fault is still present when it is reset.
    supply_v = bench.raw("6079:00") / 1000
    inject(bench, "supply_v", value=90.0)
    fault = page.locator(".faults > li.fault").first
    expect(fault).to_contain_text(re.compile("over.?voltage", re.IGNORECASE))
    reset = page.get_by_role("button", name="Reset faults")
    reset.click()
    refused = page.get_by_role("alert").filter(has_text="stays in")
    expect(refused).to_contain_text("fault present")
    expect(refused).to_contain_text("remove the cause named")
    inject(bench, "supply_v", value=supply_v)
    until(lambda: bench.raw("6079:00") / 1000 < supply_v + 5, what="the supply is right again")
    reset.click()
    expect(page.get_by_text("No fault is active.")).to_be_visible()


@pytest.mark.long
def test_the_record_of_the_drive_is_not_pretended(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "alarms")
    history = page.locator("section.panel").filter(
        has=page.get_by_role("heading", name="Past faults in the drive")
    )
    expect(history).to_contain_text("The drive keeps the last 20.")
    expect(history).to_contain_text("the manual prints no object for them")
    expect(history.get_by_role("button", name="Read the record")).to_have_count(0)
    history.get_by_role("button", name="Clear the history in the drive").click()
    dialog = page.get_by_role("dialog")
    run = dialog.get_by_role("button", name="Run")
    expect(run).to_be_disabled()
    dialog.get_by_role("checkbox").check()
    run.click()
    expect(dialog).to_have_count(0)


def test_a_support_bundle_is_made_and_fetched(laptop: Page, bench: Bench, tmp_path: Path) -> None:
    page = laptop
    open_axis(page, bench.drive, "alarms")
    before = page.locator("a.download").count()
    page.get_by_role("button", name="Make a bundle now").click()
    link = page.locator("a.download").first
    until(lambda: page.locator("a.download").count() > before, 30, "the bundle is there")
    with page.expect_download() as fetched:
        link.click()
    file = tmp_path / "bundle.zip"
    fetched.value.save_as(file)
    assert file.read_bytes()[:2] == b"PK"


@pytest.mark.long
def test_on_a_phone_everything_is_within_the_screen(phone: Page, bench: Bench) -> None:
    page = phone
    for name in ("alarms", "overview", "motion"):
        open_axis(page, bench.drive, name)
        page.locator("h1").wait_for()
        wide = page.evaluate("document.documentElement.scrollWidth - window.innerWidth")
        assert wide <= 0, name
        main = page.locator("#main")
        assert main.evaluate("e => e.scrollWidth - e.clientWidth") <= 0, name
