"""The EtherCAT segment on the Connect page: picture, exchange, jog through it, a pulled cable."""

from __future__ import annotations

import contextlib
import os
import re
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from backend.station.demo import DemoBench
from drivers.virtual.wires.netns import unavailable
from tests.api.test_ethercat_faults import host_process
from tests.browser.driving import Bench, open_axis
from tests.support.station import Station, until

pytestmark = pytest.mark.long

URL = "ethercat://virtual0"
AXIS = '[[axis]]\nname = "{name}"\ndrive = "mms7"\non = "{url}"\nstation = {at}\n'
PLUS = "Hold to move in the positive direction"
SLOW_MS = 30_000
"""For what a busy machine takes its time for; none of it is what is tested."""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    """Two drives on one segment as `make run` makes it, which bears a busy computer."""
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("segment"))
    bench = folder / "bench.toml"
    bench.write_text("".join(AXIS.format(name=n, url=URL, at=at) for n, at in (("A", 1), ("B", 2))))
    running = Station(folder, bench)
    running.drives = DemoBench(bench, folder / "wires", folder / "nvm", steady=True)
    running.start()
    running.add(1, URL, name="A")
    running.add(2, URL, name="B")
    yield running
    running.stop()


@pytest.fixture
def axis(station: Station) -> Iterator[Bench]:
    yield Bench(station, "b")
    station.http.post("/stop", json={})
    station.drives.segments[URL].command("heal")
    station.http.delete("/buses/cyclic", params={"url": URL})


def slave(page: Page, number: int, state: str) -> None:
    """The picture shows this slave in this state."""
    picture = page.get_by_role("button", name=re.compile(f"^{number} .*: {state}"))
    expect(picture).to_be_visible(timeout=SLOW_MS)


def start(page: Page) -> None:
    """Start the exchange; a machine that stalls for more than a watchdog is asked again."""
    runs = page.get_by_text("Running, cycle time 1000 µs")
    button = page.get_by_role("button", name="Start", exact=True)
    for _ in range(3):
        button.click()
        expect(runs.or_(page.get_by_text("Not possible now"))).to_be_visible(timeout=SLOW_MS)
        if runs.is_visible():
            return
    expect(runs).to_be_visible()


def hold_until_moving(page: Page, axis: Bench) -> None:
    """Hold the button. A machine that stalls lets go of it, as it must: then it is held again."""
    button = page.get_by_role("button", name=PLUS)
    for _ in range(6):
        expect(button).to_have_attribute("aria-disabled", "false", timeout=SLOW_MS)
        button.scroll_into_view_if_needed()
        box = button.bounding_box()
        assert box is not None
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.mouse.down()
        with contextlib.suppress(AssertionError):
            until(axis.moves, 6, "the axis moves through the cyclic data")
            return
        page.mouse.up()
    raise AssertionError("the axis does not move")


def connect(page: Page) -> None:
    page.evaluate("location.hash = '#/connect'")
    expect(page.get_by_role("heading", name="Cyclic exchange")).to_be_visible(timeout=SLOW_MS)


def test_exchange_jog_pulled_cable_and_return(laptop: Page, axis: Bench) -> None:
    page, segment = laptop, axis.station.drives.segments[URL]
    connect(page)
    slave(page, 1, "PREOP")
    slave(page, 2, "PREOP")

    start(page)
    slave(page, 2, "OP")
    expect(page.get_by_text("with distributed clocks")).to_be_visible()

    before = axis.state()["position"]
    open_axis(page, "b", "motion")
    hold_until_moving(page, axis)
    page.mouse.up()
    until(lambda: not axis.moves(), 10, "the axis stands")
    assert axis.state()["position"] > before
    until(lambda: axis.state()["moving_job"] is None, 10, "the job has ended")

    connect(page)
    segment.command("cut", cable=1)
    slave(page, 2, "no answer")
    expect(page.get_by_role("alert").filter(has_text="station 2")).to_be_visible(timeout=SLOW_MS)
    lost = page.get_by_text("cable between station 1 and station 2: the link was lost")
    expect(lost.first).to_be_visible(timeout=SLOW_MS)
    slave(page, 1, "OP")

    segment.command("heal", cable=1)
    slave(page, 2, "OP")
    expect(page.get_by_role("alert").filter(has_text="station 2")).to_have_count(0)
    assert axis.state()["state"] != "Operation enabled", "back, and disabled"


def test_a_slave_chosen_by_key_tells_about_itself(laptop: Page, axis: Bench) -> None:
    page = laptop
    connect(page)
    first = page.get_by_role("button", name=re.compile("^1 MMS7"))
    first.focus()
    page.keyboard.press("Enter")
    expect(first).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_text("Alias").first).to_be_visible()


def test_an_exchange_that_broke_off_comes_back_and_says_so(laptop: Page, axis: Bench) -> None:
    """The host process is replaced by itself; what is shown meanwhile is as text."""
    page, segment = laptop, axis.station.drives.segments[URL]
    connect(page)
    start(page)
    segment.command("refuse", slave=1, state="SAFEOP", code=0x001D)
    link = axis.station.ok(axis.station.http.get("/buses"))[0]
    assert link["cyclic"]["running"]
    os.kill(host_process(), signal.SIGKILL)
    reported = page.get_by_text("The exchange was interrupted and is being restored automatically")
    expect(reported).to_be_visible(timeout=SLOW_MS)
    expect(page.get_by_role("button", name="Do not restore it")).to_be_visible()
    segment.command("refuse", slave=1, state="SAFEOP", code=None)
    expect(page.get_by_text("Running, cycle time 1000 µs")).to_be_visible(timeout=SLOW_MS)
    expect(reported).to_have_count(0)
    assert axis.state()["state"] != "Operation enabled"
