"""The version of a state folder: an upgrade migrates it, an older program refuses it.

``state.json`` in the state folder says which version of the folder's contents a program has
written, which program that was, and which revisions its database has. Version 1 is what servodeck
0.1.0 wrote, which kept no such file. Whatever changes files of the folder so that the program
before would misread them adds a version and a step to `_STEPS`; new revisions of the database
count by themselves.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import backend
from backend.store.files import write_atomically
from backend.store.lock import FolderLock
from drivers.errors import NotAllowed

FILE = "state.json"
VERSION = 2
#: What 0.1.0 wrote has no file that says so.
FIRST = 1


class StateRefused(NotAllowed):
    """The state folder is not one that this program understands; nothing was written."""

    kind = "state-refused"


@dataclass(frozen=True, slots=True)
class StateVersion:
    """``version`` of the folder's contents, the ``program`` (its version, empty where not known)
    that wrote it, and the ``revisions`` that the program's database has.
    """

    version: int
    program: str = ""
    revisions: frozenset[str] = frozenset()


def read(folder: Path) -> StateVersion | None:
    """The version of a folder; None where nothing is kept in it. Changes nothing.

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
        # What cannot be listed is refused by whoever wants to write there.
        return False


def check(folder: Path) -> StateVersion | None:
    """The version of a folder that this program understands, as `read`. Changes nothing.

    Raises:
        StateRefused: a newer program has written it, or its version cannot be read.
    """
    found = read(folder)
    if found is None:
        return None
    from backend.store import migrate  # commands without a database need none of it

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
    """Migrate the folder and note its version; True where something was migrated. Blocks.

    The caller holds the folder's lock. Each step is noted when it is done, and done again where
    the process ended before that.

    Raises:
        StateRefused: as `check`; nothing was changed.
        StorageFailed: it cannot be written; the folder is of the version that was noted last.
    """
    found = check(folder)
    from backend.store import migrate  # commands without a database need none of it

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
    """Version 2 keeps what 0.1.0 wrote as it is, next to restore lists by a drive's identity.

    Restore lists in ``owed/`` are adopted when their drive answers (`RestoreStore`), since
    only then its serial number is known; the database has migrations of its own.
    """


#: By version what makes the next one of it; done twice it does no harm.
_STEPS: Mapping[int, Callable[[Path], None]] = {FIRST: _from_first}
