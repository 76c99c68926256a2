"""A safety record on the page: an axis that the drive stops by itself, recorded and signed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser import tuning
from tests.browser.conftest import LAPTOP, _open
from tests.browser.driving import open_axis
from tests.support.station import HANG_S, Station, until

pytestmark = [pytest.mark.timeout(400), pytest.mark.long]


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with tuning.running(Path(tmp_path_factory.mktemp("safety"))) as station:
        yield station


@pytest.fixture(scope="module")
def page(browser: Browser, station: Station) -> Iterator[Page]:
    opened = _open(browser, station.url, **LAPTOP)
    found = next(opened)
    found.set_default_timeout(120_000)
    yield found
    next(opened, None)


def test_a_function_is_recorded_and_signed(page: Page, station: Station) -> None:
    axis = station.add(1, tuning.URL, name="Spindle")
    tuning.keep_exchanging(page, axis)
    open_axis(page, axis, "tune")
    tuning.open_step(page, "more")
    heading = page.get_by_role("heading", name="Safety acceptance record", exact=True)
    panel = page.locator("section.panel").filter(has=heading).last
    expect(panel.get_by_text("This is a record and no certificate").first).to_be_visible()
    start = panel.get_by_role("button", name="Start, then trigger it by hand")
    # Nothing starts before somebody has stated with what, and what hangs at the axis.
    expect(start).to_be_disabled()
    panel.get_by_label("Triggered with").fill("S1")
    panel.get_by_label("Triggered by").fill("Ann")
    panel.get_by_label("Test speed (rpm)").fill("60")
    statement = panel.get_by_label("No load pulls at this axis", exact=True)
    statement.check()
    expect(start).to_be_enabled()
    start.click()

    def runs() -> bool:
        jobs = tuning.answered(station, "/jobs")
        return any(job["kind"] == "safety-check" and job["progress"] > 0.3 for job in jobs)

    until(runs, HANG_S, "the axis runs")
    station.drives.cause_fault(tuning.URL, 1)
    expect(panel.get_by_text("The drive reports:")).to_be_visible(timeout=tuning.MEASURED_MS)
    expect(panel.get_by_text("Not signed.")).to_be_visible()
    # The statement was for this check only.
    expect(statement).not_to_be_checked()
    panel.get_by_role("button", name="Sign this record").click()
    expect(panel.get_by_text(re.compile("Signed by (Ann|local user), .* SHA-256"))).to_be_visible()
    expect(panel.get_by_role("button", name="Sign this record")).to_have_count(0)
    jobs = tuning.answered(station, "/jobs")
    (name,) = next(job for job in jobs if job["kind"] == "safety-check")["result"]["measurements"]
    kept = tuning.answered(station, f"/measurements/{name}")
    assert kept["result"]["signature"]["intact"]
    assert kept["agrees"]
