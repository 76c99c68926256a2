"""Routes of recordings of other programs: their columns, and their responses."""

from __future__ import annotations

import asyncio
import base64
import re
from datetime import UTC, datetime
from pathlib import PurePath
from typing import Annotated

from fastapi import APIRouter, Query, Request

from backend.api.requests.context import TheBench
from backend.api.tuning.measurements import info_of
from backend.api.tuning.models import MeasurementInfo
from backend.api.tuning.models_response_import import ImportQuery, RecordingPreview
from backend.records.library.measurements import SUFFIX
from backend.records.response_import.evaluation import ImportSettings
from backend.records.response_import.process import ImportTask, import_in_process

router = APIRouter()
FileName = Annotated[str, Query(max_length=200, description="name of the file, for messages")]
#: Semaphores by event loop: one evaluation at a time, as each may use a processor and much memory.
_at_once: dict[asyncio.AbstractEventLoop, asyncio.Semaphore] = {}


async def _run(task: ImportTask) -> dict[str, object]:
    loop = asyncio.get_running_loop()
    async with _at_once.setdefault(loop, asyncio.Semaphore(1)):
        return await import_in_process(task)


@router.post("/measurements/import/preview")
async def preview_recording(request: Request, name: FileName) -> RecordingPreview:
    """Preview the columns of another program's recording (the body). Nothing is stored."""
    found = await _run(ImportTask(await request.body(), name, None))
    return RecordingPreview.model_validate(found)


@router.post("/measurements/import", status_code=201)
async def import_recording(
    bench: TheBench, request: Request, query: Annotated[ImportQuery, Query()]
) -> MeasurementInfo:
    """Evaluate a recording of another program and store it; the body is the file."""
    name = query.name
    low, high = query.f_min_hz, query.f_max_hz
    settings = ImportSettings(
        time=query.time, signal_in=query.input, signal_out=query.output,
        time_unit=query.time_unit, sample_rate_hz=query.sample_rate_hz,
        input_unit=query.input_unit, output_unit=query.output_unit,
        rated_torque_nm=query.rated_torque_nm, torque_constant_nm_a=query.torque_constant_nm_a,
        structure=query.structure,
        band_hz=None if low is None and high is None else (low or 0.0, high or 1e9),
        output_filter_hz=query.output_filter_hz,
        current_bandwidth_hz=query.current_bandwidth_hz, loop_delay_s=query.loop_delay_s,
    )  # fmt: skip
    found = await _run(ImportTask(await request.body(), name, settings))
    stored = await asyncio.to_thread(_store, bench, name, str(found["packed"]))
    return info_of(stored, await asyncio.to_thread(bench.measurements.head, stored))


def _store(bench: TheBench, name: str, packed: str) -> str:
    """Store the result under the time and a plain form of the file's name, never over another."""
    stem = re.sub(r"[^\w-]+", "-", PurePath(name.replace("\\", "/")).name.split(".")[0])[:40]
    begin = f"{datetime.now(UTC):%Y%m%d-%H%M%S}-imported-{stem.strip('-') or 'recording'}"
    whole, number = begin + SUFFIX, 2
    while bench.measurements.path(whole).exists():
        whole, number = f"{begin}-{number}{SUFFIX}", number + 1
    return bench.measurements.store(whole, base64.b64decode(packed))
