"""Every command and option that the documentation names exists."""

from __future__ import annotations

import re

import pytest
from typer.core import TyperGroup

from backend.cli import COMMANDS, imported
from tests.docs.pages import DOCS, named

PAGES = [page.relative_to(DOCS).as_posix() for page in sorted(DOCS.rglob("*.md"))]


def wrong(call: str) -> str | None:
    """What of a call does not exist; None where all of it does."""
    words = re.split(r"[\s\[\]]+", call)
    for name in words[0].split("|"):
        if name.startswith("-") or name.isupper():  # an option before the command; a placeholder
            continue
        if name not in COMMANDS:
            return f"there is no command {name}"
        command = imported(name, COMMANDS[name][0])
        known = {"--help"} | {opt for one in command.params for opt in options_of(one)}
        if isinstance(command, TyperGroup):
            inner = words[1].split("|") if len(words) > 1 else []
            for one in inner:
                if not re.fullmatch("[a-z-]+", one):
                    continue
                if one not in command.commands:
                    return f"{name} has no command {one}"
            chosen = [command.commands[one] for one in inner if one in command.commands]
            for each in chosen or command.commands.values():
                known |= {opt for one in each.params for opt in options_of(one)}
        for option in re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", call):
            if option not in known and "|" not in words[0]:
                return f"{name} has no option {option}"
    return None


def options_of(parameter: object) -> list[str]:
    return [*getattr(parameter, "opts", ()), *getattr(parameter, "secondary_opts", ())]


@pytest.mark.long(keep=39)
@pytest.mark.parametrize("page", PAGES)
def test_commands_of_a_page(page: str) -> None:
    bad = [
        f"{page}:{line} servodeck {call}: {problem}"
        for line, call in named(DOCS / page)
        if (problem := wrong(call))
    ]
    assert not bad, "\n".join(bad)


@pytest.mark.parametrize(
    ("call", "problem"),
    [
        ("scan ethercat://eth0 --json", None),
        ("params get|set BUS_URL", None),
        ("skan", "there is no command skan"),
        ("params fetch", "params has no command fetch"),
        ("jog BUS_URL --spede 3", "jog has no option --spede"),
    ],
)
def test_a_wrong_call_is_found(call: str, problem: str | None) -> None:
    assert wrong(call) == problem
