"""The built documentation is read and searched as files, without a server and a network."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = Path(tmp_path_factory.mktemp("site"))
    # mkdocs fails on links, anchors and pages outside of the navigation.
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "-q", "-d", str(folder)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    context = browser.new_context(offline=True, viewport={"width": 1280, "height": 800})
    yield context.new_page()
    context.close()


@pytest.mark.long
@pytest.mark.parametrize(
    ("words", "found"),
    [("holding brake", "brake-test.html"), ("working counter", "ethercat.html"), ("抱闸", "zh/")],
)
def test_search_finds_pages_of_files(site: Path, page: Page, words: str, found: str) -> None:
    page.goto((site / "index.html").as_uri())
    field = page.get_by_role("textbox", name="Search")
    field.fill(words)
    # The search reads its field when a key is released, as a person's last one is.
    field.press("End")
    results = page.locator(".md-search-result__list a")
    expect(results.first).to_be_visible()
    addresses = [each.get_attribute("href") or "" for each in results.all()]
    assert any(found in address for address in addresses), addresses


def test_every_page_is_in_the_index_and_asks_nothing_of_the_internet(site: Path) -> None:
    index = (site / "search" / "search_index.json").read_text("utf-8")
    for file in sorted(site.rglob("*.html")):
        name = file.relative_to(site).as_posix()
        text = file.read_text("utf-8")
        loaded = re.findall(
            r'<(?:script|img|link|iframe)\b[^>]*?(?:src|href)="(https?:[^"]+)"', text
        )
        assert [each for each in loaded if "canonical" not in each] == [], name
        if name != "404.html":
            assert f'"location":"{name}' in index, name
