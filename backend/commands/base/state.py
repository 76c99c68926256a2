"""The state folder of a station."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs

from backend.foundation.store import state_version
from drivers.computer.files import longest_path
from drivers.errors import NotAllowed

STATE_FOLDER_VARIABLE = "SERVODECK_CONFIG"
#: Characters of the longest path within a state folder: a recording with a name of 100 letters, in
#: its folder, while it is written under a temporary name.
_WITHIN = 140


def state_folder(chosen: Path | None) -> Path:
    """Folder of the list of drives, the parameter sets and the restore lists.

    Where no folder is given, the environment variable SERVODECK_CONFIG is used, so that server and
    commands of one station share the folder.

    Raises:
        StateRefused: a newer servodeck has written it.
        NotAllowed: its path is too long for the files in it (Windows).
    """
    folder = chosen_folder(chosen)
    longest = longest_path()
    if longest is not None and len(str(folder.absolute())) > longest - _WITHIN:
        raise NotAllowed(
            "command.state-folder-too-deep", value=str(folder), limit=str(longest - _WITHIN)
        )
    state_version.check(folder)
    return folder


def chosen_folder(chosen: Path | None) -> Path:
    """The same folder without a check of its version, for a restore that replaces it."""
    named = os.environ.get(STATE_FOLDER_VARIABLE)
    return chosen or Path(named or platformdirs.user_data_dir("servodeck"))
