"""Hand-over on the page Files, at a wide and at a narrow screen, in both languages."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.browser.driving import Bench
from tests.support.station import Station

GAIN = "2005:03"
FILE = "handed.sdset"


@pytest.fixture
def held(station: Station, bench: Bench) -> int:
    """A set of the drive as it is; the gain in it."""
    body = {"file": "handed", "author": "Anna", "notes": "", "overwrite": True}
    station.ok(station.http.post(f"/drives/{bench.drive}/sets", json=body))
    return int(bench.raw(GAIN))


def open_panel(page: Page) -> Locator:
    page.evaluate("location.hash = '#/files'")
    page.get_by_role("button", name=f"Hand {FILE} over to the controller").click()
    panel = page.locator("section.panel", has_text="Hand over to the controller")
    expect(panel).to_be_visible()
    return panel


def fits(page: Page) -> bool:
    """Nothing makes the page wider than the screen."""
    return bool(page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"))


@pytest.mark.parametrize("width", ["laptop", "phone"])
def test_export_compare_and_what_changed(
    width: str, request: pytest.FixtureRequest, bench: Bench, held: int, tmp_path: Path
) -> None:
    page: Page = request.getfixturevalue(width)
    panel = open_panel(page)
    panel.get_by_label("Values", exact=True).select_option("tuned")
    panel.get_by_role("button", name="Make the files").click()
    made = panel.get_by_role("status").first
    expect(made).to_contain_text(re.compile(r"\d+ values handed over, \d+ left out"))
    with page.expect_download() as download:
        made.get_by_role("button", name="Download handed.xml", exact=True).click()
    listed = tmp_path / "handed.xml"
    download.value.save_as(listed)
    assert b"<EtherCATMailbox>" in listed.read_bytes()
    expect(made.get_by_role("button", name="Download handed.xml.scaling.txt")).to_be_visible()

    # The controller's list is our own: nothing is overwritten.
    compare = panel.get_by_role("region", name="What will the controller overwrite?")
    compare.locator("input[type=file]").set_input_files(listed)
    expect(compare).to_contain_text("The controller overwrites nothing of this set.")

    # A list with another gain undoes the tuning, and says so.
    other = tmp_path / "plc.sh"
    other.write_text(f"ethercat download -p 0 -t uint16 0x2005 3 {held + 9}\n")
    compare.locator("input[type=file]").set_input_files(other)
    row = compare.get_by_role("row").filter(has_text=GAIN)
    expect(row).to_contain_text("gain")
    expect(row).to_contain_text("The controller will undo your tuning of")
    # In steps of 0.1 Hz (manual 004, 2005:03).
    expect(row).to_contain_text(f"{(held + 9) / 10:g}")
    assert fits(page)

    # What is no list gets one clear error.
    bad = tmp_path / "bad.xml"
    bad.write_text('<!DOCTYPE a [<!ENTITY b "c">]><EtherCATMailbox>&b;</EtherCATMailbox>')
    compare.locator("input[type=file]").set_input_files(bad)
    expect(compare.get_by_role("alert")).to_contain_text("bad.xml")

    # Since the hand-over: first nothing, then the gain that somebody wrote.
    earlier = panel.get_by_role("region", name="Earlier hand-overs").get_by_role("article").first
    check = earlier.get_by_role("button", name="What has changed since handed.xml?")
    check.click()
    expect(earlier).to_contain_text("are in the drive as they were handed over")
    bench.write(GAIN, held + 4)
    try:
        check.click()
        expect(earlier).to_contain_text("1 value has changed since the hand-over.")
        expect(earlier.get_by_role("row").filter(has_text=GAIN)).to_contain_text(
            f"{(held + 4) / 10:g}"
        )
    finally:
        bench.write(GAIN, held)
    assert fits(page)


def test_in_chinese(laptop: Page, held: int) -> None:
    laptop.evaluate("localStorage.setItem('servodeck.language', 'zh')")
    try:
        laptop.reload()
        laptop.evaluate("location.hash = '#/files'")
        laptop.get_by_role("button", name=f"将 {FILE} 移交给控制器").click()
        panel = laptop.locator("section.panel", has_text="移交给控制器")
        expect(panel.get_by_role("button", name="生成文件")).to_be_visible()
        expect(panel).to_contain_text("控制器会覆盖哪些值？")
    finally:
        laptop.evaluate("localStorage.setItem('servodeck.language', 'en')")
