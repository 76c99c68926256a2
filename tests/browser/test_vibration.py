"""Vibration over speed on the page: cogging of the motor, and a part that turns otherwise."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser import tuning
from tests.support.station import Station

pytestmark = [pytest.mark.timeout(600), pytest.mark.long]

#: Periods per revolution of the motor, and of what does not turn with its shaft.
COGGING, PLACE = 36, 7.3
BENCH = f"""
[[axis]]
name = "Feed"
drive = "mms7"
on = "{tuning.URL}"
station = 1
[axis.mechanics.motor]
inertia_kgm2 = 5e-5
rated_torque_nm = 1.27
rated_speed_rpm = 3000
[axis.mechanics.friction]
viscous_nms = 3e-4
[axis.mechanics.ripple]
revolution_nm = 0.002
cogging_nm = 0.015
cogging_per_rev = {COGGING}
phase_rad = 0.4
[axis.mechanics.place]
torque_nm = 0.012
period_rev = {1 / PLACE}
[[axis.mechanics.load]]
inertia_kgm2 = 3e-5
stiffness_nm_per_rad = 30.0
damping_nms_per_rad = 2e-3
"""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with tuning.running(Path(tmp_path_factory.mktemp("vibration")), BENCH) as station:
        yield station


@pytest.fixture(scope="module")
def page(browser: Browser, station: Station) -> Iterator[Page]:
    yield from tuning.patient_page(browser, station)


@pytest.fixture(scope="module")
def axis(station: Station) -> str:
    axis = station.add(1, tuning.URL, name="Feed")
    tuning.exchange(station, 1000)
    return axis


def test_orders_are_found_with_where_they_come_from(
    page: Page, station: Station, axis: str
) -> None:
    panel = tuning.open_panel(page, axis, "Vibration over speed")
    expect(panel.get_by_text("WARNING: the axis is enabled and moves")).to_be_visible()
    panel.get_by_label("Speeds in each direction").fill("5")
    panel.get_by_label("Further speeds about the highest level").fill("0")
    panel.get_by_label("Slowest speed").fill("200")
    tuning.run_job(page, station, axis, "Map the vibration")
    picture = panel.get_by_role("img", name="Amplitude of orders over speed")
    expect(picture).to_be_visible()
    orders = panel.locator("table", has_text="Order per revolution")
    places = {}
    for row in orders.get_by_role("row").all_inner_texts():
        if number := re.match(r"[\d.]+", row):
            places[round(float(number[0]), 1)] = row
    assert "motor, or what turns with its shaft" in places[COGGING]
    assert "gear, bearing" in places[PLACE]
    # What the samples of the bus cannot show is said.
    expect(panel.get_by_text("Nothing above 400 Hz is stated")).to_be_visible()
    tuning.expect_within_the_screen(page)


def test_the_report_has_the_map_in_both_languages(station: Station, axis: str) -> None:
    for language, words in (("en", "Order per revolution"), ("zh", "每转阶次")):
        assert words in tuning.report_of(station, axis, language)


def test_the_result_on_a_phone_in_chinese(browser: Browser, station: Station, axis: str) -> None:
    with tuning.chinese_phone(browser, station) as phone:
        panel = tuning.open_panel(phone, axis, "振动-速度图谱")
        expect(panel.get_by_text("警告：轴将使能并运动")).to_be_visible()
        expect(panel.get_by_text("不随电机轴转动的部件").first).to_be_visible()
        tuning.expect_within_the_screen(phone)
