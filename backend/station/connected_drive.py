"""A drive of the bench with what belongs to it."""

from __future__ import annotations

from backend.axis import Axis
from backend.drive import Drive
from backend.monitor import Monitor


class Member:
    """A drive of the bench with its axis and monitor."""

    def __init__(self, drive: Drive, axis: Axis, monitor: Monitor) -> None:
        self.drive = drive
        self.axis = axis
        self.monitor = monitor
