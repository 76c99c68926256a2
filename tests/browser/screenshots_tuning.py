"""Pictures for docs/tuning.md: one virtual axis on its way from untouched to tuned.

    python -m tests.browser.screenshots_tuning [--automatic] [FOLDER]

Whole pages at laptop and phone size, and single panels as far as the text needs them.
"""

from __future__ import annotations

import argparse
import io
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Browser, Locator, Page, sync_playwright

from tests.browser import tuning
from tests.browser.conftest import FLAGS, LAPTOP, PHONE, ROOT
from tests.browser.driving import open_axis
from tests.support.station import Station, until

LIMITS = {"travel_limit": 3, "speed_limit": 1200, "torque_limit": 80}
COLOURS = 64
SETTLE_MS = 2500
#: A panel is shown as wide as a page of the documentation, not wider.
PANEL = {"viewport": {"width": 1180, "height": 2600}}


def prepare(station: Station) -> str:
    """Measure, design, apply, and measure again, as the pages would."""
    drive = station.add(1, tuning.URL, name="Spindle")
    http, seconds = station.http, tuning.MEASURED_MS / 1e3
    path = f"/drives/{drive}"

    def run(tool: str, **more: object) -> Any:
        for _ in range(5):
            answer = http.post(f"{path}/jobs/{tool}", json=LIMITS | more)
            # Frames get lost on a computer that is kept busy; the segment heals by itself.
            if answer.is_success and (job := station.job(answer, seconds))["state"] == "done":
                return job["result"]
            until(lambda: station.state(drive)["fresh"], 60, "the drive answers again")
            http.post(f"{path}/fault-reset", json={})
        raise AssertionError(answer.text)

    run("inertia")
    run("sweep", kind="speed_loop")
    mechanics = run("sweep")["measurements"][-1]
    run("step")
    body = {"measurement": mechanics, "inertia_kgm2": tuning.INERTIA, "sample_rate_hz": 1000}
    designs = station.ok(http.post(f"{path}/tune/candidates", json=body))["candidates"]
    chosen = next(each for each in designs if "balanced" in each["marks"])
    gains = {name: chosen["gains"][name] for name in
             ("speed_bandwidth_hz", "integral_hz", "position_1_s")}  # fmt: skip
    gains["inertia_kgm2"] = tuning.INERTIA
    station.ok(http.put(f"{path}/gains", json={"gains": gains}))
    station.ok(http.put(f"{path}/notches", json={"notches": chosen["notches"]}))
    run("sweep", kind="speed_loop")
    run("step")
    about = {"format": "html", "machine": "Press 4", "person": "M. Keller"}
    station.ok(http.post(f"{path}/reports", json=about))
    return drive


def _store(what: Page | Locator, file: Path, colours: int, above: int = 0) -> None:
    """Keep a picture, without so many lines at its top."""
    picture = Image.open(io.BytesIO(what.screenshot())).convert("RGB")
    picture = picture.crop((0, above, picture.width, picture.height))
    picture.quantize(colours, dither=Image.Dither.NONE).save(file, optimize=True)


def _show(page: Page, what: str, number: int = 0) -> None:
    stored = page.locator("li.measured", has_text=what).nth(number)
    stored.get_by_role("button", name="Show", exact=True).click()
    page.get_by_role("img").first.wait_for()


def _panel(page: Page, title: str) -> Locator:
    return page.locator("section.panel", has=page.get_by_role("heading", name=title))


def _panels(page: Page, drive: str, folder: Path, colours: int) -> None:
    """Single steps, each as the text explains it."""

    def keep(what: Page | Locator, name: str) -> None:
        page.wait_for_timeout(SETTLE_MS)
        _store(what, folder / f"tuning-{name}.png", colours)

    open_axis(page, drive, "tune")
    keep(page.get_by_role("navigation", name="Steps of commissioning"), "path")
    tuning.open_step(page, "verify")
    page.get_by_label("Shown").select_option(index=1)
    page.get_by_label("Compared with").select_option(index=1)
    keep(_panel(page, "Step response"), "step")
    tuning.open_step(page, "notches")
    page.get_by_role("button", name="Compute designs").click()
    page.get_by_role("table", name="Designs").wait_for()
    keep(_panel(page, "Designs"), "designs")

    open_axis(page, drive, "response")
    _show(page, "Mechanics")
    keep(page.locator(".bode").first, "mechanics")
    page.get_by_text("What the shape of the curve shows").click()
    keep(page.locator("ul.shapes"), "shapes")
    page.get_by_text("What the shape of the curve shows").click()
    keep(_panel(page, "Notches"), "notches")
    keep(_panel(page, "Try gains"), "predicted")
    _show(page, "Speed loop")
    other = page.locator("li.measured", has_text="Speed loop").last
    other.get_by_role("button", name="Compare").click()
    keep(page.locator(".bode").first, "verified")


def _automatic(page: Page, station: Station, drive: str, folder: Path, colours: int) -> None:
    """All steps in one job, and what its panel then shows."""
    open_axis(page, drive, "tune")
    tuning.open_step(page, "automatic")
    tuning.run_job(page, station, drive, "Start tuning")
    page.get_by_role("heading", name="Verification").wait_for()
    page.wait_for_timeout(SETTLE_MS)
    panel = page.locator("#step-automatic")
    whole, reported = panel.bounding_box(), panel.locator(".note.good").first.bounding_box()
    assert whole is not None
    assert reported is not None
    above = round(reported["y"] - whole["y"])
    _store(panel, folder / "tuning-automatic.png", colours, above)


def _pages(browser: Browser, station: Station, drive: str, folder: Path, colours: int) -> None:
    """Both pages at two sizes, light and dark."""
    for screen, size in {"laptop": LAPTOP, "phone": PHONE}.items():
        for scheme in ("light", "dark"):
            context = browser.new_context(locale="en", color_scheme=scheme, **size)  # type: ignore[arg-type]
            page = context.new_page()
            page.goto(station.url)
            open_axis(page, drive, "tune")
            page.get_by_role("navigation", name="Steps of commissioning").wait_for()
            page.wait_for_timeout(SETTLE_MS)
            _store(page, folder / f"tune-{screen}-{scheme}.png", colours)
            open_axis(page, drive, "response")
            _show(page, "Mechanics")
            page.locator(".bode").first.scroll_into_view_if_needed()
            page.wait_for_timeout(SETTLE_MS)
            _store(page, folder / f"response-{screen}-{scheme}.png", colours)
            context.close()


def shoot(browser: Browser, folder: Path, place: Path, colours: int = COLOURS) -> None:
    """Take all pictures of tuning."""
    place.mkdir(exist_ok=True)
    with tuning.running(place) as station:
        drive = prepare(station)
        _pages(browser, station, drive, folder, colours)
        context = browser.new_context(locale="en", color_scheme="light", **PANEL)  # type: ignore[arg-type]
        page = context.new_page()
        page.goto(station.url)
        _panels(page, drive, folder, colours)
        report = station.ok(station.http.get("/reports"))[0]["file"]
        page.set_viewport_size({"width": 900, "height": 1000})
        page.goto(f"{station.url}/api/v1/reports/{report}")
        _store(page, folder / "tuning-report.png", colours)
        context.close()
    shoot_automatic(browser, folder, place / "automatic", colours)


def shoot_automatic(browser: Browser, folder: Path, place: Path, colours: int = COLOURS) -> None:
    """Take the picture of an axis that was tuned automatically, from untouched on."""
    place.mkdir(exist_ok=True)
    with tuning.running(place) as station:
        drive = station.add(1, tuning.URL, name="Spindle")
        context = browser.new_context(locale="en", color_scheme="light", **PANEL)  # type: ignore[arg-type]
        page = context.new_page()
        page.goto(station.url)
        _automatic(page, station, drive, folder, colours)
        context.close()


def main() -> None:
    """Take the pictures of tuning alone; ``--automatic``: only that of the automatic one."""
    options = argparse.ArgumentParser()
    options.add_argument("folder", nargs="?", type=Path, default=ROOT / "docs" / "images")
    options.add_argument("--automatic", action="store_true")
    asked = options.parse_args()
    folder: Path = asked.folder
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as place, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)
        try:
            (shoot_automatic if asked.automatic else shoot)(browser, folder, Path(place))
        finally:
            browser.close()


if __name__ == "__main__":
    main()
