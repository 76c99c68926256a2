"""The load side on the page: a drive with a second encoder, whose coupling has a gap."""

from __future__ import annotations

import math
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

pytestmark = pytest.mark.timeout(600)

GAP = 0.006
BENCH = (
    tuning.BENCH.replace('"mms7"', '"generic402"')
    + f"""
backlash_rad = {GAP}
[axis.mechanics.load_encoder]
counts_per_rev = 131072
eccentricity_rad = 1e-3
noise_counts = 0.3
"""
)


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    if reason := unavailable():
        pytest.skip(reason)
    folder = Path(tmp_path_factory.mktemp("load-side"))
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


def test_backlash_and_stiffness_are_measured_and_shown(page: Page, station: Station) -> None:
    axis = station.add(1, tuning.URL, "generic402", "Spindle")
    tuning.keep_exchanging(page, axis)
    open_axis(page, axis, "tune")
    tuning.open_step(page, "more")
    heading = page.get_by_role("heading", name="Load side", exact=True)
    panel = page.locator("section.panel").filter(has=heading).last
    panel.get_by_label("Inertia of the motor alone").fill(str(tuning.MOTOR))
    tuning.run_job(page, station, axis, "Measure the load side")
    expect(panel.get_by_text("The backlash is")).to_be_visible(timeout=tuning.MEASURED_MS)
    table = panel.get_by_role("table", name="Load side")
    expect(table.get_by_role("row", name="Torsional stiffness at the load")).to_be_visible()
    jobs = tuning.answered(station, "/jobs")
    found = next(job for job in jobs if job["kind"] == "load-side")["result"]
    assert found["backlash_deg"]["value"] == pytest.approx(math.degrees(GAP), rel=0.05)
    assert found["stiffness_nm_per_rad"]["value"] == pytest.approx(tuning.STIFFNESS, rel=0.10)
