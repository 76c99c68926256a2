"""The checks of texts find what they are for, and the term base is whole."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

import pytest

CHECKS = Path(__file__).resolve().parents[3] / ".ci" / "docs"


@pytest.fixture(scope="module")
def terms() -> ModuleType:
    sys.path.insert(0, str(CHECKS))
    try:
        return importlib.import_module("terms")
    finally:
        sys.path.remove(str(CHECKS))


@pytest.fixture(scope="module")
def prose(terms: ModuleType) -> ModuleType:
    sys.path.insert(0, str(CHECKS))
    try:
        return importlib.import_module("prose")
    finally:
        sys.path.remove(str(CHECKS))


@pytest.fixture
def pages(prose: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("ROOT", "DOCS", "CATALOGUE", "PAGE_TEXTS"):
        monkeypatch.setattr(prose, name, tmp_path)
    return tmp_path


def test_terms_are_whole(terms: ModuleType) -> None:
    known = terms.load()
    assert len(known) >= 200
    assert all(term.zh and term.definition and term.source for term in known)
    assert all(any("一" <= sign <= "鿿" for sign in term.zh) for term in known)


def test_two_records_of_a_term_are_refused(terms: ModuleType, tmp_path: Path) -> None:
    record = "{en: gain, zh: 增益, definition: d, source: s}"
    file = tmp_path / "terms.yaml"
    file.write_text(f"A:\n- {record}\n- {record}\n", "utf-8")
    with pytest.raises(ValueError, match="two records of"):
        terms.load(file)


@pytest.mark.long(keep=4)
@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("Two set-points differ.", ["set-point"]),
        ("Set-Point", ["set-point"]),
        ("`set-point` is code.", []),
        ("```\nset-point\n```", []),
        ("A setpoint.", []),
    ],
)
def test_banned_words_in_pages(
    prose: ModuleType, terms: ModuleType, pages: Path, line: str, found: list[str]
) -> None:
    (pages / "page.md").write_text(line, "utf-8")
    texts = [finding.text for finding in prose.words_in_pages(terms.load())]
    assert [text.split("”")[0].strip("“") for text in texts] == found


def test_banned_words_in_messages_and_on_the_page(
    prose: ModuleType, terms: ModuleType, pages: Path
) -> None:
    (pages / "x.en.ftl").write_text(
        "a_set-point = ok\nb_c = the set-point { $set-point }\n", "utf-8"
    )
    (pages / "x.zh.ftl").write_text("b_c = 共振\n", "utf-8")
    (pages / "axis").mkdir()
    (pages / "axis/x.ts").write_text("  'bit.set-point': ['setpoint', '共振'],\n", "utf-8")
    assert [(one.file.name, one.line) for one in prose.words_in_messages(terms.load())] == [
        ("x.en.ftl", 2),
        ("x.zh.ftl", 1),
    ]
    assert [(one.file.name, one.line) for one in prose.words_on_page(terms.load())] == [("x.ts", 1)]


def test_banned_words_in_report_and_chinese_files(
    prose: ModuleType, terms: ModuleType, pages: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    report, overlay = pages / "texts.py", pages / "names.yaml"
    report.write_text('"ms": ("Greatest sensitivity Ms", "最大灵敏度 Ms"),\n', "utf-8")
    overlay.write_text('"Resonance": 谐振\n"Set-point": 共振\n', "utf-8")
    monkeypatch.setattr(prose, "REPORT", report)
    monkeypatch.setattr(prose, "CHINESE", (overlay,))
    found = [(one.file.name, one.line) for one in prose.words_elsewhere(terms.load())]
    assert found == [("texts.py", 1), ("names.yaml", 2)]


def test_unclear_words_in_comments_docstrings_and_pages(
    prose: ModuleType, pages: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(prose, "CODE", (".",))
    (pages / "module.py").write_text(
        '"""Made anew."""\n\nx = f("made anew")  # read anew\n# `anew` and renewed\n', "utf-8"
    )
    (pages / "page.md").write_text("Read it anew.\n\n`anew`\n", "utf-8")
    found = [(one.file.name, one.line) for one in prose.words_in_code()]
    assert found == [("module.py", 1), ("module.py", 3), ("page.md", 1)]


@pytest.mark.parametrize(("words", "count"), [(30, 0), (31, 1)])
def test_long_sentences(prose: ModuleType, pages: Path, words: int, count: int) -> None:
    sentence = " ".join(["word"] * words)
    (pages / "page.md").write_text(f"Short.\n\n- {sentence}.\n  Next.\n", "utf-8")
    (pages / "x.en.ftl").write_text(f"a_b = {sentence}\n", "utf-8")
    (pages / "axis").mkdir()
    (pages / "axis/x.ts").write_text(f"  'a.b': ['{sentence}', '短'],\n", "utf-8")
    assert len(list(prose.long_sentences())) == count
    assert len(list(prose.long_texts())) == 2 * count


def test_missing_pictures(prose: ModuleType, pages: Path) -> None:
    (pages / "there.png").write_bytes(b"")
    (pages / "page.md").write_text("![a](there.png)\n\n![b](gone.png)\n", "utf-8")
    assert [finding.line for finding in prose.missing_pictures()] == [3]


def test_notes_of_chinese_pages_have_chinese_titles(prose: ModuleType, pages: Path) -> None:
    (pages / "zh").mkdir()
    (pages / "page.md").write_text("!!! warning\n    Text.\n", "utf-8")
    (pages / "zh" / "page.md").write_text(
        '!!! warning "警告：轴"\n    文字。\n\n!!! danger\n    文字。\n', "utf-8"
    )
    assert [(one.file.parent.name, one.line) for one in prose.english_titles()] == [("zh", 4)]


def test_the_page_has_texts_where_they_are_looked_for(prose: ModuleType) -> None:
    """A move of the files would otherwise end their checks unnoticed."""
    assert len(list(prose.PAGE_TEXTS.rglob("*.ts"))) > 10
