"""Plots as plain shapes, so that HTML page and PDF show exactly the same."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

Point = tuple[float, float]
Anchor = Literal["start", "middle", "end"]

WIDTH = 720.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 58.0, 12.0, 24.0, 40.0
_GRID, _INK, _DIM, _BAND = "#d5dbe1", "#1b242d", "#4a5763", "#eaf3f9"
_SIZE = 11.0


@dataclass(frozen=True)
class Line:
    """A straight line."""

    a: Point
    b: Point
    color: str = _GRID
    width: float = 0.8


@dataclass(frozen=True)
class Path:
    """An open line through points."""

    points: tuple[Point, ...]
    color: str
    width: float = 1.6
    dashed: bool = False


@dataclass(frozen=True)
class Area:
    """A filled shape without an edge."""

    points: tuple[Point, ...]
    color: str
    opacity: float = 1.0


@dataclass(frozen=True)
class Label:
    """One line of text; ``at`` is on its baseline."""

    at: Point
    text: str
    anchor: Anchor = "middle"
    color: str = _DIM
    bold: bool = False
    size: float = _SIZE


Shape = Line | Path | Area | Label


@dataclass(frozen=True)
class Drawing:
    """Shapes on a sheet, y downwards."""

    width: float
    height: float
    shapes: tuple[Shape, ...]


@dataclass(frozen=True)
class Curve:
    """Points [n]; None makes a gap. ``spread``: half the width of the 95 % band."""

    label: str
    color: str
    x: Sequence[float]
    y: Sequence[float | None]
    spread: Sequence[float | None] | None = None
    dashed: bool = False


@dataclass(frozen=True)
class Plot:
    """Curves over a common x axis. ``band``: valid range of x, which is shaded.

    ``steps``: permitted distances of the horizontal grid lines.
    """

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    x_range: tuple[float, float]
    log_x: bool = False
    band: tuple[float, float] | None = None
    height: float = 190.0
    steps: tuple[float, ...] = ()
    y_range: tuple[float, float] | None = None


def draw(plot: Plot) -> Drawing:
    """Draw a plot as shapes."""
    frame = _Frame(plot)
    shapes: list[Shape] = [*frame.background(), *frame.grid()]
    for curve in plot.curves:
        shapes += frame.band(curve)
    for curve in plot.curves:
        shapes += frame.lines(curve)
    shapes += frame.words()
    return Drawing(WIDTH, frame.bottom + _BOTTOM, tuple(shapes))


class _Frame:
    """The plot's rectangle and its x and y scales."""

    def __init__(self, plot: Plot) -> None:
        self.plot = plot
        self.left, self.right = _LEFT, WIDTH - _RIGHT
        self.top, self.bottom = _TOP, _TOP + plot.height
        self.ticks = _y_ticks(plot)
        self.low, self.high = self.ticks[0], self.ticks[-1]

    def x(self, value: float) -> float:
        low, high = self.plot.x_range
        if self.plot.log_x:
            low, high, value = math.log(low), math.log(high), math.log(max(value, 1e-12))
        share = (value - low) / (high - low)
        return self.left + (self.right - self.left) * share

    def y(self, value: float) -> float:
        share = (value - self.low) / (self.high - self.low)
        return self.bottom - (self.bottom - self.top) * min(1.02, max(-0.02, share))

    def background(self) -> Iterator[Shape]:
        if self.plot.band is None:
            return
        a, b = (min(self.right, max(self.left, self.x(v))) for v in self.plot.band)
        yield Area(((a, self.top), (b, self.top), (b, self.bottom), (a, self.bottom)), _BAND)

    def grid(self) -> Iterator[Shape]:
        for value in _x_ticks(self.plot):
            at = self.x(value)
            yield Line((at, self.top), (at, self.bottom))
            yield Label((at, self.bottom + 14), number(value))
        for value in self.ticks:
            at = self.y(value)
            yield Line((self.left, at), (self.right, at))
            yield Label((self.left - 6, at + 4), number(value), "end")

    def _runs(self, curve: Curve) -> Iterator[list[tuple[float, float, float]]]:
        """Parts of a curve without a gap, within the x range, as x, y and spread."""
        begin, end = self.plot.x_range
        run: list[tuple[float, float, float]] = []
        spreads = curve.spread or [0.0] * len(curve.x)
        for x, y, spread in zip(curve.x, curve.y, spreads, strict=True):
            if y is None or not math.isfinite(y) or not begin <= x <= end:
                if len(run) > 1:
                    yield run
                run = []
            else:
                run.append((x, y, spread if spread is not None and math.isfinite(spread) else 0.0))
        if len(run) > 1:
            yield run

    def band(self, curve: Curve) -> Iterator[Shape]:
        if curve.spread is None:
            return
        for run in self._runs(curve):
            up = [(self.x(x), self.y(y + s)) for x, y, s in run]
            down = [(self.x(x), self.y(y - s)) for x, y, s in reversed(run)]
            yield Area(tuple(up + down), curve.color, 0.22)

    def lines(self, curve: Curve) -> Iterator[Shape]:
        for run in self._runs(curve):
            points = tuple((self.x(x), self.y(y)) for x, y, _ in run)
            yield Path(points, curve.color, dashed=curve.dashed)

    def words(self) -> Iterator[Shape]:
        yield Label((self.left, self.top - 9), self.plot.title, "start", _INK, bold=True)
        yield Label((self.left, self.bottom + 31), self.plot.y_label, "start")
        yield Label((self.right, self.bottom + 31), self.plot.x_label, "end")
        at = self.left + 110
        for curve in self.plot.curves:
            yield Path(
                ((at, self.bottom + 27), (at + 18, self.bottom + 27)),
                curve.color,
                dashed=curve.dashed,
            )
            yield Label((at + 23, self.bottom + 31), curve.label, "start", _INK)
            at += 40 + 6.2 * sum(2 if ord(c) > 0x2E80 else 1 for c in curve.label)


def number(value: float) -> str:
    """The number of a tick, with a typographic minus sign."""
    return f"{value:.6g}".replace("-", "−")


def _x_ticks(plot: Plot) -> list[float]:
    low, high = plot.x_range
    if not plot.log_x:
        step = _step(high - low, 8, ())
        return [n * step for n in range(math.ceil(low / step), math.floor(high / step) + 1)]
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    found = [digit * 10.0**decade for decade in decades for digit in (1, 2, 5)]
    return [f for f in found if low * 0.999 <= f <= high * 1.001]


def _y_ticks(plot: Plot) -> list[float]:
    """Positions of the horizontal grid lines, at least two, that include all curves."""
    if plot.y_range is not None:
        low, high = plot.y_range
    else:
        begin, end = plot.x_range
        seen = [
            y
            for curve in plot.curves
            for x, y in zip(curve.x, curve.y, strict=True)
            if y is not None and math.isfinite(y) and begin <= x <= end
        ]
        low, high = (min(seen), max(seen)) if seen else (0.0, 1.0)
    step = _step(max(high - low, 1e-9), 6, plot.steps)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [n * step for n in range(first, max(last, first + 1) + 1)]


def _step(span: float, lines: int, choice: Sequence[float]) -> float:
    """A round distance of grid lines that gives about ``lines`` of them."""
    wanted = span / lines
    if choice:
        return next((step for step in choice if step >= wanted), choice[-1])
    power = 10.0 ** math.floor(math.log10(wanted))
    return next(digit * power for digit in (1, 2, 5, 10) if digit * power >= wanted * 0.999)
