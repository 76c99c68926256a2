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

import httpx
import pytest

from backend.api.app import make_app
from backend.records.recording.writer import RecordingWriter
from backend.station.bench import Bench
from backend.tools.tuning.autotune.run import AutotuneSettings, autotune
from backend.tools.tuning.autotune.tool import answer_of
from tests.unit.recording.support import block, header
from tests.virtual.tools.direct import direct
from tests.virtual.tools.rig import AMPLE_S, WIDE, mechanics, silent

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


@pytest.mark.long
async def test_results_are_read_by_generated_types(client: ModuleType) -> None:
    async with direct(mechanics((1e-4, 60.0, 0.006)), 5e-4) as b:
        found = await autotune(
            b.axis, b.session, AutotuneSettings(WIDE, budget_s=AMPLE_S), silent()
        )
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


@pytest.mark.long
async def test_a_recording_is_read_by_generated_types(client: ModuleType, tmp_path: Path) -> None:
    """Samples of known values, through the interface: of the stretch that was asked for, all."""
    folder = tmp_path / "recordings"
    folder.mkdir()
    writer = RecordingWriter(folder / "known.sdrec", header(), pytest.fail)
    for number in range(5):
        writer.put(0, block(number))
    writer.close({"reason": "stopped"})
    bench = Bench(tmp_path)
    transport = httpx.ASGITransport(make_app(bench, hosts=frozenset({"test"})))
    async with httpx.AsyncClient(transport=transport, base_url="http://test/api/v1") as http:
        stored = client.RecordingDetail.model_validate_json(
            (await http.get("/recordings/known.sdrec")).raise_for_status().content
        )
        answer = await http.get(
            "/recordings/known.sdrec/samples", params={"from_s": 0.0125, "duration_s": 0.02}
        )
    await bench.close()
    found = client.RecordedSamples.model_validate_json(answer.raise_for_status().content)
    assert [trace.unit for trace in found.traces] == ["inc", "rpm"]
    assert [c.name for c in stored.info.channels] == [trace.name for trace in found.traces]
    # Samples 13 to 32 of 50, one a millisecond; the second signal counts from 1000 on.
    for column, trace in enumerate(found.traces):
        assert trace.t_s == pytest.approx([n / 1000 for n in range(13, 33)], abs=1e-9)
        assert trace.values == [n + 1000 * column + 1 / 3 for n in range(13, 33)]
    assert found.more
