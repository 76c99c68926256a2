"""A virtual axis behind EtherCAT with a known resonance, and ways about the pages of tuning.

The segment takes its time from the process data, so a busy test machine changes nothing but the
time that the tests take.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from backend.station.demo import DemoBench
from drivers.virtual.wires.netns import unavailable
from tests.browser.conftest import LAPTOP, PATIENCE_MS, PHONE, _open
from tests.browser.driving import open_axis
from tests.support.station import HANG_S, Station, until

URL = "ethercat://virtual0"
MOTOR, LOAD, STIFFNESS, COULOMB = 5e-5, 1.5e-4, 60.0, 0.03
INERTIA = MOTOR + LOAD
#: Two masses and a spring: the mode of the free chain, and of the load with the motor held.
RESONANCE_HZ = math.sqrt(STIFFNESS * (1 / MOTOR + 1 / LOAD)) / (2 * math.pi)
ANTIRESONANCE_HZ = math.sqrt(STIFFNESS / LOAD) / (2 * math.pi)
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
coulomb_nm = {COULOMB}
[[axis.mechanics.load]]
inertia_kgm2 = {LOAD}
stiffness_nm_per_rad = {STIFFNESS}
damping_nms_per_rad = 2e-3
"""
#: A measurement takes seconds of motion; this bounds what a busy computer makes of it.
MEASURED_MS = 180_000


@contextmanager
def running(folder: Path, axes: str = BENCH, *defects: str) -> Iterator[Station]:
    """The station with its one axis on the bench; the axis is not added yet.

    ``defects`` are planted as by ``servodeck demo --defect``.
    """
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    bench = folder / "bench.toml"
    bench.write_text(axes, "utf-8")
    station = Station(folder, bench)
    station.drives = DemoBench(
        bench, folder / "wires", folder / "nvm", steady=True, defects=defects
    )
    station.start()
    # Writing a set of gains is some thirty transactions on a bus that may have to wait.
    expect.set_options(timeout=45_000)
    try:
        yield station
    finally:
        expect.set_options(timeout=PATIENCE_MS)
        station.stop()


_MANUAL = ("inertia", "response", "notches", "gains", "verify")


def open_step(page: Page, name: str) -> Locator:
    """Open a step of the page Tune, with the group that it stands in."""
    for each in (*(("manual",) if name in _MANUAL else ()), name):
        fold = page.locator(f"#step-{each}")
        head = fold.locator("> summary")
        head.wait_for()
        if fold.get_attribute("open") is None:
            head.click()
        expect(fold).to_have_attribute("open", "")
    return fold


def open_panel(page: Page, axis: str, title: str) -> Locator:
    """Open Tune, and on it the panel of a tool that is no step of the path."""
    open_axis(page, axis, "tune")
    more = open_step(page, "more")
    heading = page.get_by_role("heading", name=title, exact=True)
    return more.locator("section.panel").filter(has=heading)


@contextmanager
def chinese_phone(browser: Browser, station: Station) -> Iterator[Page]:
    """The page in Chinese on a narrow, dark screen with a finger."""
    opened = _open(browser, station.url, color_scheme="dark", **PHONE)
    page = next(opened)
    page.evaluate("localStorage.setItem('servodeck.language', 'zh')")
    page.reload()
    yield page
    next(opened, None)


def expect_within_the_screen(page: Page) -> None:
    """Nothing of the page has to be scrolled sideways, and no table of figures in it."""
    tables = page.locator(".scroll-table", has=page.locator(".reported-values")).all()
    for part in (page.locator("html"), page.locator("#main"), *tables):
        assert part.evaluate("e => e.scrollWidth - e.clientWidth") <= 0, part


def result_of(station: Station, kind: str) -> Any:
    """The result of the job of this kind that began last."""
    jobs = answered(station, "/jobs")
    return [job for job in jobs if job["kind"] == kind][-1]["result"]


def keep_exchanging(page: Page, axis: str) -> None:
    """Start the cyclic exchange by hand, so that measurements need not start it every time."""
    open_axis(page, axis, "tune")
    open_step(page, "checks")
    page.get_by_text("Before anything moves").wait_for()
    started = page.get_by_text("The cyclic exchange runs.")
    begin = page.get_by_role("button", name="Start", exact=True)
    expect(started.or_(begin).first).to_be_visible()
    if not started.is_visible():
        begin.first.click()
    expect(started).to_be_visible()


#: What a computer that is too busy for its buses makes the product say. The product is right
#: to end a measurement then; here the page is tested, so it is measured again, but not often:
#: what fails three times is not the computer.
BUSY = ("in time", "no longer answers", "does not answer", "were received from the bus",
        "EtherCAT communication", "heartbeat", "Operation enabled: Fault")  # fmt: skip
_TRIES = 3


def run_job(
    page: Page, station: Station, axis: str, button: str, state: Callable[[], None] | None = None
) -> None:
    """Press a button that starts a job on the axis, and wait for the job's good end.

    ``state`` makes the statements that each run asks for again.
    """
    reported = ""
    for _ in range(_TRIES):
        if state is not None:
            state()
        page.get_by_role("button", name=button, exact=True).click()
        progress = page.locator(".job")
        expect(progress.first).to_be_visible(timeout=60_000)
        expect(progress).to_have_count(0, timeout=MEASURED_MS)
        failed = page.locator(".note.fault")
        if failed.count() == 0:
            job = [each for each in answered(station, "/jobs") if each["motion"]][-1]
            if job["state"] == "done":
                return
            reported = job["cancellation"]["cause_message"]["code"]
            # The browser of a busy computer was not heard in time: the product is right here, too.
            assert reported == "work.page-not-reachable", job["cancellation"]
            print(f"{button} is repeated: {reported}")
            continue
        reported = "; ".join(failed.all_inner_texts())
        print(f"{button} is repeated: {reported}")
        assert any(words in reported for words in BUSY), reported
        # The note of a fault of the axis has no such button: it goes when the fault is reset.
        closed = failed.get_by_role("button", name="Close", exact=True)
        if closed.count() > 0:
            closed.first.click()
        until(lambda: station.state(axis)["moving_job"] is None, HANG_S, "the axis is free")
        until(lambda: _without_fault(station, axis), 60, "the drive answers without a fault")
    raise AssertionError(f"{button}: {reported}")


def sweep(station: Station, axis: str, **settings: object) -> None:
    """Measure a response past the page, again where the computer was too busy for the bus."""
    limits = {"travel_limit": 3, "speed_limit": 1200, "torque_limit": 80}
    for _ in range(_TRIES):
        asked = station.http.post(f"/drives/{axis}/jobs/sweep", json=limits | settings)
        job = station.job(asked, MEASURED_MS / 1e3)
        if job["state"] == "done":
            return
        print(f"the sweep is repeated: {job['problem']}")
        assert any(words in str(job["problem"]) for words in BUSY), job
        until(lambda: _without_fault(station, axis), 60, "the drive answers without a fault")
    raise AssertionError(job)


def patient_page(browser: Browser, station: Station) -> Iterator[Page]:
    """A page on a wide screen that waits long for what a busy computer makes late."""
    opened = _open(browser, station.url, **LAPTOP)
    page = next(opened)
    page.set_default_timeout(45_000)
    yield page
    next(opened, None)


def exchange(station: Station, cycle_us: int) -> None:
    """Start the cyclic exchange: a slower one leaves a busy computer less to do."""
    body = {"url": URL, "cycle_us": cycle_us}
    assert station.ok(station.http.post("/buses/cyclic", json=body))["cyclic"]["running"]


def report_of(station: Station, axis: str, language: str) -> str:
    """The commissioning report of an axis, as HTML."""
    body = {"format": "html", "language": language}
    made = station.ok(station.http.post(f"/drives/{axis}/reports", json=body))
    answer = station.http.get(f"/reports/{made['file']}")
    assert answer.is_success, answer.text
    return answer.text


def answered(station: Station, path: str) -> Any:
    """What the interface says of a drive, asked again where the computer was too busy."""
    for _ in range(_TRIES):
        answer = station.http.get(path)
        if answer.status_code not in (503, 504):
            return station.ok(answer)
    raise AssertionError(answer.text)


def _without_fault(station: Station, axis: str) -> bool:
    state = station.state(axis)
    if state["state"] == "Fault":
        station.http.post(f"/drives/{axis}/fault-reset", json={})
    return bool(state["fresh"]) and state["state"] != "Fault"


def short_sweeps(page: Page) -> None:
    """One pair of realisations instead of two, from here on: the page remembers it."""
    page.get_by_text("Excitation", exact=True).first.click()
    page.get_by_label("Realisations").fill("1")


def measure(page: Page, station: Station, axis: str, what: str) -> None:
    """Measure a response on the page Response, and wait until it is shown."""
    page.get_by_label("What to measure").select_option(label=what)
    run_job(page, station, axis, "Start measuring")
    shown = page.locator("li.measured").first.get_by_role("button", name="Show", exact=True)
    expect(shown).to_have_attribute("aria-pressed", "true")
    expect(page.locator("li.measured").first).to_contain_text(what)
    expect(page.get_by_role("img", name=re.compile("^Magnitude, phase"))).to_be_visible()


def number_in(text: str, unit: str) -> float:
    """The first number before a unit, as the pages write it; powers of ten are raised."""
    found = re.search(rf"([\d.]+)(?:·10(⁻?[⁰¹²³⁴⁵⁶⁷⁸⁹]+))? {re.escape(unit)}", text)
    assert found is not None, text
    power = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    return float(found[1]) * 10.0 ** int((found[2] or "0").translate(power))


def reading(page: Page, name: str) -> str:
    """The text of a value by its name, in the first list of values that has it."""
    return page.locator("dl.counters div", has=page.locator("dt", has_text=name)).first.inner_text()


def confirm(page: Page, name: str) -> None:
    """Press a button of the dialogue that is open."""
    page.get_by_role("dialog").get_by_role("button", name=name, exact=True).click()


def row(table: Locator, start: str) -> Locator:
    """The first row of a table that begins so."""
    return table.get_by_role("row").filter(has_text=re.compile(f"^{re.escape(start)}")).first
