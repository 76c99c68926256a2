"""The card "Import a recording": columns, what they are, and the response that comes of it."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from tests.api.test_response_import import QUERY, REAL
from tests.browser.driving import Bench, open_axis
from tests.browser.test_frame import SIDEWAYS

pytestmark = pytest.mark.long

#: 50 000 rows are evaluated twice: when they are stored and when they are shown.
EVALUATED_MS = 120_000


def test_a_recording_becomes_a_response(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "response")
    card = page.locator("section.panel").filter(
        has=page.get_by_role("heading", name="Import a recording")
    )
    card.locator('input[type="file"]').set_input_files(REAL)
    expect(card).to_contain_text("50000 rows", timeout=EVALUATED_MS)
    for label, column in (("Time", "time"), ("Input: torque", "input"), ("Output:", "output")):
        choice = card.get_by_label(label, exact=label == "Time")
        named = choice.locator("option", has_text=str(QUERY[column])).first
        choice.select_option(named.get_attribute("value"))
    card.get_by_label("Unit of the input").select_option("A")
    card.get_by_label("Unit of the output").select_option("rad/s")
    card.get_by_role("button", name="Evaluate and store").click()
    table = page.get_by_role("table", name="Resonances")
    expect(table).to_be_visible(timeout=EVALUATED_MS)
    # The bench's own frequencies are 53 Hz and 77 Hz.
    rows = table.get_by_role("row").all_inner_texts()[1:]
    shown = {row.split()[0]: float(re.findall(r"([\d.]+) Hz", row)[0]) for row in rows}
    assert shown == {
        "antiresonance": pytest.approx(53.0, abs=1.0),
        "resonance": pytest.approx(77.0, abs=1.0),
    }
    assert page.evaluate(SIDEWAYS) == 0


def test_what_is_no_recording_is_refused_in_words(phone: Page, bench: Bench) -> None:
    page = phone
    open_axis(page, bench.drive, "response")
    card = page.locator("section.panel").filter(
        has=page.get_by_role("heading", name="Import a recording")
    )
    text = {"name": "notes.csv", "mimeType": "text/csv", "buffer": b"no numbers\nat all\n"}
    card.locator('input[type="file"]').set_input_files(text)  # type: ignore[arg-type]
    expect(card.get_by_role("alert")).to_be_visible()
    expect(card.get_by_role("button", name="Evaluate and store")).to_have_count(0)
    assert page.evaluate(SIDEWAYS) == 0
