"""The Scales card: a drive whose unit nobody states is taught by a small move."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.api.test_scales_taught import BENCH, CAN, scales
from tests.browser.driving import open_axis
from tests.support.station import Station, until

pytestmark = pytest.mark.long

#: A busy computer takes its time for a move of 2 s.
ENDED_MS = 60_000


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    """10 000 increments to the revolution, 606Ch in 0.1 rpm; neither is stated by the drive."""
    folder = Path(tmp_path_factory.mktemp("scales"))
    (folder / "bench.toml").write_text(BENCH, "utf-8")
    running = Station(folder, folder / "bench.toml")
    running.start()
    yield running
    running.stop()


def moved(card: Locator) -> int:
    """Increments of the last small move, as the card shows them; 0 before there was one."""
    found = re.search(r"After (\d+) increments", card.inner_text())
    return int(found[1]) if found else 0


def test_a_small_move_teaches_the_scales(laptop: Page, station: Station) -> None:
    page, drive = laptop, station.add(5, CAN, "generic402", "N")
    open_axis(page, drive, "overview")
    card = page.locator("section.panel").filter(has=page.get_by_role("heading", name="Scales"))
    expect(card).to_contain_text("The axis cannot be moved in units.")
    expect(card).to_contain_text("Increments per revolution are unknown.")
    for increments in (1000, 5000):
        card.get_by_label("Increments", exact=True).fill(str(increments))
        card.get_by_role("button", name="Move by increments").click()
        ended = card.get_by_text(f"Small move by {increments} increments: N: done")
        expect(ended).to_be_visible(timeout=ENDED_MS)
        # How far it went by the drive's own count is shown next to what the person confirms.
        until(lambda wanted=increments: abs(moved(card) - wanted) < 20, what=f"{increments} moved")
    card.get_by_label("The shaft turned by").fill("0.5")
    card.get_by_role("button", name="Confirm this turn").click()
    expect(card).to_contain_text("Position and speed are certain.")
    taught = {each["quantity"]: each for each in scales(station, drive)["scales"]}
    # 5000 increments were half a turn; 1 rpm is 10 of 0.1 rpm.
    assert taught["position"]["raw_per_unit"] == pytest.approx(10_000, rel=0.01)
    assert taught["velocity"]["raw_per_unit"] == pytest.approx(10)
    station.remove(drive)
