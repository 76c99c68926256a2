"""Descriptor of a measuring tool, from which everything around the tool is derived.

Routes, rights, audit, command line, evaluation of stored files, report section and the form of the
page are made from a `Tool`; a tool itself is a package of settings, run, evaluation, result and
texts.
"""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import TYPE_CHECKING, Annotated, Any, Generic, Literal, Self, TypeAlias, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from backend.foundation.people.rights import Right
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.repeats import Repeats
from drivers.texts.message import Language, Text

if TYPE_CHECKING:  # code that only reads results or settings imports no analysis
    from pathlib import Path

    import numpy as np
    import numpy.typing as npt

    from backend.axes.axis.axis import Axis
    from backend.axes.axis.cyclic import CyclicSession
    from backend.axes.motion.envelope import Envelope

Arrays: TypeAlias = "Mapping[str, npt.NDArray[np.generic]]"
Meta = Mapping[str, object]
Keep: TypeAlias = "Callable[[str, dict[str, npt.NDArray[np.generic]], dict[str, object]], None]"
Interval = tuple[float | None, float | None]
"""Lower and upper limit of a 95 % interval; None where a limit is not known."""
Texts = Mapping[str, tuple[str, str]]
"""English and Chinese text by name."""


@dataclass(frozen=True)
class Option:
    """Names of a setting on the command line, where different from its own.

    A pair has two names. ``default`` is the initial value where the interface asks for one.
    """

    names: tuple[str, ...] = ()
    default: float | None = None


class ToolSettings(BaseModel):
    """The motion envelope of every measurement: rev from the start, rpm, % of rated torque, s.

    NaN is refused in every setting, as comparisons with a limit would not detect it.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    travel_limit: Annotated[float, Option(("--travel-rev",), 3.0)] = Field(
        gt=0, description="longest way from the start, in revolutions"
    )
    speed_limit: Annotated[float, Option(("--speed-rpm",), 1200.0)] = Field(
        gt=0, description="highest speed, in rpm"
    )
    torque_limit: Annotated[float, Option(("--torque-percent",), 80.0)] = Field(
        gt=0, le=400, description="highest torque, in % of rated"
    )
    time_limit_s: float = Field(
        default=60.0, gt=0, le=300, description="longest time of a motion, in s"
    )
    rated_torque_nm: float | None = Field(
        default=None, gt=0, description="overrides what the drive says"
    )
    cycle_ms: float = Field(
        default=1.0,
        gt=0,
        le=10,
        description="cycle of the exchange that is started where none runs, and ended afterwards",
    )
    consent: bool = Field(
        default=False,
        description="the user agreed that nothing in the drive ends a speed when this computer "
        "falls silent; needed where the drive has no watchdog (DS_C)",
    )

    @property
    def envelope(self) -> Envelope:
        """The limits of the motion."""
        from backend.axes.motion.envelope import Envelope

        return Envelope(self.travel_limit, self.speed_limit, self.torque_limit, self.time_limit_s)


class ToolResult(BaseModel):
    """Common fields of the results of all tools; ``tool`` identifies the kind of result."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    tool: str
    measurements: tuple[str, ...] = Field(default=(), description="names of the stored raw data")

    def in_language(self, language: Language) -> Self:  # noqa: ARG002
        """The same result with its texts, if any, in this language."""
        return self


@dataclass(frozen=True)
class Run:
    """Environment of a tool for one measurement.

    ``exchange`` exchanges process data, None for a tool that moves nothing; ``keep`` stores raw
    data before they are evaluated; ``partner`` is the other axis of a tool that moves two;
    ``repeats`` limits optional repetitions of measurements; ``recording`` finds the file of a
    recording by its name.
    """

    axis: Axis
    exchange: CyclicSession | None
    progress: Progress
    keep: Keep | None = None
    repeats: Repeats = field(default_factory=Repeats)
    begun_s: float = field(default_factory=time.monotonic)
    recording: Callable[[str], Path] | None = None
    partner: Axis | None = None

    @property
    def session(self) -> CyclicSession:
        """The exchange, for a tool that moves the axis."""
        assert self.exchange is not None, "a tool that moves has one"
        return self.exchange

    @property
    def passed_s(self) -> float:
        """Seconds since the measurement began."""
        return time.monotonic() - self.begun_s


@dataclass(frozen=True)
class Row:
    """One quantity of a result; ``name`` is a text of the tool, ``value`` None where unknown."""

    name: str
    value: float | None
    unit: str
    ci95: Interval | None = None
    values: Mapping[str, str] = field(default_factory=dict)
    """Values for the placeholders of the text."""


@dataclass(frozen=True)
class Note:
    """A verdict or finding; ``name`` is a text of the tool."""

    name: str
    tone: Literal["good", "warn", "fault", "plain"] = "plain"
    values: Mapping[str, str] = field(default_factory=dict)


Cell = Note | str
"""A text of the tool, or a formatted figure with its unit."""


@dataclass(frozen=True)
class Grid:
    """A table of figures, with names in its first column; ``heads`` are texts of the tool."""

    heads: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True)
class Line:
    """A curve [n], optionally with half the width of its 95 % band."""

    name: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    spread: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Chart:
    """Curves over a common quantity; names are texts of the tool."""

    name: str
    x_name: str
    y_name: str
    lines: tuple[Line, ...]


@dataclass(frozen=True)
class Section:
    """Section of a result for report and command line; the first note is the verdict."""

    notes: tuple[Note, ...]
    rows: tuple[Row, ...] = ()
    charts: tuple[Chart, ...] = ()
    grids: tuple[Grid, ...] = ()


@dataclass(frozen=True)
class Written:
    """Raw values that a tool wrote and left in force: before, after, and when."""

    time: datetime
    before: Mapping[str, int]
    after: Mapping[str, int]


S = TypeVar("S", bound=BaseModel)
R = TypeVar("R", bound=ToolResult)


def _nothing_written(_result: ToolResult) -> Written | None:
    return None


@dataclass(frozen=True)
class Tool(Generic[S, R]):
    """Descriptor of one measuring tool.

    ``kind`` names it in routes, jobs, commands, files and results; ``title`` is a message of the
    catalogue, since jobs and log lines name the tool to readers of both languages. ``texts``
    contain at least "help" and "field.<name>" of every setting of its own. ``reevaluate``
    reproduces the result from arrays and metadata as ``run`` stored them and raises ValueError
    where they are not of this tool. ``parts`` are the results inside a result, by the kind of raw
    data that they were concluded from. ``written``: the values that it left in the drive. ``right``
    is what a person needs to start it. ``motion`` False: it only reads, so that no exchange is
    started for it, it holds no grant, and needs no control of the axis; its settings then have no
    envelope. ``closes_loops`` False: it runs before it is known whether a loop may be closed, so
    that no speed is tried and no ramp is prepared before it. ``pair``: it moves two axes of one
    bus, the second one named by the setting ``partner``.
    """

    kind: str
    title: Text
    settings: type[S]
    result: type[R]
    run: Callable[[Run, S], Awaitable[R]]
    reevaluate: Callable[[Arrays, Meta], R]
    report: Callable[[R], Section]
    texts: Texts
    parts: Callable[[R], Mapping[str, ToolResult | None]] | None = None
    written: Callable[[R], Written | None] = _nothing_written
    right: Right = Right.MEASURE
    motion: bool = True
    closes_loops: bool = True
    pair: bool = False

    def text(
        self,
        name: str,
        language: Literal["en", "zh"] = "en",
        values: Mapping[str, str] | None = None,
    ) -> str:
        """A text of this tool with its placeholders filled in."""
        if name == "title":
            return self.title.words(language)
        found = self.texts[name][1 if language == "zh" else 0]
        return found.format(**values) if values else found

    def cells(self, grid: Grid, language: Language) -> list[tuple[str, ...]]:
        """Head and rows of a table as text."""

        def shown(cell: Cell) -> str:
            return cell if isinstance(cell, str) else self.text(cell.name, language, cell.values)

        head = tuple(self.text(name, language) for name in grid.heads)
        return [head, *(tuple(shown(cell) for cell in row) for row in grid.rows)]


AnyTool = Tool[Any, Any]
