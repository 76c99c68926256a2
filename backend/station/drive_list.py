"""File with the list of a bench's drives, to connect them again after a restart."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from backend.store.files import write_atomically
from drivers.texts.message import Text, Unsuitable, prose, text
from drivers.texts.validation import reason_of

VERSION = 1


@dataclass(frozen=True, slots=True)
class SavedPort:
    """Port of a drive: bus URL and station address."""

    url: str
    station: int


@dataclass(frozen=True, slots=True)
class SavedDrive:
    """A drive in the list; the first port is the one by which it was connected.

    ``id`` names what is kept of the axis, such as its scales; empty in lists of earlier versions.
    """

    name: str
    profile: str
    ports: tuple[SavedPort, ...]
    notes: str = ""
    serial: int | None = None
    id: str = ""

    def __post_init__(self) -> None:
        if not self.ports:
            raise Unsuitable(text("station.drive-without-port"))


_DRIVE = TypeAdapter(SavedDrive)


class DriveList:
    """The list of drives in its file."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def store(self, drives: Iterable[SavedDrive]) -> None:
        """Replace the file atomically."""
        content = {"version": VERSION, "drives": [asdict(drive) for drive in drives]}
        written = json.dumps(content, indent=2, ensure_ascii=False)
        write_atomically(self._path, written.encode())

    def load(self) -> tuple[list[SavedDrive], list[Text]]:
        """The drives, and a message for each invalid entry; both empty where there is no file."""
        try:
            content = json.loads(self._path.read_text("utf-8"))
            entries = content["drives"]
        except FileNotFoundError:
            return [], []
        except (OSError, ValueError, KeyError, TypeError) as error:
            cause = prose(str(error))
            return [], [text("station.drive-list-not-read", file=self._path.name, cause=cause)]
        drives: list[SavedDrive] = []
        problems: list[Text] = []
        for number, entry in enumerate(entries if isinstance(entries, list) else [], start=1):
            try:
                drives.append(_DRIVE.validate_python(entry))
            except ValidationError as error:
                first = error.errors()[0]
                place = ".".join(str(part) for part in first["loc"])
                problems.append(
                    text(
                        "station.drive-list-entry-unusable",
                        file=self._path.name,
                        number=number,
                        place=place,
                        cause=reason_of(first),
                    )
                )
        return drives, problems
