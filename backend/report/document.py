"""A report as blocks without appearance; `html` and `pdf` give it one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from backend.report.plot import Plot

Tone = Literal["plain", "good", "warn", "fault"]
Language = Literal["en", "zh"]


@dataclass(frozen=True)
class Heading:
    """``level`` 2 is a chapter, 3 a part of one."""

    text: str
    level: Literal[2, 3] = 2


@dataclass(frozen=True)
class Note:
    """A paragraph; its tone is also said as text."""

    text: str
    tone: Tone = "plain"


@dataclass(frozen=True)
class Table:
    """``head`` may be empty. ``right`` shows the columns of numbers."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    right: tuple[bool, ...] = ()


@dataclass(frozen=True)
class Figure:
    """Plots above each other, kept together, with one sentence below."""

    plots: tuple[Plot, ...]
    caption: str


@dataclass(frozen=True)
class Signatures:
    """Lines to sign on, kept together; each box has the same small labels."""

    boxes: tuple[str, ...]
    labels: tuple[str, ...]


Block = Heading | Note | Table | Figure | Signatures


@dataclass(frozen=True)
class Document:
    """``footer`` is on every page of a PDF, before the page number."""

    title: str
    subtitle: str
    language: Language
    footer: str
    page: str
    blocks: tuple[Block, ...]
