"""Command shaping on the page: an arm that oscillates slowly after each move."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser import tuning
from tests.browser.conftest import LAPTOP, _open
from tests.browser.driving import open_axis
from tests.support.station import Station

pytestmark = [pytest.mark.timeout(600), pytest.mark.long]

#: Of the arm while the motor is held.
MODE_HZ = 8.0
ARM_KGM2 = 1e-4
BENCH = f"""
[[axis]]
name = "Arm"
drive = "mms7"
on = "{tuning.URL}"
station = 1
[axis.mechanics.motor]
inertia_kgm2 = 5e-5
rated_torque_nm = 1.27
rated_speed_rpm = 3000
[axis.mechanics.friction]
viscous_nms = 2e-4
coulomb_nm = 0.01
[[axis.mechanics.load]]
inertia_kgm2 = {ARM_KGM2}
stiffness_nm_per_rad = {ARM_KGM2 * (2 * math.pi * MODE_HZ) ** 2}
damping_nms_per_rad = 1e-4
"""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with tuning.running(Path(tmp_path_factory.mktemp("shaping")), BENCH) as station:
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
    return station.add(1, tuning.URL, name="Arm")


def test_a_shaper_is_verified_and_shown(page: Page, station: Station, axis: str) -> None:
    # The slow mode needs no faster cycle, and the computer of the tests has less to do.
    cycle = {"url": tuning.URL, "cycle_us": 4000}
    station.ok(station.http.post("/buses/cyclic", json=cycle))
    open_axis(page, axis, "tune")
    tuning.open_step(page, "checks")
    expect(page.get_by_text("The cyclic exchange runs.")).to_be_visible()
    page.get_by_label("Torque limit").fill("200")
    panel = tuning.open_panel(page, axis, "Command shaping")
    warning = panel.get_by_text("WARNING: the axis is enabled and moves")
    expect(warning).to_contain_text("200 % of rated torque")
    panel.get_by_label("Time at each end (s)").fill("1")
    tuning.run_job(page, station, axis, "Measure and shape")
    expect(panel.get_by_text("The ZV shaper was verified")).to_be_visible()
    expect(panel.get_by_role("img", name="After the end of the move")).to_be_visible()
    figures = panel.get_by_role("table", name="Command shaping")
    mode = tuning.row(figures, "Frequency of the mode").inner_text()
    # The closed loop yields a little, so that the mode is slower than with the motor held.
    assert tuning.number_in(mode, "Hz") == pytest.approx(MODE_HZ, rel=0.1)
    left = tuning.row(figures, "Vibration that is left").inner_text()
    assert tuning.number_in(left, "%") < 50.0
    played = tuning.row(panel.get_by_role("table", name="Shaper"), "ZV, played")
    expect(played).to_contain_text("/")


def test_the_result_on_a_phone_in_chinese(browser: Browser, station: Station, axis: str) -> None:
    with tuning.chinese_phone(browser, station) as phone:
        panel = tuning.open_panel(phone, axis, "指令整形")
        expect(panel.get_by_text("警告：轴将使能并运动多次")).to_be_visible()
        expect(panel.get_by_text("ZV 整形器已验证")).to_be_visible()
        tuning.expect_within_the_screen(phone)
