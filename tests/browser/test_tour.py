"""`servodeck demo` as somebody meets it for the first time: connected axes and a guided tour."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from drivers.virtual.wires.netns import unavailable
from tests.browser.conftest import LAPTOP, PHONE, _open
from tests.support.demo_api import DemoApi

# The drives of the demo start in each, on a busy computer slowly.
pytestmark = [pytest.mark.timeout(500), pytest.mark.long]

#: Starting all virtual drives of the demo takes some seconds, on a busy computer many.
START_S = 120.0
AXIS = "gantry-left"


class Demo(DemoApi):
    """The running command."""

    def __init__(self, folder: Path) -> None:
        command = [sys.executable, "-m", "backend", "demo", "--port", "0"]
        self._process = subprocess.Popen(
            [*command, "--config", str(folder)], stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        url = ""
        deadline = time.monotonic() + START_S
        for line in self._process.stdout:
            if found := re.search(r"servodeck is at (\S+)", line):
                url = found[1]
                break
            assert time.monotonic() < deadline, "the demo does not start"
        assert url, "the demo ended"
        super().__init__(url, AXIS)

    def jobs(self) -> list[str]:
        """Kinds of the jobs that somebody started: reading again after a lost line is not one."""
        return [job["kind"] for job in self.ask("/jobs") if job["kind"] != "reread"]

    def close(self) -> None:
        self.http.close()
        self._process.terminate()
        self._process.wait(30)
        assert self._process.stdout is not None
        self._process.stdout.close()


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Demo]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    running = Demo(Path(tmp_path_factory.mktemp("demo")))
    yield running
    running.close()


def _without_3d(opened: Iterator[Page]) -> Iterator[Page]:
    """3D without a graphics processor takes the computer that the tour needs."""
    for page in opened:
        page.route("**/viser/**", lambda route: route.abort())
        page.reload()
        yield page


@pytest.fixture
def laptop(browser: Browser, demo: Demo) -> Iterator[Page]:
    yield from _without_3d(_open(browser, demo.url, **LAPTOP))


@pytest.fixture
def phone(browser: Browser, demo: Demo) -> Iterator[Page]:
    yield from _without_3d(_open(browser, demo.url, **PHONE))


def card(page: Page) -> Any:
    return page.get_by_role("complementary", name="Guided tour")


def press(page: Page, name: str) -> None:
    card(page).get_by_role("button", name=name, exact=True).click()


def test_the_demo_opens_on_an_ethercat_axis_with_a_load(demo: Demo, laptop: Page) -> None:
    drives = demo.ask("/drives")
    assert [drive["ports"][0]["kind"] for drive in drives] == ["ethercat"] * 3
    kinds = [demo.ask(f"/drives/{drive['id']}/record")["mechanics"]["kind"] for drive in drives]
    assert kinds == ["screw", "belt", "rotary"]
    assert demo.fresh()["state"] == "Switch on disabled"
    # Nothing is enabled: the tour's first step is somebody's own.
    expect(laptop).to_have_url(re.compile(f"#/axis/{AXIS}/overview$"))
    expect(laptop.get_by_role("heading", level=1)).to_contain_text("Gantry left")
    expect(laptop.locator("iframe")).to_be_visible()
    assert demo.jobs() == []


def test_the_tour_by_itself_moves_nothing_and_can_be_left(demo: Demo, phone: Page) -> None:
    page = phone
    before = demo.fresh()["position"]
    press(page, "Start the tour")
    for step in ("look", "jog", "response", "tune", "fault", "undo"):
        expect(card(page)).to_have_attribute("data-step", step)
        # Nothing of it lies over STOP or over the way to the pages.
        box = card(page).bounding_box()
        stop = page.get_by_role("button", name="Stop all axes (Esc)").bounding_box()
        bottom = page.locator("nav.bottom").bounding_box()
        assert box
        assert stop
        assert bottom
        assert stop["y"] + stop["height"] <= box["y"]
        assert box["y"] + box["height"] <= bottom["y"] + 1
        press(page, "Next" if step == "look" else "Skip this step")
    press(page, "Finish")
    expect(card(page)).to_have_count(0)
    assert demo.jobs() == []
    assert abs(demo.fresh()["position"] - before) < 0.001
    # It does not come again by itself, and can be left at any step.
    page.reload()
    page.get_by_role("heading", level=1).wait_for()
    expect(card(page)).to_have_count(0)
    page.get_by_role("button", name="Axes and pages").click()
    page.get_by_role("dialog").get_by_role("button", name="Appearance").click()
    page.get_by_role("menuitem", name="Guided tour").click()
    press(page, "Start the tour")
    press(page, "Next")
    press(page, "Leave the tour")
    expect(card(page)).to_have_count(0)


def test_the_tour_speaks_chinese(demo: Demo, phone: Page) -> None:
    phone.evaluate("localStorage.setItem('servodeck.language', 'zh')")
    phone.reload()
    offered = phone.get_by_role("complementary", name="引导教程")
    offered.get_by_role("button", name="开始教程").click()
    expect(offered).to_contain_text("虚拟伺服驱动器")
    expect(offered.get_by_role("button", name="退出教程")).to_be_visible()
