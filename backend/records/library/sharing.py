"""Sharing files of one station's folders with the other stations of a shared library.

A file is copied into the library's contents. From there any station can copy it into its own
folder, where it is opened like any other. Both copies are verified by their SHA-256.
"""

from __future__ import annotations

import re
from pathlib import Path

from backend.foundation.store.files import StorageFailed, write_atomically
from backend.records.library.catalogue import Library
from backend.records.library.described import require_usable
from backend.records.library.entries import Addition, Entry
from backend.records.library.index import Index
from drivers.errors import NotAllowed
from drivers.texts import limits

#: Largest file; contents are held in memory on their way to and from the store.
MOST_BYTES = 256 << 20
#: Fact that the index stores for its own use; it does not hold for a copy.
_STAMP = "stamp"


def shared_name(station: str, name: str) -> str:
    """Name of a shared file, preceded by its station's name, as stations may have equal names."""
    plain = re.sub(r"[^\w.\-]", "-", station).strip(".-")[:30] or "station"
    return f"{plain} {name}"


def share(library: Library, index: Index, entry: Entry) -> Entry:
    """Copy a file of this station into the library. Equal contents make no new version.

    Raises:
        NotAllowed: the entry is shared already, its file is gone, or it is too large.
        StorageFailed: an error of the store.
    """
    path = index.path(entry.kind, entry.name) if entry.station else None
    if path is None:
        raise NotAllowed("library.no-file-station", value=entry.name)
    size = path.stat().st_size
    if size > MOST_BYTES:
        raise NotAllowed(
            "library.too-large-library", value=size, limit=limits.size(MOST_BYTES), entry=entry.name
        )
    latest = entry.latest
    facts = {name: value for name, value in latest.facts.items() if name != _STAMP}
    facts["words"] = f"{facts.get('words', '')} {entry.station}".strip()
    return library.add(
        entry.kind,
        shared_name(entry.station, entry.name),
        path.read_bytes(),
        Addition(latest.axis, latest.author, latest.notes, latest.saved, facts, entry.tags),
    )


def fetch(library: Library, index: Index, entry: Entry) -> str:
    """Copy shared contents into this station's folder; return the file's name.

    Raises:
        NotAllowed: not a kind that is stored in folders, damaged, or another file has this name.
        StorageFailed: an error of store or disk.
    """
    folder = index.folders.get(entry.kind)
    if folder is None or entry.station:
        raise NotAllowed("library.not-shared-contents-recording", value=entry.name)
    if Path(entry.name).name != entry.name or not entry.name.endswith(folder.suffixes):
        raise NotAllowed("library.no-file-name-kind", value=entry.name)
    path = folder.path / entry.name
    data = library.content(entry.id)
    if path.exists():
        if path.read_bytes() == data:
            return entry.name
        raise NotAllowed("library.another-station-already", value=entry.name)
    # Checked under a hidden name, so that nobody opens a damaged file.
    waiting = path.with_name(f".{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(waiting, data)
        require_usable(entry.kind, waiting)
        waiting.rename(path)
    except OSError as error:
        raise StorageFailed(
            "library.cannot-kept", value=str(path), entry=entry.name, cause=str(error)
        ) from error
    finally:
        waiting.unlink(missing_ok=True)
    return entry.name
