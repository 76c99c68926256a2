"""The real page in a real browser, against the real server and virtual drives."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import (
    Browser,
    BrowserContext,
    Page,
    Playwright,
    expect,
    sync_playwright,
)

from tests.browser.cable import Cable
from tests.browser.driving import Bench
from tests.support.station import Station

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
FLAGS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
]  # fmt: skip
#: For what must appear: the tests run next to others, on a computer that has no time to spare. What
#: must be reported soon is waited for with `driving.SHOWN_MS`.
PATIENCE_MS = 15_000
#: A wide and a narrow screen with a finger, as in the field.
LAPTOP = {"viewport": {"width": 1280, "height": 800}}
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.browser)


@pytest.fixture(scope="session")
def playwright() -> Iterator[Playwright]:
    """One for all tests: a second one in the same process is refused."""
    expect.set_options(timeout=PATIENCE_MS)
    with sync_playwright() as running:
        yield running


@pytest.fixture(scope="session")
def browser(playwright: Playwright) -> Iterator[Browser]:
    program = shutil.which("chromium") or "/usr/bin/chromium"
    assert Path(program).is_file(), "Chromium is missing: run .ci/run, which installs it"
    built = ROOT / "webui" / "dist" / "index.html"
    assert built.is_file(), "the page is not built: run `make page`"
    running = playwright.chromium.launch(executable_path=program, args=FLAGS)
    yield running
    running.close()


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    running = Station(Path(tmp_path_factory.mktemp("station")), HERE / "bench.toml")
    running.start()
    yield running
    running.stop()


@pytest.fixture
def cable(station: Station) -> Iterator[Cable]:
    """The network between page and server, which a test may cut."""
    laid = Cable(station.port)
    yield laid
    laid.close()


@pytest.fixture
def x(station: Station) -> Iterator[str]:
    """The drive at station 1, on the bench."""
    drive = station.add(1, name="X")
    yield drive
    station.remove(drive)


def _open(browser: Browser, url: str, **screen: object) -> Iterator[Page]:
    context: BrowserContext = browser.new_context(locale="en", **screen)  # type: ignore[arg-type]
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    defects: list[str] = []
    page.on("pageerror", lambda error: defects.append(str(error)))
    page.on(
        "console",
        lambda message: (
            defects.append(message.text)
            if "Content Security Policy" in message.text or "Warning:" in message.text
            else None
        ),
    )
    page.goto(url)
    yield page
    context.close()
    assert defects == []


@pytest.fixture
def laptop(browser: Browser, cable: Cable) -> Iterator[Page]:
    yield from _open(browser, cable.url, **LAPTOP)


@pytest.fixture
def phone(browser: Browser, cable: Cable) -> Iterator[Page]:
    yield from _open(browser, cable.url, **PHONE)


@pytest.fixture
def bench(station: Station, x: str) -> Bench:
    """What the drive really does, asked past the page."""
    return Bench(station, x)
