"""Free space of a disk, and the reserve that stays free for the rest of the system."""

from __future__ import annotations

import shutil
from pathlib import Path

#: Free space at which recordings and exports end, so that the system keeps running [bytes].
RESERVE_BYTES = 200 * 1024 * 1024


def free_bytes(folder: Path) -> int:
    """Free space of the disk that holds ``folder``, in bytes."""
    return shutil.disk_usage(folder).free
