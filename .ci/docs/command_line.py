"""The reference of the command line, from the definition that the program itself uses."""

from __future__ import annotations

from collections.abc import Iterator

import click
from typer.core import TyperGroup

from backend.cli import COMMANDS, imported

HEAD = """# Command reference

This page is generated from the definition of the commands. `servodeck COMMAND --help` prints the same.
[Command line](../command-line.md) explains bus URLs, running servers and exit codes.
"""


def page() -> str:
    """The whole page."""
    return "\n".join([HEAD, *_overview(), *_sections()])


def commands() -> dict[str, click.Command]:
    """Every command that can be called, by its words: ``params get`` and the like."""
    found: dict[str, click.Command] = {}
    for name, (where, _) in COMMANDS.items():
        command = imported(name, where)
        if isinstance(command, TyperGroup):
            found |= {f"{name} {inner}": one for inner, one in command.commands.items()}
        else:
            found[name] = command
    return found


def _overview() -> Iterator[str]:
    yield "| command | purpose |"
    yield "| --- | --- |"
    for name, (_, help_text) in COMMANDS.items():
        yield f"| `servodeck {name}` | {_cell(help_text)} |"
    yield ""


def _sections() -> Iterator[str]:
    for words, command in commands().items():
        yield f"## servodeck {words}\n"
        yield f"{_paragraphs(command.help or '')}\n"
        arguments = [p for p in command.params if isinstance(p, click.Argument)]
        options = [p for p in command.params if isinstance(p, click.Option)]
        names = " ".join(_argument(one) for one in arguments)
        yield f"```\nservodeck {words}{' ' if names else ''}{names}{' [OPTIONS]' if options else ''}\n```\n"
        if options:
            yield "| option | value | default | meaning |"
            yield "| --- | --- | --- | --- |"
            yield from (_option(one) for one in options)
            yield ""


def _argument(argument: click.Argument) -> str:
    name = (argument.metavar or argument.name or "").strip("[]{}.").upper()
    many = "…" if argument.nargs == -1 else ""
    return f"{name}{many}" if argument.required else f"[{name}{many}]"


def _option(option: click.Option) -> str:
    names = ", ".join(f"`{name}`" for name in (*option.opts, *option.secondary_opts))
    kind = option.type
    value = "" if option.is_flag else (
        " \\| ".join(map(str, kind.choices)) if isinstance(kind, click.Choice) else kind.name
    )  # fmt: skip
    default = "required" if option.required else _default(option)
    return f"| {names} | {value} | {default} | {_cell(option.help or '')} |"


def _default(option: click.Option) -> str:
    shown = option.default
    if shown is None or shown is False or callable(shown) or shown in ((), []):
        return ""
    return f"`{getattr(shown, 'value', shown)}`"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def _paragraphs(text: str) -> str:
    return "\n\n".join(" ".join(part.split()) for part in text.split("\n\n"))
