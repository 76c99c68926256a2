"""The figures of the worked examples in docs/scope.md, read off the page on the demo's own axis.

    python -m tests.browser.worked_examples

The axis is *Gantry left* of the standard bench. Its segment takes its time from the process data,
so the figures are the same on a busy computer.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from playwright.sync_api import Page, expect, sync_playwright

import drivers.virtual
from backend.station.demo import DemoBench
from tests.browser.conftest import FLAGS, LAPTOP
from tests.browser.test_scope import (
    TORQUE,
    URL,
    VELOCITY,
    add_channel,
    figure,
    generate,
    peaks,
)
from tests.support.station import Station, until

AXIS = "Gantry left"
ERROR = "c4"
LONG_S, TRIES = 120.0, 6


def bench_text() -> str:
    """That axis of the standard bench alone."""
    text = (Path(drivers.virtual.__file__).parent / "standard_bench.toml").read_text("utf-8")
    (found,) = [part for part in text.split("[[axis]]") if f'name = "{AXIS}"' in part]
    return f"[[axis]]{found}"


def arm(page: Page, kind: str, window_s: str) -> None:
    """A single trigger."""
    page.get_by_label("Time shown").select_option(window_s)
    page.get_by_label("Trigger", exact=True).select_option("single")
    page.get_by_label("When", exact=True).select_option(kind)


def cursors(page: Page, a: str, b: str) -> None:
    """Both cursors at typed times; the table follows."""
    if page.get_by_label("Cursor A").count() == 0:
        page.get_by_role("button", name="Cursors").click()
    page.get_by_label("Cursor A").fill(a)
    page.get_by_label("Cursor B").fill(b)
    page.wait_for_timeout(1500)


def reported(page: Page, trace: str, *names: str) -> str:
    """Cells of the table, as they are shown."""
    return ", ".join(f"{name} {figure(page, trace, name).inner_text()}" for name in names)


def played(station: Station, axis: str, **signal: object) -> bool:
    """Whether a test signal was played to its end; a busy computer may keep the axis from it."""
    job = generate(station, axis, **signal)
    ended = station.job(station.http.get(f"/jobs/{job['id']}"), LONG_S)
    if ended["state"] != "done":
        station.http.post(f"/drives/{axis}/fault-reset", json={})
        time.sleep(1)
    return bool(ended["state"] == "done")


def caught(page: Page, station: Station, axis: str, **signal: object) -> None:
    """A whole signal in a single picture."""
    for _ in range(TRIES):
        page.get_by_role("button", name="Arm").click()
        expect(page.get_by_text("Waiting for the trigger")).to_be_visible()
        if played(station, axis, **signal):
            expect(page.get_by_text("Triggered (1)")).to_be_visible(timeout=LONG_S * 1e3)
            return
    raise AssertionError("this computer is too busy for the axis")


def step(page: Page, station: Station, axis: str) -> None:
    """Settling time of a speed step."""
    arm(page, "rising", "0.5")
    page.get_by_label("Level").fill("120")
    caught(page, station, axis, mode="CSV", shape="step", amplitude=240, duration_s=2.4)
    cursors(page, "-0.05", "0.3")
    print("step:", reported(page, VELOCITY, "rise", "overshoot", "settling", "max"))
    print("  torque:", reported(page, TORQUE, "max", "mean"))


def following_error(page: Page, station: Station, axis: str) -> None:
    """Velocity lag of a move at constant speed."""
    arm(page, "motion", "1")
    caught(
        page, station, axis, mode="CSP", shape="ramp", amplitude=4, duration_s=2.4, acceleration=5
    )
    cursors(page, "0.2", "0.7")
    print(
        "move:",
        reported(page, ERROR, "min", "max", "mean"),
        "; speed",
        reported(page, VELOCITY, "mean"),
    )
    print("  of", page.locator(f'[data-trace="{ERROR}"] .timing').inner_text())


def torque(page: Page, station: Station, axis: str) -> None:
    """Lines of the torque while the speed is a sine of known height."""
    page.get_by_label("Trigger", exact=True).select_option("off")
    page.get_by_label("Time shown").select_option("5")
    page.get_by_text("Spectrum", exact=True).click()
    spectrum = page.get_by_role("region", name="Spectrum")
    spectrum.get_by_label("Window").select_option("flattop")
    job = generate(
        station, axis, mode="CSV", shape="sine", amplitude=20, frequency_hz=12, duration_s=20
    )
    spectrum.get_by_label("Trace").select_option(VELOCITY)

    heights = [0.0]

    def steady() -> bool:
        """Five seconds of nothing but the signal are in sight: its line has stopped growing."""
        page.wait_for_timeout(500)
        (hertz, height), *_ = peaks(page) or [(0.0, 0.0)]
        heights.append(height)
        return abs(hertz - 12) < 0.02 and height > 15 and abs(height / heights[-2] - 1) < 1e-3

    until(steady, LONG_S, "the sine alone")
    page.get_by_role("button", name="Pause").click()
    for trace in (VELOCITY, TORQUE):
        spectrum.get_by_label("Trace").select_option(trace)
        page.wait_for_timeout(1500)
        print("spectrum:", trace, peaks(page))
    station.http.post("/stop", json={})
    station.job(station.http.get(f"/jobs/{job['id']}"), LONG_S)


def main() -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = Path(name)
        bench = folder / "bench.toml"
        bench.write_text(bench_text())
        station = Station(folder, bench)
        station.drives = DemoBench(bench, folder / "wires", folder / "nvm", steady=True)
        station.start()
        try:
            axis = station.add(1, URL, name=AXIS)
            body = {"url": URL, "cycle_us": 1000}
            until(lambda: station.http.post("/buses/cyclic", json=body).is_success, 60)
            browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)
            page = browser.new_context(locale="en", **LAPTOP).new_page()
            page.set_default_timeout(60_000)
            page.goto(f"{station.url}/#/scope")
            figure(page, VELOCITY, "min").wait_for()
            add_channel(page, "60F4")
            for example in (step, following_error, torque):
                example(page, station, axis)
            browser.close()
        finally:
            station.stop()


if __name__ == "__main__":
    main()
