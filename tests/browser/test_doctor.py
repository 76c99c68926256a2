"""The doctor on the Connect page: five injected causes, each named first, with facts and remedy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from backend.station.demo import DemoBench
from drivers.doctor.diagnosis import catalogue
from drivers.virtual.wires.netns import unavailable
from tests.support.station import Station, until

pytestmark = pytest.mark.long

SEGMENT, CAN = "ethercat://virtual0", "canopen://virtual0"
BENCH = f"""
[[axis]]
name = "A"
drive = "mms7"
on = "{SEGMENT}"
station = 1

[[axis]]
name = "Z"
drive = "ds_c"
on = "{CAN}"
station = 3
"""
SLOW_MS = 30_000
"""For what a busy machine takes its time for; none of it is what is tested."""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    if reason := unavailable():
        pytest.skip(f"no private network here: {reason}")
    folder = Path(tmp_path_factory.mktemp("doctor"))
    bench = folder / "bench.toml"
    bench.write_text(BENCH)
    running = Station(folder, bench)
    running.drives = DemoBench(bench, folder / "wires", folder / "nvm", steady=True)
    running.start()
    running.add(1, SEGMENT, name="A")
    running.add(3, CAN, "ds_c", "Z")
    yield running
    running.stop()


def slave(station: Station, command: str, **arguments: Any) -> Any:
    return station.drives.segments[SEGMENT].command(command, slave=0, **arguments)


def refused(station: Station, code: int) -> None:
    """The exchange is started, and the drive refuses Safe-Op with this AL status code."""
    slave(station, "refuse", state="SAFEOP", code=code)
    answer = station.http.post("/buses/cyclic", json={"url": SEGMENT, "cycle_us": 2000})
    assert answer.status_code == 409, answer.text


def refusing(code: int) -> Callable[[Station], Callable[[], None]]:
    """AL status codes of ETG.1020."""

    def inject(station: Station) -> Callable[[], None]:
        refused(station, code)
        return lambda: slave(station, "refuse", state="SAFEOP", code=None)

    return inject


def eeprom_damaged(station: Station) -> Callable[[], None]:
    """The alias was changed without the checksum, and the drive was switched off and on."""
    image = bytes.fromhex(slave(station, "eeprom")["data"])
    slave(station, "eeprom", word=4, data="0700")
    slave(station, "power_cycle", off_s=0.1)
    until(lambda: slave(station, "register", address=0x502) & 0x0800, what="the checksum")

    def undo() -> None:
        slave(station, "eeprom", word=4, data=image[8:10].hex())
        slave(station, "power_cycle", off_s=0.1)

    return undo


def can_drive_fault(station: Station) -> Callable[[], None]:
    drive = next(d for d in station.ok(station.http.get("/drives")) if d["name"] == "Z")["id"]
    station.drives.command(do="inject", axis="Z", what="overload")
    until(lambda: station.state(drive)["faults"], what="the fault")
    return lambda: station.ok(station.http.post(f"/drives/{drive}/fault-reset", json={}))


CASES: list[tuple[str, str, Callable[[Station], Callable[[], None]]]] = [
    (CAN, "can_drive_fault", can_drive_fault),
    (SEGMENT, "outputs_size", refusing(0x001D)),
    (SEGMENT, "watchdog_refused", refusing(0x001F)),
    (SEGMENT, "clock_mode_wrong", refusing(0x0030)),
    (SEGMENT, "eeprom_damaged", eeprom_damaged),
]


@pytest.mark.parametrize(("url", "cause", "inject"), CASES, ids=[case[1] for case in CASES])
def test_the_first_cause_is_the_injected_one(
    laptop: Page,
    station: Station,
    url: str,
    cause: str,
    inject: Callable[[Station], Callable[[], None]],
) -> None:
    undo = inject(station)
    try:
        laptop.evaluate("location.hash = '#/connect'")
        bus = laptop.locator(".bus").filter(has_text=url)
        card = bus.get_by_role("region", name="Why not in Operational?")
        card.get_by_role("button", name="Why not in Operational?").click(timeout=SLOW_MS)
        first = card.locator("ol > li").first
        text = catalogue()[cause]
        expect(first.locator("strong")).to_have_text(text.title, timeout=SLOW_MS)
        expect(first).to_contain_text(text.remedy)
        expect(first.locator("ul li").first).to_be_visible()
    finally:
        undo()


def test_a_setting_is_tried_kept_and_undone(laptop: Page, station: Station) -> None:
    """The drive refuses Safe-Op for its clock first, and takes the setting after a repair."""
    drop = refusing(0x0030)(station)
    try:
        card = _card(laptop, SEGMENT, "Why not in Operational?")
        trials = card.get_by_role("region", name="Settings to try")
        attempt = trials.get_by_role("button", name="Try bring_up.clock_modes = 0330h")
        attempt.click(timeout=SLOW_MS)
        expect(trials).to_contain_text("does not reach Operational:", timeout=SLOW_MS)
        expect(trials).to_contain_text("The setting is undone.")
        expect(trials.get_by_role("button", name="Keep")).to_have_count(0)
    finally:
        drop()
    attempt.click(timeout=SLOW_MS)
    expect(trials).to_contain_text("the drive reaches Operational.", timeout=SLOW_MS)
    trials.get_by_role("button", name="Keep").click()
    kept = "Until the drive is connected anew: bring_up.clock_modes is 0330h instead of 0300h."
    expect(trials).to_contain_text(kept, timeout=SLOW_MS)
    expect(attempt).to_have_count(0)
    trials.get_by_role("button", name="Undo").click()
    expect(card).not_to_contain_text(kept, timeout=SLOW_MS)


def test_settings_to_try_on_a_phone_in_chinese(phone: Page, station: Station) -> None:
    phone.evaluate("localStorage.setItem('servodeck.language', 'zh')")
    phone.reload()
    drop = refusing(0x0030)(station)
    try:
        card = _card(phone, SEGMENT, "为何未进入 Operational？")
        trials = card.get_by_role("region", name="可尝试的设置")
        attempt = trials.get_by_role("button", name="尝试 bring_up.clock_modes = 0330h")
        attempt.click(timeout=SLOW_MS)
        expect(trials).to_contain_text("驱动器未进入 Operational：", timeout=SLOW_MS)
        wide = phone.evaluate("document.documentElement.scrollWidth - window.innerWidth")
        assert wide <= 0
        box = attempt.bounding_box()
        assert box is not None
        assert box["x"] + box["width"] <= 390
    finally:
        drop()


def _card(page: Page, url: str, title: str) -> Locator:
    """The doctor of a bus, asked."""
    page.evaluate("location.hash = '#/connect'")
    card = page.locator(".bus").filter(has_text=url).get_by_role("region", name=title)
    card.get_by_role("button", name=title).click(timeout=SLOW_MS)
    return card
