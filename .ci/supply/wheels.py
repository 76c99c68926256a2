"""Whether every package that servodeck runs with comes as a wheel for every system.

    python .ci/supply/wheels.py

Asks the package index by ``uv``; installs and builds nothing. Prints a matrix and ends with 1
where a package would have to be built by a compiler that a field computer does not have.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile

from materials import FOLDER

SYSTEMS = {
    "win_amd64": "x86_64-pc-windows-msvc",
    "macosx_11_0_arm64": "aarch64-apple-darwin",
    "manylinux x86_64": "x86_64-manylinux_2_28",
    "manylinux aarch64": "aarch64-manylinux_2_28",
}
"""Name of a system to how ``uv`` calls it."""
PYTHONS = ("3.11", "3.12", "3.13")


def missing(platform: str, python: str) -> str:
    """What ``uv`` says of the first package without a wheel; empty where all have one."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-m", "uv", "pip", "install", "--dry-run", "--quiet",
             "--only-binary", ":all:", "--no-deps", "--target", folder,
             "--python-platform", platform, "--python-version", python,
             "-r", str(FOLDER / "run.txt")],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
    return done.stderr.strip() if done.returncode else ""


def main() -> int:
    """Ask for each system and Python, and print the matrix."""
    found = {
        (name, python): missing(platform, python)
        for name, platform in SYSTEMS.items()
        for python in PYTHONS
    }
    print("| system | " + " | ".join(f"CPython {python}" for python in PYTHONS) + " |")
    print("| --- |" + " --- |" * len(PYTHONS))
    for name in SYSTEMS:
        cells = ("no" if found[name, python] else "wheels" for python in PYTHONS)
        print(f"| {name} | " + " | ".join(cells) + " |")
    for (name, python), text in found.items():
        if text:
            print(f"{name}, CPython {python}: {text}", file=sys.stderr)
    return 1 if any(found.values()) else 0


if __name__ == "__main__":
    raise SystemExit(main())
