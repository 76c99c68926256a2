"""The 3D page: viser starts in its frame, draws, and STOP works from there."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, Playwright, WebSocket, expect

from tests.browser.conftest import FLAGS
from tests.browser.driving import Bench


@pytest.fixture(scope="module")
def browser(playwright: Playwright) -> Iterator[Browser]:
    """With WebGL; the other tests run without a GPU."""
    running = playwright.chromium.launch(
        executable_path=shutil.which("chromium") or "/usr/bin/chromium",
        args=[*(f for f in FLAGS if f != "--disable-gpu"), "--enable-unsafe-swiftshader"],
    )
    yield running
    running.close()


@pytest.fixture
def page(browser: Browser, bench: Bench) -> Iterator[Page]:
    context = browser.new_context(locale="en", viewport={"width": 900, "height": 600})
    page = context.new_page()
    page.set_default_timeout(15_000)
    yield page
    context.close()


def test_the_scene_receives_data_and_escape_stops_from_there(page: Page, bench: Bench) -> None:
    frames: list[str | bytes] = []

    def listen(socket: WebSocket) -> None:
        if socket.url.endswith("/viser"):
            socket.on("framereceived", lambda data: frames.append(data))  # noqa: PLW0108

    page.on("websocket", listen)
    page.goto(f"{bench.station.url}/#/scene")
    expect(page.get_by_text("drives a bare shaft")).to_be_visible()
    expect(page.get_by_role("link", name="Set what it drives")).to_be_visible()
    scene = page.frame_locator("iframe")
    expect(scene.locator("canvas").first).to_be_visible(timeout=60_000)
    deadline = time.monotonic() + 20
    while sum(map(len, frames)) < 500:
        assert time.monotonic() < deadline, "the parts of the scene do not arrive"
        page.wait_for_timeout(50)  # events come only while Playwright is being called
    # Software rendering keeps the frame too busy for the checks of a locator's click.
    box = page.locator("iframe").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    with page.expect_request("**/api/v1/stop"):
        page.keyboard.press("Escape")
