"""The check of pictures and quoted figures finds a page or a picture of another run."""

from __future__ import annotations

import importlib
import importlib.util
import json
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType

import pytest

FOLDERS = Path(__file__).resolve().parents[3] / ".ci"
#: SHA-256 of the bytes "abc" (FIPS 180-4, example of one block).
ABC = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
PAGE = """![a step](images/step.webp)

It settles in <span data-figure="settling">32 ms</span>;
in 中文 too: <span data-figure="settling">32</span> ms.
"""


def module(folder: str, name: str) -> ModuleType:
    sys.path.insert(0, str(FOLDERS / folder))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(FOLDERS / folder))


def program() -> ModuleType:
    """The program that makes the pictures, whose file has the name of every program."""
    file = FOLDERS / "pictures" / "__main__.py"
    spec = importlib.util.spec_from_file_location("pictures_program", file)
    assert spec is not None
    assert spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(file.parent))
    try:
        spec.loader.exec_module(loaded)
    finally:
        sys.path.remove(str(file.parent))
    return loaded


@pytest.fixture(scope="module")
def pictures() -> ModuleType:
    return module("docs", "pictures")


@pytest.fixture
def docs(pictures: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A page that quotes a figure and shows a picture, both of the run."""
    images = tmp_path / "images"
    images.mkdir()
    for name in ("ROOT", "DOCS"):
        monkeypatch.setattr(pictures.prose, name, tmp_path)
    monkeypatch.setattr(pictures, "IMAGES", images)
    monkeypatch.setattr(pictures, "FIGURES", images / "figures.json")
    monkeypatch.setattr(pictures, "README", tmp_path / "README")
    (images / "step.webp").write_bytes(b"abc")
    (tmp_path / "page.md").write_text(PAGE, "utf-8")
    run = {
        "run": {"id": "r1"},
        "pictures": {"step.webp": ABC},
        "figures": {"settling": {"value": 31.8, "unit": "ms", "text": "32"}},
    }
    (images / "figures.json").write_text(json.dumps(run), "utf-8")
    return tmp_path


def edited(page: str, new: str) -> Callable[[Path], object]:
    return lambda docs: (docs / "page.md").write_text(PAGE.replace(page, new), "utf-8")


def test_nothing_to_find(pictures: ModuleType, docs: Path) -> None:
    assert list(pictures.findings()) == []


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (edited(">32 ms<", ">33 ms<"), "settling is 32 ms, not 33 ms"),
        (edited(">32<", ">31<"), "settling is 32 ms, not 31"),
        (edited(">32 ms<", ">32 s<"), "settling is 32 ms, not 32 s"),
        (edited('"settling">32<', '"rise">32<'), "there is no figure “rise”"),
        (edited("32 ms</span>", "<b>32</b> ms</span>"), "not written as one span"),
        (edited("data-figure", "data-other"), "no page quotes “settling”"),
        (edited("![a step](images/step.webp)", ""), "no page shows this picture"),
        (lambda docs: (docs / "images" / "step.webp").write_bytes(b"abd"), "not the picture that"),
        (lambda docs: (docs / "images" / "step.webp").unlink(), "step.webp of run r1 is missing"),
        (lambda docs: (docs / "images" / "old.png").write_bytes(b""), "not made by run r1"),
        (lambda docs: (docs / "images" / "figures.json").unlink(), "cannot be read"),
        (lambda docs: (docs / "images" / "figures.json").write_text("{}"), "lacks 'run'"),
    ],
)
def test_what_is_not_of_the_run(
    pictures: ModuleType, docs: Path, change: Callable[[Path], object], found: str
) -> None:
    change(docs)
    findings = [finding.text for finding in pictures.findings()]
    assert len(findings) == 1, findings
    assert found in findings[0]


def test_a_chinese_page_shows_the_chinese_page(pictures: ModuleType, docs: Path) -> None:
    """Also where the English recording is there and the Chinese one was never made."""
    (docs / "zh").mkdir()
    page = docs / "zh" / "page.md"
    page.write_text("![阶跃](../images/step.webp)\n", "utf-8")
    (found,) = pictures.findings()
    assert (found.file, found.line) == (page, 1)
    assert "step.webp shows the English page" in found.text
    page.write_text("![阶跃](../images/step-zh.webp)\n", "utf-8")
    assert [one.text for one in pictures.prose.missing_pictures()] == [
        "there is no picture ../images/step-zh.webp"
    ]


def test_some_chapters_replace_their_pictures_alone(
    pictures: ModuleType, docs: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    made = tmp_path_factory.mktemp("made")
    (made / "jog-zh.webp").write_bytes(b"abc")
    (docs / "zh").mkdir()
    (docs / "zh" / "page.md").write_text("![点动](../images/jog-zh.webp)\n", "utf-8")
    assert [one.text for one in pictures.findings()] == []  # `missing_pictures` tells it
    assert list(pictures.prose.missing_pictures())
    run = program().publish_part(made, datetime.now(UTC), ["jog"])
    assert run.id == "r1"
    assert run.pictures == {"step.webp": ABC, "jog-zh.webp": ABC}
    assert list(pictures.findings()) == list(pictures.prose.missing_pictures()) == []
    (docs / "images" / "jog-zh.webp").write_bytes(b"of another run")
    assert "not the picture that" in next(pictures.findings()).text


def test_a_run_writes_its_figures_into_the_pages(pictures: ModuleType, docs: Path) -> None:
    run = pictures.load()
    run.figures["settling"]["text"] = "28"
    assert pictures.rewrite(run) == [docs / "page.md"]
    expected = PAGE.replace("32 ms", "28 ms").replace(">32<", ">28<")
    assert (docs / "page.md").read_text("utf-8") == expected


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (1.4987e-4, 2, "1.5·10⁻⁴"), (9.96e-5, 2, "1.0·10⁻⁴"), (0.039546, 3, "0.0395"),
        (49.7, 1, "50"), (126.4, 2, "130"), (6.94, 2, "6.9"), (0.97, 2, "0.97"), (0.0, 2, "0"),
        (-12.34, 3, "−12.3"), (0.9996, 2, "1.0"),
    ],
)  # fmt: skip
def test_figures_have_the_digits_that_repeat(value: float, digits: int, text: str) -> None:
    assert module("pictures", "readings").rounded(value, digits) == text


def test_what_is_not_finite_is_no_figure() -> None:
    with pytest.raises(ValueError, match="no figure"):
        module("pictures", "readings").Readings().add("lag", float("nan"), "rev", 3)
