"""A report as blocks without layout; `html` and `pdf` render them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from backend.report.render.plot import Plot

Tone = Literal["plain", "good", "warn", "fault"]
Language = Literal["en", "zh"]


@dataclass(frozen=True)
class Heading:
    """A heading. ``level``: 2 for a chapter, 3 for a section of it."""

    text: str
    level: Literal[2, 3] = 2


@dataclass(frozen=True)
class Note:
    """A paragraph; its tone is shown by colour and as text."""

    text: str
    tone: Tone = "plain"


@dataclass(frozen=True)
class Table:
    """A table. ``head`` may be empty. ``right`` marks the right-aligned columns (numbers)."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    right: tuple[bool, ...] = ()


@dataclass(frozen=True)
class Figure:
    """Plots one below the other on one page, with a caption."""

    plots: tuple[Plot, ...]
    caption: str


@dataclass(frozen=True)
class Signatures:
    """Boxes for signatures on one page; each box has the same labelled lines."""

    boxes: tuple[str, ...]
    labels: tuple[str, ...]


Block = Heading | Note | Table | Figure | Signatures


@dataclass(frozen=True)
class Document:
    """A whole report. ``footer`` is on every page of a PDF, before the page number."""

    title: str
    subtitle: str
    language: Language
    footer: str
    page: str
    blocks: tuple[Block, ...]
