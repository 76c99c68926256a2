"""The first start of a station in the cabinet, in a browser: code, administrator, name, ports."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from backend.api.station.box import routes
from backend.foundation.people.station import People
from backend.station.install.box.kept import Box, read
from drivers.computer.network.interfaces import Interface
from tests.browser.conftest import HERE, LAPTOP, PATIENCE_MS
from tests.support.guarded import CHEAP, PASSWORD
from tests.support.station import Station

pytestmark = pytest.mark.long

PORTS = [
    Interface("eth0", up=True, is_wired=True, is_can=False),
    Interface("eth1", up=True, is_wired=True, is_can=False),
]


@pytest.fixture
def people(tmp_path: Path) -> People:
    return People(tmp_path / "state", accounts_needed=True, passwords=CHEAP)


@pytest.fixture
def station(tmp_path: Path, people: People, monkeypatch: pytest.MonkeyPatch) -> Iterator[Station]:
    monkeypatch.setattr(routes, "network_interfaces", lambda: PORTS)
    monkeypatch.setattr(routes, "port_of", lambda _address: "eth0")
    running = Station(tmp_path, HERE / "bench.toml", people=people)
    running.start()
    yield running
    running.stop()


@pytest.fixture
def page(browser: Browser, station: Station) -> Iterator[Page]:
    context = browser.new_context(locale="en", **LAPTOP)  # type: ignore[arg-type]
    opened = context.new_page()
    opened.set_default_timeout(PATIENCE_MS)
    defects: list[str] = []
    opened.on("pageerror", lambda error: defects.append(str(error)))
    opened.goto(station.url)
    yield opened
    context.close()
    assert defects == []


def test_from_the_code_to_the_roles(page: Page, people: People, station: Station) -> None:
    page.get_by_label("Code").fill(people.accounts.setup_code)
    page.get_by_label("Name").fill("Anna")
    page.get_by_role("textbox", name="New password", exact=True).fill(PASSWORD)
    page.get_by_role("textbox", name="New password again").fill(PASSWORD)
    page.locator("form button[type=submit]").click()

    panel = page.locator("section", has=page.get_by_role("heading", name="This station"))
    expect(panel).to_contain_text("choose the network ports of the drives")
    office = panel.get_by_label("Port of the office")
    expect(office).to_have_value("eth0")
    panel.get_by_label("Name in the network").fill("Cabinet-3")
    panel.get_by_label("Port of the drives").select_option("eth0")
    panel.get_by_role("button", name="Save").click()
    expect(panel).to_contain_text("eth0 cannot be both the EtherCAT port and the office port")
    assert read(station.folder / "state") is None

    panel.get_by_label("Port of the drives").select_option("eth1")
    panel.get_by_role("button", name="Save").click()
    expect(panel).to_contain_text("cabinet-3: EtherCAT on eth1, office on eth0.")
    assert read(station.folder / "state") == Box("cabinet-3", "eth1", "eth0")
    expect(panel.get_by_label("Name in the network")).to_have_count(0)

    panel.get_by_role("button", name="Change").click()
    expect(panel.get_by_label("Name in the network")).to_have_value("cabinet-3")
