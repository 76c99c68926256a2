"""Dwell at one frequency on the page, on a chain of two inertias."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from drivers.virtual.bench import load_bench
from drivers.virtual.mechanics import analytic_response
from tests.browser import tuning
from tests.support.station import Station

pytestmark = [pytest.mark.timeout(600), pytest.mark.long]

MOTOR, LOAD, STIFFNESS, RATED_NM = 5e-5, 3e-5, 30.0, 1.27
DWELL_HZ, DWELL_PERCENT = 60.0, 8.0
BENCH = f"""
[[axis]]
name = "Chain"
drive = "mms7"
on = "{tuning.URL}"
station = 1
[axis.mechanics.motor]
inertia_kgm2 = {MOTOR}
rated_torque_nm = {RATED_NM}
rated_speed_rpm = 3000
[axis.mechanics.friction]
viscous_nms = 3e-4
[[axis.mechanics.load]]
inertia_kgm2 = {LOAD}
stiffness_nm_per_rad = {STIFFNESS}
damping_nms_per_rad = 2e-3
"""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with tuning.running(Path(tmp_path_factory.mktemp("dwell")), BENCH) as station:
        yield station


@pytest.fixture(scope="module")
def page(browser: Browser, station: Station) -> Iterator[Page]:
    yield from tuning.patient_page(browser, station)


@pytest.fixture(scope="module")
def axis(station: Station) -> str:
    axis = station.add(1, tuning.URL, name="Chain")
    tuning.exchange(station, 1000)
    return axis


def test_a_dwell_shows_what_it_excites(page: Page, station: Station, axis: str) -> None:
    panel = tuning.open_panel(page, axis, "Dwell at one frequency")
    expect(panel.get_by_text("WARNING: the axis is enabled and moves")).to_be_visible()
    panel.get_by_label("Carried by").select_option(label="torque ahead of the speed loop")
    panel.get_by_label("Frequency").fill(f"{DWELL_HZ:g}")
    panel.get_by_label("Amplitude of the torque").fill(f"{DWELL_PERCENT:g}")
    panel.get_by_label("Slow speed beneath it").fill("60")
    panel.get_by_label("Time at full amplitude").fill("2")
    tuning.run_job(page, station, axis, "Vibrate")
    expect(panel.get_by_text("The motor vibrated at this frequency")).to_be_visible()
    expect(panel.get_by_role("img", name="Amplitude while it vibrated")).to_be_visible()
    table = panel.get_by_role("table", name="Dwell at one frequency")
    speed = tuning.number_in(tuning.row(table, "Speed at the frequency").inner_text(), "rpm")
    torque = tuning.number_in(tuning.row(table, "Torque at the frequency").inner_text(), "%")
    # Whatever the loops of the drive do, speed over torque is the response of the chain.
    (spec,) = load_bench(station.folder / "bench.toml").axis
    truth = abs(complex(analytic_response(spec.mechanics, DWELL_HZ)))
    measured = speed * 2 * math.pi / 60 / (torque / 100 * RATED_NM)
    assert measured == pytest.approx(truth, rel=0.1)
    tuning.expect_within_the_screen(page)


def test_the_report_has_the_dwell_in_both_languages(station: Station, axis: str) -> None:
    for language, words in (("en", "The motor vibrated at this"), ("zh", "电机以该频率振动")):
        assert words in tuning.report_of(station, axis, language)


def test_the_result_on_a_phone_in_chinese(browser: Browser, station: Station, axis: str) -> None:
    with tuning.chinese_phone(browser, station) as phone:
        panel = tuning.open_panel(phone, axis, "定频激振")
        expect(panel.get_by_text("警告：轴将使能并运动多次")).to_be_visible()
        expect(panel.get_by_text("电机以该频率振动")).to_be_visible()
        tuning.expect_within_the_screen(phone)
