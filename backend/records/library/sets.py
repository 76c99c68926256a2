"""Parameter sets in the library, by name, and the folder from which files are imported."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC
from pathlib import Path

from backend.axes.parameters import set_file as parameter_set
from backend.axes.parameters.set_file import SUFFIX, BadSet, ParameterSet
from backend.foundation.store.files import (
    StorageFailed,
    checked_name,
    files_of,
    new_name,
    shown_name,
)
from backend.records.library.catalogue import Library
from backend.records.library.entries import Addition, AxisIdentity, Entry
from drivers.errors import NotAllowed
from drivers.texts.message import Text, text

_TAKEN = "imported"


def addition_of(content: ParameterSet, *, tags: Sequence[str] = ()) -> Addition:
    """Data that the library stores with the contents of a set."""
    return Addition(
        axis=AxisIdentity(
            profile=content.profile,
            name=content.drive_name,
            vendor_id=content.vendor_id,
            product_code=content.product_code,
            revision=content.revision,
            serial=content.serial,
            firmware=content.firmware,
        ),
        author=content.author,
        notes=content.notes,
        saved=content.saved.astimezone(UTC) if content.saved else None,
        facts={"parameters": len(content.rows)},
        tags=tuple(tags),
    )


class LibrarySets:
    """Sets of the library under their file names (``….sdset``). All methods block.

    Files in ``folder`` (from an earlier version, or put there by hand) are imported when sets are
    listed, and moved to its sub-folder ``imported``; files that are not sets stay.
    """

    def __init__(self, library: Library, folder: Path) -> None:
        self.library = library
        self.folder = folder

    def names(self) -> list[str]:
        """Names, newest first, followed by those of files that cannot be imported."""
        problems = self.take_in()
        return [entry.name for entry in self.entries()] + sorted(problems)

    def entries(self) -> list[Entry]:
        """Sets that are not deleted, newest first."""
        return self.library.all_of("set")

    def entry(self, name: str) -> Entry:
        """The set of this name.

        Raises:
            NotAllowed: there is none.
        """
        name = checked_name(name, SUFFIX)
        entry = self.library.named("set", name)
        if entry is None:
            raise NotAllowed("library.no-parameter-set", value=name)
        return entry

    def read(self, name: str, number: int | None = None) -> bytes:
        """Contents of a version, the latest by default.

        Raises:
            NotAllowed: no such set or version. BlobFailed: damaged.
        """
        path = self.folder / checked_name(name, SUFFIX)
        if self.library.named("set", path.name) is None and path.is_file():
            return path.read_bytes()  # a file that cannot be imported
        return self.library.content(self.entry(name).id, number)

    def load(self, name: str, number: int | None = None) -> ParameterSet:
        """Read and parse.

        Raises:
            NotAllowed: no such set or version. BadSet: not usable.
        """
        return parameter_set.parse(self.read(name, number), checked_name(name, SUFFIX))

    def store(
        self, name: str, data: bytes, *, overwrite: bool = False, tags: Sequence[str] = ()
    ) -> str:
        """Check and store a new set, or with ``overwrite`` a new version; returns its name.

        Raises:
            BadSet: the contents are no parameter set. NotAllowed: the name exists and
            ``overwrite`` is False. StorageFailed: disk or database. Nothing is stored then.
        """
        name = new_name(name, SUFFIX)
        content = parameter_set.parse(data, name)
        if not overwrite and self.library.named("set", name) is not None:
            raise NotAllowed("library.exists-already-choose-another-2", value=name)
        return self.library.add("set", name, data, addition_of(content, tags=tags)).name

    def delete(self, name: str) -> None:
        """Archive a set; a file that cannot be imported is deleted.

        Raises:
            NotAllowed: there is none of this name.
        """
        path = self.folder / checked_name(name, SUFFIX)
        if self.library.named("set", path.name) is None and path.is_file():
            path.unlink()
            return
        self.library.delete(self.entry(name).id)

    def take_in(self) -> dict[str, Text]:
        """Import the files of the folder; return those that cannot be imported, with the reason.

        A file is moved after its contents are stored. After a crash in between it is imported
        again, which makes no new version.
        """
        problems: dict[str, Text] = {}
        for path in sorted(files_of(self.folder, SUFFIX), key=_modified):
            shown = shown_name(path)
            try:
                data = path.read_bytes()
                name = checked_name(shown, SUFFIX)
                self.library.add("set", name, data, addition_of(parameter_set.parse(data, name)))
                _put_aside(path)
            except StorageFailed:
                raise
            except (BadSet, NotAllowed) as error:
                problems[shown] = error.text
            except FileNotFoundError:
                continue  # imported by another request at this moment
            except OSError as error:
                problems[shown] = text(
                    "library.set-cannot-be-read", name=shown, cause=error.strerror
                )
        return problems


def _modified(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0  # deleted at this moment


def _put_aside(path: Path) -> None:
    folder = path.parent / _TAKEN
    folder.mkdir(exist_ok=True)
    goal, number = folder / path.name, 2
    while goal.exists():
        goal, number = folder / f"{path.stem} {number}{path.suffix}", number + 1
    path.rename(goal)
