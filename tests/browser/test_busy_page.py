"""A hold on a page that is busy: a hiccup, and no motion after a release that it did not see."""

from __future__ import annotations

import pytest
from playwright.sync_api import Page, expect

from tests.browser.busy_page import block, hold, lasts, resumes_after_release
from tests.browser.driving import SILENT, Bench, open_axis

pytestmark = pytest.mark.long

#: Longer than the 200 ms after which the axis brakes, with room to the 500 ms after which a hold
#: has ended for good, as the computer of the tests is busy with others, too.
BLOCK_MS = 260


def test_a_hold_lasts_through_a_busy_moment_and_the_page_says_so(
    laptop: Page, bench: Bench
) -> None:
    page = laptop
    open_axis(page, bench.drive, "motion")
    for _ in range(8):
        if lasts(page, bench, [BLOCK_MS]):
            break
        # Where the computer itself took longer, the hold ends, rightly and with these words.
        assert bench.jog_end() in SILENT
    else:
        raise AssertionError("no hold of eight lasted")
    expect(page.get_by_text("The signal was interrupted for")).to_be_visible()


def test_a_release_in_a_busy_moment_is_final(laptop: Page, bench: Bench) -> None:
    open_axis(laptop, bench.drive, "motion")
    for _ in range(3):
        assert not resumes_after_release(laptop, bench, BLOCK_MS)


def test_a_page_that_is_busy_for_too_long_ends_the_hold(laptop: Page, bench: Bench) -> None:
    open_axis(laptop, bench.drive, "motion")
    hold(laptop, bench)
    block(laptop, [900])
    bench.wait_standing()
    assert bench.jog_job()["state"] != "running"
    assert bench.jog_end() in SILENT
    laptop.mouse.up()
