"""The load side on the page: a coupling with backlash, and an encoder at the load."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser import tuning
from tests.support.station import Station

pytestmark = [pytest.mark.timeout(600), pytest.mark.long]

MOTOR, LOAD, STIFFNESS, GAP_RAD = 5e-5, 1.5e-4, 60.0, 0.004
BENCH = f"""
[[axis]]
name = "Table"
drive = "generic402"
on = "{tuning.URL}"
station = 1
[axis.mechanics.motor]
inertia_kgm2 = {MOTOR}
rated_torque_nm = 1.27
rated_speed_rpm = 3000
[axis.mechanics.friction]
viscous_nms = 2e-4
coulomb_nm = 0.03
static_nm = 0.04
load_coulomb_nm = 0.01
[axis.mechanics.ripple]
cogging_nm = 0.004
[axis.mechanics.encoder]
noise_counts = 2
[[axis.mechanics.load]]
inertia_kgm2 = {LOAD}
stiffness_nm_per_rad = {STIFFNESS}
damping_nms_per_rad = 0.01
backlash_rad = {GAP_RAD}
[axis.mechanics.load_encoder]
counts_per_rev = 131072
eccentricity_rad = 1e-3
noise_counts = 0.3
"""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with tuning.running(Path(tmp_path_factory.mktemp("load_side")), BENCH) as station:
        yield station


@pytest.fixture(scope="module")
def page(browser: Browser, station: Station) -> Iterator[Page]:
    yield from tuning.patient_page(browser, station)


@pytest.fixture(scope="module")
def axis(station: Station) -> str:
    axis = station.add(1, tuning.URL, "generic402", "Table")
    tuning.exchange(station, 2000)
    return axis


def test_the_backlash_is_measured_and_shown(page: Page, station: Station, axis: str) -> None:
    panel = tuning.open_panel(page, axis, "Load side")
    expect(panel.get_by_text("WARNING: the axis is enabled and moves")).to_be_visible()
    panel.get_by_label("Inertia of the motor alone").fill(str(MOTOR))
    tuning.run_job(page, station, axis, "Measure the load side")
    expect(panel.get_by_text("check coupling, keys, belt tension and gear")).to_be_visible()
    picture = panel.get_by_role("img", name="Transmission error over the load's angle")
    expect(picture).to_be_visible()
    table = panel.get_by_role("table", name="Load side")
    gap = tuning.number_in(tuning.row(table, "Backlash at the load").inner_text(), "°")
    assert gap == pytest.approx(math.degrees(GAP_RAD), rel=0.05)
    spring = tuning.row(table, "Torsional stiffness at the load").inner_text()
    assert tuning.number_in(spring, "N·m/rad") == pytest.approx(STIFFNESS, rel=0.15)
    tuning.expect_within_the_screen(page)


def test_the_report_has_the_load_side_in_both_languages(station: Station, axis: str) -> None:
    for language, words in (("en", "Backlash at the load"), ("zh", "负载侧间隙")):
        assert words in tuning.report_of(station, axis, language)


def test_the_result_on_a_phone_in_chinese(browser: Browser, station: Station, axis: str) -> None:
    with tuning.chinese_phone(browser, station) as phone:
        panel = tuning.open_panel(phone, axis, "负载侧")
        expect(panel.get_by_text("警告：轴将使能并运动")).to_be_visible()
        expect(panel.get_by_role("table", name="负载侧").get_by_text("负载侧间隙")).to_be_visible()
        tuning.expect_within_the_screen(phone)
