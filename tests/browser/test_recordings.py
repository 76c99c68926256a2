"""Recordings, rerun and 3D in the real page: record, export, and the viewers receive data.

All that needs WebGL is here, so that one such browser and one station do for it.
"""

from __future__ import annotations

import csv
import json
import re
import shutil
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from playwright.sync_api import Browser, Page, Playwright, WebSocket, expect
from rerun.chunk import RrdReader

from backend.records.recording.reader import RecordingReader
from tests.api.test_scene import messages
from tests.browser.conftest import FLAGS, PATIENCE_MS
from tests.browser.driving import Bench
from tests.support.station import HANG_S, until

pytestmark = pytest.mark.long

#: Loading and compiling 43 MB of WebAssembly on a busy machine.
VIEWER_MS = 90_000


@pytest.fixture(scope="module")
def browser(playwright: Playwright) -> Iterator[Browser]:
    """With WebGL, which the viewer needs; the other tests run without a GPU."""
    flags = [flag for flag in FLAGS if flag != "--disable-gpu"]
    running = playwright.chromium.launch(
        executable_path=shutil.which("chromium") or "/usr/bin/chromium",
        args=[*flags, "--enable-unsafe-swiftshader"],
    )
    yield running
    running.close()


@pytest.fixture
def page(browser: Browser, bench: Bench) -> Iterator[Page]:
    context = browser.new_context(locale="en", viewport={"width": 1280, "height": 800})
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    defects: list[str] = []
    page.on("pageerror", lambda error: defects.append(str(error)))
    page.on("console", lambda message: defects.append(message.text) if _policy(message.text) else 0)
    page.goto(f"{bench.station.url}/#/rerun")
    expect(page.get_by_role("heading", name="Recordings", level=1)).to_be_visible()
    yield page
    context.close()
    for row in bench.station.ok(bench.station.http.get("/recordings"))["recordings"]:
        bench.station.http.post(f"/recordings/{row['name']}/stop")
        bench.station.http.delete(f"/recordings/{row['name']}")
    assert defects == []


@pytest.fixture
def scene_page(browser: Browser, bench: Bench) -> Iterator[Page]:
    screen = {"width": 900, "height": 600}
    context = browser.new_context(locale="en", color_scheme="dark", viewport=screen)
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    defects: list[str] = []
    page.on("pageerror", lambda error: defects.append(str(error)))
    page.on("console", lambda message: defects.append(message.text) if _policy(message.text) else 0)
    yield page
    context.close()
    assert defects == []


def _policy(text: str) -> bool:
    """A violation of the policy by us. rerun's viewer asks its makers' servers for news of
    itself; that the policy refuses it is what it is there for."""
    foreign = re.match(r"(Connecting to '|Fetch API cannot load )https://", text)
    return "Content Security Policy" in text and foreign is None


def record(page: Page, bench: Bench, name: str) -> None:
    page.get_by_label("Name").fill(name)
    page.get_by_role("button", name="Record", exact=True).click()

    def recorded() -> bool:
        rows = bench.station.ok(bench.station.http.get("/recordings"))["recordings"]
        return any(row["name"] == f"{name}.sdrec" and row["samples"] > 50 for row in rows)

    until(recorded, HANG_S, "samples are recorded")
    page.get_by_role("button", name="End").click()
    expect(page.get_by_text("complete", exact=False)).to_be_visible()


def fetched(page: Page, kind: str, folder: Path) -> Path:
    """A recording, exported by the page's button."""
    with page.expect_download(timeout=60_000) as waiting:
        page.get_by_role("button", name=f"Export as {kind}:").click()
    path = folder / f"a.{kind.lower()}"
    waiting.value.save_as(path)
    return path


def test_every_export_has_every_sample(page: Page, bench: Bench, tmp_path: Path) -> None:
    """Read back with each format's own library, and compared with the recording itself."""
    move = {"mode": "PV", "target": 200, "acceleration": 3000, "deceleration": 3000,
            "travel_limit": 200, "torque_limit": 150, "timeout_s": 30, "consent": True}  # fmt: skip
    bench.station.ok(bench.station.http.post(f"/drives/{bench.drive}/jobs/move", json=move))
    bench.wait_moving()
    record(page, bench, "browser")
    bench.station.http.post("/stop", json={})
    info = bench.station.ok(bench.station.http.get("/recordings"))["recordings"][0]
    stored = tmp_path / "a.sdrec"
    stored.write_bytes(bench.station.http.get("/recordings/browser.sdrec/file").content)
    with RecordingReader(stored) as reader:
        blocks = list(reader.blocks())
        names = [channel.name for channel in reader.channels]
        shown = [channel.shown_factor for channel in reader.channels]
    values = np.concatenate([block.values for block in blocks])
    times = np.concatenate([block.times_s for block in blocks])
    assert values.shape == (info["samples"], len(info["channels"]))
    assert np.count_nonzero(np.ptp(values, axis=0)) >= 2, "position and speed live"
    since_ns = np.rint((times - times[0]) * 1e9)

    for kind, wanted in (("CSV, raw", values), ("CSV", values * shown)):
        with fetched(page, kind, tmp_path).open(newline="") as file:
            rows = np.array([[float(cell) for cell in row] for row in list(csv.reader(file))[1:]])
        assert np.allclose(rows[:, 1:], wanted, rtol=0 if kind == "CSV, raw" else 1e-14, atol=0)
        assert np.abs(rows[:, 0] * 1e9 - since_ns).max() <= 1

    with fetched(page, "MCAP", tmp_path).open("rb") as file:
        messages = [
            (message.log_time, json.loads(message.data))
            for _, channel, message in make_reader(file).iter_messages()
            if channel.topic.endswith("/polled")
        ]
    assert [[data[name] for name in names] for _, data in messages] == values.tolist()
    stamps = np.array([time for time, _ in messages])
    assert np.abs(stamps - stamps[0] - since_ns).max() <= 1

    found: dict[str, np.ndarray] = {}
    for chunk in RrdReader(fetched(page, "RRD", tmp_path)).stream().to_chunks():
        if "time" in chunk.timeline_names and not chunk.entity_path.endswith("events"):
            batch = chunk.to_record_batch()
            (name,) = [n for n in batch.schema.names if n.endswith("scalars")]
            part = np.array(batch.column(name).to_pylist())
            entity = chunk.entity_path
            found[entity] = np.concatenate([found[entity], part]) if entity in found else part
    # One entity for each unit: put side by side they are the recording.
    together = np.column_stack(list(found.values()))
    assert sorted(together.T.tolist()) == sorted((values * shown).T.tolist())

    page.get_by_role("button", name="Delete browser.sdrec").click()
    page.get_by_role("dialog").get_by_role("button", name="Delete", exact=True).click()
    expect(page.get_by_text("No recordings.")).to_be_visible()


def test_armed_kept_and_bounded_from_the_page(page: Page, bench: Bench) -> None:
    page.get_by_label("Begins").select_option("fault")
    page.get_by_label("Name").fill("waiting")
    page.get_by_role("button", name="Arm", exact=True).click()
    row = page.locator("article", has_text="waiting.sdrec")
    expect(row).to_contain_text("waits for its trigger")
    row.get_by_role("button", name="Begin now").click()
    expect(row).to_contain_text("recording")
    row.get_by_role("button", name="End").click()
    expect(row).to_contain_text("complete")
    row.get_by_text("Notes and tags").click()
    row.get_by_label("Notes").fill("coupling B")
    row.get_by_role("checkbox").check()
    row.get_by_role("button", name="Save").click()
    expect(row.locator(".tag", has_text="kept")).to_be_visible()
    page.get_by_label("Search recordings").fill("coupling")
    expect(row).to_be_visible()
    page.get_by_label("Search recordings").fill("something else")
    expect(page.get_by_text("No recordings.")).to_be_visible()
    page.get_by_label("Search recordings").fill("")
    page.get_by_text("recording ends when less").click()
    page.get_by_label("Total at most").fill("7")
    page.get_by_role("button", name="Set", exact=True).click()
    answer = bench.station.http

    def bounded() -> bool:
        retention = bench.station.ok(answer.get("/recordings"))["retention"]
        return bool(retention["max_total_bytes"] == 7_000_000_000)

    until(bounded, HANG_S, "the bound holds on the server")


def test_what_cannot_be_recorded_is_said_in_words(page: Page, bench: Bench) -> None:
    page.get_by_label("Name").fill("../outside")
    page.get_by_role("button", name="Record", exact=True).click()
    expect(page.get_by_role("alert")).to_contain_text("is not a file name")
    assert bench.station.ok(bench.station.http.get("/recordings"))["recordings"] == []


def test_bundles_are_made_armed_and_deleted(page: Page, bench: Bench) -> None:
    page.get_by_label("Why").fill("odd noise")
    page.get_by_role("button", name="Make one now").click()
    link = page.get_by_role("link", name="Download")
    expect(link).to_be_visible(timeout=30_000)
    with page.expect_download() as waiting:
        link.click()
    assert zipfile.is_zipfile(waiting.value.path())
    armed = page.get_by_label("Make one on every fault")
    expect(armed).to_be_checked()
    armed.click()  # it shows what the server says, so not at once
    until(lambda: not bench.station.ok(bench.station.http.get("/bundles"))["armed"], HANG_S)
    expect(armed).not_to_be_checked()
    armed.click()
    until(lambda: bench.station.ok(bench.station.http.get("/bundles"))["armed"], HANG_S)
    page.get_by_role("button", name=re.compile("^Delete .*zip")).click()
    expect(page.get_by_text("No support bundles.")).to_be_visible()


def test_the_viewer_shows_what_is_live_and_what_was_recorded(page: Page, bench: Bench) -> None:
    """Live data reach it, Esc stops from there, and a stored recording opens. One page for all:
    its 43 MB are compiled once."""
    page.get_by_role("button", name="Show live").click()
    status = page.locator("[data-phase]")
    expect(status).to_have_attribute("data-phase", "live", timeout=VIEWER_MS)
    until(lambda: int(status.get_attribute("data-blobs") or 0) > 20, HANG_S, "blobs arrive")
    expect(page.frame_locator("iframe").locator("canvas")).to_be_visible()
    page.frame_locator("iframe").locator("canvas").click(timeout=VIEWER_MS)
    with page.expect_request("**/api/v1/stop"):
        page.keyboard.press("Escape")
    page.get_by_role("button", name="Close the viewer").click(timeout=VIEWER_MS)
    expect(page.locator("iframe")).to_have_count(0)
    record(page, bench, "again")
    page.get_by_role("button", name="Open in rerun").click()
    status = page.locator("[data-phase]")
    expect(status).to_have_attribute("data-phase", "stored", timeout=VIEWER_MS)
    expect(status).to_contain_text("again.sdrec")
    page.wait_for_timeout(1500)  # a viewer that fails does so while it draws
    expect(status).to_have_attribute("data-phase", "stored")


def _names(frames: list[str | bytes]) -> set[str]:
    """Nodes of the scene that these frames are about."""
    found = (messages(frame) for frame in frames if isinstance(frame, bytes))
    return {str(message.get("name", "")) for part in found for message in part}


def test_the_scene_follows_what_is_set_and_escape_stops_from_there(
    scene_page: Page, bench: Bench
) -> None:
    page = scene_page
    frames: list[str | bytes] = []

    def listen(socket: WebSocket) -> None:
        if socket.url.endswith("/viser"):
            socket.on("framereceived", lambda data: frames.append(data))  # noqa: PLW0108

    page.on("websocket", listen)
    page.goto(f"{bench.station.url}/#/scene")
    page.get_by_text("drives a bare shaft").click()
    expect(page.get_by_role("heading", name="Limits and home, in the drive")).to_be_visible()
    expect(page.get_by_text("607D:01")).to_be_visible()
    scene = page.frame_locator("iframe")
    expect(scene.locator("canvas").first).to_be_visible(timeout=60_000)
    deadline = time.monotonic() + 20
    while sum(map(len, frames)) < 500:
        assert time.monotonic() < deadline, "the parts of the scene do not arrive"
        page.wait_for_timeout(50)  # events come only while Playwright is being called
    assert "darkMode" in (page.locator("iframe").get_attribute("src") or ""), "as the page is"
    frames.clear()
    deadline = time.monotonic() + 20
    page.get_by_label("It drives").select_option("rotary")
    page.get_by_role("button", name="Keep", exact=True).click()
    expect(page.get_by_text("drives a rotary table")).to_be_visible()
    while not any("/table/plate" in name for name in _names(frames)):
        assert time.monotonic() < deadline, "the table does not come into the scene"
        page.wait_for_timeout(50)
    # Software rendering keeps the frame too busy for the checks of a locator's click.
    box = page.locator("iframe").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    with page.expect_request("**/api/v1/stop"):
        page.keyboard.press("Escape")
