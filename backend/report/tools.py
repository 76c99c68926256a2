"""Blocks of a report for results of tools, from the section that each tool provides."""

from __future__ import annotations

from itertools import cycle

from pydantic import ValidationError

from backend.records.library.measurements import BadMeasurement
from backend.report.document import Block, Figure, Note, Table
from backend.report.render.plot import Curve, Plot
from backend.report.texts import Words
from backend.tools.measuring.numbers import NONE, significant
from backend.tools.registry import BY_KIND
from backend.tools.tool import AnyTool, Chart, Grid, Interval, Section, ToolResult
from backend.tools.tool import Note as ToolNote
from backend.tools.tuning.autotune.result import VerdictInfo
from drivers.texts.validation import refusal_of

_COLORS = ("#1a5c94", "#c2571a")


def kind_title(kind: str, words: Words) -> str:
    """Title of a kind of measurement."""
    tool = BY_KIND.get(kind)
    return words(f"kind.{kind}") if tool is None else tool.text("title", words.language)


def result_of(tool: object, result: dict[str, object]) -> ToolResult:
    """The result of a tool, by the kind that its measurements state.

    Raises:
        BadMeasurement: no such tool, or not a result of that tool.
    """
    known = BY_KIND.get(str(tool))
    if known is None:
        raise BadMeasurement("report.report-cannot-show-measures", value=str(tool), tool=str(tool))
    try:
        found: ToolResult = known.result.model_validate(result)
    except ValidationError as error:
        raise BadMeasurement(
            "report.result-not-complete", tool=str(tool), cause=refusal_of(error.errors()[0])
        ) from error
    return found


def verdict_of(kept: object) -> VerdictInfo | None:
    """The verdict that autotuning stored with its measurement; None where there is none.

    Raises:
        BadMeasurement: not a verdict of autotuning.
    """
    if kept is None:
        return None
    try:
        return VerdictInfo.model_validate(kept)
    except ValidationError as error:
        raise BadMeasurement(
            "report.result-not-complete", tool="autotune", cause=refusal_of(error.errors()[0])
        ) from error


def tool_blocks(result: ToolResult, words: Words) -> list[Block]:
    """Notes, parameters with their intervals, tables and charts."""
    tool = BY_KIND[result.tool]
    section: Section = tool.report(result.in_language(words.language))
    blocks: list[Block] = [note_of(tool, each, words) for each in section.notes]
    if section.rows:
        head = (words("quantity"), words("value"), words("interval"))
        rows = tuple(
            (
                tool.text(row.name, words.language, row.values),
                significant(row.value, row.unit, 3),
                _interval(row.ci95),
            )
            for row in section.rows
        )
        blocks.append(Table(head, rows, (False, True, True)))
    blocks += [grid_table(tool, each, words) for each in section.grids]
    for chart in section.charts:
        title = tool.text(chart.name, words.language)
        blocks.append(Figure((_plot(tool, chart, words),), title))
    return blocks


def grid_table(tool: AnyTool, grid: Grid, words: Words) -> Table:
    """A table of a tool as a table of the report."""
    head, *rows = tool.cells(grid, words.language)
    return Table(head, tuple(rows), (False, *(True,) * (len(head) - 1)))


def tool_verdict(kind: str, result: ToolResult, words: Words) -> Note:
    """The first note of the tool's section, preceded by the title of the measurement."""
    tool = BY_KIND[result.tool]
    first = note_of(tool, tool.report(result.in_language(words.language)).notes[0], words)
    return Note(f"{kind_title(kind, words)}: {first.text}", first.tone)


def note_of(tool: AnyTool, note: ToolNote, words: Words) -> Note:
    """A note of a tool as a note of the report."""
    return Note(tool.text(note.name, words.language, note.values), note.tone)


def _plot(tool: AnyTool, chart: Chart, words: Words) -> Plot:
    def text(name: str) -> str:
        return tool.text(name, words.language)

    curves = tuple(
        Curve(text(line.name), color, line.x, line.y, line.spread)
        for line, color in zip(chart.lines, cycle(_COLORS), strict=False)
    )
    xs = [x for line in chart.lines for x in line.x] or [0.0, 1.0]
    return Plot("", text(chart.x_name), text(chart.y_name), curves, (min(xs), max(xs)))


def _interval(found: Interval | None) -> str:
    if found is None or None in found:
        return NONE
    return f"{significant(found[0], digits=3)} … {significant(found[1], digits=3)}"
