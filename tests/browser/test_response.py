"""The page Response: what it shows of a measurement, and what can be done with it."""

from __future__ import annotations

import io
import json
import math
import re
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from tests.browser import tuning
from tests.browser.cable import Cable
from tests.browser.conftest import LAPTOP, PHONE, _open
from tests.browser.driving import open_axis
from tests.browser.test_frame import SIDEWAYS, TOO_SMALL
from tests.browser.tuning import ANTIRESONANCE_HZ, RESONANCE_HZ, row
from tests.support.station import Station

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with tuning.running(Path(tmp_path_factory.mktemp("response"))) as station:
        yield station


@pytest.fixture(scope="module")
def axis(station: Station) -> str:
    """Measured once, past the page: the mechanics and the speed loop."""
    drive = station.add(1, tuning.URL, name="Spindle")
    for kind in ("mechanics", "speed_loop"):
        tuning.sweep(station, drive, kind=kind, realisations=1)
    return drive


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


def show(page: Page, axis: str, what: str) -> None:
    open_axis(page, axis, "response")
    stored = page.locator("li.measured", has_text=what).first
    stored.get_by_role("button", name="Show", exact=True).click()
    page.get_by_role("img", name=re.compile("^Magnitude, phase")).wait_for()


def test_a_measurement_is_explained(laptop: Page, axis: str) -> None:
    page = laptop
    show(page, axis, "Mechanics")
    table = page.get_by_role("table", name="Resonances")
    # Frequencies that the mechanics have, within the 1 % of tuning.md.
    for kind, truth in (("resonance", RESONANCE_HZ), ("antiresonance", ANTIRESONANCE_HZ)):
        read = tuning.number_in(row(table, kind).inner_text(), "Hz")
        assert read == pytest.approx(truth, rel=0.01)
    # 1.5e-4 behind the spring against 5e-5 before it, and an antiresonance at 100 Hz.
    reported = page.get_by_text(re.compile("The inertia behind the soft part is")).inner_text()
    assert "medium stiffness" in reported
    assert tuning.number_in(reported, "times") == pytest.approx(3.0, rel=0.05)
    page.get_by_text("What the shape of the curve shows").click()
    expect(page.get_by_text("tighten the coupling, then put a notch")).to_be_visible()

    # Evaluated again from the raw signals, with the settings of its measurement.
    expect(page.get_by_text("the same result as when it was measured")).to_be_visible()
    page.get_by_text("How it was measured").click()
    expect(page.locator("dl.facts .pair", has_text="torque_percent")).to_contain_text("80")


def test_cursors_follow_mouse_and_keys(laptop: Page, axis: str) -> None:
    page = laptop
    show(page, axis, "Mechanics")
    cursor = page.get_by_role("slider", name="Cursor A")
    start = float(cursor.get_attribute("aria-valuenow") or "nan")
    assert start == pytest.approx(ANTIRESONANCE_HZ, rel=0.01)
    cursor.press("ArrowRight")
    expect(cursor).to_have_attribute("aria-valuenow", re.compile(f"^{start * 1.01:.1f}"[:-1]))
    cursor.press("PageUp")
    moved = float(cursor.get_attribute("aria-valuenow") or "nan")
    assert moved == pytest.approx(start * 1.01 * 1.1, rel=2e-3)

    # A press far from any marker brings the nearest cursor there; the table reads it.
    over = page.locator(".bode-part .u-over").first
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] * 0.2, box["y"] + box["height"] / 2)
    here = float(cursor.get_attribute("aria-valuenow") or "nan")
    assert here < 0.5 * start
    table = page.get_by_role("table").filter(has_text="Cursor")
    assert tuning.number_in(row(table, "A").inner_text(), "Hz") == pytest.approx(here, rel=0.15)


def test_a_notch_is_dragged_and_predicted_but_not_written(
    laptop: Page, axis: str, station: Station
) -> None:
    page = laptop
    show(page, axis, "Mechanics")
    row(page.get_by_role("table", name="Resonances"), "resonance").get_by_role(
        "button", name="Notch here"
    ).click()
    notch = page.get_by_role("slider", name="Notch 1")
    center = page.get_by_label("Centre")
    expect(page.get_by_text("Effect in the drive: ")).to_be_visible()
    expect(page.get_by_text("with the notches below")).to_be_visible()
    placed = float(notch.get_attribute("aria-valuenow") or "nan")
    assert placed == pytest.approx(RESONANCE_HZ, rel=0.01)

    over = page.locator(".bode-part .u-over").first
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    assert box is not None
    # Where the notch is drawn: the axis is logarithmic over the valid band's lines.
    first, last = 6.2, 400.0
    share = math.log(placed / first) / math.log(last / first)
    x, y = box["x"] + share * box["width"], box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 60, y, steps=5)
    page.mouse.up()
    dragged = float(center.input_value())
    assert 0.5 * placed < dragged < 0.9 * placed
    notch.press("ArrowRight")
    expect(center).not_to_have_value(str(dragged))
    center.fill("250")
    expect(notch).to_have_attribute("aria-valuenow", "250")

    # Four views of the loop that would follow, compared with the loop as it is.
    for view, name in (
        ("Open loop", "Open loop"),
        ("Sensitivity", "Sensitivity"),
        ("Step", "Step"),
        ("Closed loop", "Closed loop"),
    ):
        page.get_by_text(view, exact=True).last.click()
        expect(page.get_by_role("img", name=name, exact=True)).to_be_visible()
    expect(page.get_by_text("edited, not written")).to_be_visible()
    slots = station.ok(station.http.get(f"/drives/{axis}/notches"))
    assert not any(slot["enabled"] for slot in slots)


def test_a_loop_is_shown_three_ways(laptop: Page, axis: str) -> None:
    page = laptop
    show(page, axis, "Speed loop")
    for view, guide in (
        ("Open loop", "0 dB: crossover"),
        ("Sensitivity", "6 dB: Ms = 2"),
        ("Closed loop", "−3 dB: bandwidth"),
    ):
        page.get_by_text(view, exact=True).click()
        expect(page.get_by_text(guide)).to_be_visible()
    assert tuning.number_in(tuning.reading(page, "Bandwidth (−3 dB)"), "Hz") > 10
    # Another kind cannot be laid over it.
    other = page.locator("li.measured", has_text="Mechanics").first
    expect(other.get_by_role("button", name="Compare")).to_be_disabled()


def test_every_export_can_be_read(laptop: Page, axis: str, tmp_path: Path) -> None:
    page = laptop
    show(page, axis, "Mechanics")

    def saved(form: str) -> Path:
        with page.expect_download() as waiting:
            page.get_by_role("button", name=f"Export as {form}").click()
        path = tmp_path / waiting.value.suggested_filename
        waiting.value.save_as(path)
        return path

    rows = saved("CSV").read_text().split("\n")
    assert rows[0].startswith("frequency_hz,magnitude_db [(rad/s)/Nm],phase_deg,coherence")
    numbers = json.loads(saved("JSON").read_text())
    assert len(rows) == len(numbers["frequency_hz"]) + 2
    assert float(rows[1].split(",")[1]) == numbers["magnitude_db"][0]
    assert "<svg" in saved("SVG").read_text()
    with Image.open(saved("PNG")) as picture:
        assert picture.size == (1920, 1200)
        assert len(picture.convert("RGB").getcolors(1 << 20) or []) > 10

    with page.expect_download() as waiting:
        page.locator("li.measured", has_text="Mechanics").first.get_by_role("link").click()
    with zipfile.ZipFile(io.BytesIO(Path(waiting.value.path()).read_bytes())) as archive:
        assert {"meta.npy", "0.excitation.npy", "0.torque_nm.npy"} <= set(archive.namelist())


def test_a_damaged_file_is_refused_in_words(laptop: Page, axis: str, station: Station) -> None:
    page = laptop
    open_axis(page, axis, "response")
    page.get_by_role("heading", name="Stored responses").wait_for()
    name = page.locator("li.measured", has_text="Mechanics").first
    name.wait_for()
    file = station.ok(station.http.get("/measurements"))[-1]["file"]
    whole = station.http.get(f"/measurements/{file}/file").content
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Import").click()
    chooser.value.set_files(
        {"name": "cut.sdmeas", "mimeType": "application/octet-stream", "buffer": whole[:-900]}
    )
    expect(page.get_by_text("cut.sdmeas is damaged, or no measurement")).to_be_visible()
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Import").click()
    chooser.value.set_files(
        {"name": "copy.sdmeas", "mimeType": "application/octet-stream", "buffer": whole}
    )
    expect(page.get_by_text("the same result as when it was measured")).to_be_visible()


def test_a_finger_that_scrolls_moves_no_marker(phone: Page, axis: str) -> None:
    page = phone
    show(page, axis, "Mechanics")
    cursors = page.get_by_role("slider", name=re.compile("^Cursor"))
    over = page.locator(".bode-part .u-over").first
    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    assert box is not None
    x, y = box["x"] + 0.1 * box["width"], box["y"] + box["height"] / 2
    fingers = page.context.new_cdp_session(page)

    def event(kind: str, *points: tuple[float, float]) -> None:
        touched = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(points)]
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touched})

    def places() -> list[str | None]:
        return [each.get_attribute("aria-valuenow") for each in cursors.all()]

    before = places()
    event("touchStart", (x, y))
    for way in range(0, 120, 10):
        event("touchMove", (x, y - way))
    event("touchEnd")
    # Two fingers zoom the page.
    event("touchStart", (x, y))
    event("touchStart", (x, y), (x + 80, y))
    event("touchMove", (x - 20, y), (x + 120, y))
    event("touchEnd")
    page.wait_for_timeout(1000)
    assert places() == before

    over.scroll_into_view_if_needed()
    box = over.bounding_box()
    assert box is not None
    x, y = box["x"] + 0.1 * box["width"], box["y"] + box["height"] / 2
    event("touchStart", (x, y))
    event("touchEnd")
    expect(cursors.first).not_to_have_attribute("aria-valuenow", before[0] or "")


def test_on_a_phone(phone: Page, axis: str) -> None:
    page = phone
    for name in ("tune", "response"):
        open_axis(page, axis, name)
        page.get_by_role("heading", level=1).wait_for()
        if name == "response":
            show(page, axis, "Mechanics")
            page.get_by_role("table", name="Resonances").wait_for()
            page.get_by_text("What the shape of the curve shows").click()
        assert page.evaluate(TOO_SMALL) == [], name
        assert page.evaluate(SIDEWAYS) == 0, name
