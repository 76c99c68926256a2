"""Commands of the tools, on a bus that the command opens or by a running server."""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Awaitable, Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from pydantic import ValidationError
from pydantic.fields import FieldInfo

from backend.api.station.models import DriveSummary
from backend.axes.axis.axis import Axis
from backend.commands.base.options import Json, Server
from backend.commands.base.printing import table
from backend.commands.base.remote import Remote
from backend.commands.base.session import progress
from backend.commands.measuring import measure
from backend.commands.measuring.measure import Answer
from backend.foundation.store.files import StorageFailed
from backend.tools.registry import BY_KIND
from backend.tools.tool import AnyTool, Option, Row, Run, ToolResult
from drivers.texts.message import language, text
from drivers.texts.validation import reason_of

_WHERE: dict[str, tuple[Any, object]] = {
    "url": (measure.Url, None),
    "station": (measure.Station, 1),
    "profile": (measure.Profile, None),
    "server": (Server, None),
    "axis": (measure.AxisName, None),
}
_OUTPUT: dict[str, tuple[Any, object]] = {"out": (measure.Out, None), "as_json": (Json, False)}


@dataclass(frozen=True)
class CommandExtras:
    """Additions to the command of a tool, beyond those that follow from its descriptor.

    ``options``: further options, or replacements for those of settings. ``settled`` returns the
    settings from the given options. ``here`` and ``there`` are called with the result, after a
    measurement by the command itself or by the server; ``lines`` returns additional lines of
    output.
    """

    options: Mapping[str, tuple[Any, object]]
    settled: Callable[[dict[str, Any]], dict[str, Any]]
    here: Callable[[Axis, Any, dict[str, Any]], Awaitable[None]]
    there: Callable[[Remote, DriveSummary, Answer, dict[str, Any]], Awaitable[None]]
    lines: Callable[[Any, dict[str, Any]], list[str]]


def command_of(tool: AnyTool, extras: CommandExtras | None = None) -> Callable[..., None]:
    """The command of a tool, with options for the drive, for each setting and for the output."""
    own = {**_WHERE, **dict(_options(tool)), **(extras.options if extras else {}), **_OUTPUT}

    def command(**given: Any) -> None:
        settings = _settings(tool, extras.settled(given) if extras else given)
        where = measure.Where(*(given[name] for name in _WHERE))
        # A file that cannot be written must not lose the result of a motion.
        failed: list[StorageFailed] = []

        async def here() -> dict[str, object]:
            if not tool.motion:
                async with measure.reading(where.url, where.station, where.profile) as axis:
                    found = await tool.run(Run(axis, None, progress(), recording=Path), settings)
                return dict(found.model_dump(mode="json"))
            if tool.pair:
                async with measure.exchanging_pair(
                    where.url, (where.station, settings.partner), where.profile, settings
                ) as (axis, partner, session):
                    pair = Run(axis, session, progress(), partner=partner)
                    found = await tool.run(pair, settings)
                return dict(found.model_dump(mode="json"))
            async with measure.exchanging(
                where.url,
                where.station,
                where.profile,
                settings.cycle_ms,
                settings.envelope,
                settings.consent,
                closes_loops=tool.closes_loops,
            ) as (axis, session):
                found = await tool.run(Run(axis, session, progress()), settings)
                if extras is not None:
                    try:
                        await extras.here(axis, found, given)
                    except StorageFailed as error:
                        failed.append(error)
            return dict(found.model_dump(mode="json"))

        async def there(at: Remote, drive: DriveSummary, answer: Answer) -> None:
            if extras is not None:
                try:
                    await extras.there(at, drive, answer, given)
                except StorageFailed as error:
                    failed.append(error)

        def lines(answer: Answer) -> list[str]:
            found = tool.result.model_validate(answer)
            more = extras.lines(found, given) if extras and not failed else []
            return lines_of(tool, found) + more

        measure.measure(
            where, tool.kind, here, settings.model_dump(mode="json"), given["out"], lines,
            as_json=given["as_json"], there=there, files=(given.get("table"),), failed=failed,
        )  # fmt: skip

    command.__name__, command.__doc__ = tool.kind, tool.text("help")
    # typer reads the options from the signature; the settings are defined once, in the tool.
    only = inspect.Parameter.KEYWORD_ONLY
    command.__dict__["__signature__"] = inspect.Signature(
        [
            inspect.Parameter(name, only, default=default, annotation=kind)
            for name, (kind, default) in own.items()
        ]
    )
    command.__annotations__ = {name: kind for name, (kind, _) in own.items()} | {"return": None}
    return command


def lines_of(tool: AnyTool, result: ToolResult) -> list[str]:
    """A result as lines of text."""
    section = tool.report(result.in_language(language()))
    lines = [tool.text(note.name, language(), note.values) for note in section.notes]
    lines += [
        f"{tool.text(row.name, language(), row.values)}: {_shown(row)}" for row in section.rows
    ]
    for grid in section.grids:
        lines += ["", *table(tool.cells(grid, language()))]
    return lines


def _shown(row: Row) -> str:
    if row.value is None:
        return text("command.cannot-be-known").words(language())
    shown = f"{row.value:.4g} {row.unit}".rstrip()
    if row.ci95 is None or None in row.ci95:
        return shown
    low, high = f"{row.ci95[0]:.4g}", f"{row.ci95[1]:.4g}"
    return text("command.value-between", value=shown, low=low, high=high).words(language())


def _options(tool: AnyTool) -> Iterator[tuple[str, tuple[Any, object]]]:
    """Each setting as an option; a pair of values as two options."""
    for name, field in tool.settings.model_fields.items():
        option = next((each for each in field.metadata if isinstance(each, Option)), Option())
        names = option.names or (f"--{name.replace('_', '-')}",)
        text = field.description or tool.text(f"field.{name}")
        default = option.default if field.is_required() else field.default
        kind = _kind(tool, name, field, pair=len(names) > 1)
        for number, flag in enumerate(names):
            key = name if len(names) == 1 else f"{name}_{number}"
            declared = f"{flag}/--no-{flag[2:]}" if kind is bool and default else flag
            yield key, (Annotated[kind, typer.Option(declared, help=text)], default)


def _kind(tool: AnyTool, name: str, field: FieldInfo, *, pair: bool) -> Any:
    """The type of an option: a choice, a number, a text or a switch."""
    kind = field.annotation
    if pair:
        return float | None
    if any(typing.get_origin(each) is Literal for each in (kind, *typing.get_args(kind))):
        return kind
    assert typing.get_origin(kind) in (None, types.UnionType), f"{tool.kind}: {name} has no option"
    return kind


def _settings(tool: AnyTool, given: dict[str, Any]) -> Any:
    """The settings from the given options.

    Raises:
        typer.BadParameter: a value is outside its limits, or one of a pair is missing.
    """
    values: dict[str, object] = {}
    for name, field in tool.settings.model_fields.items():
        option = next((each for each in field.metadata if isinstance(each, Option)), Option())
        if len(option.names) < 2:
            values[name] = given[name]
            continue
        ends = [given[f"{name}_{number}"] for number in range(len(option.names))]
        if None in ends and ends != [None, None]:
            both = text("command.give-both", first=option.names[0], second=option.names[1])
            raise typer.BadParameter(both.words(language()))
        values[name] = None if None in ends else tuple(ends)
    try:
        return tool.settings.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or tool.kind
        refused = text("input.refused", place=where, reason=reason_of(first))
        raise typer.BadParameter(refused.words(language())) from error


inertia = command_of(BY_KIND["inertia"])
sweep = command_of(BY_KIND["sweep"])
step = command_of(BY_KIND["step"])
brake_test = command_of(BY_KIND["brake-test"])
load_side = command_of(BY_KIND["load-side"])
gantry = command_of(BY_KIND["gantry"])
first_power = command_of(BY_KIND["first-power"])
safety_check = command_of(BY_KIND["safety-check"])
shaping = command_of(BY_KIND["shaping"])
vibration = command_of(BY_KIND["vibration"])
dwell = command_of(BY_KIND["dwell"])
cycle = command_of(BY_KIND["cycle"])
