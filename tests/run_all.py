"""Runs every check, says how long each took, and fails if any failed.

    python tests/run_all.py [--fast]

``--fast`` leaves out the browser and the slow suites (what pre-commit runs).
"""

from __future__ import annotations

import json
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

PYTEST = [sys.executable, "-m", "pytest", "-q", "-rs", "--durations=12"]
#: Suites with a bus in real time. Nothing runs next to them: a master that is kept from its cycle
#: for 30 ms must brake the axis, and then the test does not see what it wants to see.
REAL_TIME = [
    # First: what earlier tests leave in memory makes the server of this one slower.
    "tests/api/test_stop_floods.py",
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


class Check(NamedTuple):
    """A command that must end with 0."""

    name: str
    command: Sequence[str]
    folder: Path = ROOT


def pytest(name: str, *arguments: str, again: bool = False) -> Check:
    """A suite; each keeps its own note of what failed, as two may run at a time.

    Its report says what ran (see `tests/matrix.py`), that of a run ``again`` next to the first.
    """
    report = f"{REPORTS}/{name}{' again' if again else ''}.xml"
    noted = ["-o", f"cache_dir=.pytest_cache/{name}", f"--junitxml={report}"]
    return Check(name, [*PYTEST, *noted, *arguments])


def ignoring(paths: Sequence[str]) -> list[str]:
    """Arguments that leave these out."""
    return [f"--ignore={path}" for path in paths]


def types_on(system: str) -> Check:
    """The types as another system has them; what that system alone cannot reach is no mistake."""
    cache = f".mypy_cache/{system}"
    return Check(
        f"types on {system}",
        [str(BIN / "mypy"), "--platform", system, "--no-warn-unreachable", "--cache-dir", cache],
    )


QUICK = [
    Check("format", [str(BIN / "ruff"), "format", "--check", "."]),
    Check("lint", [str(BIN / "ruff"), "check", "."]),
    Check("types", [str(BIN / "mypy")]),
    *(types_on(system) for system in ("win32", "darwin")),
]
#: Checks without a bus as well, next to those of the types: about as long as they.
QUICK_BESIDE = [
    Check("page: types and lint", [*NPM, "run", "--silent", "check"], ROOT / "webui"),
    Check("page: unit tests", [*NPM, "run", "--silent", "test"], ROOT / "webui"),
    Check("client drift", [sys.executable, "tests/client_drift.py"]),
    Check("dependencies", [str(BIN / "deptry"), "."]),
    Check("import contracts", [str(BIN / "lint-imports")]),
    Check("terms and sentences", [sys.executable, ".ci/docs", "--check"]),
    Check("supply chain", [sys.executable, ".ci/supply", "--check"]),
    # Without --quiet, which drops the warnings before --strict counts them.
    Check("docs", [str(BIN / "mkdocs"), "build", "--strict"]),
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
        self.again: list[Check] = []
        """What failed in suites, to be run once more when nothing else runs."""
        self._out = out
        self._environment = os.environ | {
            "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}",
            "PYTHONUNBUFFERED": "1",
        }
        # Hundreds of servers, commands and virtual drives are started: 2 s of compiling each.
        self._environment.pop("PYTHONDONTWRITEBYTECODE", None)

    def run(self, checks: Sequence[Check], *, last: bool = False) -> None:
        """Run them in turn; what they print goes where this prints.

        Files with failed tests go to `again`, whole, as the tests of some follow one another; not
        at the ``last`` time. A busy machine is no defect, and a defect stays one.
        """
        for check in checks:
            self._say(f"== {check.name}")
            began = time.monotonic()
            code = self._once(check.command, check.folder)
            self._say(f"== {check.name}: {time.monotonic() - began:.0f} s, exit {code}")
            suite = list(check.command[: len(PYTEST)]) == PYTEST
            files = last_failed(check.name) if code == 1 and suite and not last else []
            if files:
                self.again.append(pytest(check.name, *files, again=True))
            elif code != 0:
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


def last_failed(name: str) -> list[str]:
    """Files with tests that failed in the last run of a suite; forgotten with this answer.

    None where the suite came to no end.
    """
    note = ROOT / ".pytest_cache" / name / "v" / "cache" / "lastfailed"
    if not note.exists():
        return []
    failed = json.loads(note.read_text("utf-8"))
    note.unlink()
    return sorted({test.partition("::")[0] for test in failed})


def main() -> int:
    """Run the checks; the exit code is the number of those that failed."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _interrupted)
    shutil.rmtree(ROOT / ".pytest_cache", ignore_errors=True)
    runner = Runner(sys.stdout)
    run_quick(runner)
    checks, failed = [*QUICK, *QUICK_BESIDE], runner.failed
    if "--fast" not in sys.argv:
        checks += [*TIMED, *BUSES, *PAGES, *PARALLEL, *MATRIX]
        failed = run_suites(runner)
    print(f"failed: {', '.join(failed)}" if failed else "all checks passed")
    print(f"{len(checks) - len(failed)} passed, {len(failed)} failed")
    return len(failed)


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


def run_suites(runner: Runner) -> list[str]:
    """Run one suite after the other; returns what failed twice.

    Two at a time take as long on two processors, and disturb one another.
    """
    runner.run([*TIMED, *BUSES, *PAGES, *PARALLEL])
    again = runner.again
    if again:
        alone = Runner(sys.stdout)
        print("== once more, alone", flush=True)
        alone.run(again, last=True)
        runner.failed += alone.failed
    runner.run(MATRIX)
    return runner.failed


if __name__ == "__main__":
    raise SystemExit(main())
