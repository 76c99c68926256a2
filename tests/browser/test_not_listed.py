"""A drive that no profile is certain of: its maker's file, chosen on the page, makes it work."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from profiles import load_profile
from profiles.importer import export_eds
from tests.support.station import Station

pytestmark = pytest.mark.long

BENCH = """
[[axis]]
name = "Unknown"
drive = "generic402"
on = "canopen://virtual0"
station = 5

[[axis]]
name = "Z"
drive = "ds_c"
on = "canopen://virtual0"
station = 3
also_on = "modbus://virtual0"
also_station = 1
"""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    folder = Path(tmp_path_factory.mktemp("unknown"))
    (folder / "bench.toml").write_text(BENCH, "utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SERVODECK_PROFILES", str(folder / "mine"))
        patch.setenv("SERVODECK_CACHE", str(folder / "cache"))
        running = Station(folder, folder / "bench.toml")
        running.start()
        yield running
        running.stop()


def test_import_from_the_connect_page(laptop: Page, station: Station, tmp_path: Path) -> None:
    text = export_eds(load_profile("generic402"), datetime(2020, 1, 2), "nova.eds")
    text = text.replace("VendorName=any", "VendorName=Nova").replace("=CiA 402 drive", "=N-400")
    file = tmp_path / "nova.eds"
    file.write_text(text + "not a line of an EDS file\r\n", "utf-8")
    page = laptop
    page.get_by_role("button", name="canopen://virtual0").click()
    page.get_by_label("Stations").fill("5")
    page.get_by_role("button", name="Scan", exact=True).click()
    found = page.get_by_role("region", name="What was found").locator(".found").first
    found.get_by_role("button", name="Import its description").click()
    dialog = page.get_by_role("dialog")
    dialog.locator('input[type="file"]').set_input_files(file)
    dialog.get_by_label("Name of the new profile").fill("nova_page")
    dialog.get_by_role("button", name="Import", exact=True).click()
    expect(dialog).to_contain_text("Nova N-400")
    dialog.get_by_text("Irregularities").click()
    expect(dialog.get_by_role("listitem").first).to_be_visible()
    page.keyboard.press("Escape")
    expect(found.get_by_label("Profile")).to_have_value("nova_page")
    found.get_by_role("button", name="Connect", exact=True).click()
    expect(page.get_by_label("State of the drive")).to_contain_text("Switch on disabled")
    (drive,) = station.ok(station.http.get("/drives"))
    assert drive["profile"] == "nova_page"
    station.ok(station.http.delete(f"/drives/{drive['id']}"))


def test_the_missing_port_is_connected(laptop: Page, station: Station) -> None:
    drive = station.add(3, "canopen://virtual0", "ds_c", "Z")
    page = laptop
    page.get_by_text("Not connected over Modbus").click()
    card = page.locator(".bench-drive").first
    card.get_by_label("Bus URL").fill("modbus://virtual0")
    card.get_by_label("Station").fill("1")
    card.get_by_role("button", name="Connect Modbus too").click()
    expect(page.get_by_text("Not connected over Modbus")).to_have_count(0)
    ports = station.ok(station.http.get(f"/drives/{drive}"))["ports"]
    assert [port["kind"] for port in ports] == ["canopen", "modbus"]
    station.ok(station.http.delete(f"/drives/{drive}"))


def test_a_serial_line_offers_the_search(laptop: Page, tmp_path: Path) -> None:
    page = laptop
    search = page.get_by_role("button", name="Search baud rate and parity")
    page.get_by_label("Bus URL").first.fill("modbus://virtual0")
    expect(search).to_have_count(0)
    page.get_by_label("Bus URL").first.fill(f"modbus://{tmp_path}/nothing")
    search.click()
    expect(page.get_by_role("alert")).to_contain_text("there is no serial port")


def test_a_profile_is_saved_as_esi(laptop: Page) -> None:
    page = laptop
    page.get_by_text("Export a profile as EDS or ESI").click()
    panel = page.locator("details").filter(has_text="Export a profile as EDS or ESI")
    choice = panel.get_by_label("Profile")
    choice.select_option("ds_c")
    expect(panel.get_by_role("button", name="Export as EDS")).to_be_visible()
    expect(panel.get_by_role("button", name="Export as ESI")).to_have_count(0)
    choice.select_option("mms7")
    with page.expect_download() as saved:
        panel.get_by_role("button", name="Export as ESI").click()
    assert saved.value.suggested_filename == "mms7.xml"
    content = saved.value.path().read_text("utf-8")
    assert "<EtherCATInfo" in content
