"""Marks of changed parameters: not yet saved in the drive's memory, or not yet in effect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from backend.axes.drive.readings import Reading
from profiles.schema import Raw


@dataclass(slots=True)
class ChangeMarks:
    """Change marks of one drive.

    ``stored``: raw values in the drive's non-volatile memory, by key, for changed parameters.
    ``pending``: keys of parameters that are not in effect yet, each with the action it waits for.
    """

    stored: dict[str, Raw] = field(default_factory=dict)
    pending: dict[str, str] = field(default_factory=dict)

    def unsaved(self, readings: Mapping[str, Reading]) -> frozenset[str]:
        """Keys whose value in the drive is not yet in its memory."""
        return frozenset(
            key
            for key, raw in self.stored.items()
            if (now := readings.get(key)) is not None and now.raw != raw
        )

    def applied(self, *what: str) -> None:
        """Clear the pending marks that wait for one of ``what``.

        One of: write_settings, reenable, power_cycle.
        """
        for key in [key for key, until in self.pending.items() if until in what]:
            del self.pending[key]

    def forget(self) -> None:
        """Clear all marks, as the drive restarted with the values of its memory."""
        self.stored.clear()
        self.pending.clear()
