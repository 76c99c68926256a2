"""What the page says of an axis that turns: STOP's verdict, and the notice on every page."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.browser.driving import REPORTED_MS, Bench, open_axis
from tests.browser.test_frame import SIDEWAYS, TOO_SMALL
from tests.support.station import Station, until

pytestmark = pytest.mark.long

#: A shaft under a constant torque T turns at (T - coulomb) / viscous: 60 rad/s here, 573 rpm.
COULOMB_NM, VISCOUS_NMS, PULL_NM = 0.03, 2e-4, 0.042
ABOUT_RPM = (PULL_NM - COULOMB_NM) / VISCOUS_NMS * 60 / 6.283185
BENCH = f"""
[[axis]]
name = "X"
drive = "mms7"
on = "mlink://virtual0"
station = 1
[axis.mechanics.motor]
inertia_kgm2 = 5e-5
rated_torque_nm = 1.27
rated_speed_rpm = 3000
[axis.mechanics.friction]
viscous_nms = {VISCOUS_NMS}
coulomb_nm = {COULOMB_NM}
[[axis]]
name = "Y"
drive = "mms7"
on = "mlink://virtual0"
station = 2
"""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    folder = Path(tmp_path_factory.mktemp("standstill"))
    (folder / "bench.toml").write_text(BENCH, "utf-8")
    running = Station(folder, folder / "bench.toml")
    running.start()
    yield running
    running.stop()


@pytest.fixture
def pulled(station: Station, x: str) -> Iterator[Bench]:
    """X without power, turned by a torque from outside, as a load on a slope does."""
    bench = Bench(station, x)
    y = station.add(2, name="Y")
    pull(station, PULL_NM)
    until(lambda: abs(bench.state()["velocity"]) > 0.7 * ABOUT_RPM, what="the load turns it")
    until(lambda: still_gains(bench) < 0.01, what="it turns at a constant speed")
    yield bench
    pull(station, 0.0)
    bench.wait_standing()
    station.remove(y)


def pull(station: Station, torque_nm: float) -> None:
    station.drives.command(do="inject", axis="X", what="load_nm", value=torque_nm)


def still_gains(bench: Bench) -> float:
    """By what share of its speed the axis gets faster within half a second."""
    before = abs(bench.state()["velocity"])
    time.sleep(0.5)
    return abs(abs(bench.state()["velocity"]) / before - 1.0)


def turned_rpm(bench: Bench) -> float:
    """By the way of the shaft over a second, which is not what the page's figure comes from."""

    def seen() -> tuple[float, float]:
        state = bench.state()
        return datetime.fromisoformat(state["time"]).timestamp(), state["position"]

    began_s, start = seen()
    ended_s, end = until(lambda: now if (now := seen())[0] > began_s + 1.0 else None)
    return float(abs(end - start) / (ended_s - began_s) * 60)


def test_an_axis_that_turns_unasked_is_reported_on_every_page(
    laptop: Page, pulled: Bench, station: Station
) -> None:
    page = laptop
    note = page.get_by_role("alert").filter(has_text="X turns without power")
    for place in ("connect", "files", f"axis/{pulled.drive}/motion"):
        page.evaluate(f"location.hash = '#/{place}'")
        expect(note).to_be_visible(timeout=REPORTED_MS)
    # It stays in sight where the page is scrolled.
    page.locator("main").evaluate("main => main.scrollTo(0, main.scrollHeight)")
    expect(note).to_be_in_viewport()
    reported = float(re.findall(r"([\d.]+) rpm", note.inner_text())[0])
    assert reported == pytest.approx(turned_rpm(pulled), rel=0.05)
    note.get_by_role("button", name="STOP").click()
    expect(page.locator(".stop-report")).to_be_visible(timeout=REPORTED_MS)
    pull(station, 0.0)
    expect(note).to_have_count(0)


def test_stop_says_of_each_axis_what_was_measured(phone: Page, pulled: Bench) -> None:
    page = phone
    open_axis(page, pulled.drive, "overview")
    page.get_by_role("button", name="Stop all axes (Esc)").click()
    report = page.locator(".stop-report")
    # Y stands. X turns, and nothing here can brake it: the speed, and what to do, are said.
    expect(report).to_contain_text("Stopped: Y")
    expect(report).to_contain_text(
        re.compile(r"X (is still moving at|has no power and coasts,) \d+")
    )
    expect(report).to_contain_text(re.compile("emergency stop|Keep clear"))
    assert page.evaluate(SIDEWAYS) == 0
    assert page.evaluate(TOO_SMALL) == []
    box, view = report.bounding_box(), page.viewport_size
    assert box is not None
    assert view is not None
    assert box["y"] + box["height"] <= view["height"]
    report.get_by_role("button", name="Close").click()
    expect(report).to_have_count(0)
