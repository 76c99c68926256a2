"""A gantry on the page: two axes on one beam that is out of square."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from drivers.virtual.defects import OUT_OF_SQUARE_RAD
from tests.api.test_gantry import AXIS, BEAM, LEAD_MM, SQUARE_RAD, STIFFNESS, connected
from tests.browser import tuning
from tests.support.station import Station

pytestmark = [pytest.mark.timeout(600), pytest.mark.long]

#: The beam is square but for the defect that is planted.
BENCH = (
    AXIS.format(name="Left", station=1)
    + AXIS.format(name="Right", station=2)
    + BEAM.replace(f"square_error_rad = {SQUARE_RAD}", "")
)


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    with tuning.running(
        Path(tmp_path_factory.mktemp("gantry")), BENCH, "Left=out_of_square"
    ) as station:
        yield station


@pytest.fixture(scope="module")
def page(browser: Browser, station: Station) -> Iterator[Page]:
    yield from tuning.patient_page(browser, station)


@pytest.fixture(scope="module")
def axis(station: Station) -> str:
    left, _right = connected(station)
    return left


def test_what_is_out_of_square_is_named_with_the_next_step(
    page: Page, station: Station, axis: str
) -> None:
    panel = tuning.open_panel(page, axis, "Gantry")
    start = panel.get_by_role("button", name="Measure both axes")
    # Nothing may move before the other axis was chosen.
    expect(panel.get_by_text("WARNING: Left and Right")).to_have_count(0)
    expect(start).to_have_attribute("aria-disabled", "true")
    panel.get_by_label("The other axis").select_option(label="Right")
    expect(panel.get_by_text("WARNING: Left and Right are enabled and move")).to_be_visible()
    panel.get_by_label("Distance of the lines").fill("5")
    panel.get_by_label("Way per motor revolution").fill(f"{LEAD_MM:g}")
    tuning.run_job(page, station, axis, "Measure both axes")
    verdict = panel.get_by_text("The gantry is out of square")
    # The beam is bent so that the first axis stands behind.
    expect(verdict).to_contain_text("Axis 2 is ahead of axis 1")
    expect(verdict).to_contain_text("Correct the reference (homing offset)")
    for name in ("Motion alike and skew, from torque to speed", "Coupling of both axes"):
        expect(panel.get_by_role("img", name=name)).to_be_visible()
    table = panel.get_by_role("table", name="Gantry")
    away = tuning.row(table, "Out of square").inner_text()
    truth_rev = OUT_OF_SQUARE_RAD / (2 * math.pi)
    assert _signed(away, "rev") == pytest.approx(-truth_rev, rel=0.1)
    millimetres = table.get_by_role("row").filter(has_text=re.compile(r"Out of square.* mm"))
    assert _signed(millimetres.inner_text(), "mm") == pytest.approx(-truth_rev * LEAD_MM, rel=0.1)
    spring = tuning.row(table, "Stiffness between the axes at rest").inner_text()
    assert tuning.number_in(spring, "N·m/rad") == pytest.approx(STIFFNESS, rel=0.1)
    tuning.expect_within_the_screen(page)


def _signed(text: str, unit: str) -> float:
    """The first number before a unit with its sign, as the page writes it."""
    value = tuning.number_in(text, unit)
    return -value if re.search(rf"[-−]\s?[\d.]+(·10[⁻⁰-⁹]+)? {unit}", text) else value
