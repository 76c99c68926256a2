"""What the page translates of the server's words is what the server says."""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TEXTS = ROOT / "webui" / "src" / "i18n" / "texts"
#: Where jobs get their titles and steps, and interfaces their problems.
SOURCES = ("backend", "drivers")


def _words(node: ast.AST) -> str | None:
    """A string with ``{}`` for whatever is put in."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(
            str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values
        )
    return None


def _said() -> set[str]:
    found: set[str] = set()
    for file in (file for folder in SOURCES for file in (ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text())):
            if (words := _words(node)) is not None:
                found |= {words, *words.split(": "), *re.split(": |; ", words)}
    # What the catalogue says reaches the page as a sentence still where a message is part of a
    # state or of a result.
    for file in (ROOT / "drivers" / "texts" / "catalogue").rglob("*.en.ftl"):
        for line in file.read_text("utf-8").splitlines():
            words = re.sub(r"\{[^{}]*\$[^{}]*\}", "{}", line.partition(" = ")[2] or line)
            words = re.sub(r"^ \}", "{}", words)  # the end of a selection
            found |= {words, *words.split(": "), *re.split(": |; ", words)}
    return found


def test_every_translated_sentence_is_one_of_the_servers() -> None:
    source = "".join(file.read_text() for file in sorted(TEXTS.glob("said*.ts")))
    texts = re.findall(r"""'said\.\w+':\s*\[\s*(?:'([^']*)'|"([^"]*)"),""", source)
    assert len(texts) == source.count("'said.")
    # "3 of 6" stands in the server's words with its number.
    said = {re.sub(r"^\d of 6$", "{} of 6", words) for words in _said()}
    translated = {re.sub(r"\{\w+\}", "{}", one or other) for one, other in texts}
    assert translated - said == set()
