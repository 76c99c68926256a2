"""How one axis of the demo is commissioned, and what is photographed on the way.

The axis is *Gantry left* of the demo bench, a screw on EtherCAT, from untouched to tuned. Signals
and figures of the scope come first, as the settings are then those of the delivery.
"""

from __future__ import annotations

import json
import math
import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from camera import Recording, obstacle, opened, take
from demo import AXIS, Demo
from marks import Mark
from playwright.sync_api import Browser, Locator, Page, expect
from readings import Readings

from tests.browser.conftest import LAPTOP
from tests.browser.driving import find, open_axis
from tests.browser.test_scope import TORQUE, VELOCITY, add_channel, figure, number, peaks
from tests.browser.tuning import open_step
from tests.support.station import until

URL = "ethercat://virtual0"
CYCLE_US = 1000
LIMITS = {"travel_limit": 3, "speed_limit": 1200, "torque_limit": 80}
SIGNAL_LIMITS = {"travel_limit": 20, "speed_limit": 1500, "torque_limit": 250}
#: Measurements that a busy computer disturbed are repeated; what fails more often is a defect.
TRIES = 8
LONG_S = 240.0
#: How often a page is looked at until its trouble is taken as lasting.
WHOLE_TRIES = 8
#: After the first values have come, so that plots and tables show something.
SETTLE_MS = 1500
#: Panels are photographed on a page that shows them whole.
TALL = {"viewport": {"width": 1180, "height": 2600}}
ERROR = "c4"
LANGUAGES = ("en", "zh")
START = re.compile("^(Start tuning|开始整定)$")
VERIFICATION = re.compile("^(Verification|验证)$")


class Story:
    """The run: the demo, the browser, and where the pictures go."""

    def __init__(self, demo: Demo, browser: Browser, folder: Path) -> None:
        self.demo = demo
        self.browser = browser
        self.folder = folder
        self.readings = Readings()
        self.repeated = 0

    # --- the axis ---------------------------------------------------------------------

    def ok(self, path: str, method: str = "GET", body: object = None) -> Any:
        """What the interface answers; a refusal ends the run."""
        answer = self.demo.http.request(method, path, json=body)
        assert answer.is_success, f"{path}: {answer.text}"
        return answer.json() if answer.content else None

    def ended(self, job: str, timeout_s: float = LONG_S) -> Any:
        """A job once it has ended."""

        def over() -> Any:
            now = self.demo.ask(f"/jobs/{job}")
            return now if now["state"] != "running" else None

        return until(over, timeout_s, f"job {job} ends")

    def ready(self) -> None:
        """The axis answers without a fault, nothing moves it, and the bus exchanges."""

        def fit() -> bool:
            state = self.demo.fresh()
            if state["state"] == "Fault":
                self.demo.http.post(f"/drives/{AXIS}/fault-reset", json={})
            return state["moving_job"] is None and state["state"] != "Fault"

        until(fit, LONG_S, "the axis is ready")
        body = {"url": URL, "cycle_us": CYCLE_US}
        until(lambda: self._exchanges(body), LONG_S, "the exchange runs")

    def _exchanges(self, body: object) -> bool:
        buses = self.demo.ask("/buses")
        (bus,) = [each for each in buses if each["url"] == URL]
        if (bus["cyclic"] or {}).get("running"):
            return True
        return bool(self.demo.http.post("/buses/cyclic", json=body).is_success)

    def run(self, tool: str, **settings: object) -> Any:
        """A measurement; the result of the job."""
        for _ in range(TRIES):
            self.ready()
            answer = self.demo.http.post(f"/drives/{AXIS}/jobs/{tool}", json=LIMITS | settings)
            if answer.is_success:
                job = self.ended(answer.json()["id"])
                if job["state"] == "done":
                    return job["result"]
                print(f"{tool} is repeated: {(job['problem'] or {}).get('detail')}")
            else:
                print(f"{tool} is repeated: {answer.text}")
            self.repeated += 1
            time.sleep(1)
        raise RuntimeError(f"{tool} failed {TRIES} times")

    # --- pictures ---------------------------------------------------------------------

    @contextmanager
    def page(self, language: str = "en", **size: Any) -> Iterator[Page]:
        """A page of the demo in a browser context of its own."""
        with opened(self.browser, self.demo.url, language, **size) as page:
            yield page

    def whole(self, page: Page, faulty: bool) -> str:
        """Wait until the page shows its values and no trouble; returns what is still in the way."""
        reason = ""
        for _ in range(WHOLE_TRIES):
            self.demo.fresh()
            page.wait_for_timeout(SETTLE_MS)
            reason = obstacle(page)
            if reason == "" or (faulty and self.demo.fresh()["state"] == "Fault"):
                return ""
        return reason

    def keep(self, what: Page | Locator, name: str, marks: Sequence[Mark] = ()) -> None:
        """Store a picture of what a page shows now.

        Raises:
            RuntimeError: it shows trouble.
        """
        page = what if isinstance(what, Page) else what.page
        if reason := self.whole(page, faulty=False):
            raise RuntimeError(f"{name}: {reason}")
        take(what, self.folder / f"{name}.webp", marks)
        print(f"  {name}", flush=True)

    def shoot(
        self,
        page: Page,
        name: str,
        show: Callable[[Page], Sequence[Mark]],
        *,
        faulty: bool = False,
    ) -> None:
        """Bring a page into sight and store a picture of it.

        What a busy bus did not answer stays on the page as a problem: it is then loaded again.
        ``faulty``: the picture is about a fault, so its notice belongs there.
        """
        reason = ""
        for _ in range(TRIES):
            marks = show(page)
            reason = self.whole(page, faulty)
            if not reason:
                take(page, self.folder / f"{name}.webp", marks)
                print(f"  {name}", flush=True)
                return
            print(f"  {name} is repeated: {reason}", flush=True)
            self.repeated += 1
            page.reload()
        raise RuntimeError(f"{name}: {reason}")

    def recording(self, name: str, language: str) -> Path:
        """The file of a recording."""
        return self.folder / f"recording-{name}{'' if language == 'en' else '-zh'}.webp"

    def both(
        self, name: str, show: Callable[[Page], Sequence[Mark]], *, faulty: bool = False
    ) -> None:
        """The same picture in English and in Chinese."""
        for language in LANGUAGES:
            with self.page(language) as page:
                file = name if language == "en" else f"{name}-zh"
                self.shoot(page, file, show, faulty=faulty)


def axis_page(name: str, press: str = "") -> Callable[[Page], Sequence[Mark]]:
    """Shows a page of the axis, after a press of a button or tab of it."""

    def show(page: Page) -> Sequence[Mark]:
        open_axis(page, AXIS, name)
        if press:
            page.get_by_text(press, exact=True).first.click()
        return []

    return show


def panel(page: Page, title: str) -> Locator:
    """A part of the page by its title."""
    return page.locator("section.panel", has=page.get_by_role("heading", name=title, exact=True))


# --- the bus --------------------------------------------------------------------------


def connected(story: Story) -> None:
    """What a scan finds; it is made before the exchange, which keeps the bus to itself."""
    story.demo.fresh()
    story.both("connect", _connect)


def _connect(page: Page) -> Sequence[Mark]:
    page.evaluate("location.hash = '#/connect'")
    way = page.locator("ul.ways button", has_text=URL)
    way.click()
    scan = page.locator("button", has_text=re.compile("^(Scan|扫描)$")).first
    scan.click()
    page.locator(".found").first.wait_for()
    scan.scroll_into_view_if_needed()
    page.wait_for_timeout(SETTLE_MS)
    return [Mark(scan), Mark(page.locator(".found").first)]


# --- scope: the axis as delivered -----------------------------------------------------


def played(story: Story, **signal: object) -> bool:
    """Whether a test signal was played to its end; a busy computer may keep the axis from it."""
    story.ready()
    answer = story.demo.http.post(f"/drives/{AXIS}/jobs/generate", json=SIGNAL_LIMITS | signal)
    done = answer.is_success and story.ended(answer.json()["id"])["state"] == "done"
    story.repeated += not done
    return bool(done)


def arm(page: Page, kind: str, window_s: str) -> None:
    """A single trigger."""
    page.get_by_label("Time shown").select_option(window_s)
    page.get_by_label("Trigger", exact=True).select_option("single")
    page.get_by_label("When", exact=True).select_option(kind)


def caught(page: Page, story: Story, **signal: object) -> None:
    """A whole signal in a single picture."""
    for _ in range(TRIES):
        page.get_by_role("button", name="Arm").click()
        expect(page.get_by_text("Waiting for the trigger")).to_be_visible(timeout=60_000)
        if played(story, **signal):
            expect(page.get_by_text("Triggered (1)")).to_be_visible(timeout=120_000)
            return
    raise RuntimeError("this computer is too busy for the axis")


def cursors(page: Page, a: str, b: str) -> None:
    """Both cursors at typed times; the table follows."""
    if page.get_by_label("Cursor A").count() == 0:
        page.get_by_role("button", name="Cursors").click()
    page.get_by_label("Cursor A").fill(a)
    page.get_by_label("Cursor B").fill(b)
    page.wait_for_timeout(SETTLE_MS)


def reading(page: Page, trace: str, name: str) -> float:
    """A cell of the table of measurements."""
    return number(figure(page, trace, name))


def scope(story: Story) -> None:
    """A step, a move and a spectrum, with the figures that the page reads."""
    story.ready()
    with story.page() as page:
        page.evaluate(f"location.hash = '#/axis/{AXIS}/overview'")
        page.wait_for_timeout(SETTLE_MS)
        page.evaluate("location.hash = '#/scope'")
        figure(page, VELOCITY, "min").wait_for()
        add_channel(page, "60F4")
        _step(page, story)
        _following_error(page, story)
        _spectrum(page, story)


def _step(page: Page, story: Story) -> None:
    add = story.readings.add
    arm(page, "rising", "0.5")
    page.get_by_label("Level").fill("100")
    # An earlier, lower step as reference.
    caught(page, story, mode="CSV", shape="step", amplitude=180, duration_s=2.4)
    page.get_by_text("Keep", exact=True).click()
    page.get_by_role("button", name="Keep this view as reference").click()
    page.get_by_text("Measurements", exact=True).click()
    page.get_by_label("Level").fill("120")
    caught(page, story, mode="CSV", shape="step", amplitude=240, duration_s=2.4)
    cursors(page, "-0.05", "0.3")
    page.get_by_role("heading", level=1).scroll_into_view_if_needed()
    plot = page.get_by_role("img", name="Scope")
    marks = [
        Mark(page.get_by_role("button", name="Channels")),
        Mark(page.get_by_label("Trigger", exact=True)),
        Mark(page.get_by_role("button", name="Cursors")),
        Mark(plot),
    ]
    story.keep(page, "scope", marks)
    # The plot and all rows of the table, at its right end the times of the step.
    page.set_viewport_size({"width": 1280, "height": 1180})
    page.locator(".scroll-table.measurements").evaluate("e => e.scrollTo(e.scrollWidth, 0)")
    story.keep(page, "scope-step")
    page.set_viewport_size(LAPTOP["viewport"])
    rise_ms = reading(page, VELOCITY, "rise")
    add("scope_rise", rise_ms, "ms", 2)
    add("scope_bandwidth", 0.35e3 / rise_ms, "Hz", 1)
    add("scope_overshoot", reading(page, VELOCITY, "overshoot"), "%", 2)
    add("scope_peak", reading(page, VELOCITY, "max"), "rpm", 2)
    add("scope_settling", reading(page, VELOCITY, "settling"), "ms", 2)
    add("scope_torque_max", reading(page, TORQUE, "max"), "%", 2)
    add("scope_torque_mean", reading(page, TORQUE, "mean"), "%", 2)


def _following_error(page: Page, story: Story) -> None:
    arm(page, "motion", "1")
    caught(page, story, mode="CSP", shape="ramp", amplitude=4, duration_s=2.4, acceleration=5)
    cursors(page, "0.2", "0.7")
    lag = reading(page, ERROR, "mean")
    story.readings.add("scope_lag", lag, "rev", 3)
    story.readings.add("scope_position_gain", 5 / lag, "/s", 2)


def _spectrum(page: Page, story: Story) -> None:
    page.get_by_label("Trigger", exact=True).select_option("off")
    page.get_by_label("Time shown").select_option("5")
    page.get_by_text("Spectrum", exact=True).click()
    spectrum = page.get_by_role("region", name="Spectrum")
    spectrum.get_by_label("Window").select_option("flattop")
    spectrum.get_by_label("Trace").select_option(VELOCITY)
    signal = {"mode": "CSV", "shape": "sine", "amplitude": 20, "frequency_hz": 12}
    answer = story.demo.http.post(
        f"/drives/{AXIS}/jobs/generate", json=SIGNAL_LIMITS | signal | {"duration_s": 25}
    )
    assert answer.is_success, answer.text
    heights = [0.0]

    def steady() -> bool:
        """Nothing but the signal is in sight: its line has stopped growing."""
        page.wait_for_timeout(500)
        (hertz, height), *_ = peaks(page) or [(0.0, 0.0)]
        heights.append(height)
        if page.get_by_text("not equally spaced").count() > 0:
            return False  # samples that the bus lost are in sight
        return abs(hertz - 12) < 0.02 and height > 15 and abs(height / heights[-2] - 1) < 1e-3

    until(steady, 120.0, "the sine alone")
    page.get_by_role("button", name="Pause").click()
    found = {}
    for trace in (VELOCITY, TORQUE):
        spectrum.get_by_label("Trace").select_option(trace)
        page.wait_for_timeout(SETTLE_MS)
        found[trace] = peaks(page)
    page.locator(".scope-tabs").scroll_into_view_if_needed()
    page.get_by_role("table", name="Highest peaks").scroll_into_view_if_needed()
    story.keep(page, "scope-spectrum")
    for trace, name, unit in ((VELOCITY, "speed", "rpm"), (TORQUE, "torque", "%")):
        for hertz in (12, 36):
            # A table taken between two pictures of the browser may have a side of the line, too.
            height = max((a for f, a in found[trace] if abs(f - hertz) < 0.3), default=math.nan)
            story.readings.add(f"line_{hertz}_{name}", height, unit, 2)
    _worked_out(story)
    story.demo.http.post("/stop", json={})
    story.ended(answer.json()["id"])


def _worked_out(story: Story) -> None:
    """The torque of the line at 12 Hz from the mechanics of the bench file, for the speed read.

    Inertia times acceleration, and at right angles the first line of the square wave of Coulomb
    friction, 4/π of its height, with viscous friction; all in % of the rated torque.
    """
    rated, inertia, coulomb, viscous = 1.27, 1.5e-4, 0.03, 2e-4
    speed = story.readings.figures["line_12_speed"]["value"] * math.tau / 60
    accelerating = 100 * inertia * math.tau * 12 * speed / rated
    friction = 100 * (4 / math.pi * coulomb + viscous * speed) / rated
    story.readings.add("line_12_speed_rad", speed, "rad/s", 3)
    story.readings.add("line_12_inertia", accelerating, "%", 3)
    story.readings.add("line_12_expected", math.hypot(accelerating, friction), "%", 3)


# --- pages of the axis ----------------------------------------------------------------


def pages(story: Story) -> None:
    """Every page once, on the axis as delivered."""
    story.ready()
    story.ok(f"/drives/{AXIS}/watch", "PUT", {"keys": ["2005:03", "200E:0B", "60F4:00"]})
    body = {"file": "feed screw as delivered", "author": "M. Keller", "notes": "before tuning"}
    job = story.ok(f"/drives/{AXIS}/jobs/read_all", "POST", {})
    story.ended(job["id"])
    answer = story.demo.http.post(f"/drives/{AXIS}/sets", json=body)
    assert answer.is_success or answer.status_code == 409, answer.text  # kept by an earlier try
    story.both("parameters", _parameters)
    story.both("motion", _motion)
    with story.page() as page:
        story.shoot(page, "overview", axis_page("overview"))
        story.shoot(page, "homing", axis_page("motion", "Homing"))
        story.shoot(page, "gains", axis_page("gains"))
        story.shoot(page, "setup", axis_page("setup", "Calculate"))
        story.shoot(page, "io", axis_page("io"))


def _parameters(page: Page) -> Sequence[Mark]:
    """One value edited and not written."""
    open_axis(page, AXIS, "parameters")
    row = find(page, "6084:00")
    row.get_by_role("button").nth(1).click()  # the first one marks a favourite
    page.keyboard.type("1200000")
    page.keyboard.press("Enter")
    page.get_by_role("searchbox").fill("608")
    page.wait_for_timeout(SETTLE_MS)
    return [Mark(page.get_by_role("searchbox")), Mark(page.locator('[id="row-6084:00"]'))]


def _motion(page: Page) -> Sequence[Mark]:
    open_axis(page, AXIS, "motion")
    page.locator(".jog-pad").wait_for()
    return [
        Mark(page.locator(".jog-panel .fields")),
        Mark(page.locator(".jog-pad button").last),
        Mark(page.locator(".jog-live")),
        Mark(page.locator("button.stop")),
    ]


# --- jog ------------------------------------------------------------------------------


def jog(story: Story) -> None:
    """Hold the button, release it: the axis brakes. In both languages."""
    for language in LANGUAGES:
        _jog(story, language)


def _jog(story: Story, language: str) -> None:
    for _ in range(TRIES):
        story.ready()
        with story.page(language) as page:
            open_axis(page, AXIS, "motion")
            name = re.compile("^(Hold to move in the positive direction|按住向正方向运动)$")
            button = page.get_by_role("button", name=name)
            expect(button).to_have_attribute("aria-disabled", "false")
            box = button.bounding_box()
            assert box is not None
            page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
            with Recording(page) as recording:
                recording.wait(1)
                page.mouse.down()
                recording.wait(4)
                page.mouse.up()
                recording.wait(2.5)
            disturbed = page.locator(".jog-panel .note.warn")
            ended = page.get_by_text(re.compile("Ended: released|已结束：已松开"))
            if ended.is_visible() and disturbed.count() == 0:
                recording.store(story.recording("jog", language))
                return
        story.repeated += 1
    raise RuntimeError("no jog was undisturbed and ended by the release")


# --- measuring and tuning -------------------------------------------------------------


def measured(story: Story) -> None:
    """Inertia, both responses and a step, before anything is changed."""
    add = story.readings.add
    found = story.run("inertia")
    add("inertia", found["inertia_kgm2"], "kg·m²", 2)
    add("coulomb", found["coulomb_nm"], "N·m", 1)
    sweep = story.run("sweep")
    kinds = {each["kind"]: each["frequency_hz"] for each in sweep["resonances"][:2]}
    add("antiresonance", kinds["antiresonance"], "Hz", 2)
    add("resonance", kinds["resonance"], "Hz", 3)
    story.both("response", _response)
    with story.page(size=TALL) as page:
        open_axis(page, AXIS, "tune")
        story.keep(page.get_by_role("navigation", name="Steps of commissioning"), "tuning-path")
    loop = story.run("sweep", kind="speed_loop")
    add("bandwidth_before", loop["margins"]["bandwidth_hz"], "Hz", 2)
    story.run("step")


def show(page: Page, what: str) -> None:
    """The newest stored measurement of a kind."""
    stored = page.locator("li.measured", has_text=what).first
    stored.get_by_role("button", name="Show", exact=True).click()
    page.get_by_role("img").first.wait_for()


def designs(story: Story) -> None:
    """What is designed from the measurements by hand, step by step."""
    with story.page(size=TALL) as page:
        # All columns of the table.
        page.set_viewport_size({"width": 1640, "height": 2600})
        open_axis(page, AXIS, "tune")
        open_step(page, "notches")
        page.get_by_role("button", name="Compute designs").click()
        page.get_by_role("table", name="Designs").wait_for(timeout=180_000)
        story.keep(panel(page, "Designs"), "tuning-designs")
        page.set_viewport_size(TALL["viewport"])
        open_axis(page, AXIS, "response")
        show(page, "Mechanics")
        story.keep(page.locator(".bode").first, "tuning-mechanics")
        page.get_by_text("What the shape of the curve shows").click()
        story.keep(page.locator("ul.shapes"), "tuning-shapes")
        page.get_by_text("What the shape of the curve shows").click()
        page.get_by_role("button", name="Notch here").first.click()
        expect(page.get_by_text("Effect in the drive: ").first).to_be_visible()
        story.keep(panel(page, "Notches"), "tuning-notches")
        story.keep(panel(page, "Try gains"), "tuning-predicted")


def automatic(story: Story) -> None:
    """All steps in one job, started on the page; the figures are those of the English page."""
    result = _automatic(story, "en")
    _tuned(story, result)


def automatic_chinese(story: Story) -> None:
    """The same on the Chinese page, undone afterwards: what follows finds the axis as delivered."""
    result = _automatic(story, "zh")
    undo = {"before": result["before"], "after": result["after"]}
    path = f"/drives/{AXIS}/tune/undo"
    # The page that has just been closed may have control for a moment more.
    until(lambda: story.demo.http.post(path, json=undo).is_success, 60, "the tuning is undone")


def _automatic(story: Story, language: str) -> Any:
    """The result of the job."""
    for _ in range(TRIES):
        story.ready()
        with story.page(language) as page:
            open_axis(page, AXIS, "tune")
            start = page.get_by_role("button", name=START)
            open_step(page, "automatic")
            start.scroll_into_view_if_needed()
            page.wait_for_timeout(SETTLE_MS)
            before = {job["id"] for job in story.demo.ask("/jobs")}
            with Recording(page, speed=4) as recording:
                recording.wait(1)
                start.click()
                began = time.monotonic()
                new = until(lambda old=before: _new(story, "autotune", old), 60, "the job runs")
                while story.demo.ask(f"/jobs/{new}")["state"] == "running":
                    page.locator("#step-automatic ol.steps").scroll_into_view_if_needed()
                    recording.wait(1)
                took_s = time.monotonic() - began
                recording.wait(1)
                ended = page.locator("#step-automatic").get_by_role("heading", name=VERIFICATION)
                if ended.count() > 0:
                    ended.scroll_into_view_if_needed()
                recording.wait(8)
            job = story.demo.ask(f"/jobs/{new}")
            if job["state"] == "done" and job["result"]["applied"] is not None:
                length_s = recording.store(story.recording("tune", language))
                print(f"  tune: {took_s:.0f} s, shown in {length_s:.0f} s")
                return job["result"]
            print(f"autotune is repeated: {(job['problem'] or {}).get('detail')}")
        story.repeated += 1
    raise RuntimeError("the axis was not tuned")


def _new(story: Story, kind: str, before: set[str]) -> str | None:
    found = [job["id"] for job in story.demo.ask("/jobs") if job["kind"] == kind]
    return next((job for job in found if job not in before), None)


def _tuned(story: Story, result: Any) -> None:
    """Figures of the design that was written, as it was measured."""
    add = story.readings.add
    applied, verified = result["applied"], result["verified"]
    worst = verified["verdict"]["worst"]
    add("tuned_speed_loop", applied["gains"]["speed_bandwidth_hz"], "Hz", 2)
    add("tuned_bandwidth", verified["measured_bandwidth_hz"], "Hz", 2)
    add("tuned_phase_margin", worst["phase_margin_deg"], "°", 1)
    add("tuned_gain_margin", worst["gain_margin_db"], "dB", 1)
    add("tuned_ms", worst["ms"], "", 1)
    # Several sets of notches keep the same margins: which one the search finds does not repeat.
    print("  ", json.dumps({"applied": applied, "worst": worst, "step": result["step"]["step"]}))


def verified(story: Story) -> None:
    """The tuned axis beside the untouched one, on the page and in the report."""
    story.both("tune", _tune)
    with story.page(size=TALL) as page:
        open_axis(page, AXIS, "tune")
        page.get_by_role("heading", name="Verification").wait_for()
        story.keep(page.locator("#step-automatic"), "tuning-automatic")
    story.run("sweep", kind="speed_loop")
    story.run("step")
    about = {"format": "html", "machine": "Press 4", "person": "M. Keller"}
    story.ok(f"/drives/{AXIS}/reports", "POST", about)
    with story.page(size=TALL) as page:
        open_axis(page, AXIS, "tune")
        open_step(page, "verify")
        page.get_by_label("Shown").select_option(index=1)
        other = page.get_by_label("Compared with")
        other.select_option(index=other.locator("option").count() - 1)
        story.keep(panel(page, "Step response"), "tuning-step")
        open_axis(page, AXIS, "response")
        show(page, "Speed loop")
        first = page.locator("li.measured", has_text="Speed loop").last
        first.get_by_role("button", name="Compare").click()
        story.keep(page.locator(".bode").first, "tuning-verified")
        file = story.demo.ask("/reports")[0]["file"]
        page.set_viewport_size({"width": 900, "height": 1000})
        page.goto(f"{story.demo.url}api/v1/reports/{file}")
        story.keep(page, "tuning-report")
    with story.page() as page:
        page.evaluate("location.hash = '#/files'")
        story.keep(page, "files")


def _tune(page: Page) -> Sequence[Mark]:
    open_axis(page, AXIS, "tune")
    page.locator("#step-automatic .note.good").first.wait_for()
    page.wait_for_timeout(SETTLE_MS)
    page.locator("ol.path").scroll_into_view_if_needed()
    panel = page.locator("#step-automatic")
    start = panel.get_by_role("button", name=START)
    return [
        Mark(page.locator("ol.path")),
        Mark(panel.locator(".mantine-SegmentedControl-root").first),
        Mark(panel.locator(".note.warn").first),
        Mark(start, "right"),
    ]


def _response(page: Page) -> Sequence[Mark]:
    open_axis(page, AXIS, "response")
    page.locator(".bode").first.wait_for()
    page.locator(".bode").first.scroll_into_view_if_needed()
    return []


# --- a fault --------------------------------------------------------------------------


def fault(story: Story) -> None:
    """A fault, what the page says about it, and its reset."""
    for language in LANGUAGES:
        _fault(story, language)
    story.ok(f"/drives/{AXIS}/training-fault", "POST")
    until(lambda: story.demo.fresh()["state"] == "Fault", 60, "the fault is there")
    story.both("alarms", _alarms, faulty=True)
    story.demo.http.post(f"/drives/{AXIS}/fault-reset", json={})


def _fault(story: Story, language: str) -> None:
    story.ready()
    with story.page(language) as page:
        open_axis(page, AXIS, "alarms")
        name = re.compile("^(Reset faults|故障复位)$")
        reset = page.get_by_role("button", name=name).first
        reset.wait_for()
        with Recording(page) as recording:
            recording.wait(1)
            story.ok(f"/drives/{AXIS}/training-fault", "POST")
            until(lambda: story.demo.fresh()["state"] == "Fault", 60, "the fault is there")
            recording.wait(4)
            reset.hover()
            recording.wait(1)
            reset.click()
            until(lambda: story.demo.fresh()["state"] != "Fault", 60, "the fault is reset")
            recording.wait(2.5)
        recording.store(story.recording("fault", language))


def _alarms(page: Page) -> Sequence[Mark]:
    open_axis(page, AXIS, "alarms")
    active = page.locator("section.panel").first
    active.wait_for()
    return [Mark(active.locator(".panel-body")), Mark(active.locator("header button"), "left")]


CHAPTERS: tuple[Callable[[Story], None], ...] = (
    connected, scope, pages, jog, measured, designs, automatic_chinese, automatic, verified, fault,
)  # fmt: skip
