"""What is known of a drive's parameters, and what was sent to them."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.texts.message import Text
from profiles.schema import Raw


@dataclass(frozen=True, slots=True)
class Reading:
    """What a drive said of one parameter. ``value`` is in the parameter's unit."""

    key: str
    raw: Raw | None
    value: Raw | None
    time: float | None
    """Seconds since the epoch, None when never read."""
    problem: Text | None = None
    """Why there is no value."""
    unused: bool = False
    """The drive's own count leaves it out, as ``problem`` says: there is nothing to be read."""

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

    ``before`` is what was known before, ``after`` what was read back; ``problem`` states why that
    is not known, and then the drive may hold either.
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
    """A motion object that was sent without reading back; ``problem`` empty where it arrived."""

    drive: str
    name: str
    key: str
    parameter: str
    raw: int
    problem: Text | None = None


@dataclass(frozen=True, slots=True)
class Refusal:
    """A write that was not sent as it can move the axis and nobody had the permission."""

    drive: str
    name: str
    key: str
    wanted: Raw
    why: Text
