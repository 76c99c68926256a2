"""A report as one printable HTML page without scripts or other files; all text is escaped."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Iterable
from html import escape

from backend.report.document import (
    Block,
    Document,
    Figure,
    Heading,
    Note,
    Signatures,
    Table,
)
from backend.report.render.plot import Area, Drawing, Label, Line, Path, Point, Shape, draw
from backend.report.texts import Words

_STYLE = """
body { font: 11pt/1.45 system-ui, "Noto Sans CJK SC", "Microsoft YaHei", "PingFang SC", sans-serif;
  color: #1b242d; background: #fff; max-width: 190mm; margin: 12mm auto; padding: 0 6mm; }
h1 { font-size: 20pt; margin: 0; } h2 { font-size: 14pt; margin: 9mm 0 2mm;
  border-bottom: 1px solid #8996a2; } h3 { font-size: 12pt; margin: 7mm 0 1mm; }
.subtitle, .caption { color: #4a5763; margin: 0 0 3mm; }
p { margin: 1.5mm 0; overflow-wrap: anywhere; }
.good, .warn, .fault { border-left: 4px solid; padding: 1mm 3mm; break-inside: avoid; }
.good { border-color: #1d7a45; background: #e9f6ee; }
.warn { border-color: #b36b00; background: #fdf3e1; }
.fault { border-color: #c1121f; background: #fdeaec; }
table { border-collapse: collapse; width: 100%; margin: 2mm 0; font-size: 10pt; }
th, td { text-align: left; vertical-align: top; padding: 1mm 2mm; border-bottom: 1px solid #d5dbe1;
  overflow-wrap: anywhere; }
thead { display: table-header-group; } tr { break-inside: avoid; }
.right { text-align: right; font-variant-numeric: tabular-nums; }
figure { margin: 2mm 0; break-inside: avoid; } svg { width: 100%; height: auto; display: block; }
.signatures { display: grid; grid-template-columns: 1fr 1fr; gap: 10mm; break-inside: avoid; }
.signatures div { border-bottom: 1px solid #1b242d; height: 14mm; }
.signatures small { color: #4a5763; }
h2, h3 { break-after: avoid; }
@page { size: A4; margin: 15mm; } @media print { body { margin: 0; padding: 0; } }
"""


def render_html(document: Document) -> bytes:
    """The page, UTF-8."""
    digest = base64.b64encode(hashlib.sha256(_STYLE.encode()).digest()).decode()
    policy = f"default-src 'none'; style-src 'sha256-{digest}'; base-uri 'none'; form-action 'none'"
    words = Words(document.language)
    language = "zh-CN" if document.language == "zh" else "en"
    body = "\n".join(_block(block, words) for block in document.blocks)
    return f"""<!doctype html>
<html lang="{language}">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(document.title)} – {escape(document.subtitle)}</title>
<style>{_STYLE}</style>
</head>
<body>
<h1>{escape(document.title)}</h1>
<p class="subtitle">{escape(document.subtitle)}</p>
{body}
<p class="caption">{escape(document.footer)}</p>
</body>
</html>
""".encode()


def _block(block: Block, words: Words) -> str:
    if isinstance(block, Heading):
        return f"<h{block.level}>{escape(block.text)}</h{block.level}>"
    if isinstance(block, Note):
        return _note(block, words)
    if isinstance(block, Table):
        return _table(block)
    if isinstance(block, Figure):
        plots = "\n".join(svg(draw(plot), plot.title) for plot in block.plots)
        caption = f'<figcaption class="caption">{escape(block.caption)}</figcaption>'
        return f"<figure>\n{plots}\n{caption}\n</figure>"
    return _signatures(block)


def _note(note: Note, words: Words) -> str:
    if note.tone == "plain":
        return f"<p>{escape(note.text)}</p>"
    # The tone is also text, as the report may be printed in black and white.
    tone = escape(words(f"tone.{note.tone}"))
    return f'<p class="{note.tone}"><strong>{tone}:</strong> {escape(note.text)}</p>'


def _table(table: Table) -> str:
    right = table.right or (False,) * len(table.rows[0] if table.rows else table.head)

    def cells(row: Iterable[str], tag: str) -> str:
        return "".join(
            f"<{tag}{' class=' + chr(34) + 'right' + chr(34) if is_right else ''}>"
            f"{escape(text)}</{tag}>"
            for text, is_right in zip(row, right, strict=True)
        )

    head = f"<thead><tr>{cells(table.head, 'th')}</tr></thead>" if table.head else ""
    rows = "\n".join(f"<tr>{cells(row, 'td')}</tr>" for row in table.rows)
    return f"<table>{head}<tbody>\n{rows}\n</tbody></table>"


def _signatures(block: Signatures) -> str:
    boxes = []
    for box in block.boxes:
        lines = "".join(f"<div></div><small>{escape(label)}</small>" for label in block.labels)
        boxes.append(f"<section><strong>{escape(box)}</strong>{lines}</section>")
    return f'<div class="signatures">{"".join(boxes)}</div>'


# --- pictures --------------------------------------------------------------------------


def svg(drawing: Drawing, title: str) -> str:
    """A drawing as an SVG element without styles, which the page's policy would block."""
    shapes = "\n".join(_shape(shape) for shape in drawing.shapes)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{escape(title)}" '
        f'viewBox="0 0 {drawing.width:g} {drawing.height:g}" font-family="sans-serif">\n'
        f"{shapes}\n</svg>"
    )


def _points(points: Iterable[Point]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def _shape(shape: Shape) -> str:
    if isinstance(shape, Line):
        (x1, y1), (x2, y2) = shape.a, shape.b
        return (
            f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" '
            f'stroke="{shape.color}" stroke-width="{shape.width:g}"/>'
        )
    if isinstance(shape, Path):
        dash = ' stroke-dasharray="6 4"' if shape.dashed else ""
        return (
            f'<polyline points="{_points(shape.points)}" fill="none" stroke="{shape.color}" '
            f'stroke-width="{shape.width:g}"{dash}/>'
        )
    if isinstance(shape, Area):
        return (
            f'<polygon points="{_points(shape.points)}" fill="{shape.color}" '
            f'fill-opacity="{shape.opacity:g}"/>'
        )
    return _label(shape)


def _label(label: Label) -> str:
    x, y = label.at
    bold = ' font-weight="bold"' if label.bold else ""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{label.anchor}" font-size="{label.size:g}" '
        f'fill="{label.color}"{bold}>{escape(label.text)}</text>'
    )
