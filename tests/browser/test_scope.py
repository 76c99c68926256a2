"""The page Scope: triggers, cursors, spectra and what is kept, on signals known by construction.

The segment takes its time from the process data, so frequencies and times are exact on a busy
computer too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from backend.station.demo import DemoBench
from drivers.virtual.wires.netns import unavailable
from tests.browser.cable import Cable
from tests.browser.conftest import LAPTOP, PHONE, _open
from tests.browser.test_frame import SIDEWAYS, TOO_SMALL
from tests.support.station import HANG_S, Station, until

pytestmark = pytest.mark.long

URL = "ethercat://virtual0"
BENCH = f"""
[[axis]]
name = "Spindle"
drive = "mms7"
on = "{URL}"
station = 1
[axis.mechanics.motor]
inertia_kgm2 = 5e-5
rated_torque_nm = 1.27
rated_speed_rpm = 3000
[axis.mechanics.friction]
viscous_nms = 2e-4
coulomb_nm = 0.03
"""
LIMITS = {"travel_limit": 20, "speed_limit": 1500, "torque_limit": 250}
#: Resolves when smooth scrolling has ended: for five pictures nothing has moved.
AT_REST = """() => new Promise((done) => {
    let [last, same] = ['', 0]
    const look = () => {
        const parts = [...document.querySelectorAll('main, .scope-tabs')]
        const now = [scrollY, ...parts.flatMap((e) => [e.scrollTop, e.scrollLeft])].join()
        same = now === last ? same + 1 : 0
        last = now
        if (same >= 5) done(null)
        else requestAnimationFrame(look)
    }
    look()
})"""
SCROLLED = "() => scrollY + document.querySelector('main').scrollTop"
#: A run of one second of the axis' time may take many of a busy computer's.
LONG_MS = 90_000
VELOCITY, POSITION, TORQUE, TARGET = "c1", "c2", "c3", "c4"


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("scope"))
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
def cyclic(station: Station, axis: str) -> Iterator[str]:
    body = {"url": URL, "cycle_us": 1000}
    until(lambda: station.http.post("/buses/cyclic", json=body).is_success, 60, "it runs")
    yield axis
    station.http.post("/stop", json={})
    for job in station.ok(station.http.get("/jobs")):
        if job["state"] == "running":
            station.job(station.http.get(f"/jobs/{job['id']}"), 60)
    station.http.delete("/buses/cyclic", params={"url": URL})


@pytest.fixture
def cable(station: Station) -> Iterator[Cable]:
    laid = Cable(station.port)
    yield laid
    laid.close()


@pytest.fixture
def page(browser: Browser, cable: Cable) -> Iterator[Page]:
    for page in _open(browser, cable.url, **LAPTOP):
        page.evaluate("location.hash = '#/scope'")
        figure(page, VELOCITY, "min").wait_for()
        yield page


def generate(station: Station, axis: str, **signal: Any) -> Any:
    answer = station.http.post(f"/drives/{axis}/jobs/generate", json=LIMITS | signal)
    return station.ok(answer)


def figure(page: Page, trace: str, name: str) -> Locator:
    """A cell of the table of measurements."""
    return page.locator(f'[data-trace="{trace}"] [data-figure="{name}"]')


def number(cell: Locator) -> float:
    text = cell.inner_text().replace("−", "-")
    return math.nan if text == "—" else float(text)


def add_channel(page: Page, words: str) -> None:
    page.get_by_role("button", name="Channels").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_role("textbox", name="Search").fill(words)
    dialog.get_by_role("checkbox").first.check()
    dialog.get_by_role("button", name="Close").last.click()
    expect(dialog).to_be_hidden()


def soon(read: Callable[[], Any], expected: Any, what: str) -> None:
    """What a gesture does is seen with the next picture, which a busy computer paints late."""
    until(lambda: read() == expected, HANG_S, what)


def length(stretch: Sequence[float]) -> float:
    return stretch[1] - stretch[0]


def peaks(page: Page) -> list[tuple[float, float]]:
    """Frequency and amplitude, all of one picture: the table changes while the signal runs."""
    rows = page.get_by_role("table", name="Highest peaks").locator("tbody tr").all_inner_texts()
    found = [[float(cell.replace("−", "-")) for cell in row.split()] for row in rows]
    return [(hertz, amplitude) for hertz, amplitude in found]


def test_a_step_is_caught_and_the_cursors_read_it(
    page: Page, station: Station, cyclic: str
) -> None:
    page.get_by_label("Time shown").select_option("1")
    page.get_by_label("Trigger", exact=True).select_option("single")
    page.get_by_label("On", exact=True).select_option(VELOCITY)
    page.get_by_label("Level").fill("100")
    expect(page.get_by_text("Waiting for the trigger")).to_be_visible()
    # The motion is started on another page, as it is by whoever has one screen.
    page.evaluate(f"location.hash = '#/axis/{cyclic}/motion'")
    expect(page.get_by_text("Waiting for the trigger")).to_have_count(0)
    job = generate(station, cyclic, mode="CSV", shape="step", amplitude=240, duration_s=2.4)
    station.job(station.http.get(f"/jobs/{job['id']}"), LONG_MS / 1000)
    page.evaluate("location.hash = '#/scope'")
    expect(page.get_by_text("Triggered (1)")).to_be_visible(timeout=LONG_MS)
    # Trigger at 0 s, 20 % of a second before it: it stands before and runs at 240 rpm after.
    page.get_by_role("button", name="Cursors").click()
    page.get_by_label("Cursor A").fill("-0.15")
    page.get_by_label("Cursor B").fill("0.6")
    expect(page.get_by_text("Between the cursors: 0.75 s")).to_be_visible()
    until(
        lambda: abs(number(figure(page, VELOCITY, "b")) - 240) < 5, HANG_S, "cursor B reads 240 rpm"
    )
    assert abs(number(figure(page, VELOCITY, "a"))) < 5
    assert number(figure(page, VELOCITY, "ba")) == pytest.approx(240, abs=8)
    assert number(figure(page, VELOCITY, "max")) > 230
    # 240 rpm are 4 turns a second: between 0.3 s and 0.6 s the shaft turns 1.2 times.
    page.get_by_label("Cursor A").fill("0.3")
    until(lambda: abs(number(figure(page, POSITION, "ba")) - 1.2) < 0.02, HANG_S, "1.2 turns")
    assert number(figure(page, VELOCITY, "mean")) == pytest.approx(240, rel=0.02)
    # A cursor is dragged as well: B to the middle of the plot, 0.3 s after the trigger.
    box = page.get_by_role("img", name="Scope").locator(".u-over").bounding_box()
    assert box is not None
    x_of_b = box["x"] + box["width"] * (0.2 + 0.6)
    page.mouse.move(x_of_b, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * (0.2 + 0.45), box["y"] + 50, steps=5)
    page.mouse.up()
    cursor_b = page.get_by_label("Cursor B")
    soon(lambda: float(cursor_b.input_value()), pytest.approx(0.45, abs=0.01), "B is dragged")


def test_a_sine_has_its_frequency_and_amplitude(page: Page, station: Station, cyclic: str) -> None:
    amplitude, hertz = 0.05, 7.0
    add_channel(page, "607A")
    page.get_by_label("Time shown").select_option("2")
    page.get_by_text("Maths", exact=True).click()
    page.get_by_role("button", name="Add a computed channel").click()
    page.get_by_label("Expression").fill("derivative(c4) * 60")
    page.locator(".maths-row").get_by_label("Unit").fill("rpm")
    page.get_by_text("Measurements", exact=True).click()
    speed = 2 * math.pi * hertz * amplitude * 60
    jobs: list[Any] = []

    def whole() -> bool:
        """The sine at its full size is in sight: speed and frequency are the signal's."""
        # A server that others keep from its work for 200 ms rightly ends the motion.
        if not jobs or station.ok(station.http.get(f"/jobs/{jobs[-1]['id']}"))["state"] == "failed":
            assert len(jobs) < 5, jobs
            jobs.append(generate(station, cyclic, mode="CSP", shape="sine", amplitude=amplitude,
                                 frequency_hz=hertz, duration_s=60))  # fmt: skip
        seen = number(figure(page, "m1", "rms")), number(figure(page, TARGET, "frequency"))
        return abs(seen[0] * math.sqrt(2) / speed - 1) < 0.003 and abs(seen[1] - hertz) < 0.02

    until(whole, LONG_MS / 1000, "the measured frequency and speed are the signal's")
    assert number(figure(page, TARGET, "pp")) == pytest.approx(2 * amplitude, rel=0.005)
    page.get_by_role("button", name="Pause").click()
    page.get_by_text("Spectrum", exact=True).click()
    spectrum = page.get_by_role("region", name="Spectrum")
    spectrum.get_by_label("Trace").select_option(TARGET)
    until(lambda: peaks(page) and abs(peaks(page)[0][1] - amplitude) < 0.0005, HANG_S, "amplitude")
    assert peaks(page)[0][0] == pytest.approx(hertz, abs=0.02)
    expect(spectrum.get_by_text("1000 Hz", exact=False)).to_be_visible()
    expect(page.get_by_text("not equally spaced")).to_have_count(0)
    # The speed of a sine of A turns at f is 2πfA turns a second.
    spectrum.get_by_label("Trace").select_option("m1")
    until(
        lambda: peaks(page) and abs(peaks(page)[0][1] - speed) < 0.01 * speed, HANG_S, "its speed"
    )
    assert peaks(page)[0][0] == pytest.approx(hertz, abs=0.02)
    # The axis follows it: the same line, about as high.
    spectrum.get_by_label("Trace").select_option(POSITION)
    until(lambda: peaks(page) and abs(peaks(page)[0][1] - amplitude) < 0.01, HANG_S, "it follows")
    for tab in ("Spectrogram", "X–Y"):
        page.get_by_text(tab, exact=True).click()
        expect(page.get_by_role("img", name=tab)).to_be_visible()


def test_timing_is_reported_and_follows_the_exchange(
    page: Page, station: Station, axis: str
) -> None:
    timing = page.locator(f'[data-trace="{VELOCITY}"] .timing')
    expect(timing).to_contain_text("polled")
    body = {"url": URL, "cycle_us": 1000}
    until(lambda: station.http.post("/buses/cyclic", json=body).is_success, 60, "it runs")
    expect(timing).to_contain_text("synchronous 1000/s", timeout=20_000)
    station.ok(station.http.delete("/buses/cyclic", params={"url": URL}))
    expect(timing).to_contain_text("polled", timeout=20_000)
    assert page.get_by_text("no data for").count() == 0


def test_what_passes_without_a_connection_is_counted(page: Page, cyclic: str, cable: Cable) -> None:
    expect(page.locator(f'[data-trace="{VELOCITY}"] .timing')).to_contain_text("synchronous")
    until(lambda: number(figure(page, VELOCITY, "rms")) >= 0, HANG_S)
    lost = page.locator("[data-lost]")
    before = int(lost.get_attribute("data-lost") or 0)
    cable.cut()
    expect(page.get_by_text("no data for").first).to_be_visible(timeout=15_000)
    cable.mend()
    until(lambda: int(lost.get_attribute("data-lost") or 0) > before + 500, HANG_S, "it is counted")
    expect(page.get_by_text("no data for")).to_have_count(0)
    expect(lost).to_contain_text("while there was no connection")


def test_setups_references_and_snapshots_are_kept(page: Page, station: Station, axis: str) -> None:
    add_channel(page, "60F4")
    page.get_by_label("Time shown").select_option("0.5")
    page.get_by_label("Trigger", exact=True).select_option("auto")
    scales = page.locator(".scales summary")
    scales.click()
    page.get_by_role("combobox", name="rpm").select_option("fixed")
    page.get_by_label("Lower end, rpm").fill("-50")
    page.get_by_label("Upper end, rpm").fill("50")
    expect(scales).to_contain_text("rpm: −50 … 50 · rev: follows the traces")
    # The wheel on the axis of revolutions, the third one, fixes its scale; two clicks free it.
    axis_of_rev = page.locator(".time-plot .u-axis").nth(2)
    axis_of_rev.hover()
    page.mouse.wheel(0, -100)
    expect(scales).not_to_contain_text("rev: follows")
    axis_of_rev.dblclick()
    expect(scales).to_contain_text("rev: follows")
    page.get_by_text("Keep", exact=True).click()
    page.get_by_label("Name of this set-up").fill("Following error")
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_role("button", name="Use Following error")).to_be_visible()
    page.get_by_role("button", name="Keep this view as reference").click()
    expect(page.get_by_text("Ref 1 Spindle Velocity actual value")).to_be_visible()
    page.get_by_label("Name (or the time)").fill("before oiling")
    page.get_by_label("Notes").fill("noisy below 10 rpm")
    page.get_by_role("button", name="Take a snapshot").click()
    expect(page.get_by_text("noisy below 10 rpm")).to_be_visible()
    # Another person's browser: nothing stored in it, all of it on the server.
    page.evaluate("localStorage.clear()")
    page.reload()
    figure(page, VELOCITY, "min").wait_for()
    expect(page.locator("[data-trace]")).to_have_count(3)
    page.get_by_text("Keep", exact=True).click()
    page.get_by_role("button", name="Use Following error").click()
    expect(page.get_by_role("button", name="Channels (4)")).to_be_visible()
    expect(page.get_by_label("Trigger", exact=True)).to_have_value("auto")
    expect(page.get_by_label("Time shown")).to_have_value("0.5")
    expect(scales).to_contain_text("rpm: −50 … 50 · rev: follows the traces")
    page.get_by_role("button", name="Show as reference").click()
    expect(page.get_by_text("before oiling: Spindle Following error")).to_be_visible()
    for name in ("Delete before oiling.sdsnap", "Delete Following error"):
        page.get_by_role("button", name=name).click()
        expect(page.get_by_role("button", name=name)).to_have_count(0)


def test_a_text_that_is_no_expression_is_said_to_be_none(page: Page) -> None:
    page.get_by_text("Maths", exact=True).click()
    page.get_by_role("button", name="Add a computed channel").click()
    for text, words in (
        ("c1 +", "ends too early"),
        ("fetch(c1)", "“fetch” is no function"),
        ("", "Write something"),
        ("c1; c2", "“;” at position 3"),
    ):
        page.get_by_label("Expression").fill(text)
        expect(page.get_by_text(words)).to_be_visible()
    expect(page.get_by_role("button", name="Channels (3)")).to_be_visible()


class Fingers:
    """Touches of a page, as its screen reports them."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._session = page.context.new_cdp_session(page)

    def touch(self, kind: str, *places: tuple[float, float]) -> None:
        points = [{"x": x, "y": y, "id": n} for n, (x, y) in enumerate(places)]
        self._session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def move(self, *ways: tuple[tuple[float, float], tuple[float, float]], steps: int = 4) -> None:
        """Put fingers down, move each along its way, rest, and lift them."""
        self.touch("touchStart", *(begin for begin, _ in ways))
        for step in range(1, steps + 1):
            part = step / steps
            self.touch(
                "touchMove",
                *((a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])) for a, b in ways),
            )
        # The browser reports places between two that it was reported, by their times.
        self._page.evaluate("() => new Promise(requestAnimationFrame)")
        self.touch("touchMove", *(end for _, end in ways))
        self.touch("touchEnd")


def cursor_times(page: Page) -> tuple[float, float]:
    first, second = (
        float(page.get_by_label(f"Cursor {name}").input_value()) for name in ("A", "B")
    )
    return first, second


def stretch_in_sight(page: Page) -> tuple[float, float]:
    """Begin and end: new cursors stand at one and at two thirds of it."""
    page.get_by_role("button", name="Cursors").click()
    a, b = cursor_times(page)
    page.get_by_role("button", name="Cursors").click()
    return a - (b - a), b + (b - a)


def two_fingers_zoom(page: Page) -> None:
    """Next to each other they zoom and move time, one above the other the scales."""
    page.get_by_label("Time shown").select_option("5")
    page.get_by_role("button", name="Pause").click()
    plot = page.locator(".time-plot .u-over")
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    assert box is not None
    across, up = (
        (lambda part: box["x"] + part * box["width"]),
        (lambda part: box["y"] + (1 - part) * box["height"]),
    )
    fingers = Fingers(page)
    soon(lambda: length(stretch_in_sight(page)), pytest.approx(5, rel=0.02), "5 s in sight")
    begin, end = stretch_in_sight(page)
    middle = up(0.5)
    fingers.move(
        ((across(0.4), middle), (across(0.3), middle)),
        ((across(0.6), middle), (across(0.7), middle)),
    )
    half = pytest.approx((end - begin) / 2, rel=0.03)
    soon(lambda: length(stretch_in_sight(page)), half, "twice as near")
    nearer = stretch_in_sight(page)
    assert sum(nearer) / 2 == pytest.approx((begin + end) / 2, abs=0.05)
    fingers.move(
        ((across(0.2), middle), (across(0.4), middle)),
        ((across(0.6), middle), (across(0.8), middle)),
    )
    wide = length(nearer)
    earlier = pytest.approx(nearer[0] - 0.2 * wide, abs=0.03 * wide)
    soon(lambda: stretch_in_sight(page)[0], earlier, "moved by a fifth")
    moved = stretch_in_sight(page)
    assert length(moved) == pytest.approx(wide, rel=0.03)
    assert page.evaluate("visualViewport.scale") == 1, "the page itself is not zoomed"
    scales = page.locator(".scales summary")
    expect(scales).to_have_text("Y scales follow the traces")
    fingers.move(
        ((across(0.5), up(0.4)), (across(0.5), up(0.3))),
        ((across(0.5), up(0.6)), (across(0.5), up(0.7))),
    )
    expect(scales).not_to_contain_text("follow")  # none of the three
    assert stretch_in_sight(page) == pytest.approx(moved, abs=0.02 * wide), "time is as it was"
    page.get_by_role("button", name="Autoscale").click()
    expect(scales).to_have_text("Y scales follow the traces")


def one_finger_moves_cursors(page: Page) -> None:
    """It drags and taps them; scrolling and zooming over them leaves them where they are."""
    page.get_by_role("button", name="Cursors").click()
    page.get_by_label("Cursor A").wait_for()
    page.evaluate(AT_REST)
    plot = page.locator(".time-plot .u-over")
    box = plot.bounding_box()
    assert box is not None
    (x, y), wide, high = (box["x"], box["y"]), box["width"], box["height"]
    a, b = cursor_times(page)
    third = b - a
    fingers = Fingers(page)
    fingers.move(((x + wide / 3, y + high / 2), (x + wide / 6, y + high / 2)))
    dragged = pytest.approx((a - third / 2, b), abs=third / 10)
    soon(lambda: cursor_times(page), dragged, "A is dragged")
    page.touchscreen.tap(x + 0.9 * wide, y + high / 2)
    there = pytest.approx((a - third / 2, b + 0.7 * third), abs=third / 10)
    soon(lambda: cursor_times(page), there, "B is tapped")
    tapped = cursor_times(page)
    fingers.move(
        ((x + wide / 2, y + high / 2), (x + 0.45 * wide, y + high / 2)),
        ((x + 0.7 * wide, y + high / 2), (x + 0.75 * wide, y + high / 2)),
    )
    page.evaluate(AT_REST)
    assert cursor_times(page) == tapped, "two fingers zoom"
    before = page.evaluate(SCROLLED)
    fingers.move(((x + wide / 2, y + 0.8 * high), (x + wide / 2, y + 0.3 * high)), steps=8)
    page.evaluate(AT_REST)
    assert page.evaluate(SCROLLED) > before + 50, "the page scrolls"
    assert cursor_times(page) == tapped
    page.get_by_role("button", name="Cursors").click()


def test_on_a_phone(browser: Browser, cable: Cable, axis: str) -> None:
    for page in _open(browser, cable.url, **PHONE):
        page.evaluate("location.hash = '#/scope'")
        figure(page, VELOCITY, "min").wait_for()
        # As much as is to be looked at must have come.
        expect(figure(page, POSITION, "rms")).not_to_have_text("—")
        two_fingers_zoom(page)
        one_finger_moves_cursors(page)
        page.get_by_label("Trigger", exact=True).select_option("normal")
        for tab in ("Spectrum", "Spectrogram", "X–Y", "Maths", "Keep", "Measurements"):
            page.get_by_text(tab, exact=True).click()
            page.evaluate(AT_REST)
            assert page.evaluate(TOO_SMALL) == [], tab
            assert page.evaluate(SIDEWAYS) == 0, tab
