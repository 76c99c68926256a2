"""Detection of settings that change during a recording or a live view."""

from __future__ import annotations

from collections.abc import Iterable

from backend.axes.axis.cyclic import OUTPUT_ROLES
from backend.axes.drive.drive import Drive
from backend.axes.drive.readings import Reading
from backend.station.bench import Bench
from drivers.texts.message import Text, text

#: Roles of commands, which a motion writes many times a second, so no settings; the mode is one.
_COMMANDS = tuple(role for role in OUTPUT_ROLES if role != "mode")


class ChangedSettings:
    """Compares every reading of a writable parameter with the one before, from `begin` on."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._known: dict[tuple[str, str], object] = {}

    def begin(self) -> None:
        """Take the last known readings of all drives as the values to compare with."""
        for drive_id, connected in self._bench.connected_drives.items():
            for key, reading in connected.drive.readings.items():
                if reading.raw is not None:
                    self._known.setdefault((drive_id, key), reading.raw)

    def forget(self) -> None:
        """Discard the values, as no recording or live view runs any more."""
        self._known.clear()

    def among(self, drive_id: str, readings: Iterable[Reading]) -> list[tuple[str, Text]]:
        """Key and message of each setting among these readings that has changed."""
        connected = self._bench.connected_drives.get(drive_id)
        if connected is None:
            return []
        drive, found = connected.drive, []
        commands = {drive.key(role) for role in _COMMANDS}
        for reading in readings:
            if reading.raw is None or reading.key in commands:
                continue
            place = (drive_id, reading.key)
            before = self._known.get(place, reading.raw)
            self._known[place] = reading.raw
            if before != reading.raw and drive.parameter(reading.key).access == "rw":
                found.append((reading.key, _changed(drive, reading)))
        return found


def _changed(drive: Drive, reading: Reading) -> Text:
    parameter = drive.parameter(reading.key)
    return text(
        "station.setting-changed",
        drive=drive.name,
        parameter=parameter.name,
        now=f"{reading.value} {parameter.unit}".strip(),
    )
