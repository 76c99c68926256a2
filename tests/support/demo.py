"""The command `servodeck demo` as a process, for what has to meet it as a person does."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import httpx

from tests.support.station import HANG_S, until

#: Starting all virtual drives of the demo takes some seconds, on a busy computer many.
START_S = 120.0
#: The axis on which the demo opens.
AXIS = "gantry-left"


class Demo:
    """The running command; `http` talks to its interface."""

    def __init__(self, folder: Path, bench: Path | None = None) -> None:
        """`bench`: another bench file than the standard one."""
        command = [sys.executable, "-m", "backend", "demo", "--port", "0"]
        if bench is not None:
            command += ["--bench", str(bench)]
        self._process = subprocess.Popen(
            [*command, "--config", str(folder)], stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        self.url = ""
        deadline = time.monotonic() + START_S
        for line in self._process.stdout:
            if found := re.search(r"servodeck is at (\S+)", line):
                self.url = found[1]
                break
            assert time.monotonic() < deadline, "the demo does not start"
        assert self.url, "the demo ended"
        self.http = httpx.Client(base_url=f"{self.url}api/v1", timeout=HANG_S)

    def ask(self, path: str) -> Any:
        answer = self.http.get(path)
        assert answer.is_success, answer.text
        return answer.json()

    def fresh(self) -> Any:
        """The state of the first axis, once its drive answers: a busy computer loses it."""

        def answered() -> Any:
            state = self.ask(f"/drives/{AXIS}/state")
            return state if state["fresh"] and state["position"] is not None else None

        return until(answered, START_S, "the axis answers")

    def jobs(self) -> list[str]:
        """Kinds of the jobs that somebody started: reading again after a lost line is not one."""
        return [job["kind"] for job in self.ask("/jobs") if job["kind"] != "reread"]

    def close(self) -> None:
        self.http.close()
        self._process.terminate()
        self._process.wait(30)
        assert self._process.stdout is not None
        self._process.stdout.close()
