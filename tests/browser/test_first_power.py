"""The checklist of the first power on the page: a motor with two exchanged phases."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from backend.station.demo import DemoBench
from drivers.virtual.wires.netns import unavailable
from tests.browser import tuning
from tests.browser.conftest import LAPTOP, PATIENCE_MS, _open
from tests.browser.driving import open_axis
from tests.support.station import Station

pytestmark = [pytest.mark.timeout(400), pytest.mark.long]

BENCH = (
    tuning.BENCH
    + """
[axis.mechanics.phases]
order = "exchanged"
"""
)


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    if reason := unavailable():
        pytest.skip(reason)
    folder = Path(tmp_path_factory.mktemp("first-power"))
    bench = folder / "bench.toml"
    bench.write_text(BENCH, "utf-8")
    running = Station(folder, bench)
    running.drives = DemoBench(bench, folder / "wires", folder / "nvm", steady=True)
    running.start()
    # Starting an exchange is some transactions on a bus that may have to wait.
    expect.set_options(timeout=120_000)
    try:
        yield running
    finally:
        expect.set_options(timeout=PATIENCE_MS)
        running.stop()


@pytest.fixture(scope="module")
def page(browser: Browser, station: Station) -> Iterator[Page]:
    opened = _open(browser, station.url, **LAPTOP)
    found = next(opened)
    found.set_default_timeout(120_000)
    yield found
    next(opened, None)


def test_exchanged_phases_are_found_and_named(page: Page, station: Station) -> None:
    axis = station.add(1, tuning.URL, name="Spindle")
    tuning.keep_exchanging(page, axis)
    open_axis(page, axis, "tune")
    tuning.open_step(page, "first")
    start = page.get_by_role("button", name="Go through the checklist")
    # Nothing starts before somebody has stated what hangs at the axis.
    expect(start).to_be_disabled()
    nothing_hangs = page.get_by_label("No load pulls at this axis", exact=True)
    nothing_hangs.check()
    expect(start).to_be_enabled()
    tuning.run_job(page, station, axis, "Go through the checklist", nothing_hangs.check)
    checks = page.get_by_role("list", name="Check").get_by_role("listitem")
    expect(checks).to_have_count(7)
    expect(
        checks.filter(has_text=re.compile("^Phases: the torque turned the shaft"))
    ).to_be_visible()
    expect(page.get_by_text("Do not close a loop over this motor yet")).to_be_visible()
    # The statement was for this run only.
    expect(nothing_hangs).not_to_be_checked()
    jobs = tuning.answered(station, "/jobs")
    found = next(job["result"] for job in jobs if job["kind"] == "first-power")
    assert found["travel_rev"] <= 0.1
    assert found["torque_percent"] <= 10
