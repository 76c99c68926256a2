"""The load side on the page: a drive with a second encoder, whose coupling has backlash."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser import tuning
from tests.browser.conftest import LAPTOP, _open
from tests.support.station import Station

pytestmark = pytest.mark.timeout(600)

BACKLASH_RAD = 0.006
BENCH = (
    tuning.BENCH.replace('"mms7"', '"generic402"')
    + f"""
backlash_rad = {BACKLASH_RAD}
[axis.mechanics.load_encoder]
counts_per_rev = 131072
eccentricity_rad = 1e-3
noise_counts = 0.3
"""
)


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with tuning.running(Path(tmp_path_factory.mktemp("load-side")), BENCH) as station:
        yield station


@pytest.fixture(scope="module")
def page(browser: Browser, station: Station) -> Iterator[Page]:
    opened = _open(browser, station.url, **LAPTOP)
    found = next(opened)
    found.set_default_timeout(120_000)
    yield found
    next(opened, None)


@pytest.fixture(scope="module")
def axis(station: Station) -> str:
    return station.add(1, tuning.URL, "generic402", "Spindle")


def test_backlash_and_stiffness_are_measured_and_shown(
    page: Page, station: Station, axis: str
) -> None:
    tuning.keep_exchanging(page, axis)
    panel = tuning.open_panel(page, axis, "Load side")
    expect(panel.get_by_text("WARNING: the axis is enabled and moves")).to_be_visible()
    panel.get_by_label("Inertia of the motor alone").fill(str(tuning.MOTOR))
    tuning.run_job(page, station, axis, "Measure the load side")
    expect(panel.get_by_text("The backlash is")).to_be_visible()
    expect(
        panel.get_by_role("img", name="Transmission error over the load's angle")
    ).to_be_visible()
    table = panel.get_by_role("table", name="Load side")
    shown = tuning.number_in(tuning.row(table, "Backlash at the load").inner_text(), "°")
    assert shown == pytest.approx(math.degrees(BACKLASH_RAD), rel=0.05)
    stiffness = tuning.row(table, "Torsional stiffness at the load").inner_text()
    assert tuning.number_in(stiffness, "N·m/rad") == pytest.approx(tuning.STIFFNESS, rel=0.10)


def test_the_result_on_a_phone_in_chinese(browser: Browser, station: Station, axis: str) -> None:
    with tuning.chinese_phone(browser, station) as phone:
        panel = tuning.open_panel(phone, axis, "负载侧")
        expect(panel.get_by_text("警告：轴将使能并运动多次")).to_be_visible()
        expect(panel.get_by_text("负载侧间隙为")).to_be_visible()
        tuning.expect_within_the_screen(phone)
