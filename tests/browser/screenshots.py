"""Pictures of the page for the documentation, from the real page on a virtual bench.

    python -m tests.browser.screenshots [FOLDER]

Into FOLDER goes every page at laptop and phone size, light and dark; into ``docs/images``, where
none is given, only what the documentation shows.
"""

from __future__ import annotations

import io
import re
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from tests.browser import screenshots_tuning
from tests.browser.conftest import FLAGS, LAPTOP, PHONE, ROOT
from tests.browser.driving import find, open_axis
from tests.support.station import Station, until

SCREENS = {"laptop": LAPTOP, "phone": PHONE}
SCHEMES = ("light", "dark")
COLOURS = 128
#: A little past the first read, so that the plots have something to show.
SETTLE_MS = 1500


def _go(name: str) -> Callable[[Page, str], None]:
    def go(page: Page, drive: str) -> None:
        if name in ("connect", "scope", "files"):
            page.evaluate(f"location.hash = '#/{name}'")
        else:
            open_axis(page, drive, name)

    return go


def _parameters(page: Page, drive: str) -> None:
    """Some values edited, some written and not saved, and one chosen."""
    open_axis(page, drive, "parameters")
    if page.get_by_role("button", name=re.compile("^Write edited")).is_disabled():
        found = find(page, "6084:00")
        found.get_by_role("button", name=re.compile("^Edit")).click()
        page.keyboard.type("1200000")
        page.keyboard.press("Enter")
    page.get_by_role("searchbox").fill("608")


def _scope(page: Page, drive: str) -> None:
    _go("scope")(page, drive)
    page.wait_for_timeout(5000)


def _homing(page: Page, drive: str) -> None:
    open_axis(page, drive, "motion")
    page.get_by_text("Homing", exact=True).first.click()


def _setup(page: Page, drive: str) -> None:
    """A screw, with the gear that follows from it."""
    open_axis(page, drive, "setup")
    page.get_by_role("textbox", name="Lead").fill("10")
    page.get_by_role("button", name="Calculate").click()


PICTURES: dict[str, Callable[[Page, str], None]] = {
    "connect": _go("connect"),
    "overview": _go("overview"),
    "parameters": _parameters,
    "motion": _go("motion"),
    "homing": _homing,
    "scope": _scope,
    "gains": _go("gains"),
    "setup": _setup,
    "io": _go("io"),
    "files": _go("files"),
}


def _prepare(station: Station) -> str:
    """Two axes on the bench: one moves back and forth, the other has something unsaved."""
    first = station.add(1, name="Feed screw")
    station.add(2, name="Turntable")
    station.done(station.http.post(f"/drives/{first}/jobs/read_all", json={}))
    for key, raw in (("6083:00", 900000), ("6081:00", 2500000)):
        station.ok(station.http.put(f"/drives/{first}/parameters/{key}", json={"raw": raw}))
    body = {"file": "feed screw as delivered", "author": "M. Keller", "notes": "before tuning"}
    station.ok(station.http.post(f"/drives/{first}/sets", json=body))
    here = station.state(first)["position"]
    travel = {
        "first": here, "second": here + 4, "speed": 300, "acceleration": 1500, "dwell_s": 0.3,
        "count": 100000, "travel_limit": 5, "torque_limit": 100,
    }  # fmt: skip
    watch = {"keys": ["2040:00", "200E:0B", "60F4:00"]}
    station.ok(station.http.put(f"/drives/{first}/watch", json=watch))
    screw = {"mechanics": {"kind": "screw", "lead_mm": 10}}
    station.ok(station.http.put(f"/drives/{first}/mechanics", json=screw))
    station.ok(station.http.post(f"/drives/{first}/jobs/sequence", json=travel))
    until(lambda: abs(station.state(first)["velocity"]) > 100, what="the axis moves")
    return first


def _store(page: Page, file: Path) -> None:
    picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    picture.quantize(COLOURS, dither=Image.Dither.NONE).save(file, optimize=True)


def _shown() -> set[str]:
    """Names of the pictures in the documentation."""
    pages = (ROOT / "docs").rglob("*.md")
    return {
        name for page in pages for name in re.findall(r"images/([\w-]+\.png)", page.read_text())
    }


def _shoot(
    browser: Browser,
    station: Station,
    drive: str,
    folder: Path,
    shown: set[str] | None,
    faulty: bool,
) -> None:
    pictures = {"alarms": _go("alarms")} if faulty else PICTURES
    for screen, size in SCREENS.items():
        for scheme in SCHEMES:
            context = browser.new_context(locale="en", color_scheme=scheme, **size)  # type: ignore[arg-type]
            page = context.new_page()
            page.goto(station.url)
            page.get_by_label("State of the drive").wait_for()
            for name, show in pictures.items():
                file = folder / f"{name}-{screen}-{scheme}.png"
                if shown is not None and file.name not in shown:
                    continue
                show(page, drive)
                page.wait_for_timeout(SETTLE_MS)
                _store(page, file)
            context.close()


def main() -> None:
    """Take all pictures."""
    given = sys.argv[1:]
    folder = Path(given[0]) if given else ROOT / "docs" / "images"
    shown = None if given else _shown()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as place, sync_playwright() as playwright:
        program = "/usr/bin/chromium"
        browser = playwright.chromium.launch(executable_path=program, args=FLAGS)
        station = Station(Path(place))
        station.start()
        try:
            drive = _prepare(station)
            _shoot(browser, station, drive, folder, shown, faulty=False)
            station.http.post("/stop", json={})
            until(lambda: station.state(drive)["moving_job"] is None, what="the axis is free")
            station.drives.command(do="inject", axis="Feed screw", what="over_current")
            until(lambda: station.state(drive)["state"] == "Fault", what="the fault is there")
            _shoot(browser, station, drive, folder, shown, faulty=True)
            screenshots_tuning.shoot(browser, folder, Path(place) / "tuning", COLOURS)
        finally:
            browser.close()
            station.stop()


if __name__ == "__main__":
    main()
