"""Runs every check in turn, says how long each took, and fails if any failed.

    python tests/run_all.py [--fast]

``--fast`` leaves out the browser and the slow suites (what pre-commit runs).
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BIN = Path(sys.executable).parent
#: Without a system npm, the one of a Python package (see hatch_build.py).
NPM = ["npm"] if shutil.which("npm") else [sys.executable, str(ROOT / "hatch_build.py")]

PYTEST = [sys.executable, "-m", "pytest", "-q", "--durations=12"]
#: Suites with a bus in real time have the machine to themselves: a master that is kept from its
#: cycle for 30 ms must brake the axis, and then the test does not see what it wants to see.
REAL_TIME = [
    "tests/api/test_ethercat.py", "tests/api/test_ethercat_faults.py",
    "tests/api/test_ethercat_segment.py", "tests/api/test_every_family.py",
    "tests/wire/ethercat_host",
    "tests/api/test_scope_streams.py", "tests/api/test_scope_soak.py",
]  # fmt: skip

CHECKS: list[tuple[str, list[str], Path]] = [
    ("format", [str(BIN / "ruff"), "format", "--check", "."], ROOT),
    ("lint", [str(BIN / "ruff"), "check", "."], ROOT),
    ("types", [str(BIN / "mypy")], ROOT),
    ("dependencies", [str(BIN / "deptry"), "."], ROOT),
    ("import contracts", [str(BIN / "lint-imports")], ROOT),
    ("page: types and lint", [*NPM, "run", "--silent", "check"], ROOT / "webui"),
    ("page: unit tests", [*NPM, "run", "--silent", "test"], ROOT / "webui"),
    ("client drift", [sys.executable, "tests/client_drift.py"], ROOT),
    ("docs", [str(BIN / "mkdocs"), "build", "--strict", "--quiet"], ROOT),
    ("tests", [*PYTEST, "-n", "2", "--dist", "loadfile", "-m", "not browser",
               *(f"--ignore={path}" for path in REAL_TIME)], ROOT),
    ("EtherCAT tests", [*PYTEST, *REAL_TIME], ROOT),
    ("browser tests", [*PYTEST, "-m", "browser", "tests/browser"], ROOT),
]  # fmt: skip
SLOW = {"tests", "EtherCAT tests", "browser tests", "docs"}


def last_failed() -> list[str]:
    """Files with tests that failed in the last run of pytest; forgotten with this answer."""
    note = ROOT / ".pytest_cache" / "v" / "cache" / "lastfailed"
    failed = json.loads(note.read_text("utf-8"))
    note.unlink()
    return sorted({test.partition("::")[0] for test in failed})


def main() -> int:
    """Run the checks; the exit code is the number of those that failed."""
    fast = "--fast" in sys.argv
    (ROOT / ".pytest_cache" / "v" / "cache" / "lastfailed").unlink(missing_ok=True)
    environment = os.environ | {"PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}"}
    failed: list[str] = []
    for name, command, folder in CHECKS:
        if fast and name in SLOW:
            continue
        print(f"== {name}", flush=True)
        began = time.monotonic()
        done = subprocess.run(command, cwd=folder, env=environment, check=False)
        if done.returncode == 1 and command[: len(PYTEST)] == PYTEST:
            # Once more, alone, and said aloud: a busy machine is no defect, a defect stays one.
            # Whole files, as the tests of some follow one another.
            files = last_failed()
            print(f"== {name}: once more, alone: {' '.join(files)}", flush=True)
            done = subprocess.run([*PYTEST, *files], cwd=folder, env=environment, check=False)
        print(f"== {name}: {time.monotonic() - began:.0f} s, exit {done.returncode}", flush=True)
        if done.returncode != 0:
            failed.append(name)
    print(f"failed: {', '.join(failed)}" if failed else "all checks passed")
    passed = len(CHECKS) - len(failed) if not fast else len(CHECKS) - len(SLOW) - len(failed)
    print(f"{passed} passed, {len(failed)} failed")
    return len(failed)


if __name__ == "__main__":
    raise SystemExit(main())
