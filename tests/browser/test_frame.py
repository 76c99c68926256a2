"""The frame on a phone, without a mouse, in both languages."""

from __future__ import annotations

from playwright.sync_api import Page, expect

from tests.browser.driving import Bench, open_axis
from tests.support.station import until

PAGES = ["overview", "parameters", "motion", "io", "alarms"]
#: Visible things to press that are smaller than a gloved finger needs. Boxes count with their
#: label; rows of the table hold their button.
TOO_SMALL = """() => {
 const targets = [...document.querySelectorAll('button, a, input, select, summary')];
 return targets.flatMap(e => {
  if (!e.checkVisibility() || e.closest('.skip')) return [];
  if (e.type === 'checkbox' || e.type === 'radio') return [];
  const box = (e.closest('.mantine-Input-wrapper, .grid-row') ?? e).getBoundingClientRect();
  if (box.bottom < 0 || box.top > innerHeight) return [];
  return box.height < 43.5 ? [`${e.outerHTML.slice(0, 120)} ${box.height}`] : [];
 })}"""
SIDEWAYS = "() => document.documentElement.scrollWidth - document.documentElement.clientWidth"


def test_targets_and_width_on_a_phone(phone: Page, bench: Bench) -> None:
    for name in PAGES:
        open_axis(phone, bench.drive, name)
        phone.get_by_role("heading", level=1).wait_for()
        assert phone.evaluate(TOO_SMALL) == [], name
        assert phone.evaluate(SIDEWAYS) == 0, name
    for name in ("connect", "scope", "rerun", "files"):
        phone.evaluate(f"location.hash = '#/{name}'")
        phone.get_by_role("heading", level=1).wait_for()
        assert phone.evaluate(TOO_SMALL) == [], name
        assert phone.evaluate(SIDEWAYS) == 0, name


def test_only_rows_in_sight_are_drawn(phone: Page, laptop: Page, bench: Bench) -> None:
    for page in (phone, laptop):
        open_axis(page, bench.drive, "parameters")
        page.get_by_role("row").first.wait_for()
        total = int(page.get_by_role("grid").get_attribute("aria-rowcount") or 0)
        assert page.get_by_role("row").count() < 60 < total
        page.get_by_role("grid").focus()
        page.keyboard.press("End")
        expect(page.locator(f"[aria-rowindex='{total}']")).to_be_visible()


def test_language(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "overview")
    page.get_by_role("button", name="Appearance and language").click()
    page.get_by_role("menuitem", name="中文").click()
    expect(page.get_by_role("link", name="参数")).to_be_visible()
    expect(page.get_by_label("驱动器状态")).to_contain_text("禁止接通")
    page.reload()
    expect(page.get_by_role("link", name="参数")).to_be_visible()


def test_control_is_taken_shown_and_given_back(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "overview")
    page.get_by_role("button", name="Control is free").click()
    expect(page.get_by_role("button", name="You have control")).to_be_visible()
    other = bench.station.http.post(
        f"/drives/{bench.drive}/transition", json={"goal": "Ready to switch on"}
    )
    assert other.status_code == 409
    page.get_by_role("button", name="You have control").click()
    expect(page.get_by_role("button", name="Control is free")).to_be_visible()


def test_scope_draws_and_measures(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "overview")
    page.get_by_role("link", name="Scope").click()
    table = page.locator(".measurements")
    expect(table.get_by_role("row")).to_have_count(4)
    expect(table).to_contain_text("polled")
    velocity = table.get_by_role("row").nth(1).get_by_role("cell").nth(2)
    expect(velocity).not_to_have_text("—")
    page.get_by_role("button", name="Cursors").click()
    expect(page.get_by_text("Between the cursors")).to_be_visible()

    def export() -> list[str]:
        with page.expect_download() as download:
            page.get_by_role("button", name="CSV").click()
        return download.value.path().read_text("utf-8").splitlines()

    lines = until(lambda: found if len(found := export()) > 20 else None, 15, "twenty samples")
    assert lines[0].startswith('"time_s","X Velocity actual value')
    assert all(line.count(",") == 3 for line in lines[1:])
