"""The state folder of a station."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs

from backend.store import state_version

STATE_FOLDER_VARIABLE = "SERVODECK_CONFIG"


def state_folder(chosen: Path | None) -> Path:
    """Folder of the list of drives, the parameter sets and the restore lists.

    Where no folder is given, the environment variable SERVODECK_CONFIG is used, so that server and
    commands of one station share the folder.

    Raises:
        StateRefused: a newer servodeck has written it.
    """
    folder = chosen_folder(chosen)
    state_version.check(folder)
    return folder


def chosen_folder(chosen: Path | None) -> Path:
    """The same folder without a check of its version, for a restore that replaces it."""
    named = os.environ.get(STATE_FOLDER_VARIABLE)
    return chosen or Path(named or platformdirs.user_data_dir("servodeck"))
