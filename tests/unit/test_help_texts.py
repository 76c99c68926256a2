"""Help of the command line in Chinese: whole, nothing left over, and printed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from backend.cli import COMMANDS, app, imported
from backend.commands.base.help_texts import chinese, plain
from drivers.texts.message import speaking


def _texts_of(command: Any) -> Iterator[str]:
    yield command.help or ""
    for option in (*command.params, command.get_help_option(typer.Context(command))):
        yield getattr(option, "help", None) or ""
    for below in getattr(command, "commands", {}).values():
        yield from _texts_of(below)


def _every_text() -> set[str]:
    found = {text for _, text in COMMANDS.values()}
    found |= set(_texts_of(typer.main.get_command(app)))
    for name, (where, _) in COMMANDS.items():
        found |= set(_texts_of(imported(name, where)))
    return {plain(text) for text in found if text}


def test_every_text_of_the_help_is_there_in_chinese_and_no_other() -> None:
    assert set(chinese()) == _every_text()


@pytest.mark.parametrize(
    "arguments", [["--language", "zh", "--help"], ["--language", "zh", "jog", "--help"]]
)
def test_help_is_printed_in_chinese(arguments: list[str]) -> None:
    with speaking("en"):
        printed = CliRunner().invoke(app, arguments)
        assert printed.exit_code == 0
        assert "轴会运动；按 Ctrl+C 停止。" in printed.output
        assert "Turn an axis" not in printed.output
        assert "选项" in printed.output


def test_help_is_english_elsewhere() -> None:
    with speaking("en"):
        assert "Turn an axis" in CliRunner().invoke(app, ["jog", "--help"]).output
