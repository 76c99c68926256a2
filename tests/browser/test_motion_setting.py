"""Objects that can energise the motor: no field in the table, and where they are set."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from tests.browser.driving import Bench, find, open_axis
from tests.support.station import until

pytestmark = pytest.mark.long

#: Retry enable, 0 from the factory: after a fault the drive goes on by itself. No page is made
#: for it.
SETTING = "200B:07"


@pytest.mark.parametrize("key", ["6040:00", "6060:00", "60FF:00"])
def test_what_moves_is_not_written_in_the_table(laptop: Page, bench: Bench, key: str) -> None:
    page = laptop
    before = bench.raw(key)
    open_axis(page, bench.drive, "parameters")
    row = find(page, key)
    expect(row).to_contain_text("moves")
    expect(row.get_by_role("button", name=re.compile("^Edit"))).to_have_count(0)
    row.click()
    detail = page.get_by_label("Chosen parameter")
    expect(detail).to_contain_text("Can energise the motor")
    expect(detail.get_by_role("textbox")).to_have_count(0)
    # Past the page: refused, with the page that can.
    path = f"/drives/{bench.drive}/parameters/{key}"
    answer = bench.station.http.put(path, json={"raw": 15 if key == "6040:00" else 3})
    assert answer.status_code == 409
    assert answer.json()["type"] == "urn:servodeck:not-granted"
    assert "Motion page" in answer.json()["remedy"]
    assert bench.raw(key) == before
    detail.get_by_role("link", name="Open the Motion page").click()
    expect(page.get_by_role("heading", level=1)).to_contain_text("Motion")


def test_a_setting_that_can_move_needs_reason_and_consent(laptop: Page, bench: Bench) -> None:
    page = laptop
    assert bench.raw(SETTING) == 0
    open_axis(page, bench.drive, "parameters")
    find(page, SETTING).click()
    page.get_by_role("button", name="Set with permission…").click()
    dialog = page.get_by_role("dialog")
    value = dialog.get_by_label("New value")
    expect(value).to_have_value("0")
    value.select_option("1")
    # What for (the reason below), until when, and within what limits the permission is given.
    for label, fact in (("Valid until", "for this one write"), ("Limits", "0.001 rev")):
        term = dialog.get_by_role("term").filter(has_text=label)
        expect(term).to_be_visible()
        expect(term.locator("xpath=following-sibling::dd[1]")).to_contain_text(fact)
    write = dialog.get_by_role("button", name="Write this setting")
    write.click(force=True)  # dim, and a press states the reason
    expect(dialog).to_contain_text("Give a reason.")
    dialog.get_by_label("Reason (log and audit)").fill("test of the supply")
    write.click(force=True)
    assert bench.raw(SETTING) == 0
    dialog.get_by_label(re.compile("^Nobody is in the danger zone")).check()
    write.click()
    expect(dialog).to_have_count(0)
    until(lambda: bench.raw(SETTING) == 1, what="the setting is written")
    log = bench.station.ok(bench.station.http.get("/log"))
    assert any("test of the supply" in entry["text"] for entry in log)


def test_with_power_it_is_not_written(laptop: Page, bench: Bench) -> None:
    page = laptop
    before = bench.raw(SETTING)
    goal = {"goal": "Operation enabled"}
    path = f"/drives/{bench.drive}/transition"
    bench.station.ok(bench.station.http.post(path, json=goal))
    open_axis(page, bench.drive, "parameters")
    find(page, SETTING).click()
    page.get_by_role("button", name="Set with permission…").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_role("button", name="Write this setting").click(force=True)
    expect(dialog).to_contain_text("The axis has power: disable it first.")
    assert bench.raw(SETTING) == before
