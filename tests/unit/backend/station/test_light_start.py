"""The page is there before heavy libraries are: the start leaves them out and loads them behind."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

from backend.commands.server.serve import LATE

ROOT = Path(__file__).parents[4]
#: Each takes from a tenth of a second to a second of processor time to load.
HEAVY = (
    "matplotlib", "PIL", "reportlab", "rerun", "scipy.fft", "scipy.linalg", "scipy.ndimage",
    "scipy.optimize", "scipy.signal", "scipy.special", "scipy.stats", "trimesh", "viser",
)  # fmt: skip
_ASK = (
    "import json, sys, backend.api.app, backend.commands.server.serve; "
    "print(json.dumps([*sys.modules]))"
)


def test_server_starts_without_heavy_libraries() -> None:
    done = subprocess.run(
        [sys.executable, "-c", _ASK], cwd=ROOT, capture_output=True, text=True, check=True
    )
    loaded = json.loads(done.stdout)
    assert "backend.api.app" in loaded
    assert not [name for name in HEAVY if name in loaded]


def test_what_analysis_takes_from_scipy_is_loaded_before_an_axis_moves() -> None:
    used = set()
    for file in (ROOT / "backend").rglob("*.py"):
        used |= set(re.findall(r"(?<![\w.])scipy\.[a-z]+(?=\.)", file.read_text("utf-8")))
    assert len(used) > 4
    # Files of MATLAB are read by a request of its own, not for a motion.
    assert used - {"scipy.io"} == {name for name in LATE if name.startswith("scipy.")}


def test_what_is_loaded_late_is_there() -> None:
    for name in LATE:
        assert import_module(name)
