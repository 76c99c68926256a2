"""Checks of texts: banned words, length of sentences, pictures that exist."""

from __future__ import annotations

import io
import re
import tokenize
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from terms import ROOT, Banned, Term, banned

DOCS = ROOT / "docs"
CATALOGUE = ROOT / "drivers" / "texts" / "catalogue"
PAGE_TEXTS = ROOT / "webui" / "src" / "i18n" / "texts"
#: Texts of the report in both languages, and Chinese ones in YAML (`--help`, profiles).
REPORT = ROOT / "backend" / "report" / "texts.py"
CHINESE = (ROOT / "drivers" / "texts" / "help.zh.yaml", *(ROOT / "profiles").glob("*/zh/*.yaml"))
#: Turns of phrase that comments, docstrings and pages must not use, and the plain word for each.
UNCLEAR = (
    ("anew", "again"), ("in words", "as text"), ("told apart", "distinguished"),
    ("tell apart", "distinguish"), ("tells apart", "distinguishes"), ("says why", "states why"),
    ("gives way", "yields"), ("is believed", "is trusted"), ("are believed", "are trusted"),
    ("borrowed", "changed temporarily"), ("nobody tells", "nothing states"),
    ("takes it back", "undoes it"), ("taken back", "undone"), ("by another door", "in another way"),
    ("beside a loop", "with a closed loop"), ("beside the loop", "with the loop closed"),
)  # fmt: skip
#: Where comments and docstrings are read.
CODE = ("backend", "drivers", "profiles", "benchmarks", "tests")
#: Words that a sentence may have outside of reference pages.
LONGEST = 30
#: Pages that are looked up and not read: their sentences may be longer.
REFERENCE = ("adr/", "architecture.md", "handover.md", "reference/", "security.md")


class Finding(NamedTuple):
    """What is wrong at a place."""

    file: Path
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.file.relative_to(ROOT)}:{self.line}: {self.text}"


class Line(NamedTuple):
    """A line of prose and where it is."""

    number: int
    text: str


def pages() -> list[Path]:
    """Every page of the documentation."""
    return sorted(DOCS.rglob("*.md"))


def prose(text: str) -> Iterator[Line]:
    """The lines of a page without code, neither in blocks nor inside a line, and without spans."""
    fence = ""
    for number, line in enumerate(text.splitlines(), 1):
        found = re.match(r"\s*(```+|~~~+)", line)
        if found:
            fence = "" if fence else found[1]
            continue
        if not fence:
            yield Line(number, re.sub(r"</?span[^>]*>", "", re.sub(r"`[^`]*`", "`code`", line)))


def words_in_pages(terms: Sequence[Term]) -> Iterator[Finding]:
    """Banned words in the documentation."""
    for page in pages():
        rules = banned(terms, chinese=page.is_relative_to(DOCS / "zh"))
        yield from _words(page, prose(page.read_text("utf-8")), rules)


def words_in_messages(terms: Sequence[Term]) -> Iterator[Finding]:
    """Banned words in the catalogue of messages, whose names are left out."""
    for file in sorted(CATALOGUE.rglob("*.ftl")):
        lines = (
            Line(number, re.sub(r"^\s*[\w.-]+ = |\{[^{}]*\}", "", line))
            for number, line in enumerate(file.read_text("utf-8").splitlines(), 1)
            if not line.startswith("#")
        )
        yield from _words(file, lines, banned(terms, chinese=file.name.endswith(".zh.ftl")))


def words_on_page(terms: Sequence[Term]) -> Iterator[Finding]:
    """Banned words in the texts of the page; English and Chinese stand in one file."""
    rules = [*banned(terms, chinese=False), *banned(terms, chinese=True)]
    for file in sorted(PAGE_TEXTS.rglob("*.ts")):
        lines = (
            Line(number, re.sub(r"^\s*(//|/?\*).*|^\s*'[^']+':", "", line))
            for number, line in enumerate(file.read_text("utf-8").splitlines(), 1)
        )
        yield from _words(file, lines, rules)


def words_elsewhere(terms: Sequence[Term]) -> Iterator[Finding]:
    """Banned words in the report and in the Chinese texts of `--help` and of the profiles."""
    chinese = banned(terms, chinese=True)
    for file, rules in [
        (REPORT, [*banned(terms, chinese=False), *chinese]),
        *((file, chinese) for file in sorted(CHINESE)),
    ]:
        lines = (Line(n, line) for n, line in enumerate(file.read_text("utf-8").splitlines(), 1))
        yield from _words(file, lines, rules)


def words_in_code() -> Iterator[Finding]:
    """`UNCLEAR` in comments and docstrings of Python modules and in English pages."""
    rules = [
        Banned(re.compile(rf"\b{re.escape(word)}\b", re.IGNORECASE), word, better)
        for word, better in UNCLEAR
    ]
    for folder in CODE:
        for file in sorted((ROOT / folder).rglob("*.py")):
            yield from _words(file, remarks(file.read_text("utf-8")), rules)
    for page in pages():
        if not page.is_relative_to(DOCS / "zh"):
            yield from _words(page, prose(page.read_text("utf-8")), rules)


def remarks(source: str) -> Iterator[Line]:
    """The lines of the comments and docstrings of a module, without quoted code."""
    before = tokenize.NEWLINE
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        alone = before in {tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}
        if token.type == tokenize.COMMENT or (token.type == tokenize.STRING and alone):
            for number, line in enumerate(token.string.splitlines(), token.start[0]):
                yield Line(number, re.sub(r"`[^`]*`", "`code`", line))
        if token.type not in {tokenize.COMMENT, tokenize.NL}:
            before = token.type


def _words(file: Path, lines: Iterable[Line], rules: Sequence[Banned]) -> Iterator[Finding]:
    for line in lines:
        for rule in rules:
            if rule.pattern.search(line.text):
                yield Finding(file, line.number, f"“{rule.word}”: write “{rule.better}”")


def long_texts() -> Iterator[Finding]:
    """Sentences of messages and of the page that are longer than `LONGEST` words."""
    for file in sorted(CATALOGUE.rglob("*.en.ftl")):
        for number, line in enumerate(file.read_text("utf-8").splitlines(), 1):
            text = re.sub(r"^\s*[\w.-]+ = ", "", re.sub(r"\{[^{}]*\}", "X", line))
            yield from _long(file, number, _split(text))
    for file in sorted(PAGE_TEXTS.rglob("*.ts")):
        for number, line in enumerate(file.read_text("utf-8").splitlines(), 1):
            for single, double in re.findall(r"'((?:[^'\\]|\\.)*)'|\"([^\"]*)\"", line):
                yield from _long(file, number, _split(single or double))


def _long(file: Path, line: int, found: Iterable[str]) -> Iterator[Finding]:
    for sentence in found:
        count = len(re.findall(r"[\w’'`{}–-]+", sentence))
        if count > LONGEST:
            yield Finding(file, line, f"{count} words in one sentence: {sentence[:60]}…")


def long_sentences() -> Iterator[Finding]:
    """Sentences of the read pages that are longer than `LONGEST` words."""
    for page in pages():
        name = page.relative_to(DOCS).as_posix()
        if name.startswith((*REFERENCE, "zh/")):
            continue
        for line, sentence in sentences(page.read_text("utf-8")):
            yield from _long(page, line, [sentence])


def sentences(text: str) -> Iterator[tuple[int, str]]:
    """The sentences of a page with the line at which their paragraph begins."""
    start, paragraph = 0, ""
    for line in [*prose(text), Line(0, "")]:
        bare = line.text.strip()
        alone = re.match(r"([-*] |\d+\. |#|!!!|\||!\[)", bare)
        if not bare or alone:
            yield from ((start, one) for one in _split(paragraph))
            paragraph = ""
        if bare.startswith("|"):
            yield from (
                (line.number, one) for cell in bare.split("|") for one in _split(cell.strip())
            )
        elif bare and not bare.startswith(("!!!", "![")):
            start = line.number if not paragraph else start
            paragraph += " " + re.sub(r"^([-*]|\d+\.|#+) ", "", bare)


def _split(paragraph: str) -> list[str]:
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", paragraph.strip())
    return [one for one in re.split(r"(?<=[.!?:;])\s+", plain) if one]


def english_titles() -> Iterator[Finding]:
    """Notes of Chinese pages without a Chinese title: the builder would write "Warning" there."""
    for page in sorted((DOCS / "zh").rglob("*.md")):
        for line in prose(page.read_text("utf-8")):
            if line.text.startswith("!!! ") and not re.search("[\u4e00-\u9fff]", line.text):
                yield Finding(page, line.number, "a note needs a Chinese title in quotes")


def missing_pictures() -> Iterator[Finding]:
    """Pictures that a page shows and that are no files."""
    for page in pages():
        for line in prose(page.read_text("utf-8")):
            for target in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", line.text):
                if not (page.parent / target).is_file():
                    yield Finding(page, line.number, f"there is no picture {target}")
