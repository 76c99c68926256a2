"""Limits of errors are codes and facts where they have words, and have both languages."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from backend.api.messages.errors import problem_of
from drivers.errors import DriveError, OutOfRange
from drivers.ethercat.process.protocol import error_from_wire, error_to_wire
from drivers.texts import limits
from drivers.texts.message import Text, speaking, text

ROOT = Path(__file__).parents[2]
#: Words of a bare limit that have no language: units, names of objects and of other programs.
NAMES = set(
    re.findall(
        r"\w+",
        "rev rpm rad deg rated percent permille ms kbit status html pdf sqlite "
        "postgresql localhost ethercat canopen virtual slcan baudrate parity stopbits "
        "timeout_ms silence_us retries none ff at_enable energises forget",
    )
)
CASES = [
    (limits.at_least(1500.0, "rpm/s"), "at least 1500 rpm/s", "至少 1500 rpm/s"),
    (limits.at_least(3), "at least 3", "至少 3"),
    (limits.below(62.5, "Hz"), "below 62.5 Hz", "低于 62.5 Hz"),
    (limits.between(60, 86400, "s"), "60 to 86400 s", "60 至 86400 s"),
    (limits.between(1, 9), "1 to 9", "1 至 9"),
    (limits.size(67108864), "67108864 bytes", "67108864 字节"),
    (limits.stays_free(256 << 20), "256 MiB stay free", "保留 256 MiB 空闲"),
    (limits.from_start("20 mm"), "20 mm from the start", "距起点 20 mm"),
]


@pytest.mark.parametrize(("limit", "english", "chinese"), CASES)
def test_a_limit_has_words_in_both_languages(limit: Text, english: str, chinese: str) -> None:
    error = OutOfRange("axis.detail", drive="X", value=1, limit=limit, name="speed")
    assert error.limit == english
    for language, words in (("en", english), ("zh", chinese)):
        with speaking(language):
            problem = problem_of(error)
        assert problem.limit == words
        assert problem.limit_message is not None
        assert Text.from_wire(problem.limit_message.model_dump()) == limit


def test_a_limit_comes_out_of_the_bus_process_as_it_went_in() -> None:
    for limit in (limits.below(62.5, "Hz"), "1…247", None):
        error = OutOfRange(text("drive.interrupted"), limit=limit)
        found = error_from_wire(error_to_wire(error))
        assert found.limit_text == error.limit_text


def test_what_is_within_a_limit_is_advised_where_no_nearer_remedy_is_known() -> None:
    advised = DriveError(text("drive.interrupted"), limit=limits.above_zero()).advice_text
    assert advised is not None
    assert "限值" in advised.words("zh")


def _constants(node: ast.expr) -> Iterator[str]:
    match node:
        case ast.Constant(value=str(words)):
            yield words
        case ast.JoinedStr(values=parts):
            for part in parts:
                if isinstance(part, ast.Constant):
                    yield str(part.value)
        case ast.BinOp(left=left, right=right):
            yield from _constants(left)
            yield from _constants(right)
        case ast.IfExp(body=body, orelse=orelse):
            yield from _constants(body)
            yield from _constants(orelse)
        case ast.BoolOp(values=values):
            for each in values:
                yield from _constants(each)


def test_no_limit_is_an_english_phrase() -> None:
    found = []
    for file in [*(ROOT / "backend").rglob("*.py"), *(ROOT / "drivers").rglob("*.py")]:
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            for each in node.keywords:
                if each.arg != "limit":
                    continue
                words = re.findall(r"[A-Za-z_]{2,}", " ".join(_constants(each.value)))
                if any(word.islower() and word not in NAMES for word in words):
                    found.append(f"{file.relative_to(ROOT)}:{node.lineno}: {ast.unparse(each)}")
    assert not found, "make a message of it (drivers/texts/limits.py):\n" + "\n".join(found)
