"""The reference of the command line, from the definition that the program itself uses."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from typer.core import TyperArgument, TyperCommand, TyperGroup, TyperOption

from backend.cli import COMMANDS, imported

_KINDS = {int: "integer", float: "number", str: "text", Path: "path"}

HEAD = """# Command reference

This page is generated from the definition of the commands.
`servodeck COMMAND --help` prints the same.
[Command line](../command-line.md) explains bus URLs, running servers and exit codes.
"""


def page() -> str:
    """The whole page."""
    return "\n".join([HEAD, *_overview(), *_sections()])


def commands() -> dict[str, TyperCommand]:
    """Every command that can be called, by its words: ``params get`` and the like."""
    found: dict[str, TyperCommand] = {}
    for name, (where, _) in COMMANDS.items():
        command = imported(name, where)
        if isinstance(command, TyperGroup):
            for inner, one in command.commands.items():
                assert isinstance(one, TyperCommand)
                found[f"{name} {inner}"] = one
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
        arguments = [p for p in command.params if isinstance(p, TyperArgument)]
        options = [p for p in command.params if isinstance(p, TyperOption)]
        names = " ".join(_argument(one) for one in arguments)
        usage = " ".join(filter(None, ["servodeck", words, names, "[OPTIONS]" if options else ""]))
        yield f"```\n{usage}\n```\n"
        if options:
            yield "| option | value | default | meaning |"
            yield "| --- | --- | --- | --- |"
            yield from (_option(one) for one in options)
            yield ""


def _argument(argument: TyperArgument) -> str:
    name = (argument.metavar or argument.name or "").strip("[]{}.").upper()
    many = "…" if argument.nargs == -1 else ""
    return f"{name}{many}" if argument.required else f"[{name}{many}]"


def _option(option: TyperOption) -> str:
    names = ", ".join(f"`{name}`" for name in (*option.opts, *option.secondary_opts))
    value = "" if option.is_flag else _kind(option.type_descriptor.annotation)
    default = "required" if option.required else _default(option)
    return f"| {names} | {value} | {default} | {_cell(option.help or '')} |"


def _kind(annotation: Any) -> str:
    """What is to be given for an option; the words of a choice."""
    if get_origin(annotation) is Literal:
        return " \\| ".join(get_args(annotation))
    inner = [one for one in get_args(annotation) if one is not NoneType]
    if inner:
        return f"{_kind(inner[0])}…" if get_origin(annotation) is list else _kind(inner[0])
    if issubclass(annotation, Enum):
        return " \\| ".join(str(one.value) for one in annotation)
    return _KINDS.get(annotation) or str(annotation.__name__)


def _default(option: TyperOption) -> str:
    shown = option.default
    if shown is None or shown is False or callable(shown) or shown in ((), []):
        return ""
    return f"`{getattr(shown, 'value', shown)}`"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def _paragraphs(text: str) -> str:
    return "\n\n".join(" ".join(part.split()) for part in text.split("\n\n"))
