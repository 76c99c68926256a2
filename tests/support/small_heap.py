"""Keep garbage collection short in a process that runs many tests.

A full collection visits every object that earlier tests and imports left and took up to 0.5 s. No
task of the process runs meanwhile: a motion whose setpoints are valid for 0.2 s is braked. The
server excludes what its start made for the same reason.
"""

from __future__ import annotations

import pytest

from drivers.computer.timing.scheduling import spare_collector


class SmallHeap:
    """Exclude from collection what lived before the first test of each file.

    What the tests of a file leave in cycles is collected before that, with its warnings.
    """

    def __init__(self) -> None:
        self._file: object = None

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_setup(self, item: pytest.Item) -> None:
        """At the first test of a file, before its fixtures."""
        if item.path != self._file:
            self._file = item.path
            spare_collector()
