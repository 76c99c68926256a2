"""Every page in Chinese: no sentence or label of ours stays English."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from drivers.cia402 import State
from tests.browser.conftest import LAPTOP, _open
from tests.support.station import Station, until

pytestmark = pytest.mark.long

AXIS_PAGES = (
    "overview", "parameters", "motion", "tune", "response", "gains", "setup", "io", "alarms",
)  # fmt: skip
BENCH_PAGES = ("connect", "scope", "rerun", "scene", "files", "audit", "people")
#: Three words in a row with a small letter each are a phrase; names and abbreviations are not.
ENGLISH = re.compile(r"[A-Za-z]*[a-z]{2,}(?:[ ,]+[A-Za-z]*[a-z]{2,}){2,}")
#: A command is typed as it stands.
COMMAND = re.compile(r"sudo [ -~]+")
#: States of CiA 402-2 stand in English next to the Chinese name, as the manuals print them.
STATES = re.compile("|".join(re.escape(state.value) for state in State))
#: Visible texts and labels, except what states its language as English (names in the original).
VISIBLE = """() => {
  const found = []
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT)
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const parent = node.parentElement
    if (!parent || parent.closest('[lang="en"], code, kbd, pre, script, style')) continue
    if (parent.checkVisibility({checkVisibilityCSS: true})) found.push(node.textContent.trim())
  }
  for (const name of ['aria-label', 'title', 'placeholder']) {
    for (const each of document.querySelectorAll(`[${name}]`)) {
      if (!each.closest('[lang="en"]')) found.push(each.getAttribute(name))
    }
  }
  return found
}"""


def _phrases(page: Page, originals: set[str]) -> set[str]:
    """English phrases on the page; a tooltip may begin with the original of a profile's text."""
    found = set()
    for text in page.evaluate(VISIBLE):
        rest = "" if text.partition("\n")[0] in originals or text in originals else text
        if ENGLISH.search(COMMAND.sub("", STATES.sub("", rest))):
            found.add(text)
    return found


@pytest.fixture
def chinese(browser: Browser, station: Station) -> Iterator[Page]:
    for page in _open(browser, station.url, **LAPTOP):
        page.evaluate("localStorage.setItem('servodeck.language', 'zh')")
        page.reload()
        yield page


@pytest.mark.parametrize("place", ["scene", "axis/x/overview"])
def test_states_of_the_scene_are_chinese_with_the_english_in_brackets(
    station: Station, x: str, chinese: Page, place: str
) -> None:
    """The frame itself has signs alone, as viser shows the same to everybody."""
    chinese.route("**/viser/**", lambda route: route.abort())
    chinese.evaluate("localStorage.setItem('servodeck.overview.scene', '1')")
    chinese.goto(f"{station.url}#/{place}")
    state = chinese.locator(".scene .scene-states [data-drive=x]")
    expect(state).to_have_text("X [O] 禁止接通（Switch on disabled）")
    # It covers nothing of the frame, in which people click and read.
    frame, below = chinese.locator(".scene iframe").bounding_box(), state.bounding_box()
    assert frame is not None
    assert below is not None
    assert below["y"] >= frame["y"] + frame["height"] - 1


@pytest.mark.parametrize("name", [*AXIS_PAGES, *BENCH_PAGES])
def test_no_phrase_stays_english(station: Station, x: str, chinese: Page, name: str) -> None:
    place = f"axis/{x}/{name}" if name in AXIS_PAGES else name
    chinese.goto(f"{station.url}#/{place}")
    chinese.get_by_role("heading").first.wait_for()
    expect(chinese.locator("html")).to_have_attribute("lang", re.compile("^zh"))
    chinese.wait_for_load_state("networkidle")
    expect(chinese.locator("[aria-busy=true]")).to_have_count(0)
    # What is folded belongs to the page: notes and help stand there.
    chinese.evaluate("document.querySelectorAll('details').forEach((each) => (each.open = true))")
    expect(chinese.locator("[aria-busy=true]")).to_have_count(0)
    expect(chinese.locator(".untranslated")).to_have_count(0)
    texts = station.ok(station.http.get("/profiles/mms7/texts?language=zh"))["texts"]
    # The translations of a family's texts come after the page.
    until(lambda: not _phrases(chinese, set(texts)), 10.0, str(_phrases(chinese, set(texts))))
