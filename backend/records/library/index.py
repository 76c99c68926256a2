"""Index of files of the state folder as entries of the library, without copying them.

Recordings, measurements and reports are written by their own parts of the program, directly into
their folders. The index compares names, times and sizes with the database, reads new or changed
files, and removes entries of deleted ones. It is therefore correct again after a crash, after
deletions by retention, and after files were copied by hand.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from sqlalchemy import select
from sqlalchemy.orm import selectinload

from backend.foundation.store.database import Store
from backend.foundation.store.files import files_of, shown_name
from backend.foundation.store.library_tables import Item, Tag
from backend.records.library import rows
from backend.records.library.entries import Addition, Kind
from drivers.errors import NotAllowed
from drivers.texts.answers import sentence


@dataclass(frozen=True, slots=True)
class Described:
    """Index data of a file. ``notes`` and ``tags`` only where the file contains them."""

    addition: Addition
    notes: str | None = None
    tags: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True)
class Folder:
    """A folder that is indexed. ``describe`` may raise NotAllowed for a file that is damaged.

    ``sidecar``: suffix of an accompanying file, whose change counts as well.
    """

    kind: Kind
    path: Path
    suffixes: tuple[str, ...]
    describe: Callable[[Path], Described]
    sidecar: str = ""

    def stamps(self) -> dict[str, str]:
        """Names of its files, each with a stamp that changes with the file."""
        found: dict[str, str] = {}
        for path in files_of(self.path, *self.suffixes):
            if shown_name(path) != path.name:
                continue  # no database contains a name that is not UTF-8
            try:
                status = path.stat()
                stamp = f"{status.st_mtime_ns}:{status.st_size}"
                sidecar = path.with_name(path.name + self.sidecar)
                if self.sidecar and sidecar.exists():
                    stamp += f":{sidecar.stat().st_mtime_ns}"
            except FileNotFoundError:
                continue  # deleted at this moment
            found[path.name] = stamp
        return found


class Index:
    """Keeps the entries of one station's folders up to date. Blocks."""

    def __init__(self, store: Store, station: str, folders: Iterable[Folder]) -> None:
        self._store = store
        self._station = station
        self.folders = {folder.kind: folder for folder in folders}

    def path(self, kind: Kind, name: str) -> Path | None:
        """Path of the file of an entry of this station; None where it is gone."""
        folder = self.folders.get(kind)
        if folder is None or Path(name).name != name:
            return None
        path = folder.path / name
        return path if path.is_file() else None

    def refresh(self, busy: Collection[str] = ()) -> None:
        """Bring the entries up to date; files named in ``busy`` are still being written.

        Raises:
            DatabaseFailed: an error of the database; the next refresh continues.
        """
        for folder in self.folders.values():
            self._refresh(folder, busy)

    def _refresh(self, folder: Folder, busy: Collection[str]) -> None:
        here = {name: s for name, s in folder.stamps().items() if name not in busy}
        ours = select(Item).where(Item.kind == folder.kind, Item.station == self._station)
        with self._store.reading() as session:
            known = {
                item.name: str(item.versions[-1].facts.get("stamp", ""))
                for item in session.scalars(ours.options(selectinload(Item.versions)))
                if item.versions
            }
        gone = [name for name in known if name not in here and name not in busy]
        fresh = {name: s for name, s in here.items() if known.get(name) != s}
        if not gone and not fresh:
            return
        # Reading files takes time, so it is outside the transaction.
        described = {name: self._describe(folder, name, stamp) for name, stamp in fresh.items()}
        with self._store.writing() as session:
            items = {item.name: item for item in session.scalars(ours)}
            for name in gone:
                if name in items:
                    session.delete(items[name])
            for name, found in described.items():
                if found is None:
                    continue
                item = items.get(name)
                if item is None:
                    item = Item(
                        kind=folder.kind,
                        station=self._station,
                        name=name,
                        notes="",
                        words="",
                        changed=datetime.now(UTC),
                    )
                    session.add(item)
                _put(item, found, folder.path / name)

    def _describe(self, folder: Folder, name: str, stamp: str) -> Described | None:
        path = folder.path / name
        try:
            found = folder.describe(path)
        except NotAllowed as error:
            found = Described(Addition(facts=sentence("problem", error.text)))
        except FileNotFoundError:
            return None
        facts = {**found.addition.facts, "stamp": stamp}
        addition = Addition(
            axis=found.addition.axis,
            author=found.addition.author,
            notes=found.addition.notes,
            saved=found.addition.saved,
            facts=facts,
        )
        return Described(addition, found.notes, found.tags)


def _put(item: Item, found: Described, path: Path) -> None:
    """Replace the only version of a file's entry by its present state."""
    try:
        status = path.stat()
    except FileNotFoundError:
        return
    modified = datetime.fromtimestamp(status.st_mtime, UTC)
    item.versions = [rows.new_version(1, "file", "", status.st_size, found.addition, modified)]
    item.changed = found.addition.saved or modified
    if found.notes is not None:
        item.notes = found.notes
    if found.tags is not None:
        have = {tag.tag: tag for tag in item.tags}
        item.tags = [have.get(tag) or Tag(tag=tag) for tag in dict.fromkeys(found.tags)]
    item.words = rows.words(item)
