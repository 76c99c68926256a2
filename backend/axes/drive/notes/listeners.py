"""Listeners to readings, writes, commands and refusals of a drive; called on the event loop."""

from __future__ import annotations

from collections.abc import Callable

from backend.axes.drive.readings import CommandRecord, Reading, Refusal, WriteRecord


class DriveListeners:
    """Listeners of one drive."""

    def __init__(self) -> None:
        self._readings: list[Callable[[list[Reading]], None]] = []
        self._writes: list[Callable[[WriteRecord], None]] = []
        self._commands: list[Callable[[CommandRecord], None]] = []
        self._refusals: list[Callable[[Refusal], None]] = []

    def add(self, listener: Callable[[list[Reading]], None]) -> Callable[[], None]:
        """Call ``listener`` with every batch of new readings; return a function to remove it."""
        self._readings.append(listener)
        return lambda: self._readings.remove(listener)

    def add_writes(self, listener: Callable[[WriteRecord], None]) -> None:
        """Call ``listener`` after every write that `Drive.write` sent, also where it failed."""
        self._writes.append(listener)

    def add_commands(self, listener: Callable[[CommandRecord], None]) -> None:
        """Call ``listener`` after every command sent without reading back, also where it failed."""
        self._commands.append(listener)

    def add_refusals(self, listener: Callable[[Refusal], None]) -> None:
        """Call ``listener`` after every write that was refused because it can move the axis."""
        self._refusals.append(listener)

    def refused(self, refusal: Refusal) -> None:
        """Report a refusal."""
        for listener in self._refusals:
            listener(refusal)

    def read(self, readings: list[Reading]) -> None:
        """Report new readings."""
        for listener in list(self._readings):
            listener(readings)

    def wrote(self, record: WriteRecord) -> None:
        """Report a write."""
        for listener in self._writes:
            listener(record)

    def commanded(self, record: CommandRecord) -> None:
        """Report a command."""
        for listener in self._commands:
            listener(record)
