"""Texts of ``--help`` in the language of the user."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import typer
import yaml
from typer import rich_utils
from typer.core import TyperCommand, TyperGroup

import drivers.texts

FILE = Path(drivers.texts.__file__).with_name("help.zh.yaml")


@cache
def chinese() -> dict[str, str]:
    """The Chinese texts, by the English text with single spaces."""
    texts: dict[str, str] = yaml.safe_load(FILE.read_text("utf-8"))
    return texts


def plain(text: str) -> str:
    """A text with single spaces, as it is a key in the file."""
    return " ".join(text.split())


def translate(command: TyperCommand | TyperGroup) -> None:
    """Replace the help of a command, its options and its subcommands by the Chinese texts.

    A text that is not in the file stays as it is.
    """
    texts = chinese()
    if command.help:
        command.help = command.short_help = texts.get(plain(command.help), command.help)
    ending = command.get_help_option(typer.Context(command))
    for option in (*command.params, ending):
        text = getattr(option, "help", None)
        if text:
            option.help = texts.get(plain(text), text)  # type: ignore[union-attr]
    for below in getattr(command, "commands", {}).values():
        translate(below)
    rich_utils.OPTIONS_PANEL_TITLE = "选项"
    rich_utils.ARGUMENTS_PANEL_TITLE = "参数"
    rich_utils.COMMANDS_PANEL_TITLE = "命令"
