"""How long a hold lasts on a page whose own thread is blocked, and what a release then does.

    python -m tests.browser.busy_page [HOLDS]

holds the jog button HOLDS times (8) for each length of the block, with a block every
``FREE_MS`` and prints how many holds lasted. The worker sends the signs of life; each says how
long the page was silent, so that the axis brakes in a block and goes on after it.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from playwright.sync_api import Page, expect, sync_playwright

from tests.browser.driving import MOVING_RPM, Bench, open_axis
from tests.support.station import Station, until

LENGTHS_MS = (250, 300, 350, 400, 450)
#: Between two blocks: the axis is braked and has its speed again.
FREE_MS = 700
BLOCKS = 3
PLUS = "Hold to move in the positive direction"
#: Blocks the page's own thread for each of these times, one after the other.
BLOCK = """([lengths, free]) => {
 let wait = 0;
 for (const ms of lengths) {
  setTimeout(() => { const end = performance.now() + ms; while (performance.now() < end); }, wait);
  wait += ms + free;
 }}"""


def block(page: Page, lengths_ms: Sequence[int]) -> None:
    """Begin to block; returns at once."""
    page.evaluate(BLOCK, [list(lengths_ms), FREE_MS])


def hold(page: Page, bench: Bench) -> str:
    """Hold the button with the mouse until the axis moves; the job's id."""
    button = page.get_by_role("button", name=PLUS)

    def down() -> None:
        expect(button).to_have_attribute("aria-disabled", "false")
        button.scroll_into_view_if_needed()
        button.hover()
        page.mouse.down()

    bench.press(down, page.mouse.up, page.locator(".not-begun").is_visible)
    return str(bench.jog_job()["id"])


def lasts(page: Page, bench: Bench, lengths_ms: Sequence[int]) -> bool:
    """Whether one hold lasts through these blocks, to where the axis moves again after them."""
    job = hold(page, bench)
    block(page, lengths_ms)
    page.wait_for_timeout(sum(lengths_ms) + FREE_MS * len(lengths_ms))
    now = bench.jog_job()
    assert now["id"] == job, "a jog began that nobody asked for"
    lasted = now["state"] == "running"
    if lasted:
        until(lambda: bench.moves() or bench.jog_job()["state"] != "running", what="it goes on")
        lasted = bool(bench.jog_job()["state"] == "running")
    page.mouse.up()
    bench.wait_standing()
    return lasted


def resumes_after_release(page: Page, bench: Bench, length_ms: int) -> bool:
    """Release within a block: whether the axis moves once more after it has stood."""
    hold(page, bench)
    block(page, [length_ms])
    page.mouse.up()  # the page sees it when the block is over
    until(lambda: not bench.moves(), what="the axis stands")
    deadline = time.monotonic() + 1.5
    while time.monotonic() < deadline:
        if abs(bench.state()["velocity"]) > MOVING_RPM:
            return True
    assert bench.jog_job()["state"] != "running"
    return False


def main() -> None:
    """Print the table."""
    from tests.browser.conftest import FLAGS, LAPTOP

    holds = int(sys.argv[1]) if len(sys.argv) > 1 else 8
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}; {BLOCKS} blocks in each hold")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        station = Station(Path(folder), Path(__file__).with_name("bench.toml"))
        station.start()
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)
        bench = Bench(station, station.add(1, name="X"))
        page = browser.new_page(locale="en", **LAPTOP)  # type: ignore[arg-type]
        page.goto(station.url)
        open_axis(page, bench.drive, "motion")
        for length in LENGTHS_MS:
            lasted = sum(lasts(page, bench, [length] * BLOCKS) for _ in range(holds))
            again = sum(resumes_after_release(page, bench, length) for _ in range(holds))
            print(f"{length} ms: {lasted} of {holds} lasted; {again} resumed after a release")
        browser.close()
        station.stop()


if __name__ == "__main__":
    main()
