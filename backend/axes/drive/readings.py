"""Records of a drive's parameters: readings, writes, commands and refusals."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.texts.message import Text
from profiles.schema import Raw


@dataclass(frozen=True, slots=True)
class Reading:
    """Last reading of one parameter. ``value`` is in the parameter's unit."""

    key: str
    raw: Raw | None
    value: Raw | None
    time: float | None
    """Seconds since the epoch, None when never read."""
    problem: Text | None = None
    """Why there is no value."""
    unused: bool = False
    """The drive's own count excludes this subindex, as ``problem`` states: it has no value."""

    @property
    def error(self) -> str:
        """The problem in English words; empty where there is none."""
        return "" if self.problem is None else self.problem.words()

    @property
    def integer(self) -> int | None:
        """The raw value where it is an integer; else None."""
        return self.raw if isinstance(self.raw, int) else None


@dataclass(frozen=True, slots=True)
class WriteRecord:
    """A value that was sent to the drive; raw values.

    ``before``: last known value; ``after``: value read back. ``problem`` states why ``after`` is
    not known; the drive may then hold either value.
    """

    drive: str
    name: str
    key: str
    parameter: str
    before: Raw | None
    wanted: Raw
    after: Raw | None
    problem: Text | None = None


@dataclass(frozen=True, slots=True)
class CommandRecord:
    """A value that was sent without reading back; ``problem`` is None where it was sent."""

    drive: str
    name: str
    key: str
    parameter: str
    raw: int
    problem: Text | None = None


@dataclass(frozen=True, slots=True)
class Refusal:
    """A write that was not sent, as it can move the axis and the caller had no grant."""

    drive: str
    name: str
    key: str
    wanted: Raw
    why: Text
