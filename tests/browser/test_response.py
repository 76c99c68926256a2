"""Response and Tune in the browser, on a virtual axis behind EtherCAT with a known resonance.

The segment takes its time from the process data, so a busy test machine changes nothing but the
time that the tests take.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from backend.demo import DemoBench
from drivers.virtual.wires.netns import unavailable
from tests.browser.cable import Cable
from tests.browser.conftest import LAPTOP, PHONE, _open
from tests.browser.driving import open_axis
from tests.browser.test_frame import SIDEWAYS, TOO_SMALL
from tests.support.station import Station

URL = "ethercat://virtual0"
MOTOR, LOAD, STIFFNESS = 5e-5, 1.5e-4, 60.0
#: Two masses and a spring: the mode of the free chain.
RESONANCE_HZ = math.sqrt(STIFFNESS * (1 / MOTOR + 1 / LOAD)) / (2 * math.pi)
BENCH = f"""
[[axis]]
name = "Spindle"
drive = "mms7"
on = "{URL}"
station = 1
[axis.mechanics.motor]
inertia_kgm2 = {MOTOR}
rated_torque_nm = 1.27
rated_speed_rpm = 3000
[axis.mechanics.friction]
viscous_nms = 2e-4
coulomb_nm = 0.03
[[axis.mechanics.load]]
inertia_kgm2 = {LOAD}
stiffness_nm_per_rad = {STIFFNESS}
damping_nms_per_rad = 2e-3
"""
MEASURED_MS = 120_000


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("response"))
    bench = folder / "bench.toml"
    bench.write_text(BENCH)
    running = Station(folder, bench)
    running.drives = DemoBench(bench, folder / "wires", folder / "nvm", steady=True)
    running.start()
    yield running
    running.stop()


@pytest.fixture(scope="module")
def axis(station: Station) -> str:
    return station.add(1, URL, name="Spindle")


@pytest.fixture
def cable(station: Station) -> Iterator[Cable]:
    laid = Cable(station.port)
    yield laid
    laid.close()


@pytest.fixture
def laptop(browser: Browser, cable: Cable) -> Iterator[Page]:
    yield from _open(browser, cable.url, **LAPTOP)


@pytest.fixture
def phone(browser: Browser, cable: Cable) -> Iterator[Page]:
    yield from _open(browser, cable.url, **PHONE)


def test_the_way_from_exchange_to_notches(laptop: Page, axis: str, station: Station) -> None:
    page = laptop
    open_axis(page, axis, "tune")
    page.get_by_role("link", name="Tune").wait_for()
    page.get_by_role("button", name="Start", exact=True).first.click()
    expect(page.get_by_text("The cyclic exchange runs.")).to_be_visible()

    open_axis(page, axis, "response")
    page.get_by_role("button", name="Start measuring").click()
    table = page.get_by_role("table", name="Resonances")
    table.wait_for(timeout=MEASURED_MS)
    expect(page.get_by_role("img", name=re.compile("^Magnitude, phase"))).to_be_visible()

    # The resonance that the mechanics have, within the 1 % of tuning.md.
    row = table.get_by_role("row").filter(has_text=re.compile("^resonance")).first
    read = float(re.findall(r"([\d.]+) Hz", row.inner_text())[0])
    assert read == pytest.approx(RESONANCE_HZ, rel=0.01)

    row.get_by_role("button", name="Notch here").click()
    expect(page.get_by_text(re.compile("The drive will do: "))).to_be_visible()
    page.get_by_role("button", name="Write the notches").click()
    page.get_by_role("dialog").get_by_role("button", name="Write", exact=True).click()
    expect(page.get_by_text("Notches were written.")).to_be_visible()
    slots = station.ok(station.http.get(f"/drives/{axis}/notches"))
    on = [slot for slot in slots if slot["enabled"]]
    assert len(on) == 1
    assert on[0]["notch"]["center_hz"] == pytest.approx(RESONANCE_HZ, rel=0.03)

    page.get_by_role("button", name="Take it back").click()
    expect(page.get_by_text("Notches were written.")).to_have_count(0)
    slots = station.ok(station.http.get(f"/drives/{axis}/notches"))
    assert not any(slot["enabled"] for slot in slots)


def test_on_a_phone(phone: Page, axis: str) -> None:
    page = phone
    for name in ("tune", "response"):
        open_axis(page, axis, name)
        page.get_by_role("heading", level=1).wait_for()
        if name == "response":
            page.get_by_role("button", name="Show", exact=True).first.click()
            page.get_by_role("table", name="Resonances").wait_for()
        assert page.evaluate(TOO_SMALL) == [], name
        assert page.evaluate(SIDEWAYS) == 0, name
