"""The load of the machine's cycle on the page: read while the axis is moved, not by the tool."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.browser import tuning
from tests.browser.conftest import LAPTOP, _open
from tests.support.station import HANG_S, Station, until

pytestmark = [pytest.mark.timeout(300), pytest.mark.long]

#: The machine's cycle: three revolutions out and back.
SEQUENCE = {
    "first": 0, "second": 3, "speed": 600, "acceleration": 3000, "dwell_s": 0.3, "count": 1000,
    "travel_limit": 5, "torque_limit": 200,
}  # fmt: skip
READ_S = 12


@pytest.fixture(scope="module")
def axis(station: Station) -> str:
    return station.add(1, name="Spindle")


@pytest.fixture(scope="module")
def page(browser: Browser, station: Station) -> Iterator[Page]:
    opened = _open(browser, station.url, **LAPTOP)
    yield next(opened)
    next(opened, None)


@pytest.fixture
def machine(station: Station, axis: str) -> Iterator[Any]:
    """The axis is moved all the time."""
    job = station.ok(station.http.post(f"/drives/{axis}/jobs/sequence", json=SEQUENCE))
    until(lambda: abs(station.state(axis)["velocity"]) > 100, HANG_S, "the axis moves")
    yield job
    station.http.delete(f"/jobs/{job['id']}")
    until(lambda: station.state(axis)["moving_job"] is None, HANG_S, "the axis is free")


def test_a_cycle_is_read_and_shown(page: Page, station: Station, axis: str, machine: Any) -> None:
    panel = tuning.open_panel(page, axis, "Load of the machine's cycle")
    # The tool moves nothing.
    expect(panel.get_by_text("Nothing is written")).to_be_visible()
    expect(panel.get_by_text("WARNING")).to_have_count(0)
    panel.get_by_label("Time of reading (s)").fill(str(READ_S))
    panel.get_by_label("Rated torque of the motor (N·m)").fill("1.27")
    panel.get_by_label("Thermal time constant of the motor (min)").fill("20")
    panel.get_by_role("button", name="Read the cycle").click()
    expect(panel.get_by_text("The motor endures this cycle")).to_be_visible(timeout=60_000)
    expect(panel.get_by_role("img", name="Torque over speed")).to_be_visible()
    table = panel.get_by_role("table", name="Load of the machine's cycle")
    fastest = tuning.row(table, "Highest speed").inner_text()
    assert tuning.number_in(fastest, "rpm") == pytest.approx(SEQUENCE["speed"], rel=0.1)
    assert tuning.number_in(tuning.row(table, "Effective torque, of rated").inner_text(), "%") > 0
    # Who moved the axis still does.
    jobs = {job["id"]: job["state"] for job in station.ok(station.http.get("/jobs"))}
    assert jobs[machine["id"]] == "running"


def test_the_result_on_a_phone_in_chinese(browser: Browser, station: Station, axis: str) -> None:
    with tuning.chinese_phone(browser, station) as phone:
        panel = tuning.open_panel(phone, axis, "机器循环负载")
        expect(panel.get_by_text("电机可承受此循环")).to_be_visible()
        tuning.expect_within_the_screen(phone)
