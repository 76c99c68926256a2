"""A press has an effect, or the page states why not, whatever comes and goes meanwhile."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, Page, Route, expect

from tests.browser.driving import Bench, open_axis
from tests.browser.test_motion import PLUS
from tests.support.station import until

Press = tuple[Callable[[], None], Callable[[], None]]

#: Where a button stands, at each moment at which a press could be taken: right after the page was
#: changed, before it was drawn, and as it is drawn.
WATCH = """name => {
 const button = document.querySelector(`[aria-label="${name}"]`);
 const box = button.getBoundingClientRect();
 const x = box.x + box.width / 2, y = box.y + box.height / 2;
 window.found = [];
 const look = when => {
  const top = document.elementFromPoint(x, y);
  if (!button.contains(top)) window.found.push(`${when}: ${top?.outerHTML.slice(0, 80)}`);
  else if (button.getBoundingClientRect().y !== box.y)
   window.found.push(`${when}: moved ${button.getBoundingClientRect().y - box.y}`);
 };
 new MutationObserver(() => look('changed')).observe(
  document.body, {childList: true, subtree: true, characterData: true, attributes: true});
 const draw = () => { look('drawn'); requestAnimationFrame(draw); };
 requestAnimationFrame(draw);
}"""


#: What stands above the button becomes higher, as a list does that gets another line.
GROW = "document.querySelector('.quantities').style.marginTop = '90px'"


def _place(button: Locator) -> tuple[float, float]:
    button.scroll_into_view_if_needed()
    box = button.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def _mouse(page: Page, x: float, y: float) -> Press:
    page.mouse.move(x, y)
    return page.mouse.down, page.mouse.up


def _finger(page: Page, x: float, y: float) -> Press:
    fingers = page.context.new_cdp_session(page)

    def event(kind: str, *points: dict[str, float]) -> None:
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": list(points)})

    return lambda: event("touchStart", {"x": x, "y": y}), lambda: event("touchEnd")


@pytest.mark.long
def test_no_moment_shows_a_press_another_place(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "motion")
    button = page.get_by_role("button", name=PLUS)
    expect(button).to_have_attribute("aria-disabled", "false")
    button.scroll_into_view_if_needed()
    page.evaluate(WATCH, PLUS)
    for _ in range(3):
        bench.station.drives.command(do="inject", axis="X", what="over_temperature")
        notice = page.locator(".late").get_by_role("alert")
        expect(notice).to_be_visible()
        bench.station.ok(bench.station.http.post(f"/drives/{bench.drive}/fault-reset"))
        expect(notice).to_have_count(0)
    assert page.evaluate("window.found") == []


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("screen", ["laptop", "phone"])
def test_a_press_acts_on_what_it_began_on(
    screen: str, request: pytest.FixtureRequest, bench: Bench
) -> None:
    """The page grows above the button, between press and release."""
    page: Page = request.getfixturevalue(screen)
    open_axis(page, bench.drive, "motion")
    button = page.get_by_role("button", name="Enable", exact=True)
    expect(button).to_be_enabled()
    down, up = (_finger if screen == "phone" else _mouse)(page, *_place(button))
    # What the drive makes of it is another matter, and takes time.
    with page.expect_request(re.compile("/transition$")):
        down()
        page.evaluate(GROW)
        up()


def test_a_finger_presses_nothing_that_came_under_it(phone: Page, bench: Bench) -> None:
    page = phone
    open_axis(page, bench.drive, "motion")
    button = page.get_by_role("button", name="Enable", exact=True)
    expect(button).to_be_enabled()
    x, y = _place(button)
    down, up = _finger(page, x, y - 60)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    down()
    button.evaluate("e => e.style.transform = 'translateY(-60px)'")
    under = "([x, y]) => document.elementFromPoint(x, y).closest('button')?.innerText"
    assert page.evaluate(under, [x, y - 60]) == "Enable"
    up()
    page.wait_for_timeout(300)
    assert not [url for url in asked if "transition" in url]


@pytest.mark.long
def test_a_press_that_begins_nothing_says_why(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "motion")
    button = page.get_by_role("button", name=PLUS)
    expect(button).to_have_attribute("aria-disabled", "false")
    start = page.get_by_role("button", name="Start the move")
    page.get_by_text("Move", exact=True).first.click()
    start.click(force=True)
    reported = page.locator(".not-begun")
    expect(reported).to_contain_text("A field above is empty")
    page.get_by_text("Jog", exact=True).first.click()
    try:
        bench.station.drives.command(do="pull", wire="mlink://virtual0")
        expect(button).to_have_attribute("aria-disabled", "true")
        # Taking the power off is tried all the same.
        expect(page.get_by_role("button", name="Disable", exact=True)).to_be_enabled()
        button.click(force=True)
        expect(reported).to_contain_text("did not answer when the button was pressed")
        page.get_by_text("Move", exact=True).first.click()
        start.click(force=True)
        expect(reported).to_contain_text("did not answer when the button was pressed")
    finally:
        bench.station.drives.command(do="heal", wire="mlink://virtual0")
    until(lambda: bench.state()["fresh"], what="the drive answers again")


def test_the_keyboard_stays_where_it_was(laptop: Page, bench: Bench) -> None:
    """After a dialogue, and after a button that its own request disabled."""
    page = laptop
    page.evaluate("location.hash = '#/connect'")
    opens = page.get_by_role("button", name="Name and notes").first
    opens.focus()
    page.keyboard.press("Enter")
    dialogue = page.get_by_role("dialog")
    expect(dialogue.get_by_role("button", name="Close")).to_be_focused()
    page.keyboard.press("Escape")
    expect(dialogue).to_have_count(0)
    expect(opens).to_be_focused()

    again = page.get_by_role("button", name="Look again")
    again.focus()
    held: list[Route] = []

    def hold(route: Route) -> None:
        held.append(route)

    page.route(re.compile("/interfaces$"), hold)
    page.keyboard.press("Enter")
    expect(again).to_be_disabled()
    while not held:
        page.wait_for_timeout(20)
    held[0].continue_()
    expect(again).to_be_enabled()
    expect(again).to_be_focused()
    # Let go on purpose, it stays where it is.
    page.mouse.click(2, 790)
    page.evaluate("document.body.append(document.createElement('i'))")
    page.wait_for_timeout(100)
    assert page.evaluate("document.activeElement === document.body")


@pytest.mark.long
def test_a_key_that_is_held_presses_once(laptop: Page, bench: Bench) -> None:
    page = laptop
    open_axis(page, bench.drive, "motion")
    button = page.get_by_role("button", name="Enable", exact=True)
    expect(button).to_be_enabled()
    button.focus()
    page.evaluate(
        "window.presses = 0; document.activeElement.addEventListener('click', () => presses++)"
    )
    for _ in range(5):
        page.keyboard.down("Enter")
    page.keyboard.up("Enter")
    assert page.evaluate("window.presses") == 1
