"""Runs every check in turn, says how long each took, and fails if any failed.

    python tests/run_all.py [--fast]

``--fast`` leaves out the browser and the slow suites (what pre-commit runs).
"""

from __future__ import annotations

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

CHECKS: list[tuple[str, list[str], Path]] = [
    ("format", [str(BIN / "ruff"), "format", "--check", "."], ROOT),
    ("lint", [str(BIN / "ruff"), "check", "."], ROOT),
    ("types", [str(BIN / "mypy")], ROOT),
    ("import contracts", [str(BIN / "lint-imports")], ROOT),
    ("page: types and lint", [*NPM, "run", "--silent", "check"], ROOT / "webui"),
    ("page: unit tests", [*NPM, "run", "--silent", "test"], ROOT / "webui"),
    ("client drift", [sys.executable, "tests/client_drift.py"], ROOT),
    ("docs", [str(BIN / "mkdocs"), "build", "--strict", "--quiet"], ROOT),
    ("tests", [sys.executable, "-m", "pytest", "-q", "-n", "2", "--dist", "loadfile",
               "-m", "not browser"], ROOT),
    ("browser tests", [sys.executable, "-m", "pytest", "-q", "-m", "browser"], ROOT),
]  # fmt: skip
SLOW = {"tests", "browser tests", "docs"}


def main() -> int:
    """Run the checks; the exit code is the number of those that failed."""
    fast = "--fast" in sys.argv
    environment = os.environ | {"PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}"}
    failed: list[str] = []
    for name, command, folder in CHECKS:
        if fast and name in SLOW:
            continue
        print(f"== {name}", flush=True)
        began = time.monotonic()
        done = subprocess.run(command, cwd=folder, env=environment, check=False)
        print(f"== {name}: {time.monotonic() - began:.0f} s, exit {done.returncode}", flush=True)
        if done.returncode != 0:
            failed.append(name)
    print(f"failed: {', '.join(failed)}" if failed else "all checks passed")
    passed = len(CHECKS) - len(failed) if not fast else len(CHECKS) - len(SLOW) - len(failed)
    print(f"{passed} passed, {len(failed)} failed")
    return len(failed)


if __name__ == "__main__":
    raise SystemExit(main())
