"""File with the list of a bench's drives, to connect them again after a restart."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from backend.foundation.store.files import StorageFailed, write_atomically
from drivers.texts.message import Text, Unsuitable, prose, text
from drivers.texts.validation import reason_of

VERSION = 1
_DAMAGED = ".damaged"


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
        #: Whether the file has something that was not loaded, so that it must not be lost.
        self._damaged = False

    def store(self, drives: Iterable[SavedDrive]) -> None:
        """Replace the file atomically; a damaged one is kept under another name.

        Raises:
            StorageFailed: it cannot be written, or the damaged one cannot be kept.
        """
        if self._damaged:
            self._set_aside()
            self._damaged = False
        content = {"version": VERSION, "drives": [asdict(drive) for drive in drives]}
        written = json.dumps(content, indent=2, ensure_ascii=False)
        write_atomically(self._path, written.encode())

    def load(self) -> tuple[list[SavedDrive], list[Text]]:
        """The drives, and a message for each invalid entry; both empty where there is no file.

        Damaged lists that were kept under another name have a message each as well.
        """
        self._damaged = False
        kept = [
            text("station.drive-list-damaged-kept", file=str(file))
            for file in sorted(self._path.parent.glob(f"{self._path.name}{_DAMAGED}*"))
        ]
        try:
            entries = _entries(json.loads(self._path.read_text("utf-8")))
        except FileNotFoundError:
            return [], kept
        except (OSError, ValueError, KeyError, TypeError) as error:
            self._damaged = True
            cause = prose(str(error))
            line = text("station.drive-list-not-read", file=self._path.name, cause=cause)
            return [], [line, *kept]
        drives: list[SavedDrive] = []
        problems: list[Text] = []
        for number, entry in enumerate(entries, start=1):
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
        self._damaged = bool(problems)
        return drives, problems + kept

    def _set_aside(self) -> None:
        """Keep the present file under another name before it is replaced."""
        number, aside = 2, self._path.with_name(self._path.name + _DAMAGED)
        while aside.exists():
            aside = self._path.with_name(f"{self._path.name}{_DAMAGED}-{number}")
            number += 1
        try:
            try:
                # The file stays at its place as well, so that no failure leaves none there.
                aside.hardlink_to(self._path)
            except OSError:
                self._path.rename(aside)
        except FileNotFoundError:
            return
        except OSError as error:
            raise StorageFailed(
                "store.not-written",
                value=str(aside),
                path=aside.name,
                strerror=str(error.strerror or error),
            ) from error


def _entries(content: dict[str, object]) -> list[object]:
    entries = content["drives"]
    if not isinstance(entries, list):
        raise TypeError("drives: not a list")
    return entries
