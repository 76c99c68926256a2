"""From the scan to values that survive a power cut, and parameter sets, through the page."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from tests.browser.driving import Bench, find, open_axis, row
from tests.support.station import Station, until

ACCELERATION = "6083:00"


def test_scan_and_connect(laptop: Page, station: Station) -> None:
    page = laptop
    page.get_by_role("button", name="mlink://virtual0").click()
    page.get_by_label("Stations").fill("1-3")
    page.get_by_label("Stop at the first drive found").uncheck()
    page.get_by_role("button", name="Scan").click()
    results = page.get_by_role("region", name="What was found")
    expect(results.get_by_role("heading")).to_have_text("Drives found: 2")
    first = results.locator(".found").first
    expect(first).to_contain_text("Station 1")
    expect(first.get_by_label("Profile")).to_have_value("mms7")
    first.get_by_label("Name").fill("Gantry")
    first.get_by_role("button", name="Connect").click()
    expect(page.get_by_role("link", name="Gantry")).to_be_visible()
    expect(page.get_by_label("State of the drive")).to_contain_text("Switch on disabled")
    (drive,) = station.ok(station.http.get("/drives"))
    assert drive["name"] == "Gantry"
    # The bench is as it was for the other tests.
    page.get_by_role("button", name="Remove axis").click()
    page.get_by_role("dialog").get_by_role("button", name="Remove axis").click()
    until(lambda: station.ok(station.http.get("/drives")) == [], what="the drive is gone")


def test_edit_write_save_and_power_cycle(laptop: Page, bench: Bench) -> None:
    page = laptop
    before = bench.raw(ACCELERATION)
    wanted = before + 12345
    open_axis(page, bench.drive, "parameters")
    page.get_by_role("button", name="Read all").click()
    expect(find(page, ACCELERATION)).to_contain_text(str(before))

    # Typed is not written: it is marked, and the drive still has the old value.
    found = row(page, ACCELERATION)
    found.get_by_role("button", name=re.compile("^Edit")).click()
    page.keyboard.type(str(wanted))
    page.keyboard.press("Enter")
    expect(found).to_contain_text("edited")
    # Digits missing from it would be read as another number.
    assert found.locator(".typed").evaluate("shown => shown.scrollWidth <= shown.clientWidth")
    assert bench.raw(ACCELERATION) == before

    page.get_by_role("button", name="Write edited (1)").click()
    expect(found.locator(".edited")).to_have_count(0)
    expect(found.locator(".value")).to_have_text(str(wanted))
    assert bench.raw(ACCELERATION) == wanted
    expect(found).to_contain_text("in drive, not saved")

    page.get_by_role("button", name=re.compile("Save in the drive")).click()
    dialog = page.get_by_role("dialog")
    for box in dialog.get_by_role("checkbox").all():
        box.check()
    dialog.get_by_role("button", name="Run").click()
    expect(found.locator(".unsaved")).to_have_count(0, timeout=30_000)

    bench.power_cycle()
    until(lambda: bench.state()["fresh"], what="the drive is back")
    assert bench.raw(ACCELERATION) == wanted
    page.get_by_role("button", name=re.compile("Read shown")).click()
    expect(found.locator(".value")).to_have_text(str(wanted))


@pytest.mark.long
def test_what_cannot_be_written_is_not_kept(laptop: Page, bench: Bench) -> None:
    page = laptop
    before = bench.raw(ACCELERATION)
    open_axis(page, bench.drive, "parameters")
    found = find(page, ACCELERATION)
    expect(found.locator(".value")).to_have_text(str(before))
    found.get_by_role("button", name=re.compile("^Edit")).click()
    page.keyboard.type("-5")
    expect(found.get_by_role("alert")).to_contain_text("at least")
    page.keyboard.press("Tab")
    expect(found.locator(".edited")).to_have_count(0)
    expect(page.get_by_role("button", name="Write edited (0)")).to_be_disabled()
    assert bench.raw(ACCELERATION) == before


def test_table_with_the_keyboard_alone(laptop: Page, bench: Bench) -> None:
    page = laptop
    before = bench.raw(ACCELERATION)
    open_axis(page, bench.drive, "parameters")
    find(page, ACCELERATION)
    page.get_by_role("grid").focus()
    page.keyboard.press("ArrowDown")
    expect(row(page, ACCELERATION)).to_have_attribute("aria-selected", "true")
    expect(row(page, ACCELERATION).locator(".value")).to_have_text(str(before))
    page.keyboard.press("Enter")
    page.keyboard.type(str(before + 7))
    page.keyboard.press("Enter")
    page.keyboard.press("Control+Enter")
    expect(row(page, ACCELERATION).locator(".value")).to_have_text(str(before + 7))
    assert bench.raw(ACCELERATION) == before + 7


@pytest.mark.long
def test_set_file_change_compare_load(laptop: Page, bench: Bench) -> None:
    page = laptop
    original = bench.raw(ACCELERATION)
    open_axis(page, bench.drive, "parameters")
    page.get_by_text("Compare", exact=True).click()
    page.get_by_role("button", name="Save to a file").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_label("File name").fill("browser test")
    dialog.get_by_label("Author").fill("tester")
    dialog.get_by_role("button", name="Save", exact=True).click()
    expect(dialog).to_have_count(0)

    bench.write(ACCELERATION, original + 999)
    source = page.get_by_label("Compare with")
    source.select_option(label="file browser test.sdset")
    page.get_by_role("button", name="Compare", exact=True).click()
    line = page.get_by_role("row").filter(has_text=ACCELERATION)
    expect(line).to_contain_text(str(original + 999))
    expect(line).to_contain_text("differs")
    expect(line.get_by_role("checkbox")).to_be_checked()

    page.get_by_role("button", name="Load (1)").click()
    dialog.get_by_role("button", name="Write now").click()
    expect(dialog).to_contain_text("1 written and read back, 0 failed")
    dialog.get_by_role("button", name="Close").last.click()
    assert bench.raw(ACCELERATION) == original
    expect(page.get_by_text("No difference.").first).to_be_visible()


def test_value_that_somebody_else_wrote_arrives(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "parameters")
    found = find(page, ACCELERATION)
    bench.write(ACCELERATION, 4242)
    expect(found.locator(".value")).to_have_text("4242")


@pytest.mark.long
def test_chinese_page_finds_parameters_in_both_languages_and_shows_the_original(
    laptop: Page, bench: Bench
) -> None:
    page = laptop
    open_axis(page, bench.drive, "parameters")
    page.evaluate("localStorage.setItem('servodeck.language', 'zh')")
    page.reload()
    search = page.get_by_role("searchbox")
    for wanted in ("速度环带宽", "speed loop bandwidth"):
        search.fill(wanted)
        expect(row(page, "2005:03").locator(".name")).to_contain_text("速度环带宽")
    name = row(page, "2005:03").locator(".name")
    expect(name).not_to_contain_text("Speed loop bandwidth")
    page.get_by_label("同时显示英文原文").check()
    expect(name).to_contain_text("Speed loop bandwidth")
    page.get_by_label("同时显示英文原文").uncheck()
    # Units and numbers are the drive's in every language.
    expect(row(page, "2005:03").locator(".unit")).to_have_text("Hz")
