"""Terminals on the page: functions with a warning of twins, overruling for a while, probes."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from tests.browser.cable import Cable
from tests.browser.driving import REPORTED_MS, Bench, open_axis
from tests.support.machine import within
from tests.support.station import until


@pytest.mark.long
def test_a_function_is_written_and_a_twin_is_asked_about(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "io")
    page.get_by_label("Function of DI1").select_option("3")
    until(lambda: bench.raw("2030:01") == 3, what="DI1 is the home switch")
    # A second home switch is not written before it was agreed to.
    page.get_by_label("Function of DI2").select_option("3")
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("DI2 would get the same function as DI1")
    assert bench.raw("2030:02") == 0
    dialog.get_by_role("button", name="Cancel").click()
    assert bench.raw("2030:02") == 0
    page.get_by_label("Function of DI2").select_option("3")
    page.get_by_role("dialog").get_by_role("button", name="Write anyway").click()
    until(lambda: bench.raw("2030:02") == 3, what="DI2 is one too")
    expect(page.get_by_text("The same function as DI2.")).to_be_visible()
    for key in ("2030:01", "2030:02"):
        bench.write(key, 0)


def test_polarity_is_one_bit_and_leaves_the_others_alone(laptop: Page, bench: Bench) -> None:
    page = laptop
    bench.write("2031:01", 0x0101)
    open_axis(page, bench.drive, "io")
    choice = page.get_by_label("Polarity of DI2")
    expect(choice).to_have_value("0")
    expect(choice.get_by_role("option", name="normally closed")).to_be_attached()
    choice.select_option("1")
    until(lambda: bench.raw("2031:01") == 0x0103, what="bit 1 is set")
    bench.write("2031:01", 0)


def begin_forcing(page: Page, bench: Bench) -> None:
    open_axis(page, bench.drive, "io")
    force = page.locator("section.panel").filter(
        has=page.get_by_role("heading", name="Force outputs")
    )
    begin = force.get_by_role("button", name="Begin")
    expect(begin).to_be_disabled()
    force.get_by_label(re.compile("^I understand")).check()
    begin.click()
    force.get_by_role("radiogroup", name="Value of DO1").get_by_text("on", exact=True).click()
    until(lambda: bench.raw("60FE:02") == 0x10000, what="DO1 is forced")


def test_forcing_ends_with_leaving_the_page(laptop: Page, bench: Bench) -> None:
    page = laptop
    begin_forcing(page, bench)
    assert bench.raw("60FE:01") & 0x10000
    open_axis(page, bench.drive, "overview")
    # The mask is written first, the value after it.
    keys = ("60FE:02", "60FE:01")
    within(3, lambda: [bench.raw(key) for key in keys] == [0, 0], "leaving lets go at once")


def test_forcing_ends_with_stop(laptop: Page, bench: Bench) -> None:
    page = laptop
    begin_forcing(page, bench)
    page.keyboard.press("Escape")
    within(3, lambda: bench.raw("60FE:02") == 0, "STOP lets go")
    expect(page.get_by_text("STOP was pressed")).to_be_visible(timeout=REPORTED_MS)


@pytest.mark.long
def test_forcing_ends_with_the_connection(laptop: Page, bench: Bench, cable: Cable) -> None:
    begin_forcing(laptop, bench)
    cable.cut()
    within(15, lambda: bench.raw("60FE:02") == 0, "no sign of life lets go")
    cable.mend()


@pytest.mark.long
def test_a_probe_is_set_up_and_shows_what_it_waits_for(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "io")
    probe = page.get_by_role("group", name="Probe 1")
    probe.get_by_label("Armed").check()
    probe.get_by_label("Rising edge").check()
    probe.get_by_role("button", name="Set up").click()
    until(lambda: bench.raw("60B8:00") == 0x11, what="60B8h as in manual 004:4670, single")
    expect(probe.get_by_text("nothing latched").first).to_be_visible()
    probe.get_by_label("Armed").uncheck()
    probe.get_by_role("button", name="Set up").click()
    until(lambda: bench.raw("60B8:00") & 1 == 0, what="the probe is off")
