"""Hand-over on the page Files, at a wide and at a narrow screen, in both languages."""

from __future__ import annotations

import base64
import re
from pathlib import Path
from xml.etree.ElementTree import tostring

import pytest
from defusedxml.ElementTree import fromstring
from playwright.sync_api import Locator, Page, expect

from tests.browser.driving import Bench
from tests.support.station import Station

pytestmark = pytest.mark.long

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


PLANTED = 30


def planted(station: Station, drive: str) -> tuple[bytes, dict[str, int]]:
    """Our list with another value in thirty of its writes, and these by key."""
    body = {"set_file": FILE, "format": "twincat", "file": "plc.xml"}
    made = station.ok(station.http.post(f"/drives/{drive}/handover", json=body))
    root = fromstring(base64.b64decode(made["files"][0]["content"]))
    commands = root.findall(".//InitCmd")
    changed = {}
    for command in commands[:: len(commands) // PLANTED][:PLANTED]:
        data = command.find("Data")
        assert data is not None
        other = int.from_bytes(bytes.fromhex(data.text or ""), "little") ^ 1
        data.text = other.to_bytes(len(data.text or "") // 2, "little").hex()
        index, subindex = (int(command.findtext(tag) or "") for tag in ("Index", "SubIndex"))
        changed[f"{index:04X}:{subindex:02X}"] = other
    assert len(changed) == PLANTED
    return tostring(root), changed


@pytest.mark.parametrize("width", ["laptop", "phone"])
def test_thirty_planted_conflicts_are_shown_and_no_other(
    width: str,
    request: pytest.FixtureRequest,
    station: Station,
    bench: Bench,
    held: int,
    tmp_path: Path,
) -> None:
    page: Page = request.getfixturevalue(width)
    data, changed = planted(station, bench.drive)
    listed = tmp_path / "plc.xml"
    listed.write_bytes(data)
    panel = open_panel(page)
    compare = panel.get_by_role("region", name="What will the controller overwrite?")
    compare.locator("input[type=file]").set_input_files(listed)
    expect(compare.get_by_role("status")).to_contain_text(f"plc.xml (twincat): {PLANTED} conflicts")
    rows = compare.locator("tbody tr")
    expect(rows).to_have_count(PLANTED)
    assert {row.locator("td").nth(1).inner_text() for row in rows.all()} == set(changed)
    kinds = {row.locator("td").nth(0).inner_text().strip() for row in rows.all()}
    assert kinds <= {"gain", "limit", "unit", "motion", "other"}
    assert {"gain", "limit"} <= kinds
    gains = rows.filter(has=page.locator("td:first-child", has_text="gain"))
    for row in gains.all():
        expect(row).to_contain_text("The controller will undo your tuning of")
    assert fits(page)


@pytest.mark.parametrize("width", ["laptop", "phone"])
def test_a_whole_segment_in_one_list(
    width: str, request: pytest.FixtureRequest, station: Station, held: int, tmp_path: Path
) -> None:
    y = station.add(2, name="Y")
    try:
        body = {"file": "second", "author": "Anna", "notes": "", "overwrite": True}
        station.ok(station.http.post(f"/drives/{y}/sets", json=body))
        page: Page = request.getfixturevalue(width)
        panel = open_panel(page)
        panel.get_by_label("Controller", exact=True).select_option("lcec")
        drives = panel.get_by_role("group", name="Drives of the list, in the order of the cable")
        drives.get_by_role("button", name="Add a drive").click()
        expect(drives.get_by_role("listitem")).to_have_count(2)
        second = drives.get_by_role("listitem").nth(1)
        expect(second.get_by_label("Parameter set")).to_have_value("second.sdset")
        drives.get_by_role("button", name="Move Y one place forward").click()
        panel.get_by_role("button", name="Make the files").click()
        made = panel.get_by_role("status").first
        expect(made.get_by_role("button", name="Download handed.xml.2.scaling.txt")).to_be_visible()
        with page.expect_download() as download:
            made.get_by_role("button", name="Download handed.xml", exact=True).click()
        download.value.save_as(tmp_path / "segment.xml")
        segment = fromstring((tmp_path / "segment.xml").read_bytes())
        assert [s.get("name") for s in segment.iterfind("master/slave")] == ["drive1", "drive2"]
        newest = station.ok(station.http.get(f"/drives/{y}/handovers"))[0]
        assert (newest["file"], newest["set_file"]) == ("handed.xml", "second.sdset")
        sheet = made.get_by_role("button", name="Download handed.xml.1.scaling.txt")
        with page.expect_download() as download:
            sheet.click()
        # The drive that was moved forward is the first on the cable.
        assert download.value.path().read_text().startswith("Hand-over of Y ")
        assert fits(page)
        drives.get_by_role("button", name="Remove Y from the list").click()
        expect(drives.get_by_role("listitem")).to_have_count(1)
    finally:
        station.remove(y)


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
