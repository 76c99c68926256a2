"""What was changed in a drive since its memory was last written, and what waits to act."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from backend.drive.readings import Reading
from profiles.schema import Raw


@dataclass(slots=True)
class ChangeMarks:
    """``stored`` is what the drive's memory holds of what was changed: raw values by key.

    ``pending`` are keys that wait for something before they act, and for what.
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
        """What waited for one of ``what`` (write_settings, reenable, power_cycle) acts now."""
        for key in [key for key, until in self.pending.items() if until in what]:
            del self.pending[key]

    def forget(self) -> None:
        """The drive restarted: what it holds is what its memory held."""
        self.stored.clear()
        self.pending.clear()
