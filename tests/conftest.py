"""What holds for every test: none sees the files of the person who runs it."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest

from drivers.computer.timing.scheduling import VIRTUAL_PRIORITY
from tests.support import long_suite
from tests.support.hang import EndsWhatHangs
from tests.support.small_heap import SmallHeap

_ROOT = Path(__file__).resolve().parents[1]
_homes = pytest.StashKey[tempfile.TemporaryDirectory[str]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Which of the two suites runs (see `long_suite`)."""
    long_suite.add_option(parser)


def pytest_configure(config: pytest.Config) -> None:
    """Own folders for data and settings, also of the processes that tests start.

    The cache is shared by all tests: it holds only what is made from the project's own files.
    """
    config.pluginmanager.register(EndsWhatHangs(), "ends-what-hangs")
    config.pluginmanager.register(SmallHeap(), "small-heap")
    config.addinivalue_line("markers", long_suite.MARKER)
    config.pluginmanager.register(long_suite.LongSuite(config.getoption("--long")), "long-suite")
    home = tempfile.TemporaryDirectory(prefix="servodeck-tests-")
    config.stash[_homes] = home
    os.environ["XDG_DATA_HOME"] = str(Path(home.name) / "data")
    os.environ["XDG_CONFIG_HOME"] = str(Path(home.name) / "config")
    os.environ["XDG_STATE_HOME"] = str(Path(home.name) / "state")
    os.environ["XDG_CACHE_HOME"] = str(_ROOT / ".pytest_cache" / "user")
    # Tests share two cores: a second BLAS thread waits for the first. Child processes inherit it.
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    # Virtual drives and the masters next to them keep their time however busy the computer is.
    os.environ[VIRTUAL_PRIORITY] = "20"
    for name in ("SERVODECK_PROFILES", "SERVODECK_CACHE", "SERVODECK_SERVER"):
        os.environ.pop(name, None)


def pytest_unconfigure(config: pytest.Config) -> None:
    """Remove the folders again."""
    home = config.stash.get(_homes, None)
    if home is not None:
        home.cleanup()
