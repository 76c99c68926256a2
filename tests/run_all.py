"""Runs every check, says how long each took, and fails if any failed.

    python tests/run_all.py [--fast | --long]

``--fast`` leaves out the suites (what pre-commit runs). ``--long`` runs the tests with the marker
``long`` as well (see `tests/support/long_suite.py`).
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import IO, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
BIN = Path(sys.executable).parent
#: Without a system npm, the one of a Python package (see hatch_build.py).
NPM = ["npm"] if shutil.which("npm") else [sys.executable, str(ROOT / "hatch_build.py")]

PYTEST = [sys.executable, "-m", "pytest", "-q", "-rfEs", "--durations=12"]
#: Suites with a bus in real time. Nothing runs next to them: a master that is kept from its cycle
#: for 30 ms must brake the axis, and then the test does not see what it wants to see.
REAL_TIME = [
    # First: what earlier tests leave in memory makes the server of this one slower.
    "tests/api/test_stop_floods.py",
    "tests/api/test_stop_first.py",
    "tests/api/test_ethercat.py",
    "tests/api/test_ethercat_faults.py",
    "tests/api/test_ethercat_segment.py",
    "tests/api/test_every_family.py",
    "tests/api/test_gantry.py",
    "tests/api/test_demo_defects.py",
    "tests/wire/ethercat_host",
    "tests/api/test_scope_streams.py",
    "tests/api/test_scope_soak.py",
    "tests/api/test_scales_taught.py",
    "tests/docs",
    # A bound on processor time, which another program on the same core lengthens.
    "tests/unit/importer/test_importer_large.py",
]
#: Suites that compute and keep no time.
PATIENT = [
    "tests/profiles",
    "tests/unit",
    "tests/virtual/conformance",
    "tests/virtual/firmware",
    # Measurements and tunings whose buses follow the frames, however late they come.
    "tests/virtual/tools/test_excitations.py",
    "tests/virtual/tools/test_families.py",
    "tests/virtual/tools/test_notches.py",
    "tests/virtual/tools/test_play.py",
    "tests/virtual/tools/test_wrong_situations.py",
]
#: No check takes as long, in s: one that does hangs, and ends with all that it has started.
LIMIT_S = 2400.0
#: Of every suite what ran, as JUnit XML.
REPORTS = ".pytest_cache/reports"
TWO = ["-n", "2", "--dist", "loadfile"]
#: Two worker processes take half the time of one.
TYPES = [str(BIN / "mypy"), "--num-workers", "2"]


class Check(NamedTuple):
    """A command that must end with 0."""

    name: str
    command: Sequence[str]
    folder: Path = ROOT


def pytest(name: str, *arguments: str) -> Check:
    """A suite; its report says what ran (see `tests/matrix.py`)."""
    return Check(name, [*PYTEST, f"--junitxml={REPORTS}/{name}.xml", *arguments])


def ignoring(paths: Sequence[str]) -> list[str]:
    """Arguments that leave these out."""
    return [f"--ignore={path}" for path in paths]


def types_on(system: str) -> Check:
    """The types as another system has them; what that system alone cannot reach is no mistake."""
    cache = f".mypy_cache/{system}"
    return Check(
        f"types on {system}",
        [*TYPES, "--platform", system, "--no-warn-unreachable", "--cache-dir", cache],
    )


QUICK = [
    Check("format", [str(BIN / "ruff"), "format", "--check", "."]),
    Check("lint", [str(BIN / "ruff"), "check", "."]),
    Check("types", TYPES),
    *(types_on(system) for system in ("win32", "darwin")),
    Check("client drift", [sys.executable, "tests/client_drift.py"]),
    Check("dependencies", [str(BIN / "deptry"), "."]),
    Check("import contracts", [str(BIN / "lint-imports")]),
    Check("terms and sentences", [sys.executable, ".ci/docs", "--check"]),
    Check("supply chain", [sys.executable, ".ci/supply", "--check"]),
    # Without --quiet, which drops the warnings before --strict counts them.
    Check("docs", [str(BIN / "mkdocs"), "build", "--strict"]),
]
#: Checks without a bus as well, next to the others: about as long as they.
QUICK_BESIDE = [
    Check("page: types and lint", [*NPM, "run", "--silent", "check"], ROOT / "webui"),
    Check("page: unit tests", [*NPM, "run", "--silent", "test"], ROOT / "webui"),
]
TIMED = [
    pytest("tests", *TWO, "-m", "not browser", "tests", *ignoring(REAL_TIME), *ignoring(PATIENT)),
]
BUSES = [pytest("EtherCAT tests", *REAL_TIME)]
PAGES = [pytest("browser tests", "-m", "browser", "tests/browser")]
PARALLEL = [
    # Workers write to a pipe: tests of full disks bound the length of files.
    pytest("patient tests", *TWO, "--timeout=900", *PATIENT, *ignoring(REAL_TIME)),
]
#: Whether the documentation says no more than what has just run.
MATRIX = [Check("matrix", [sys.executable, "tests/matrix.py", REPORTS])]


class Runner:
    """Runs checks one by one, and remembers which failed."""

    def __init__(self, out: IO[str]) -> None:
        self.failed: list[str] = []
        self._out = out
        self._environment = os.environ | {
            "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}",
            "PYTHONUNBUFFERED": "1",
        }
        # Hundreds of servers, commands and virtual drives are started: 2 s of compiling each.
        self._environment.pop("PYTHONDONTWRITEBYTECODE", None)

    def run(self, checks: Sequence[Check]) -> None:
        """Run them in turn; what they print goes where this prints."""
        for check in checks:
            self._say(f"== {check.name}")
            began = time.monotonic()
            code = self._once(check.command, check.folder)
            self._say(f"== {check.name}: {time.monotonic() - began:.0f} s, exit {code}")
            if code != 0:
                self.failed.append(check.name)

    def _say(self, line: str) -> None:
        print(line, file=self._out, flush=True)

    def _once(self, command: Sequence[str], folder: Path) -> int:
        mark = str(uuid.uuid4())
        with subprocess.Popen(
            command, cwd=folder, env=self._environment | {MARK: mark}, stdout=self._out,
            stderr=subprocess.STDOUT, start_new_session=True,
        ) as process, _ended_with_this(process.pid, mark):  # fmt: skip
            try:
                return process.wait(LIMIT_S)
            except subprocess.TimeoutExpired:
                self._say(f"== ended after {LIMIT_S:.0f} s, as it hangs")
                return HANGS


HANGS = 124
"""The exit code of a check that was ended, as of timeout(1)."""
MARK = "SERVODECK_CHECK"
"""Environment variable that every process of a check inherits, whatever session it makes."""
_running: dict[str, int] = {}


@contextmanager
def _ended_with_this(group: int, mark: str) -> Iterator[None]:
    """Whatever a check has started ends with it, virtual drives in sessions of their own too."""
    _running[mark] = group
    try:
        yield
    finally:
        del _running[mark]
        _end(group, mark)


def _end(group: int, mark: str) -> None:
    with suppress(ProcessLookupError):
        os.killpg(group, signal.SIGKILL)
    wanted = f"{MARK}={mark}".encode()
    for folder in Path("/proc").glob("[0-9]*"):
        # Processes of others, and those that end meanwhile.
        with suppress(OSError):
            if wanted in (folder / "environ").read_bytes().split(b"\0"):
                os.kill(int(folder.name), signal.SIGKILL)


def _interrupted(number: int, _frame: FrameType | None) -> None:
    for mark, group in tuple(_running.items()):
        _end(group, mark)
    os._exit(128 + number)


def main() -> int:
    """Run the checks; the exit code is the number of those that failed."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupted)
    shutil.rmtree(ROOT / ".pytest_cache", ignore_errors=True)
    began = time.monotonic()
    runner = Runner(sys.stdout)
    checks = [*QUICK, *QUICK_BESIDE]
    run_quick(runner)
    if "--fast" not in sys.argv:
        rest = [*suites("all" if "--long" in sys.argv else "without"), *MATRIX]
        runner.run(rest)
        checks += rest
    failed = runner.failed
    print(f"failed: {', '.join(failed)}" if failed else "all checks passed")
    print(
        f"{len(checks) - len(failed)} passed, {len(failed)} failed, "
        f"{time.monotonic() - began:.0f} s"
    )
    return len(failed)


def suites(which: str) -> list[Check]:
    """The suites, one after the other: two at a time take as long on two processors, and disturb
    one another. ``which`` is for ``--long`` of pytest.
    """
    return [
        check._replace(command=[*check.command, f"--long={which}"])
        for check in (*PARALLEL, *TIMED, *BUSES, *PAGES)
    ]


def run_quick(runner: Runner) -> None:
    """Run the checks without a bus in two lanes."""
    with tempfile.TemporaryFile("w+", encoding="utf-8") as printed, ThreadPoolExecutor() as pool:
        parallel = Runner(printed)
        lane = pool.submit(parallel.run, QUICK_BESIDE)
        runner.run(QUICK)
        lane.result()
        printed.seek(0)
        shutil.copyfileobj(printed, sys.stdout)
    runner.failed += parallel.failed


if __name__ == "__main__":
    raise SystemExit(main())
