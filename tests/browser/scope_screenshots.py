"""Pictures of the Scope page for docs/scope.md, from signals known by construction.

    python -m tests.browser.scope_screenshots [FOLDER]

A speed step with an earlier one as reference and the spectrum of a sine, into ``docs/images``
unless set otherwise.
"""

from __future__ import annotations

import io
import sys
import tempfile
from pathlib import Path

import httpx
from PIL import Image
from playwright.sync_api import Page, expect, sync_playwright

from backend.station.demo import DemoBench
from tests.browser.conftest import FLAGS, LAPTOP, PHONE, ROOT
from tests.browser.test_scope import (
    BENCH,
    URL,
    add_channel,
    figure,
    generate,
    peaks,
)
from tests.support.station import Station, until

COLOURS = 256


def save(page: Page, path: Path) -> None:
    """As small as a picture of few colours can be."""
    picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    # Fewer colours would cost thin lines theirs, by which they are distinguished.
    picture.quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)


def step(page: Page, station: Station, axis: str) -> None:
    """Two steps of the speed, the first one kept as reference."""
    page.get_by_label("Time shown").select_option("0.5")
    page.get_by_label("Trigger", exact=True).select_option("single")
    page.get_by_label("Level").fill("100")
    for amplitude in (180, 240):
        page.get_by_role("button", name="Arm").click()
        expect(page.get_by_text("Waiting for the trigger")).to_be_visible()
        for _ in range(5):  # a busy computer may keep the axis from its work
            if page.get_by_text("Triggered (1)").is_visible():
                break
            station.http.post(f"/drives/{axis}/fault-reset", json={})
            station.job(generated(station, axis, "CSV", "step", amplitude), 90)
            page.wait_for_timeout(500)
        if amplitude == 180:
            page.get_by_text("Keep", exact=True).click()
            page.get_by_role("button", name="Keep this view as reference").click()
            page.get_by_text("Measurements", exact=True).click()
    page.wait_for_timeout(1500)


def generated(
    station: Station, axis: str, mode: str, shape: str, amplitude: float
) -> httpx.Response:
    """The job of a test signal."""
    job = generate(station, axis, mode=mode, shape=shape, amplitude=amplitude, frequency_hz=12,
                   duration_s=4)  # fmt: skip
    return station.http.get(f"/jobs/{job['id']}")


def spectrum(page: Page, station: Station, axis: str) -> None:
    """The line of a sine that the axis follows."""
    page.get_by_label("Trigger", exact=True).select_option("off")
    page.get_by_label("Time shown").select_option("2")
    page.get_by_text("Spectrum", exact=True).click()
    add_channel(page, "607A")
    signal = {"mode": "CSP", "shape": "sine", "amplitude": 0.05, "frequency_hz": 12.0}
    job = generate(station, axis, duration_s=8, **signal)

    def whole() -> bool:
        """One line and next to nothing next to it: neither a gap nor a fade is in sight."""
        found = peaks(page)
        return (
            len(found) > 1
            and abs(found[0][0] - 12) < 0.02
            and found[1][1] < 0.015 * found[0][1]
            and page.get_by_text("not equally spaced").count() == 0
        )

    until(whole, 90, "the line alone")
    page.get_by_role("button", name="Pause").click()
    station.job(station.http.get(f"/jobs/{job['id']}"), 90)
    page.locator(".scope-tabs").scroll_into_view_if_needed()
    page.get_by_role("table", name="Highest peaks").scroll_into_view_if_needed()
    page.wait_for_timeout(1000)


def main() -> None:
    """Take the pictures."""
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images"
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = Path(name)
        bench = folder / "bench.toml"
        bench.write_text(BENCH)
        station = Station(folder, bench)
        station.drives = DemoBench(bench, folder / "wires", folder / "nvm", steady=True)
        station.start()
        try:
            axis = station.add(1, URL, name="Spindle")
            body = {"url": URL, "cycle_us": 1000}
            until(lambda: station.http.post("/buses/cyclic", json=body).is_success, 60)
            browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)
            for screen, size in (("laptop", LAPTOP), ("phone", PHONE)):
                for scheme in ("light", "dark"):
                    context = browser.new_context(locale="en", color_scheme=scheme, **size)
                    page = context.new_page()
                    page.goto(f"{station.url}/#/scope")
                    figure(page, "c1", "min").wait_for()
                    step(page, station, axis)
                    page.get_by_role("heading", level=1).scroll_into_view_if_needed()
                    save(page, target / f"scope-{screen}-{scheme}.png")
                    if screen == "laptop" and scheme == "light":
                        table = page.get_by_role("region", name="Measurements")
                        table.get_by_role("row").last.scroll_into_view_if_needed()
                        save(page, target / "scope-step-laptop-light.png")
                        spectrum(page, station, axis)
                        save(page, target / "scope-spectrum-laptop-light.png")
                    context.close()
            browser.close()
        finally:
            station.stop()


if __name__ == "__main__":
    main()
