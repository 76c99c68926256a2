"""The whole path on a virtual axis: identify, measure, place notches, apply, verify, undo, report.

One axis is measured from untouched to tuned and back, so the tests are in order and share it.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect
from pypdf import PdfReader

from tests.browser import tuning
from tests.browser.cable import Cable
from tests.browser.conftest import LAPTOP, _open
from tests.browser.driving import MOVING_RPM, open_axis
from tests.browser.tuning import COULOMB, INERTIA, MEASURED_MS, RESONANCE_HZ, confirm, row
from tests.support.station import HANG_S, Station, until

pytestmark = [pytest.mark.timeout(600), pytest.mark.long]


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with tuning.running(Path(tmp_path_factory.mktemp("tune"))) as station:
        yield station


@pytest.fixture(scope="module")
def axis(station: Station) -> str:
    return station.add(1, tuning.URL, name="Spindle")


@pytest.fixture(scope="module")
def cable(station: Station) -> Iterator[Cable]:
    laid = Cable(station.port)
    yield laid
    laid.close()


@pytest.fixture(scope="module")
def page(browser: Browser, cable: Cable, axis: str) -> Iterator[Page]:
    """One page for the whole path: what it remembers of changes is part of it."""
    opened = _open(browser, cable.url, **LAPTOP)
    found = next(opened)
    found.set_default_timeout(120_000)
    tuning.keep_exchanging(found, axis)
    yield found
    next(opened, None)


def notches_of(station: Station, axis: str) -> list[float]:
    slots = tuning.answered(station, f"/drives/{axis}/notches")
    return [slot["notch"]["center_hz"] for slot in slots if slot["enabled"]]


def gains_of(station: Station, axis: str) -> tuple[float, float]:
    gains = tuning.answered(station, f"/drives/{axis}/gains")
    return gains["speed_hz"], gains["inertia_kgm2"]


def expect_step(page: Page, name: str, reported: str) -> None:
    """What the path reports of a step: done, next or open."""
    path = page.get_by_role("navigation", name="Steps of commissioning")
    step = path.get_by_role("link", name=re.compile(name)).locator("small")
    expect(step).to_have_text(re.compile(f"^(?:{reported})$"))


def open_sections(page: Page) -> list[str]:
    """Which steps stand open."""
    found = page.locator("details.fold[open]").evaluate_all("all => all.map(each => each.id)")
    return [str(each).removeprefix("step-") for each in found]


def test_only_the_present_step_is_open(page: Page, axis: str) -> None:
    open_axis(page, axis, "overview")
    open_axis(page, axis, "tune")
    start = page.get_by_role("button", name="Start tuning")
    expect(start).to_be_in_viewport(ratio=1)
    assert open_sections(page) == ["automatic"]
    # The way to a step opens it, with the group that it stands in, and folds nothing.
    path = page.get_by_role("navigation", name="Steps of commissioning")
    path.get_by_role("link", name=re.compile("Verify")).click()
    expect(page.get_by_role("button", name="Start the step")).to_be_in_viewport()
    assert open_sections(page) == ["automatic", "manual", "verify"]


def test_identify(page: Page, axis: str, station: Station) -> None:
    expect_step(page, "Pre-checks", "done")
    expect_step(page, "Inertia", "next")
    tuning.open_step(page, "inertia")
    page.get_by_label("Repetitions").fill("2")
    tuning.run_job(page, station, axis, "Measure the inertia")
    table = page.get_by_role("table", name="Inertia and friction")
    table.wait_for(timeout=MEASURED_MS)
    expect(page.get_by_text("The data support this answer.")).to_be_visible()
    # Within the 2 % and 10 % of tuning.md.
    inertia = tuning.number_in(row(table, "Inertia").inner_text(), "kg·m²")
    assert inertia == pytest.approx(INERTIA, rel=0.02)
    friction = tuning.number_in(row(table, "Coulomb").inner_text(), "N·m")
    assert friction == pytest.approx(COULOMB, rel=0.1)
    expect_step(page, "Inertia", "done")
    # Who went on by hand finds the next step open.
    open_axis(page, axis, "overview")
    open_axis(page, axis, "tune")
    expect(page.locator("#step-response")).to_have_attribute("open", "")
    assert open_sections(page) == ["manual", "response"]


def test_measure_before(page: Page, axis: str, station: Station) -> None:
    open_axis(page, axis, "response")
    tuning.short_sweeps(page)
    tuning.measure(page, station, axis, "Speed loop")
    tuning.measure(page, station, axis, "Mechanics")
    read = row(page.get_by_role("table", name="Resonances"), "resonance").inner_text()
    assert tuning.number_in(read, "Hz") == pytest.approx(RESONANCE_HZ, rel=0.01)


def test_place_write_and_take_back_a_notch(page: Page, axis: str, station: Station) -> None:
    open_axis(page, axis, "response")
    stored = page.locator("li.measured", has_text="Mechanics").first
    stored.get_by_role("button", name="Show", exact=True).click()
    page.get_by_role("button", name="Notch here").first.click()
    expect(page.get_by_text("Effect in the drive: ")).to_be_visible()
    page.get_by_role("button", name="Write the notches").click()
    confirm(page, "Write")
    expect(page.get_by_text("Notches were written.")).to_be_visible()
    assert notches_of(station, axis) == [pytest.approx(RESONANCE_HZ, rel=0.03)]

    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_text("Notches were written.")).to_have_count(0)
    assert notches_of(station, axis) == []


def test_step_before(page: Page, axis: str, station: Station) -> None:
    open_axis(page, axis, "tune")
    tuning.open_step(page, "verify")
    tuning.run_job(page, station, axis, "Start the step")
    table = page.get_by_role("table", name="Numbers of the step")
    table.wait_for(timeout=MEASURED_MS)
    assert tuning.number_in(row(table, "Rise").inner_text(), "ms") > 0


def test_design_and_apply(page: Page, axis: str, station: Station) -> None:
    open_axis(page, axis, "tune")
    tuning.open_step(page, "notches")
    page.get_by_role("button", name="Compute designs").click()
    table = page.get_by_role("table", name="Designs").last
    table.wait_for(timeout=MEASURED_MS)
    for mark in ("Robust", "Balanced", "Fast"):
        expect(table.get_by_role("row").filter(has_text=mark).first).to_be_visible()
    wanted = table.get_by_role("row").filter(has_text="Balanced").first
    speed = float(re.findall(r"([\d.]+) Hz", wanted.inner_text())[1])
    wanted.get_by_role("button", name="Apply").click()
    confirm(page, "Write")
    expect(page.get_by_text("Written, not verified yet.")).to_be_visible(timeout=60_000)
    now, inertia = gains_of(station, axis)
    assert now == pytest.approx(speed, rel=0.01)
    # The drive's gains mean what they should only with the true inertia.
    assert inertia == pytest.approx(INERTIA, rel=0.03)
    expect_step(page, "Verify", "next|open")


def test_verify_over_the_measurement_of_before(page: Page, axis: str, station: Station) -> None:
    open_axis(page, axis, "response")
    tuning.measure(page, station, axis, "Speed loop")
    # Before and after on the same axes.
    older = page.locator("li.measured", has_text="Speed loop").last
    older.get_by_role("button", name="Compare").click()
    legend = page.locator("ul.legend").first
    expect(legend).to_contain_text("compared with")
    expect(legend).to_contain_text("measured")
    text = tuning.reading(page, "Bandwidth (−3 dB)")
    before = float(re.findall(r"before: ([\d.]+) Hz", text)[0])
    assert tuning.number_in(text, "Hz") > before
    margin = re.findall(r"([\d.]+)°", tuning.reading(page, "Phase margin"))
    assert float(margin[0]) > 30

    open_axis(page, axis, "tune")
    expect_step(page, "Verify", "done")
    tuning.open_step(page, "verify")
    tuning.run_job(page, station, axis, "Start the step")
    head = page.get_by_role("table", name="Numbers of the step")
    expect(head).to_contain_text("before", timeout=MEASURED_MS)


def test_report(page: Page, axis: str) -> None:
    open_axis(page, axis, "tune")
    # Verified by hand: nobody has tuned this axis automatically.
    expect(page.locator("#step-verify > summary")).to_contain_text("done")
    expect(page.locator("#step-automatic > summary")).not_to_contain_text("done")
    page.get_by_label("Machine").fill("Press <4>")
    page.get_by_label("Commissioned by").fill("Ann")
    page.get_by_label("Language of the report").select_option("zh")
    page.get_by_role("button", name="Make the report").click()
    stored = page.get_by_role("link", name=re.compile("^Download .*pdf"))
    stored.wait_for(timeout=60_000)
    with page.expect_download() as waiting:
        stored.click()
    data = Path(waiting.value.path()).read_bytes()
    text = "\n".join(p.extract_text() for p in PdfReader(io.BytesIO(data)).pages)
    for part in ("Press <4>", "Ann", "调试报告", "2005:03", "速度环频率响应"):
        assert part in text
    expect_step(page, "Report", "done")


def test_take_everything_back(page: Page, axis: str, station: Station) -> None:
    open_axis(page, axis, "tune")
    assert notches_of(station, axis) != []
    tuning.open_step(page, "gains")
    expect(page.get_by_role("button", name="Undo").first).to_be_visible()
    back = page.get_by_role("button", name="Undo")
    for left in (1, 0):
        back.first.click()
        expect(page.get_by_text(re.compile("were written"))).to_have_count(left)
    assert notches_of(station, axis) == []
    # As the virtual drive left the factory: 200 Hz for the motor alone.
    assert gains_of(station, axis) == (pytest.approx(200.0), pytest.approx(5e-5))


def settings_of(station: Station, axis: str) -> tuple[object, object]:
    """What tuning may change."""
    gains, notches = (
        tuning.answered(station, f"/drives/{axis}/{what}") for what in ("gains", "notches")
    )
    return gains, notches


def test_autotune_is_cancelled_while_the_axis_moves(
    page: Page, axis: str, station: Station
) -> None:
    open_axis(page, axis, "tune")
    before = settings_of(station, axis)
    tuning.open_step(page, "automatic")
    page.get_by_label("Write and verify the result").uncheck()
    page.get_by_role("button", name="Start tuning").click()
    now = page.locator("ol.steps li[aria-current=step]")
    expect(now).to_contain_text("Inertia", timeout=MEASURED_MS)
    until(lambda: station.state(axis)["state"] == "Operation enabled", 60, "the axis is enabled")
    page.locator(".job").get_by_role("button", name="Cancel").click()
    expect(page.get_by_role("status").filter(has_text="cancelled")).to_be_visible()
    # The axis is at standstill without torque, and everything is as it was.
    until(lambda: station.state(axis)["moving_job"] is None, HANG_S, "the axis is free")
    assert station.state(axis)["state"] != "Operation enabled"
    assert abs(station.state(axis)["velocity"]) < MOVING_RPM
    assert settings_of(station, axis) == before


def details_of(page: Page, title: str) -> Locator:
    """What the answer of the automatic tuning folds under this title."""
    summary = page.locator("summary", has_text=title)
    return page.locator("#step-automatic .stack details", has=summary)


def test_autotune_shows_designs_and_writes_nothing_unasked(
    page: Page, axis: str, station: Station
) -> None:
    before = settings_of(station, axis)
    tuning.run_job(page, station, axis, "Start tuning")
    reported = details_of(page, "What was measured")
    reported.locator("summary").click()
    read = row(reported.get_by_role("table", name="Inertia and friction"), "Inertia").inner_text()
    assert tuning.number_in(read, "kg·m²") == pytest.approx(INERTIA, rel=0.02)
    read = row(reported.get_by_role("table", name="Resonances"), "resonance").inner_text()
    assert tuning.number_in(read, "Hz") == pytest.approx(RESONANCE_HZ, rel=0.01)
    reported = details_of(page, "Designs")
    reported.locator("summary").click()
    designs = reported.get_by_role("table", name="Designs")
    for mark in ("Robust", "Balanced", "Fast"):
        expect(designs.get_by_role("row").filter(has_text=mark).first).to_be_visible()
    assert settings_of(station, axis) == before
