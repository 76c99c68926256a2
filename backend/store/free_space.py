"""How much of a disk is left, and how much stays free for the rest of the system."""

from __future__ import annotations

import shutil
from pathlib import Path

#: Recordings and exports end while this much is still free, so that the system lives on (bytes).
RESERVE_BYTES = 200 * 1024 * 1024


def free_bytes(folder: Path) -> int:
    """Free space of the disk that holds ``folder``, in bytes."""
    return shutil.disk_usage(folder).free
