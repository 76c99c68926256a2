"""Numbered rings and arrows over elements of the page, drawn from their boxes.

The marks lie in one SVG over the page that takes no press; it is removed after the picture.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from playwright.sync_api import Locator, Page

#: Distance of a frame from the element that it surrounds, in CSS pixels.
MARGIN_PX = 4
_DRAW = """(boxes) => {
  const made = (name, of) => {
    const e = document.createElementNS('http://www.w3.org/2000/svg', name)
    for (const [key, value] of Object.entries(of)) e.setAttribute(key, value)
    return e
  }
  const [wide, high] = [innerWidth, innerHeight]
  const svg = made('svg', { id: 'picture-marks', width: wide, height: high })
  svg.style.cssText = 'position:fixed;inset:0;z-index:2147483647;pointer-events:none'
  const colour = '#c2185b'
  const within = (value, end) => Math.min(Math.max(value, 14), end - 14)
  for (const { x, y, width, height, label, arrow } of boxes) {
    const ring = { fill: 'none', stroke: colour, 'stroke-width': 2.5 }
    const middle = y + height / 2
    let [at, above] = [x - 9, y + 4]
    if (arrow) {
      // The arrow ends at the middle of the element's left or right edge.
      const side = arrow === 'left' ? -1 : 1
      const tip = side < 0 ? x - 2 : x + width + 2
      const tail = tip + side * 44
      svg.append(
        made('path', {
          d: `M${tail} ${middle}H${tip}m${side * 9} -7L${tip} ${middle}l${side * 9} 7`, ...ring,
        }),
      )
      ;[at, above] = [tail, middle]
    } else {
      const [left, top] = [Math.max(x, 2), Math.max(y, 2)]
      const [right, bottom] = [Math.min(x + width, wide - 2), Math.min(y + height, high - 2)]
      const size = { width: right - left, height: bottom - top }
      svg.append(made('rect', { x: left, y: top, ...size, rx: 7, ...ring }))
    }
    const [cx, cy] = [within(at, wide), within(above, high)]
    svg.append(made('circle', { cx, cy, r: 11, fill: colour, stroke: '#fff', 'stroke-width': 2 }))
    const text = made('text', {
      x: cx, y: cy + 5, 'text-anchor': 'middle',
      style: 'font: bold 14px sans-serif; fill: #fff',
    })
    text.textContent = label
    svg.append(text)
  }
  document.body.append(svg)
}"""
_REMOVE = "() => document.getElementById('picture-marks')?.remove()"


class Mark(NamedTuple):
    """A number at an element: a frame around it, or an arrow to its left or right edge."""

    element: Locator
    arrow: str = ""


@contextmanager
def drawn(page: Page, marks: Sequence[Mark]) -> Iterator[None]:
    """Show the marks, numbered from 1 in their order.

    Raises:
        ValueError: an element is not in sight, so its number would point at nothing.
    """
    size = page.viewport_size
    assert size is not None
    boxes = []
    for number, mark in enumerate(marks, 1):
        box = mark.element.first.bounding_box()
        inside = (
            box is not None
            and box["x"] >= 0
            and box["y"] >= 0
            and box["x"] + box["width"] <= size["width"] + 1
            and box["y"] + box["height"] <= size["height"] + 1
        )
        if box is None or not inside:
            raise ValueError(f"mark {number} of {page.url} is not in sight: {box}")
        frame = 0 if mark.arrow else MARGIN_PX
        boxes.append(
            {
                "x": box["x"] - frame,
                "y": box["y"] - frame,
                "width": box["width"] + 2 * frame,
                "height": box["height"] + 2 * frame,
                "label": str(number),
                "arrow": mark.arrow,
            }
        )
    page.evaluate(_DRAW, boxes)
    try:
        yield
    finally:
        page.evaluate(_REMOVE)
