"""The frame on a phone, without a mouse, in both languages."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.browser.cable import Cable
from tests.browser.driving import REPORTED_MS, Bench, open_axis
from tests.support.station import HANG_S, until

ROOT = Path(__file__).resolve().parents[2]
AXIS = ["overview", "parameters", "motion", "tune", "response", "gains", "setup", "io", "alarms"]
BENCH = ["connect", "scope", "rerun", "scene", "files", "audit", "people"]
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
#: Buttons whose label does not fit into them.
CUT = """() => [...document.querySelectorAll('button, button span')].filter(
 e => e.checkVisibility() && getComputedStyle(e).overflowX !== 'visible'
  && e.scrollWidth > e.clientWidth + 1).map(e => e.innerText)"""
#: What lies over STOP: at its corners and in its middle there is nothing but itself.
OVER_STOP = """() => {
 const stop = document.querySelector('.stop'), box = stop.getBoundingClientRect();
 const xs = [box.left + 4, (box.left + box.right) / 2, box.right - 5];
 const ys = [box.top + 4, (box.top + box.bottom) / 2, box.bottom - 5];
 return xs.flatMap(x => ys.map(y => document.elementFromPoint(x, y)))
  .filter(e => e !== stop).map(e => e && e.outerHTML.slice(0, 120))}"""
#: Rules of WCAG 2 that the page breaks; foreign viewers in their frames are not ours.
AXE = """async only => {
 const found = await axe.run({exclude: [['iframe']]}, {
  runOnly: only, rules: {'label-content-name-mismatch': {enabled: true}},
  resultTypes: ['violations'], iframes: false});
 return found.violations.map(v => `${v.id}: ${v.nodes.slice(0, 3).map(
  n => n.html.slice(0, 140) + ' ' + n.any.map(a => a.message).join('; ')).join(' | ')}`)}"""
#: WCAG 2.2 at A and AA. `label-content-name-mismatch` is experimental and enabled by name: voice
#: control presses a button by the words that stand on it.
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]
#: The library's classes in use, and those that a style sheet of the page knows.
CLASSES = """() => {
 const used = new Set([...document.querySelectorAll('[class*=m_]')].flatMap(e => [...e.classList]));
 const known = [...document.styleSheets].flatMap(s => [...s.cssRules]).map(r => r.cssText).join();
 return [...used].filter(c => /^m_[0-9a-f]+$/.test(c) && !known.includes(c))}"""

#: Cumulative layout shift (Chromium's own measure) of what was drawn since; each page its own.
SHIFTS = """() => {
 window.shift = 0;
 new PerformanceObserver(list => {
  for (const entry of list.getEntries()) window.shift += entry.value;
 }).observe({type: 'layout-shift'})}"""
MOST_SHIFT = 0.05
#: Round trip of a bad line, at which what a page asks for comes in several steps.
SLOW_LINE_MS = 100


def _pages(page: Page, drive: str) -> Iterator[str]:
    """Every page in turn, drawn."""
    for name in AXIS + BENCH:
        place = f"/axis/{drive}/{name}" if name in AXIS else f"/{name}"
        page.evaluate(f"location.hash = '#{place}'")
        expect(page.locator("main")).not_to_have_text("")
        page.get_by_role("heading", level=1).wait_for()
        yield name


def test_every_page_suits_a_glove_a_reader_and_both_lights(phone: Page, bench: Bench) -> None:
    page = phone
    # Colours on their way from one to the other are no colours to judge; viser is not ours.
    page.emulate_media(reduced_motion="reduce")
    page.route("**/viser/**", lambda route: route.abort())
    page.evaluate((ROOT / "webui/node_modules/axe-core/axe.min.js").read_text("utf-8"))
    whole = (ROOT / "webui/node_modules/@mantine/core/styles.css").read_text("utf-8")
    found: list[str] = []
    for name in _pages(page, bench.drive):
        page.emulate_media(color_scheme="light")
        defects = [f"small: {each}" for each in page.evaluate(TOO_SMALL)]
        defects += [f"cut: {each}" for each in page.evaluate(CUT)]
        defects += [f"over STOP: {each}" for each in page.evaluate(OVER_STOP)]
        defects += page.evaluate(AXE, RULES)
        if wider := page.evaluate(SIDEWAYS):
            defects.append(f"{wider} px too wide")
        defects += [f"no style: {each}" for each in page.evaluate(CLASSES) if f".{each}" in whole]
        page.emulate_media(color_scheme="dark")
        expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", "dark")
        defects += [f"dark {each}" for each in page.evaluate(AXE, RULES)]
        found += [f"{name}: {each}" for each in defects]
    assert found == [], "\n".join(found)


@pytest.mark.long
def test_no_page_of_a_laptop_breaks_a_rule_in_either_light(laptop: Page, bench: Bench) -> None:
    page = laptop
    page.emulate_media(reduced_motion="reduce")
    page.route("**/viser/**", lambda route: route.abort())
    page.evaluate((ROOT / "webui/node_modules/axe-core/axe.min.js").read_text("utf-8"))
    found: list[str] = []
    for name in _pages(page, bench.drive):
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", scheme)
            found += [f"{name} {scheme}: {each}" for each in page.evaluate(AXE, RULES)]
    assert found == [], "\n".join(found)


def test_nothing_lies_over_stop(phone: Page, bench: Bench) -> None:
    page = phone
    open_axis(page, bench.drive, "overview")
    page.get_by_role("button", name="Axes and pages").click()
    expect(page.get_by_role("dialog")).to_be_visible()
    assert page.evaluate(OVER_STOP) == []
    page.get_by_role("dialog").get_by_role("link", name="Connect").click()
    page.get_by_role("button", name="Name and notes").click()
    page.get_by_role("textbox", name="Notes").focus()
    assert page.evaluate(OVER_STOP) == []
    page.get_by_role("button", name="Cancel").click()


def test_what_is_shown_is_not_taken_for_current_without_a_connection(
    laptop: Page, bench: Bench, cable: Cable
) -> None:
    page = laptop
    open_axis(page, bench.drive, "overview")
    state = page.get_by_label("State of the drive")
    expect(state).to_contain_text("Switch on disabled")
    expect(page.locator(".quantities")).to_be_visible()
    cable.cut()
    expect(page.get_by_text("The values shown are from")).to_be_visible(timeout=REPORTED_MS)
    expect(state).to_contain_text("No answer", timeout=REPORTED_MS)
    expect(page.locator(".quantities")).to_have_class(re.compile("stale"), timeout=REPORTED_MS)
    cable.mend()
    expect(state).to_contain_text("Switch on disabled")


@pytest.mark.long
def test_a_page_asked_for_without_a_connection_comes_by_itself(
    laptop: Page, bench: Bench, cable: Cable
) -> None:
    page = laptop
    open_axis(page, bench.drive, "overview")
    expect(page.locator(".quantities")).to_be_visible()
    code = re.compile(r"/assets/AlarmsPage")
    page.route(code, lambda route: route.abort())
    page.reload()
    expect(page.locator(".quantities")).to_be_visible()
    cable.cut()
    open_axis(page, bench.drive, "alarms")
    expect(page.get_by_text("It opens automatically")).to_be_visible()
    page.unroute(code)
    cable.mend()
    expect(page.get_by_role("heading", name="Alarms")).to_be_visible()


@pytest.mark.long
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
    page.get_by_role("button", name="中文").click()
    pages = page.get_by_role("navigation", name="页面")
    expect(pages.get_by_role("link", name="参数")).to_be_visible()
    expect(page.get_by_label("驱动器状态")).to_contain_text("禁止接通")
    page.reload()
    expect(pages.get_by_role("link", name="参数")).to_be_visible()
    expect(page.locator("html")).to_have_attribute("lang", "zh-Hans")


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


@pytest.mark.long
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

    lines = until(lambda: found if len(found := export()) > 20 else None, HANG_S, "twenty samples")
    assert lines[0].startswith('"time_s","X Velocity actual value')
    assert all(line.count(",") == 3 for line in lines[1:])


@pytest.mark.long
def test_nothing_moves_under_a_finger_while_a_page_opens(laptop: Page, x: str) -> None:
    """Also where the answers come late: the pages that moved most before they were waited for."""
    open_axis(laptop, x, "overview")
    laptop.get_by_role("heading", level=1).wait_for()
    network = laptop.context.new_cdp_session(laptop)
    network.send("Network.enable")
    slow = {"offline": False, "latency": SLOW_LINE_MS, "downloadThroughput": -1}
    network.send("Network.emulateNetworkConditions", {**slow, "uploadThroughput": -1})
    laptop.evaluate(SHIFTS)
    moved: dict[str, float] = {}
    for name in ("response", "io", "alarms", "tune", "audit", "connect"):
        laptop.evaluate("window.shift = 0")
        place = f"/axis/{x}/{name}" if name in AXIS else f"/{name}"
        laptop.evaluate(f"location.hash = '#{place}'")
        laptop.locator("main .arrived").get_by_role("heading", level=1).wait_for()
        laptop.wait_for_timeout(4 * SLOW_LINE_MS)  # what comes late, comes now
        moved[name] = laptop.evaluate("window.shift")
    assert {name: shift for name, shift in moved.items() if shift > MOST_SHIFT} == {}
