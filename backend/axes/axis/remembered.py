"""Stored data of one axis besides its connection: mechanics, watch list, scales.

One small file per axis in the state folder, written atomically.
"""

from __future__ import annotations

import re
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from backend.axes.scales.gear_calculator import Mechanics
from backend.axes.scales.taught import Taught
from backend.foundation.store.files import write_atomically


class AxisRecord(BaseModel):
    """Stored data of one axis."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    mechanics: Mechanics | None = None
    watch: tuple[str, ...] = Field(default=(), description="parameter keys, in order")
    scales: Taught | None = Field(default=None, description="as a person states or confirmed them")


class AxisStore:
    """Records by the id of the drive."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._known: dict[str, AxisRecord] = {}

    def get(self, drive: str) -> AxisRecord:
        """The record of an axis; an empty one where there is no readable file."""
        if drive not in self._known:
            try:
                text = self._file(drive).read_text("utf-8")
                self._known[drive] = AxisRecord.model_validate_json(text)
            except (OSError, ValidationError):
                # The record is a convenience: a damaged file must not prevent use of the axis.
                self._known[drive] = AxisRecord()
        return self._known[drive]

    def put(self, drive: str, record: AxisRecord) -> AxisRecord:
        """Store a record.

        Raises:
            StorageFailed: it cannot be written.
        """
        self._folder.mkdir(parents=True, exist_ok=True)
        write_atomically(self._file(drive), record.model_dump_json(indent=1).encode())
        self._known[drive] = record
        return record

    def _file(self, drive: str) -> Path:
        return self._folder / f"{re.sub(r'[^a-z0-9-]', '_', drive)}.json"
