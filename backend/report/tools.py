"""What a report shows of tools that have a descriptor, from the section that each of them makes."""

from __future__ import annotations

from itertools import cycle

from backend.report.document import Block, Figure, Note, Table
from backend.report.numbers import NONE, significant
from backend.report.plot import Curve, Plot
from backend.report.texts import Words
from backend.tools.registry import BY_KIND
from backend.tools.tool import AnyTool, Chart, Interval, Section, ToolResult
from backend.tools.tool import Note as ToolNote

_COLORS = ("#1a5c94", "#c2571a")


def kind_title(kind: str, words: Words) -> str:
    """What a kind of measurement is called."""
    tool = BY_KIND.get(kind)
    return words(f"kind.{kind}") if tool is None else tool.text("title", words.language)


def tool_blocks(kind: str, result: ToolResult, words: Words) -> list[Block]:
    """Notes, parameters with their intervals, and charts."""
    tool = BY_KIND[kind]
    section: Section = tool.report(result.in_language(words.language))
    head = (words("quantity"), words("value"), words("interval"))
    rows = tuple(
        (tool.text(row.name, words.language, row.values), significant(row.value, row.unit, 3),
         _interval(row.ci95))
        for row in section.rows
    )  # fmt: skip
    blocks: list[Block] = [_note(tool, each, words) for each in section.notes]
    blocks.append(Table(head, rows, (False, True, True)))
    for chart in section.charts:
        title = tool.text(chart.name, words.language)
        blocks.append(Figure((_plot(tool, chart, words),), title))
    return blocks


def tool_verdict(kind: str, result: ToolResult, words: Words) -> Note:
    """The first note of the section, with the tool's title."""
    tool = BY_KIND[kind]
    first = _note(tool, tool.report(result.in_language(words.language)).notes[0], words)
    return Note(f"{tool.text('title', words.language)}: {first.text}", first.tone)


def _note(tool: AnyTool, note: ToolNote, words: Words) -> Note:
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
