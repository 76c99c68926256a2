"""A report as a PDF on A4.

Text is set in DejaVu Sans; characters that it lacks, above all Chinese, in Droid Sans Fallback
(fonts/README.md). The characters that occur are embedded, so that a report looks the same on every
computer and in many years.
"""

from __future__ import annotations

import io
from functools import cache
from itertools import groupby
from pathlib import Path as FilePath
from typing import Any
from xml.sax.saxutils import escape

from reportlab.lib.colors import HexColor
from reportlab.lib.enums import TA_LEFT, TA_RIGHT
from reportlab.lib.pagesizes import A4
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import (
    BaseDocTemplate,
    CondPageBreak,
    Flowable,
    Frame,
    KeepTogether,
    PageTemplate,
    Paragraph,
    Spacer,
    TableStyle,
)
from reportlab.platypus import Table as Grid

from backend.report.document import (
    Block,
    Document,
    Figure,
    Heading,
    Note,
    Signatures,
    Table,
)
from backend.report.render.plot import Area, Drawing, Label, Line, Path, Shape, draw
from backend.report.texts import Words

_PLAIN, _BOLD, _WIDE = "DejaVuSans", "DejaVuSans-Bold", "DroidSansFallbackFull"
_FONTS = FilePath(__file__).parent / "fonts"
_MARGIN, _FOOT = 18 * mm, 16 * mm
_INNER = A4[0] - 2 * _MARGIN
_TONES = {
    "good": ("#1d7a45", "#e9f6ee"),
    "warn": ("#b36b00", "#fdf3e1"),
    "fault": ("#c1121f", "#fdeaec"),
}


@cache
def _fonts() -> frozenset[int]:
    """Register the fonts once; return the code points of the plain font."""
    fonts = {name: TTFont(name, _FONTS / f"{name}.ttf") for name in (_PLAIN, _BOLD, _WIDE)}
    for font in fonts.values():
        pdfmetrics.registerFont(font)
    return frozenset(fonts[_PLAIN].face.charToGlyph)


def _runs(text: str) -> list[tuple[bool, str]]:
    """Parts of a text that the plain font can set (True) or not (False)."""
    known = _fonts()
    return [(has, "".join(part)) for has, part in groupby(text, key=lambda c: ord(c) in known)]


def _markup(text: str) -> str:
    """Escaped text with the right font for each part. Control characters become spaces."""
    clean = "".join(c if c.isprintable() and ord(c) < 0x10000 else " " for c in text)
    return "".join(
        escape(part) if has else f'<font name="{_WIDE}">{escape(part)}</font>'
        for has, part in _runs(clean)
    )


def _style(size: float = 9.0, *, right: bool = False, **more: Any) -> ParagraphStyle:
    settings: dict[str, Any] = {
        "fontName": _PLAIN,
        "fontSize": size,
        "leading": size * 1.4,
        "textColor": HexColor("#1b242d"),
        "alignment": TA_RIGHT if right else TA_LEFT,
        # Breaks long words, and Chinese, which has no spaces, at the end of the line.
        "wordWrap": "CJK",
        "splitLongWords": 1,
    }
    return ParagraphStyle("text", **(settings | more))


def render_pdf(document: Document) -> bytes:
    """The PDF file."""
    _fonts()
    out = io.BytesIO()
    frame = Frame(_MARGIN, _FOOT + 6 * mm, _INNER, A4[1] - _MARGIN - _FOOT - 6 * mm, 0, 0, 0, 0)

    def foot(canvas: Canvas, template: BaseDocTemplate) -> None:
        page = f"{document.page} {template.page}"
        if document.language == "zh":
            page += " 页"
        _write(canvas, _MARGIN, _FOOT, document.footer[:110], "start", 7.0)
        _write(canvas, A4[0] - _MARGIN, _FOOT, page, "end", 7.0)

    template = BaseDocTemplate(
        out,
        pagesize=A4,
        title=document.title,
        subject=document.subtitle,
        creator="servodeck",
        lang="zh-CN" if document.language == "zh" else "en",
    )
    template.addPageTemplates([PageTemplate("page", [frame], onPage=foot)])
    words = Words(document.language)
    story: list[Flowable] = [
        Paragraph(_markup(document.title), _style(18, fontName=_BOLD)),
        Paragraph(_markup(document.subtitle), _style(11, textColor=HexColor("#4a5763"))),
    ]
    for block in document.blocks:
        story += _block(block, words)
    template.build(story)
    return out.getvalue()


def _block(block: Block, words: Words) -> list[Flowable]:
    if isinstance(block, Heading):
        size = 13.0 if block.level == 2 else 11.0
        style = _style(size, fontName=_BOLD, spaceBefore=size * 0.9, spaceAfter=3, keepWithNext=1)
        return [CondPageBreak(30 * mm), Paragraph(_markup(block.text), style)]
    if isinstance(block, Note):
        return [_note(block, words)]
    if isinstance(block, Table):
        return [_table(block), Spacer(1, 6)]
    if isinstance(block, Figure):
        caption = Paragraph(_markup(block.caption), _style(7.5, textColor=HexColor("#4a5763")))
        return [KeepTogether([*(_Picture(draw(plot)) for plot in block.plots), caption])]
    return [_signatures(block)]


def _note(note: Note, words: Words) -> Paragraph:
    if note.tone == "plain":
        return Paragraph(_markup(note.text), _style(spaceAfter=2))
    edge, ground = _TONES[note.tone]
    style = _style(
        spaceBefore=3,
        spaceAfter=5,
        leftIndent=6,
        backColor=HexColor(ground),
        borderPadding=3,
        borderColor=HexColor(edge),
        borderWidth=0.8,
    )
    tone = f'<font name="{_BOLD}">{_markup(words(f"tone.{note.tone}") + ":")}</font>'
    return Paragraph(f"{tone} {_markup(note.text)}", style)


def _table(table: Table) -> Grid:
    count = len(table.rows[0] if table.rows else table.head)
    right = table.right or (False,) * count
    styles = [_style(8.5, right=each) for each in right]
    bold = [_style(8.5, right=each, fontName=_BOLD) for each in right]
    heads = [table.head] if table.head else []
    rows = [[Paragraph(_markup(c), s) for c, s in zip(r, bold, strict=True)] for r in heads]
    rows += [[Paragraph(_markup(c), s) for c, s in zip(r, styles, strict=True)] for r in table.rows]
    # The width of the first column depends on the number of columns; the others are equal.
    first = _INNER * (0.3 if count == 2 and not table.head else 0.34 if count < 5 else 0.13)
    rest = (_INNER - first) / (count - 1)
    widths = [first] + [rest] * (count - 1)
    if count == 5:
        widths = [_INNER * share for share in (0.13, 0.33, 0.17, 0.17, 0.2)]
    grid = Grid(rows, colWidths=widths, repeatRows=1 if table.head else 0, hAlign="LEFT")
    grid.setStyle(
        TableStyle([
            ("LINEBELOW", (0, 0), (-1, -1), 0.4, HexColor("#d5dbe1")),
            ("VALIGN", (0, 0), (-1, -1), "TOP"),
            ("TOPPADDING", (0, 0), (-1, -1), 2), ("BOTTOMPADDING", (0, 0), (-1, -1), 3),
            ("LEFTPADDING", (0, 0), (-1, -1), 2), ("RIGHTPADDING", (0, 0), (-1, -1), 4),
        ])
    )  # fmt: skip
    return grid


def _signatures(block: Signatures) -> Flowable:
    width = _INNER / len(block.boxes)
    head = [Paragraph(_markup(box), _style(9, fontName=_BOLD)) for box in block.boxes]
    rows: list[list[Paragraph]] = [head]
    for label in block.labels:
        rows.append([Paragraph(_markup(label), _style(7.5)) for _ in block.boxes])
    grid = Grid(rows, colWidths=[width] * len(block.boxes), rowHeights=[16] + [34] * len(rows[1:]))
    lines = [
        ("LINEABOVE", (column, row), (column, row), 0.6, HexColor("#1b242d"))
        for row in range(2, len(rows))
        for column in range(len(block.boxes))
    ]
    end = ("LINEBELOW", (0, len(rows) - 1), (-1, len(rows) - 1), 0.6, HexColor("#1b242d"))
    grid.setStyle(TableStyle([*lines, end, ("VALIGN", (0, 1), (-1, -1), "TOP")]))
    return KeepTogether([grid])


# --- pictures --------------------------------------------------------------------------


class _Picture(Flowable):
    """A drawing, scaled to the width of the page."""

    def __init__(self, drawing: Drawing) -> None:
        super().__init__()
        self.drawing = drawing
        self.scale = _INNER / drawing.width
        self.width, self.height = _INNER, drawing.height * self.scale

    def wrap(self, _width: float, _height: float) -> tuple[float, float]:
        return self.width, self.height

    def draw(self) -> None:
        canvas: Canvas = self.canv
        canvas.saveState()
        canvas.translate(0, self.height)
        canvas.scale(self.scale, self.scale)
        for shape in self.drawing.shapes:
            _paint(canvas, shape)
        canvas.restoreState()


def _paint(canvas: Canvas, shape: Shape) -> None:
    """Paint a shape; y points downwards in drawings and upwards on pages."""
    if isinstance(shape, Label):
        x, y = shape.at
        _write(canvas, x, -y, shape.text, shape.anchor, shape.size, shape.color, bold=shape.bold)
        return
    if isinstance(shape, Line):
        canvas.setStrokeColor(HexColor(shape.color))
        canvas.setLineWidth(shape.width)
        canvas.setDash()
        canvas.line(shape.a[0], -shape.a[1], shape.b[0], -shape.b[1])
        return
    outline = canvas.beginPath()
    for number, (x, y) in enumerate(shape.points):
        (outline.lineTo if number else outline.moveTo)(x, -y)
    if isinstance(shape, Area):
        outline.close()
        canvas.setFillColor(HexColor(shape.color), shape.opacity)
        canvas.drawPath(outline, stroke=0, fill=1)
        canvas.setFillAlpha(1.0)
        return
    _outline(canvas, shape)
    canvas.drawPath(outline, stroke=1, fill=0)


def _outline(canvas: Canvas, path: Path) -> None:
    canvas.setStrokeColor(HexColor(path.color))
    canvas.setLineWidth(path.width)
    canvas.setDash(6, 4) if path.dashed else canvas.setDash()


def _write(
    canvas: Canvas, x: float, y: float, text: str, anchor: str, size: float,
    color: str = "#4a5763", *, bold: bool = False,
) -> None:  # fmt: skip
    """Write one line of text, each part in a font that has its characters."""
    font = _BOLD if bold else _PLAIN
    runs = [(font if has else _WIDE, part) for has, part in _runs(text)]
    widths = [pdfmetrics.stringWidth(part, name, size) for name, part in runs]
    x -= {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * sum(widths)
    canvas.setFillColor(HexColor(color))
    for (name, part), width in zip(runs, widths, strict=True):
        canvas.setFont(name, size)
        canvas.drawString(x, y, part)
        x += width
