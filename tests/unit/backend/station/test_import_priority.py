"""Processes that read files of others go after the server: STOP and the buses come first."""

from __future__ import annotations

import os
import subprocess
import sys

import psutil
import pytest

from tests.support.station import until


@pytest.mark.long(keep=1)
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has classes of priority, no steps")
@pytest.mark.parametrize(
    "module",
    [["backend.station.drives.import_process", "768"], ["backend.records.response_import.process"]],
)
def test_an_import_goes_after_the_server(module: list[str]) -> None:
    own = os.getpriority(os.PRIO_PROCESS, 0)
    with subprocess.Popen(
        [sys.executable, "-m", *module],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as reading:
        try:
            # It waits for its task here, so that the priority can be seen.
            until(lambda: psutil.Process(reading.pid).nice() == min(own + 10, 19))
        finally:
            reading.kill()
