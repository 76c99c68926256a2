"""Findings of an import on the command line, in English and in Chinese."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from importer_samples import ODD_EDS, with_object
from typer.testing import CliRunner

from backend.cli import app
from drivers.texts.imports import finding_line
from drivers.texts.message import Language, speaking
from profiles.importer import import_file

ODDITIES = (
    "orphan", "point", "zeros", "modules", "limits", "no_limits", "suffix", "unknown_type",
    "count", "sign", "no_type",
)  # fmt: skip
#: Three English words after one another; names of fields, types and objects are single ones.
_SENTENCE = re.compile(r"\b[a-z]{2,} [a-z]+ [a-z]{2,}\b")


def odd(name: str) -> str:
    """An oddity with objects of its own, so that several fit in one file."""
    return re.sub(r"(?m)^\[210([0aA])", f"[2{1 + ODDITIES.index(name):02X}\\g<1>", ODD_EDS[name])


def odd_file() -> bytes:
    """A file with all of them."""
    text = "".join(odd(name) for name in ODDITIES)
    return with_object(text.replace("[ManufacturerObjects]", "[OptionalObjects]"))


def printed(folder: Path, language: Language) -> list[str]:
    """What the command prints of each finding."""
    source = folder / "odd.eds"
    source.write_bytes(odd_file())
    with speaking(language):
        arguments = ["--language", language, "profile", "import", str(source)]
        done = CliRunner().invoke(app, [*arguments, "--folder", str(folder / language)])
    assert done.exit_code == 0, done.output
    return done.output.splitlines()


def test_each_language_has_every_finding_and_no_words_of_the_other(tmp_path: Path) -> None:
    report = import_file(odd_file(), "odd.eds").report
    assert len(report.findings) > len(ODDITIES)
    assert len({each.code for each in report.findings}) >= len(ODDITIES)
    for language in ("en", "zh"):
        lines = printed(tmp_path, language)
        expected = [f"  {finding_line(each).words(language)}" for each in report.findings]
        assert lines[: len(expected)] == expected
        for line in lines[:-1] if language == "zh" else []:
            assert re.search(r"[\u4e00-\u9fff]", line), line
            assert not _SENTENCE.search(line), line
        if language == "en":
            assert not re.search(r"[\u3000-\u9fff]", "".join(lines))


@pytest.mark.parametrize(
    ("data", "english", "chinese"),
    [
        (b"<EtherCATInfo>", "odd.eds is not well-formed XML", "odd.eds 不是格式正确的 XML"),
        (b"%PDF-1.7", "odd.eds is a PDF document", "odd.eds 是 PDF 文档"),
        (b"", "odd.eds describes no objects", "odd.eds 没有描述任何对象"),
    ],
)
def test_a_refused_file_is_refused_in_either_language(
    tmp_path: Path, data: bytes, english: str, chinese: str
) -> None:
    source = tmp_path / "odd.eds"
    source.write_bytes(data)
    for language, words in (("en", english), ("zh", chinese)):
        with speaking("en"):
            done = CliRunner().invoke(
                app, ["--language", language, "profile", "import", str(source)]
            )
        assert done.exit_code == 1
        assert words in done.stderr
