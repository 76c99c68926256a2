"""Jog by mouse, finger and key; everything that must end it; STOP."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.browser.cable import Cable
from tests.browser.driving import REPORTED_MS, Bench, open_axis, says_no
from tests.support.station import until

PLUS = "Hold to move in the positive direction"
MINUS = "Hold to move in the negative direction"


def _centre(page: Page, name: str) -> tuple[float, float]:
    button = page.get_by_role("button", name=name)
    expect(button).to_have_attribute("aria-disabled", "false")
    button.scroll_into_view_if_needed()
    button.hover(trial=True)  # it stands still, and nothing lies over it
    box = button.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def _press(page: Page, bench: Bench, name: str = PLUS) -> None:
    """Hold a jog button with the mouse until the axis moves."""
    open_axis(page, bench.drive, "motion")

    def down() -> None:
        # After a jog that a stall ended, the button is dim until the axis has its settings back.
        page.mouse.move(*_centre(page, name))
        page.mouse.down()

    bench.press(down, page.mouse.up, says_no(page))


def test_jog_by_mouse(laptop: Page, bench: Bench) -> None:
    open_axis(laptop, bench.drive, "motion")
    laptop.mouse.move(*_centre(laptop, PLUS))
    start = bench.state()["position"]
    assert bench.jog(laptop.mouse.down, laptop.mouse.up, says_no(laptop)) == "jog.end-released"
    assert bench.state()["position"] > start
    expect(laptop.get_by_text("Ended: released")).to_be_visible()


@pytest.mark.long
def test_sliding_off_the_button_still_ends_with_the_release(laptop: Page, bench: Bench) -> None:
    start = bench.state()["position"]
    _press(laptop, bench, MINUS)
    laptop.mouse.move(600, 700)
    laptop.mouse.up()
    bench.wait_standing()
    assert bench.state()["position"] < start


def _touch(page: Page, end: str) -> tuple[Callable[[], None], Callable[[], None]]:
    """A finger on the button, and its end."""
    x, y = _centre(page, PLUS)
    fingers = page.context.new_cdp_session(page)

    def event(kind: str, *points: dict[str, float]) -> None:
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": list(points)})

    return lambda: event("touchStart", {"x": x, "y": y}), lambda: event(end)


@pytest.mark.long
def test_jog_by_finger(phone: Page, bench: Bench) -> None:
    open_axis(phone, bench.drive, "motion")
    assert bench.jog(*_touch(phone, "touchEnd"), says_no(phone)) == "jog.end-released"


def test_cancelled_touch_stops(phone: Page, bench: Bench) -> None:
    open_axis(phone, bench.drive, "motion")
    assert bench.jog(*_touch(phone, "touchCancel"), says_no(phone)) == "jog.end-pointer-cancelled"


def test_jog_by_key(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "motion")
    _centre(page, PLUS)
    start = bench.state()["position"]
    page.get_by_role("group", name=re.compile("^Jog")).focus()
    bench.jog(
        lambda: page.keyboard.down("ArrowLeft"),
        lambda: page.keyboard.up("ArrowLeft"),
        says_no(page),
    )
    assert bench.state()["position"] < start


def test_arrow_keys_elsewhere_do_not_jog(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "motion")
    _centre(page, PLUS)
    page.get_by_label("Speed").first.focus()
    page.keyboard.down("ArrowRight")
    page.keyboard.up("ArrowRight")
    # A jog would be in the list as soon as it is asked for.
    page.get_by_role("button", name=PLUS).hover()
    jobs = bench.station.ok(bench.station.http.get("/jobs"))
    assert not [job for job in jobs if job["kind"] == "jog" and job["state"] == "running"]
    assert not bench.moves()


def _hide(page: Page, _cable: Cable) -> None:
    """What a browser does when another tab is shown."""
    page.evaluate(
        "Object.defineProperty(document, 'visibilityState', {get: () => 'hidden'});"
        "document.dispatchEvent(new Event('visibilitychange'))"
    )


def _blur(page: Page, _cable: Cable) -> None:
    page.evaluate("window.dispatchEvent(new Event('blur'))")


def _pause(page: Page, _cable: Cable) -> None:
    """None of the page's code runs any more; the worker's does."""
    session = page.context.new_cdp_session(page)
    session.send("Debugger.enable")
    session.send("Debugger.pause")


def _hang(page: Page, _cable: Cable) -> None:
    """The page's own thread is busy; the worker's timers run on."""
    page.evaluate(
        "() => { const end = performance.now() + 3000; while (performance.now() < end); }"
    )


def _leave(page: Page, _cable: Cable) -> None:
    page.evaluate("location.hash = '#/connect'")


def _close(page: Page, _cable: Cable) -> None:
    page.goto("about:blank")


def _cut(_page: Page, cable: Cable) -> None:
    cable.cut()


def _stall(_page: Page, cable: Cable) -> None:
    cable.stall()


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("trouble", [_hide, _blur, _pause, _hang, _leave, _close, _cut, _stall])
def test_the_jog_ends(laptop: Page, bench: Bench, cable: Cable, trouble: Any) -> None:
    """The button stays pressed; the axis stops all the same."""
    _press(laptop, bench)
    trouble(laptop, cable)
    bench.wait_standing()
    assert bench.jog_job()["state"] != "running"
    cable.mend()


@pytest.mark.long
def test_the_jog_ends_when_page_and_worker_are_frozen(laptop: Page, bench: Bench) -> None:
    """A closed lid: the browser's processes get no time at all, and close no connection."""
    _press(laptop, bench)
    browser = laptop.context.browser
    assert browser is not None
    reported = browser.new_browser_cdp_session().send("SystemInfo.getProcessInfo")
    frozen = [process["id"] for process in reported["processInfo"] if process["type"] == "renderer"]
    try:
        for process in frozen:
            os.kill(process, signal.SIGSTOP)
        bench.wait_standing()
        assert bench.jog_end() == "jog.end-no-sign-of-life"
    finally:
        for process in frozen:
            os.kill(process, signal.SIGCONT)


def test_lost_connection_is_said_and_comes_back(laptop: Page, bench: Bench, cable: Cable) -> None:
    open_axis(laptop, bench.drive, "overview")
    expect(laptop.get_by_label("State of the drive")).to_contain_text("Switch on disabled")
    cable.cut()
    expect(laptop.get_by_text("Connection to the server lost.")).to_be_visible(timeout=REPORTED_MS)
    cable.mend()
    expect(laptop.get_by_text("Connection to the server lost.")).to_have_count(0)
    expect(laptop.get_by_label("State of the drive")).to_contain_text("Switch on disabled")


def test_escape_stops_a_jog(laptop: Page, bench: Bench) -> None:
    _press(laptop, bench)
    laptop.keyboard.press("Escape")
    bench.wait_standing()
    expect(laptop.get_by_text("Stopped: X")).to_be_visible(timeout=REPORTED_MS)


def _start_sequence(page: Page, bench: Bench) -> None:
    open_axis(page, bench.drive, "motion")
    page.get_by_text("Reciprocating", exact=True).first.click()
    here = round(bench.state()["position"], 3)
    page.get_by_label("First position").fill(str(here))
    page.get_by_label("Second position").fill(str(here + 3))
    page.get_by_label("Pause").fill("0")
    page.get_by_role("button", name="Start", exact=True).click()
    bench.wait_moving()


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("where", ["motion", "parameters", "scope", "rerun", "connect", "files"])
def test_stop_on_every_page(laptop: Page, bench: Bench, where: str) -> None:
    page = laptop
    _start_sequence(page, bench)
    if where in ("scope", "rerun", "connect", "files"):
        page.evaluate(f"location.hash = '#/{where}'")
    else:
        open_axis(page, bench.drive, where)
    button = page.get_by_role("button", name="Stop all axes (Esc)")
    box = button.bounding_box()
    assert box is not None
    assert min(box["width"], box["height"]) >= 48
    assert box["x"] + box["width"] >= 1279
    button.click()
    bench.wait_standing()
    expect(page.get_by_text("Stopped: X")).to_be_visible(timeout=REPORTED_MS)


def test_stop_is_reached_through_an_open_dialog(phone: Page, bench: Bench) -> None:
    page = phone
    _start_sequence(page, bench)
    page.evaluate("location.hash = '#/files'")
    page.get_by_role("button", name="Save to a file").click()
    expect(page.get_by_role("dialog")).to_be_visible()
    # A click by coordinates goes to whatever is on top there.
    page.touchscreen.tap(340, 30)
    bench.wait_standing()


def test_stop_works_when_the_websocket_does_not(laptop: Page, bench: Bench) -> None:
    """The worker is made deaf; the request of its own carries STOP."""
    page = laptop
    _start_sequence(page, bench)
    page.evaluate(
        "Worker.prototype.postMessage = () => { throw new Error('deaf') };"
        "window.addEventListener('unhandledrejection', (e) => e.preventDefault())"
    )
    page.get_by_role("button", name="Stop all axes (Esc)").click()
    bench.wait_standing()


def test_state_machine_picture_drives_the_axis(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "overview")
    page.get_by_role("button", name="Go to Operation enabled").click()
    until(lambda: bench.state()["state"] == "Operation enabled", what="enabled")
    expect(page.get_by_label("State of the drive")).to_contain_text("Operation enabled")
    page.get_by_role("button", name="Go to Switch on disabled").click()
    until(lambda: bench.state()["state"] == "Switch on disabled", what="disabled")


@pytest.mark.long
def test_fault_shows_cause_and_remedy(laptop: Page, bench: Bench) -> None:
    page = laptop
    bench.station.drives.command(do="inject", axis="X", what="over_temperature")
    open_axis(page, bench.drive, "overview")
    panel = page.locator(".faults")
    expect(panel).to_contain_text("Possible causes")
    expect(panel).to_contain_text("What to do")
    expect(page.get_by_label("State of the drive")).to_contain_text("Fault")
    page.get_by_role("button", name="Reset faults").click()
    until(lambda: bench.state()["state"] != "Fault", what="fault reset")
