"""A complete file takes the place of another one, also while a third program reads it."""

from __future__ import annotations

import os
import time
from pathlib import Path

#: Pauses between attempts [s]. Together shorter than the 200 ms after which a setpoint expires:
#: the caller can be the event loop of a server with an axis in motion.
PAUSES_S = (0.005, 0.01, 0.02, 0.04, 0.07)


def move_into_place(source: Path, target: Path) -> None:
    """Replace ``target`` by ``source`` in one step; try again for a short time if it is refused.

    Windows refuses it while a program has either file open: a virus scanner, OneDrive, an indexer,
    for some milliseconds each (ERROR_ACCESS_DENIED, ERROR_SHARING_VIOLATION of MoveFileEx).

    Raises:
        OSError: it was not done, and both files are as they were.
    """
    for pause_s in PAUSES_S:
        try:
            source.replace(target)
        except PermissionError:
            # In a folder that may not be written, waiting changes nothing.
            if not os.access(target.parent, os.W_OK):
                raise
            time.sleep(pause_s)
        else:
            return
    source.replace(target)
