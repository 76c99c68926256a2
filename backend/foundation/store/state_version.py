"""Version of a state folder: an upgrade migrates the folder, an older program refuses it.

``state.json`` in the state folder contains the version of the folder's contents, the program that
wrote it, and the revisions of its database. Version 1 is the contents written by servodeck 0.1.0,
which wrote no such file. A change to files of the folder that an earlier program would misread
needs a new version and a step in `_STEPS`; new database revisions need neither.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import backend
from backend.foundation.store.files import write_atomically
from backend.foundation.store.lock import FolderLock
from drivers.errors import NotAllowed

FILE = "state.json"
VERSION = 2
#: Version of folders without the file: written by 0.1.0.
FIRST = 1


class StateRefused(NotAllowed):
    """The state folder is not of a version that this program supports; nothing was written."""

    kind = "state-refused"


@dataclass(frozen=True, slots=True)
class StateVersion:
    """Contents of ``state.json``.

    ``version`` of the folder's contents, ``program`` version that wrote it (empty where unknown),
    and ``revisions`` of that program's database.
    """

    version: int
    program: str = ""
    revisions: frozenset[str] = frozenset()


def read(folder: Path) -> StateVersion | None:
    """Read the version of a folder; None if nothing is stored in it. Changes nothing.

    Raises:
        StateRefused: the file is damaged, or cannot be read.
    """
    file = folder / FILE
    try:
        content = json.loads(file.read_bytes())
        return StateVersion(
            int(content["version"]),
            str(content["program"]),
            frozenset(str(one) for one in content["revisions"]),
        )
    except (FileNotFoundError, NotADirectoryError):
        return StateVersion(FIRST) if _is_used(folder) else None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StateRefused(
            "store.state-version-unreadable", value=str(file), file=str(file), cause=str(error)
        ) from error


def _is_used(folder: Path) -> bool:
    try:
        return any(path.name != FolderLock.NAME for path in folder.iterdir())
    except OSError:
        # A folder that cannot be listed is refused later, by the code that writes to it.
        return False


def check(folder: Path) -> StateVersion | None:
    """Read the version of a folder and check that this program supports it. Changes nothing.

    Raises:
        StateRefused: a newer program has written it, or its version cannot be read.
    """
    found = read(folder)
    if found is None:
        return None
    from backend.foundation.store import migrate  # not needed by commands without a database

    unknown = found.revisions - migrate.known_revisions()
    if found.version > VERSION or unknown:
        raise StateRefused(
            "store.state-newer",
            value=found.version,
            limit=str(VERSION),
            folder=str(folder),
            program=found.program,
            have=backend.__version__,
        )
    return found


def bring_up_to_date(folder: Path) -> bool:
    """Migrate the folder and record its version; True if something was migrated. Blocks.

    The caller holds the folder's lock. Each completed step is recorded, and repeated if the
    process ended before that.

    Raises:
        StateRefused: as `check`; nothing was changed.
        StorageFailed: the folder cannot be written; it has the version that was recorded last.
    """
    found = check(folder)
    from backend.foundation.store import migrate  # not needed by commands without a database

    revisions = migrate.known_revisions()
    wanted = StateVersion(VERSION, backend.__version__, revisions)
    if found == wanted:
        return False
    version = VERSION if found is None else found.version
    migrated = version < VERSION
    while version < VERSION:
        _STEPS[version](folder)
        version += 1
        _note(folder, StateVersion(version, backend.__version__, revisions))
    if not migrated:
        _note(folder, wanted)
    return migrated


def _note(folder: Path, state: StateVersion) -> None:
    content = {
        "format": "servodeck state",
        "version": state.version,
        "program": state.program,
        "revisions": sorted(state.revisions),
    }
    write_atomically(folder / FILE, json.dumps(content, indent=1).encode())


def _from_first(_folder: Path) -> None:
    """Step to version 2: no file changes; version 2 adds restore lists named by a drive's identity.

    Restore lists in ``owed/`` are adopted when their drive answers (`RestoreStore`), as its serial
    number is unknown before; the database has migrations of its own.
    """


#: By version: the step to the next version. Repeating a step does no harm.
_STEPS: Mapping[int, Callable[[Path], None]] = {FIRST: _from_first}
