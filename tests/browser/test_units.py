"""Mechanics, gains, brake, resistor and watch list through the page, down to the drive."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from tests.browser.driving import Bench, open_axis
from tests.support.station import until

pytestmark = pytest.mark.long


def test_a_screw_becomes_a_gear_and_is_taken_back(laptop: Page, bench: Bench) -> None:
    page = laptop
    before = bench.raw("6092:01")
    open_axis(page, bench.drive, "setup")
    page.get_by_label("Lead").fill("10")
    page.get_by_role("button", name="Calculate").click()
    plan = page.locator("section.panel").filter(has=page.get_by_role("heading", name="Result"))
    expect(plan).to_contain_text("10 mm")
    # Nothing is written yet.
    assert bench.raw("6092:01") == before
    plan.get_by_role("button", name="Write the gear").click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("changes the meaning")
    dialog.get_by_role("button", name="Write the gear").click()
    # 10 mm of 0.001 mm.
    until(lambda: bench.raw("6092:01") == 10000, what="the feed is written")
    # Overview shows travel next to revolutions.
    open_axis(page, bench.drive, "overview")
    expect(page.get_by_text("Travel", exact=True)).to_be_visible()
    _move_in_millimetres(page, bench)
    open_axis(page, bench.drive, "setup")
    bench.write("6092:01", before)
    page.get_by_role("button", name="Delete the mechanics").click()
    expect(page.get_by_role("button", name="Delete the mechanics")).to_have_count(0)
    open_axis(page, bench.drive, "overview")
    expect(page.get_by_text("Travel", exact=True)).to_have_count(0)


def _move_in_millimetres(page: Page, bench: Bench) -> None:
    """Typed in mm, refused in mm, moved by mm; going back to revolutions leaves no number."""
    start = bench.state()["position"]
    open_axis(page, bench.drive, "motion")
    page.get_by_text("Move", exact=True).click()
    target = page.get_by_role("textbox", name="Target")
    target.fill("5")
    page.locator(".travel-unit").get_by_text("mm").click()
    expect(target).to_have_value("")
    target.fill("500")
    page.get_by_role("button", name="Start the move").click()
    expect(page.get_by_text("+500 mm from the start point")).to_be_visible()
    target.fill("5")
    page.get_by_role("button", name="Start the move").click()
    # 10 mm for each revolution.
    until(lambda: abs(bench.state()["position"] - start - 0.5) < 0.01, what="the axis moved 5 mm")
    bench.wait_standing()
    page.locator(".travel-unit").get_by_text("rev").click()
    expect(target).to_have_value("")


def test_what_cannot_be_is_said_before_it_is_written(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "setup")
    page.get_by_text("Rack", exact=True).click()
    expect(page.get_by_role("button", name="Calculate")).to_be_disabled()
    page.get_by_role("textbox", name="Module").fill("2")
    page.get_by_role("textbox", name="Teeth").fill("20")
    page.get_by_role("button", name="Calculate").click()
    # π · 2 · 20 mm.
    expect(page.get_by_text("125.6637 mm")).to_be_visible()
    expect(page.get_by_text("the ratio contains π")).to_be_visible()


def test_a_gain_is_written_and_undone(laptop: Page, bench: Bench) -> None:
    page = laptop
    before = bench.raw("2005:03")
    open_axis(page, bench.drive, "gains")
    # The picture leads to the parameters of a block.
    page.get_by_role("button", name="Speed loop").click()
    field = page.get_by_role("textbox", name="Speed loop bandwidth", exact=True)
    expect(field).to_be_in_viewport()
    expect(field).to_have_value(re.compile(r"\d"))
    field.fill("150")
    field.blur()
    block = page.locator("#block-speed")
    block.get_by_role("button", name="Write (1)").click()
    # Scale 0.1 Hz.
    until(lambda: bench.raw("2005:03") == 1500, what="the gain is in the drive")
    expect(block.get_by_text("takes effect later").first).to_be_visible()
    page.locator(".note.info").get_by_role("button").first.click()
    until(lambda: bench.raw("2005:03") == before, what="it is as before")


def test_a_stop_option_is_chosen_in_words(laptop: Page, bench: Bench) -> None:
    page = laptop
    before = bench.raw("605D:00")
    open_axis(page, bench.drive, "motion")
    page.get_by_text("Settings", exact=True).click()
    choice = page.get_by_role("combobox", name="Halt option code")
    expect(choice).to_have_value(str(before))
    choice.select_option(label="2 · quick stop deceleration, stay in halt")
    page.get_by_role("button", name="Write (1)").click()
    until(lambda: bench.raw("605D:00") == 2, what="605Dh is 2")
    bench.write("605D:00", before)


def test_the_resistor_of_the_manuals_example(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "setup")
    page.get_by_text("Resistor", exact=True).click()
    # What arrives from the drive later would ask for a new calculation.
    expect(page.get_by_label("Threshold voltage")).to_have_value("56")
    page.get_by_label("Model").select_option("400 W")
    page.get_by_label("Inertia of motor and load").fill("0.0005")
    page.get_by_label("Speed before braking").fill("3000")
    page.get_by_role("button", name="Calculate").click()
    # Equation 9 of manual 004: 24.67 J, and more than both resistors take.
    expect(page.get_by_text("24.67 J")).to_be_visible()
    expect(page.get_by_text(re.compile("This exceeds the built-in and external"))).to_be_visible()


def test_the_course_of_the_brake_is_drawn(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "setup")
    page.get_by_text("Brake", exact=True).click()
    picture = page.get_by_role("img", name="Brake timing")
    # 004:1793, figure 24.
    expect(picture).to_contain_text("50 ms")


def test_the_watch_list_is_live_and_stays(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "overview")
    search = page.get_by_role("combobox", name="Add a parameter")
    search.fill("Temperature · 2040")
    page.locator("[data-combobox-option]:visible").first.click()
    row = page.locator("ul.watch li").filter(has_text="2040:00")
    expect(row).to_contain_text("°C")
    expect(row).not_to_contain_text("ago")
    page.reload()
    open_axis(page, bench.drive, "overview")
    expect(page.locator("ul.watch li").filter(has_text="2040:00")).to_contain_text("°C")
    page.get_by_role("button", name=re.compile("^Remove .* from the list")).first.click()
    expect(page.locator("ul.watch li")).to_have_count(0)
