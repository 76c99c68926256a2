"""What holds for every test: none sees the files of the person who runs it."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest

_ROOT = Path(__file__).resolve().parents[1]
_homes = pytest.StashKey[tempfile.TemporaryDirectory[str]]()


def pytest_configure(config: pytest.Config) -> None:
    """Own folders for data and settings, also of the processes that tests start.

    The cache is shared by all tests: it holds only what is made from the project's own files.
    """
    home = tempfile.TemporaryDirectory(prefix="servodeck-tests-")
    config.stash[_homes] = home
    os.environ["XDG_DATA_HOME"] = str(Path(home.name) / "data")
    os.environ["XDG_CONFIG_HOME"] = str(Path(home.name) / "config")
    os.environ["XDG_STATE_HOME"] = str(Path(home.name) / "state")
    os.environ["XDG_CACHE_HOME"] = str(_ROOT / ".pytest_cache" / "user")
    for name in ("SERVODECK_PROFILES", "SERVODECK_CACHE", "SERVODECK_SERVER"):
        os.environ.pop(name, None)


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove the folders again."""
    home = config.stash.get(_homes, None)
    if home is not None:
        home.cleanup()
