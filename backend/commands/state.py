"""Where a station keeps what it keeps."""

from __future__ import annotations

from pathlib import Path

import platformdirs


def state_folder(chosen: Path | None) -> Path:
    """Where the list of drives and the parameter sets are kept."""
    return chosen or Path(platformdirs.user_data_dir("servodeck"))
