"""Two and three real browsers on one station: log-in, control, and a guest from afar."""

from __future__ import annotations

import asyncio
import contextlib
import statistics
from collections.abc import Callable, Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Dialog, Locator, Page, expect

from backend.foundation.people.rights import Right, Role
from backend.foundation.people.station import People
from tests.browser.conftest import HERE, LAPTOP, PATIENCE_MS
from tests.browser.driving import REPORTED_MS, Bench, open_axis, says_no
from tests.browser.test_motion import PLUS, _centre
from tests.support.guarded import CHEAP, NAMES, PASSWORD
from tests.support.machine import OwnTime, within
from tests.support.station import Station, until

#: Greatest time from letting the enabling button go to standstill.
STOPS_WITHIN_S = 0.2


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    folder = Path(tmp_path_factory.mktemp("guarded"))
    people = People(folder / "state", accounts_needed=True, passwords=CHEAP)
    running = Station(folder, HERE / "bench.toml", people=people)
    running.start()
    assert running.loop is not None

    async def enter() -> str:
        accounts = people.accounts
        for role, name in NAMES.items():
            made = await accounts.add(name, PASSWORD, role)
            if role is Role.ADMINISTRATOR:
                owner = made.id
        secret, _ = await accounts.make_token(owner, "tests", frozenset(Right), timedelta(hours=1))
        return secret

    token = asyncio.run_coroutine_threadsafe(enter(), running.loop).result(20)
    running.http.headers["Authorization"] = f"Bearer {token}"
    yield running
    running.stop()


Open = Callable[[str], Page]


@pytest.fixture
def opened(browser: Browser, station: Station, bench: Bench) -> Iterator[Open]:
    """Opens a browser of its own at an address of the station."""
    contexts = []
    defects: list[str] = []

    def open_at(address: str) -> Page:
        context = browser.new_context(locale="en", **LAPTOP)  # type: ignore[arg-type]
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.on("pageerror", lambda error: defects.append(str(error)))
        page.goto(f"{station.url}/{address}")
        return page

    yield open_at
    for context in contexts:
        context.close()
    assert defects == []


def log_in(page: Page, role: Role) -> Page:
    page.get_by_label("Name").fill(NAMES[role])
    page.get_by_label("Password").first.fill(PASSWORD)
    page.get_by_role("button", name="Log in").click()
    page.get_by_role("link", name="Connect").first.wait_for()
    return page


def person(opened: Open, bench: Bench, role: Role, page: str = "motion") -> Page:
    shown = log_in(opened(""), role)
    open_axis(shown, bench.drive, page)
    shown.get_by_role("heading", level=1).wait_for()
    return shown


def button(page: Page | Locator, name: str) -> Locator:
    return page.get_by_role("button", name=name, exact=True)


# --- log-in ---------------------------------------------------------------------------


@pytest.mark.long
def test_nothing_is_shown_before_the_log_in(opened: Open, bench: Bench) -> None:
    page = opened(f"#/axis/{bench.drive}/motion")
    expect(page.get_by_role("heading", name="Log in")).to_be_visible()
    assert page.get_by_text("X", exact=True).count() == 0
    page.get_by_label("Name").fill("Olaf")
    page.get_by_label("Password").first.fill("wrong wrong wrong")
    button(page, "Log in").click()
    expect(page.get_by_text("name or password is wrong")).to_be_visible()
    log_in(page, Role.OPERATOR)
    button(page, "Appearance").click()
    page.get_by_role("menuitem", name="Log out").click()
    expect(page.get_by_role("heading", name="Log in")).to_be_visible()
    page.reload()
    expect(page.get_by_role("heading", name="Log in")).to_be_visible()


# --- control --------------------------------------------------------------------------


@pytest.mark.long
def test_control_is_asked_for_handed_over_and_overridden(opened: Open, bench: Bench) -> None:
    olaf = person(opened, bench, Role.OPERATOR)
    anna = person(opened, bench, Role.ADMINISTRATOR)
    button(olaf, "Control is free").click()
    expect(anna.get_by_text("Olaf has control")).to_be_visible()
    # Conflict: the other page cannot move the axis.
    anna.mouse.move(*_centre(anna, PLUS))
    anna.mouse.down()
    expect(anna.get_by_text("Olaf has control of this axis").first).to_be_visible()
    anna.mouse.up()
    assert not bench.moves()
    # Asked for, kept, asked for, given.
    button(anna, "Olaf has control").click()
    anna.get_by_role("menuitem", name="Ask for control").click()
    expect(olaf.get_by_text("Anna asks for control of X.")).to_be_visible()
    button(olaf, "Keep control").click()
    expect(anna.get_by_text("Olaf keeps control of X.")).to_be_visible()
    button(anna, "Olaf has control").click()
    anna.get_by_role("menuitem", name="Ask for control").click()
    button(olaf, "Hand over").click()
    expect(button(anna, "You have control")).to_be_visible()
    expect(anna.get_by_text("Olaf gave you control of X.")).to_be_visible()
    # Handed over for a time.
    button(anna, "You have control").click()
    anna.get_by_role("menuitem", name="For 5 min").first.click()
    button(olaf, "You have control").click()
    expect(olaf.get_by_text("Yours until")).to_be_visible()
    olaf.keyboard.press("Escape")
    # Taken by the administrator, with notice.
    button(anna, "Olaf has control").click()
    anna.get_by_role("menuitem", name="Take control now").click()
    expect(olaf.get_by_text("Anna took control of X from you.")).to_be_visible()
    expect(button(anna, "You have control")).to_be_visible()
    # Lost with the connection.
    anna.close()
    expect(button(olaf, "Control is free")).to_be_visible(timeout=2_500)


@pytest.mark.long
def test_a_viewer_moves_nothing_and_can_stop(opened: Open, bench: Bench) -> None:
    olaf = person(opened, bench, Role.OPERATOR)
    vera = person(opened, bench, Role.VIEWER)
    vera.mouse.move(*_centre(vera, PLUS))
    vera.mouse.down()
    expect(vera.get_by_text("Vera may not do this")).to_be_visible()
    vera.mouse.up()
    olaf.mouse.move(*_centre(olaf, PLUS))
    bench.press(olaf.mouse.down, olaf.mouse.up, says_no(olaf))
    vera.keyboard.press("Escape")
    bench.wait_standing()
    # Who stopped it is reported where it was moved from, and not on the page that pressed.
    expect(olaf.get_by_text("Vera pressed STOP.")).to_be_visible(timeout=REPORTED_MS)
    expect(vera.get_by_text("Vera pressed STOP.")).to_have_count(0)
    olaf.mouse.up()


# --- markup ---------------------------------------------------------------------------

MARKUP = "<img src=x onerror=alert(1)>"
#: What is alive if a text was mistaken for markup: elements that no page of ours has.
ALIVE = """() => [...document.querySelectorAll('img[src="x"], svg[onload], a[href^="javascript"]')]
                 .map((each) => each.outerHTML)"""
#: Pages, and whether one of the texts is to be read there.
PAGES = {
    "connect": True, "files": True, "audit": True, "people": True, "scope": False,
    "axis/{drive}/overview": True, "axis/{drive}/parameters": True, "axis/{drive}/motion": True,
    "axis/{drive}/alarms": True, "axis/{drive}/tune": True, "axis/{drive}/response": True,
    "axis/{drive}/gains": True, "axis/{drive}/setup": True, "axis/{drive}/io": True,
}  # fmt: skip


def write_markup_everywhere(station: Station, bench: Bench) -> None:
    """Into every free text of the interface, as somebody with all rights would."""
    quoted, ask = f"\"'>{MARKUP}", station.http
    drive = f"/drives/{bench.drive}"
    setup = {
        "traces": [],
        "maths": [{"id": "m1", "name": MARKUP, "unit": "<b>", "expression": "1"}],
    }
    kept: dict[str, Any] = {}
    for method, path, body in (
        ("PATCH", drive, {"name": MARKUP, "notes": quoted}),
        ("POST", f"{drive}/sets", {"file": "marked", "author": MARKUP, "notes": quoted}),
        (
            "POST",
            f"{drive}/reports",
            {"format": "html", "person": MARKUP, "machine": quoted, "notes": quoted},
        ),
        ("POST", "/accounts", {"name": MARKUP, "role": "viewer", "password": PASSWORD}),
        ("POST", "/bundles", {"reason": quoted}),
        ("PUT", "/scope/setups/marked", setup),
    ):
        kept[path] = station.ok(ask.request(method, path, json=body))
    entries = station.ok(ask.get("/library"))["entries"]
    entry = next(each["id"] for each in entries if each["kind"] == "set")
    station.ok(ask.patch(f"/library/{entry}", json={"notes": quoted, "tags": [MARKUP]}))
    # What is refused is quoted in the refusal, in the log and in the audit.
    ask.post("/session", json={"name": MARKUP, "password": MARKUP})
    ask.delete(f"/scope/setups/{MARKUP.replace(' ', '%20')}")


@pytest.mark.long
def test_markup_stays_text_on_every_page(opened: Open, station: Station, bench: Bench) -> None:
    write_markup_everywhere(station, bench)
    page = log_in(opened(""), Role.ADMINISTRATOR)
    spoken: list[str] = []

    def heard(dialog: Dialog) -> None:
        spoken.append(dialog.message)
        dialog.dismiss()

    page.on("dialog", heard)
    for address, shown in PAGES.items():
        where = address.format(drive=bench.drive)
        page.evaluate("(where) => { location.hash = '#/' + where }", where)
        page.get_by_role("heading", level=1).first.wait_for()
        if shown:
            expect(page.get_by_text(MARKUP).first).to_be_attached()
        assert page.evaluate(ALIVE) == [], address
    report = station.ok(station.http.get("/reports"))[0]["file"]
    page.goto(f"{station.url}/api/v1/reports/{report}")
    expect(page.get_by_text(MARKUP).first).to_be_attached()
    assert page.evaluate(ALIVE) == []
    # An address that is none opens the page all the same: a guest's place is followed by a click.
    page.goto(f"{station.url}/#/axis/%E0%A4%A/motion")
    expect(page.locator(".stop").first).to_be_visible()
    assert spoken == []


# --- a guest --------------------------------------------------------------------------


def invited(host: Page, opened: Open, bench: Bench, *allowed: str) -> Page:
    """A guest's page, on the motion page of the axis, come in by link and code."""
    host.evaluate("location.hash = '#/people'")
    host.get_by_label("Name of the guest").fill("Gert")
    for each in allowed:
        host.get_by_label(each, exact=True).first.check()
    button(host, "Create an invitation").click()
    reported = host.locator(".note.info")
    link = reported.locator(".mono").first.inner_text()
    code = reported.locator("strong.mono").inner_text()
    host.context.grant_permissions(["clipboard-read", "clipboard-write"])
    button(reported, "Copy").click()
    expect(button(reported, "Copied")).to_be_visible()
    assert host.evaluate("navigator.clipboard.readText()") == link
    guest = opened(link.split("/", 3)[3])
    guest.get_by_label("Code").fill(code.lower().replace("-", " "))
    button(guest, "Join").click()
    expect(guest.get_by_text("You are a guest of")).to_be_visible()
    open_axis(guest, bench.drive, "motion")
    guest.get_by_role("heading", level=1).wait_for()
    return guest


def end_visit(host: Page) -> None:
    button(host, "End the session").first.click()


@pytest.mark.long
def test_a_guest_looks_and_is_seen_and_nothing_more(opened: Open, bench: Bench) -> None:
    olaf = person(opened, bench, Role.OPERATOR)
    guest = invited(olaf, opened, bench)
    expect(guest.get_by_text("can change nothing")).to_be_visible()
    guest.mouse.move(*_centre(guest, PLUS))
    guest.mouse.down()
    expect(guest.get_by_text("a guest may not do this without a grant")).to_be_visible()
    guest.mouse.up()
    button(guest, "Control is free").click()
    expect(guest.get_by_text("may only view")).to_be_visible()
    assert not bench.moves()
    # The person on site goes where the guest is, and sees the guest's pointer there.
    olaf.get_by_role("link", name="Go to their page").click()
    guest.mouse.move(400, 400)
    guest.mouse.move(410, 420)
    pointer = olaf.locator(".pointer", has_text="Gert (guest)")
    expect(pointer).to_be_visible()
    # The pointer of before may still be drawn: it is followed until it is there.
    olaf.wait_for_function(
        """([x, y]) => {
            const box = document.querySelector('.pointer')?.getBoundingClientRect()
            return box && Math.abs(box.x - x) < 25 && Math.abs(box.y - y) < 25
        }""",
        arg=[410, 420],
    )
    # And the guest's cursor on the scope, at the same time of the samples, whatever is in sight.
    for page in (olaf, guest):
        page.evaluate("location.hash = '#/scope'")
    over = guest.locator(".time-plot .u-over")
    over.hover()
    guest.mouse.wheel(0, -1)  # stands still from here on, and shows another stretch
    over.hover()
    cursor = olaf.locator(".shared-cursor", has_text="Gert (guest)")
    expect(cursor).to_be_visible()
    guest.mouse.move(5, 5)  # where there is no plot
    expect(cursor).to_have_count(0)
    over.hover()
    expect(cursor).to_be_visible()
    # At the same moment of an X–Y plot, and on a spectrogram at the same frequency as well.
    button(guest, "Follow").click()
    for page in (olaf, guest):
        page.get_by_label("Time shown").select_option("60")
    for tab, plot in (("X–Y", ".xy-plot"), ("Spectrogram", ".heat-map")):
        for page in (olaf, guest):
            page.get_by_text(tab, exact=True).click()
        guest.locator(f"{plot} .over").hover()
        expect(olaf.locator(f"{plot} .shared-cursor.point")).to_be_visible()
        expect(olaf.locator(".time-plot .shared-cursor")).to_be_visible()
    # Chat stays text, whatever is in it.
    olaf.evaluate("location.hash = '#/people'")
    guest.evaluate("location.hash = '#/people'")
    guest.get_by_placeholder("Message to everybody here").fill(MARKUP)
    button(guest, "Send").click()
    expect(olaf.get_by_text(MARKUP)).to_be_visible()
    end_visit(olaf)
    expect(guest.get_by_role("heading", name="Log in")).to_be_visible(timeout=3_000)


def enable(olaf: Page) -> None:
    hold = olaf.get_by_role("button", name="Hold to let it move")
    box = hold.bounding_box()
    assert box is not None
    olaf.mouse.move(box["x"] + 20, box["y"] + 20)
    olaf.mouse.down()


def move_together(olaf: Page, guest: Page, bench: Bench) -> None:
    """Both hold their button until the axis moves. On a busy machine a page may fall silent for a
    moment, which rightly lets go; then they press again, as people do."""
    for _ in range(8):
        enable(olaf)
        guest.mouse.move(*_centre(guest, PLUS))
        guest.mouse.down()
        with contextlib.suppress(AssertionError):
            until(bench.moves, 5, "the axis moves")
            return
        guest.mouse.up()
        olaf.mouse.up()
    raise AssertionError("never did both hold for long enough")


def granted(olaf: Page, guest: Page) -> None:
    button(olaf, "Grant control").click()
    expect(guest.get_by_text("Not enabled from site")).to_be_visible()


def standstill_s(bench: Bench, let_go: Callable[[], None]) -> float:
    """Seconds from letting go to the first reading at standstill."""
    with OwnTime(with_children=True) as took:
        let_go()
        until(lambda: not bench.moves(), 30, "the axis stands")
    return took.s


def test_a_guest_moves_only_while_the_button_on_site_is_held(opened: Open, bench: Bench) -> None:
    olaf = person(opened, bench, Role.OPERATOR)
    guest = invited(olaf, opened, bench, "move")
    granted(olaf, guest)
    x, y = _centre(guest, PLUS)
    guest.mouse.move(x, y)
    guest.mouse.down()
    expect(guest.get_by_text("does not hold the enabling button")).to_be_visible(
        timeout=REPORTED_MS
    )
    guest.mouse.up()
    assert not bench.moves()
    times = []
    for _ in range(3):
        move_together(olaf, guest, bench)
        times.append(standstill_s(bench, olaf.mouse.up))
        assert bench.jog_job()["state"] != "running" or not bench.moves()
        guest.mouse.up()
        bench.wait_standing()
    print("standstill after letting go:", ", ".join(f"{t * 1e3:.0f} ms" for t in times))
    assert statistics.median(times) < STOPS_WITHIN_S
    end_visit(olaf)


@pytest.mark.long
def test_the_end_of_the_visit_stops_the_guest_at_once(opened: Open, bench: Bench) -> None:
    olaf = person(opened, bench, Role.OPERATOR)
    anna = person(opened, bench, Role.ADMINISTRATOR)
    guest = invited(olaf, opened, bench, "move")
    granted(olaf, guest)
    move_together(olaf, guest, bench)
    # Another person on site may end it too, while the button is still held.
    end_visit(anna)
    within(1, lambda: not bench.moves(), "the axis stands")
    expect(guest.get_by_role("heading", name="Log in")).to_be_visible(timeout=3_000)
    # The page loads again just now; its cookie is asked, not the page.
    again = guest.context.request.get(f"{bench.station.url}/api/v1/drives")
    assert again.status == 401
    guest.mouse.up()
    olaf.mouse.up()
    bench.wait_standing()


@pytest.mark.long
def test_a_page_on_site_that_goes_away_stops_the_guest(opened: Open, bench: Bench) -> None:
    olaf = person(opened, bench, Role.OPERATOR)
    guest = invited(olaf, opened, bench, "move")
    granted(olaf, guest)
    move_together(olaf, guest, bench)
    assert standstill_s(bench, olaf.context.close) < 2
    guest.mouse.up()
    bench.wait_standing()
    anna = person(opened, bench, Role.ADMINISTRATOR)
    end_visit(anna)


@pytest.mark.long
def test_a_guest_whose_browser_closes_stops_the_axis(opened: Open, bench: Bench) -> None:
    olaf = person(opened, bench, Role.OPERATOR)
    guest = invited(olaf, opened, bench, "move")
    granted(olaf, guest)
    move_together(olaf, guest, bench)
    assert standstill_s(bench, guest.context.close) < 2
    olaf.mouse.up()
    bench.wait_standing()
    end_visit(olaf)


@pytest.mark.long
def test_a_guest_who_may_only_look_can_stop(opened: Open, bench: Bench) -> None:
    olaf = person(opened, bench, Role.OPERATOR)
    guest = invited(olaf, opened, bench)
    open_axis(olaf, bench.drive, "motion")
    olaf.mouse.move(*_centre(olaf, PLUS))
    bench.press(olaf.mouse.down, olaf.mouse.up, says_no(olaf))
    guest.get_by_role("button", name="Stop all axes (Esc)").click()
    bench.wait_standing()
    expect(olaf.get_by_text("pressed STOP.")).to_be_visible(timeout=REPORTED_MS)
    olaf.mouse.up()
    button(olaf.locator(".stop-report"), "Close").click()
    end_visit(olaf)
