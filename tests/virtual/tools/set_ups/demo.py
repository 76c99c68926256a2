"""Mechanics with a defect as ``servodeck demo --defect`` plants it."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

from backend.station.demo import DemoBench
from drivers.virtual.defects import Defect
from drivers.virtual.mechanics import MechanicsSpec
from tests.virtual.tools.rig import URL


def with_defect(healthy: MechanicsSpec, defect: Defect) -> MechanicsSpec:
    """Of the axis that the command would start, from a bench file that has no defect."""
    mechanics = healthy.model_dump(mode="json", exclude_defaults=True)
    axis = {"name": "X", "drive": "generic402", "on": URL, "station": 1, "mechanics": mechanics}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bench.json"
        file.write_text(json.dumps({"axis": [axis]}), "utf-8")
        demo = DemoBench(file, Path(folder) / "wires", defects=(f"X={defect}",))
        return demo.spec.axis[0].mechanics
