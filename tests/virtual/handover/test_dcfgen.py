"""Lely's dcfgen, which ros2_canopen runs over a bus.yml, where it is installed.

``SERVODECK_DCFGEN`` names the program of dcf-tools 2.4 where it is not in the path; it needs a
setuptools older than 81 and an empy older than 4, and so an environment of its own.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml

from backend.records.handover.files import files_of, fitting
from tests.support.controllers.acceptance import axis_of
from tests.support.controllers.text_files import concise
from tests.support.handed_over import SAVED


@pytest.mark.parametrize("family", ["ds_c", "maker_b.eds"])
def test_dcfgen_makes_the_writes_of_the_bus_yml(family: str, tmp_path: Path) -> None:
    program = os.environ.get("SERVODECK_DCFGEN") or shutil.which("dcfgen")
    if program is None:
        pytest.skip("dcfgen of dcf-tools is not installed (SERVODECK_DCFGEN names it)")
    for name, data in files_of(axis_of(family), "ros2", "bus.yml", SAVED).items():
        (tmp_path / name).write_bytes(data)
    content = yaml.safe_load((tmp_path / "bus.yml").read_text())
    # As ros2_canopen's own step before it: nodes stand at the top.
    content |= content.pop("nodes")
    (tmp_path / "expanded.yml").write_text(yaml.safe_dump(content))
    made = subprocess.run(
        [program, "-r", "-S", "-d", str(tmp_path), "expanded.yml"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    written = [(i, s, d) for i, s, d, _ in concise((tmp_path / "drive.bin").read_bytes()).writes]
    axis = fitting(axis_of(family), "ros2")
    assert written[-len(axis.writes) :] == [(w.index, w.subindex, w.data) for w in axis.writes]
