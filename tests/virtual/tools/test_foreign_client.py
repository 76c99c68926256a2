"""Types that an off-the-shelf generator makes of the published interface read what tools conclude.

Nothing of the product's own models is used to read: a script that somebody writes against
``openapi.json`` has no more.
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from backend.tools.autotune.run import AutotuneSettings, autotune
from backend.tools.autotune.tool import answer_of
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import WIDE, mechanics, silent

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """The models as the generator makes them."""
    target = tmp_path_factory.mktemp("client") / "servodeck_client.py"
    made = subprocess.run(
        [
            str(Path(sys.executable).parent / "datamodel-codegen"),
            "--input", str(ROOT / "webui" / "openapi.json"), "--input-file-type", "openapi",
            "--output", str(target), "--output-model-type", "pydantic_v2.BaseModel",
            "--formatters", "builtin",
        ],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    spec = importlib.util.spec_from_file_location(target.stem, target)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[target.stem] = module
    spec.loader.exec_module(module)
    return module


def _job(result: object) -> str:
    """A finished job as the server answers it."""
    message = {"code": "work.done", "params": {}}
    return json.dumps({
        "id": "1", "kind": "tool", "drive": "x", "title": "", "title_message": message,
        "state": "done", "progress": 1.0, "step": "", "step_message": message,
        "started": "2026-01-01T00:00:00Z", "ended": "2026-01-01T00:01:00Z", "motion": True,
        "result": result, "problem": None,
    })  # fmt: skip


async def test_results_are_read_by_generated_types(client: ModuleType) -> None:
    async with direct(mechanics((1e-4, 60.0, 0.006)), 5e-4) as b:
        found = await autotune(b.axis, b.session, AutotuneSettings(WIDE), silent())
    answer = answer_of(found).model_dump(mode="json")

    def read(result: object, kind: str) -> object:
        job = client.JobInfo.model_validate_json(_job(result))
        assert type(job.result).__name__ == kind
        return job.result

    tuned = read(answer, "AutotuneAnswer")
    assert found.applied is not None
    assert tuned.verified.sweep.kind.value == "speed_loop"  # type: ignore[attr-defined]
    assert tuned.applied.bandwidth_hz == pytest.approx(found.applied.bandwidth_hz)  # type: ignore[attr-defined]
    swept = read(answer["mechanics"], "SweepAnswer")
    assert len(swept.magnitude_db) == len(swept.frequency_hz) > 50  # type: ignore[attr-defined]
    moved = read(answer["inertia"], "InertiaAnswer")
    assert moved.inertia_kgm2 == pytest.approx(1.5e-4, rel=0.02)  # type: ignore[attr-defined]
    stepped = read(answer["step"], "StepAnswer")
    assert len(stepped.actual) == len(stepped.time_s)  # type: ignore[attr-defined]
