"""A connected drive with its axis and monitor."""

from __future__ import annotations

from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.station.drives.monitor import Monitor


class ConnectedDrive:
    """A drive of the axis list with its axis and monitor."""

    def __init__(self, drive: Drive, axis: Axis, monitor: Monitor) -> None:
        self.drive = drive
        self.axis = axis
        self.monitor = monitor
