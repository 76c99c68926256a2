"""Routes of tuning that move the axis: measurements and the automatic tuning."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from datetime import UTC, datetime

import numpy as np
import numpy.typing as npt
from fastapi import APIRouter
from pydantic import BaseModel

from backend.api import convert
from backend.api.context import Controlled, TheBench, TheDrive
from backend.api.health.kept import keep_health
from backend.api.models import JobInfo
from backend.api.report import routes as routes_report
from backend.api.scope.recordings import TheRecordings
from backend.api.tuning import design as routes_design
from backend.api.tuning import measurements as routes_measurements
from backend.api.tuning import response_import as routes_response_import
from backend.api.tuning.measurements import change_log
from backend.api.tuning.models import (
    AutotuneRequest,
    ExcitationInfo,
    SweepRequest,
    ToolInfo,
)
from backend.axis.cyclic import CyclicSession
from backend.axis.cyclic_mode import keeping_mode
from backend.axis.restoring import shielded
from backend.library.measurements import MeasurementStore
from backend.report.changes import Change
from backend.station.bench import Bench
from backend.station.connected_drive import ConnectedDrive
from backend.station.measuring import EXCHANGE_ENDS_S, exchange_for
from backend.station.recording.service import Recordings
from backend.tools.autotune import run as autotune
from backend.tools.autotune.apply import take_back
from backend.tools.health.settings import HealthSettings
from backend.tools.registry import TOOLS
from backend.tools.sweep import evaluation as sweep_evaluation
from backend.tools.sweep import profile_speed
from backend.tools.sweep import run as sweep
from backend.tools.sweep.preview import preview
from backend.tools.tool import AnyTool, Keep, Run, ToolSettings
from backend.work.jobs import JobResult, Progress
from drivers.errors import DriveError
from drivers.texts.message import Text, text

router = APIRouter()
for part in (routes_design, routes_measurements, routes_report, routes_response_import):
    router.include_router(part.router)

Measure = Callable[[CyclicSession, Progress, Keep], Awaitable[JobResult]]


async def _start(
    bench: Bench,
    connected: ConnectedDrive,
    request: ToolSettings,
    kind: str,
    title: Text,
    tool: Measure,
    *,
    closes_loops: bool = True,
) -> JobInfo:
    """Start a measurement as a job; raw data are stored before they are evaluated.

    ``closes_loops`` as in `Tool`.
    """
    bench.motion.require_idle(connected)
    exchange = await exchange_for(bench, connected, request.cycle_ms / 1e3)
    session = exchange.session
    files: list[str] = []

    def keep(
        name: str, arrays: dict[str, npt.NDArray[np.generic]], meta: dict[str, object]
    ) -> None:
        files.append(bench.measurements.save(name, connected.drive, arrays, meta))

    async def work(progress: Progress) -> JobResult:
        exchange.taken = True
        limits, axis = request.envelope, connected.axis
        try:
            async with (
                profile_speed.prepared(axis, session, limits, request.consent)
                if closes_loops
                else keeping_mode(axis, session)
            ):
                result = await tool(session, progress, keep)
            await asyncio.to_thread(_conclude, bench.measurements, files, result)
            if isinstance(request, HealthSettings):
                await keep_health(bench, connected.drive, request, result, files)
        finally:
            await shielded(exchange.end, EXCHANGE_ENDS_S, connected.drive.name)
        return result | {"measurements": files}

    try:
        if closes_loops:
            profile_speed.require_consent(session, connected.drive, request.consent)
        job = bench.jobs.start(
            kind,
            text("work.of-drive", title=title, drive=connected.drive.name),
            work,
            drive=connected.drive.id,
            motion=True,
        )
    except DriveError:
        # Another motion may have begun while the exchange was started.
        await exchange.end()
        raise
    exchange.ends_with(job)
    bench.journal.add(job.title_text, drive=connected.drive.id)
    return convert.job(job)


#: Where the result of automatic tuning holds what was concluded from each kind of file.
_PARTS: dict[str, tuple[str, ...]] = {
    "inertia": ("inertia",),
    "sweep-mechanics": ("mechanics",),
    "sweep-speed_loop": ("verified", "sweep"),
    "step": ("step",),
}
_LOOP = "sweep-speed_loop"


def _conclude(store: MeasurementStore, files: Sequence[str], result: JobResult) -> None:
    """Keep with the raw data what was concluded from them.

    Of several files of a kind (designs that were taken back) the last one made the result.
    """
    kinds = {store.head(file).kind: file for file in files}
    if result.get("tool") == "health":
        # What was concluded from its parts is not the conclusion of the whole.
        kinds = {kind: file for kind, file in kinds.items() if kind == "health"}
    for kind, file in kinds.items():
        part: object = result
        for name in _PARTS.get(kind, ()) if "candidates" in result else ():
            part = part.get(name) if isinstance(part, dict) else None
        if isinstance(part, dict):
            verified = result.get("verified") if kind == _LOOP else None
            verdict = verified.get("verdict") if isinstance(verified, dict) else None
            store.conclude(file, part, verdict if isinstance(verdict, dict) else None)


def _sweep_settings(request: SweepRequest) -> sweep_evaluation.SweepSettings:
    return sweep_evaluation.SweepSettings(
        request.envelope, request.kind, request.loop, request.f_min_hz, request.f_max_hz,
        request.share, request.realisations, request.base_motion, request.rated_torque_nm,
        excitation=request.excitation, odd_lines=request.odd_lines,
    )  # fmt: skip


@router.post("/drives/{drive_id}/tune/excitation")
async def preview_excitation(connected: TheDrive, request: SweepRequest) -> ExcitationInfo:
    """What a frequency response would play. Nothing moves."""
    found = await preview(connected.axis, _sweep_settings(request), 1e3 / request.cycle_ms)
    return ExcitationInfo(
        unit=found.unit, time_s=found.time_s.tolist(), value=found.value.tolist(),
        frequency_hz=found.frequency_hz.tolist(), amplitude=found.amplitude.tolist(),
        peak=found.peak, crest=found.crest, duration_s=found.duration_s,
        realisations=found.realisations, inertia_kgm2=found.inertia_kgm2,
    )  # fmt: skip


@router.post("/drives/{drive_id}/jobs/sweep", status_code=202)
async def start_sweep(bench: TheBench, connected: Controlled, request: SweepRequest) -> JobInfo:
    """Measure a frequency response. The result has the form of ``servodeck sweep --out``."""
    settings = _sweep_settings(request)

    async def tool(session: CyclicSession, progress: Progress, keep: Keep) -> JobResult:
        return sweep_evaluation.as_json(
            await sweep.sweep(connected.axis, session, settings, progress, keep)
        )

    return await _start(
        bench, connected, request, "sweep", text("api-tuning.frequency-response"), tool
    )


@router.post("/drives/{drive_id}/jobs/autotune", status_code=202)
async def start_autotune(
    bench: TheBench, connected: Controlled, request: AutotuneRequest
) -> JobInfo:
    """All steps from inertia to verification; `before` of the result undoes what was applied."""
    settings = autotune.AutotuneSettings(
        request.envelope, request.mark, request.load, request.loop, request.scheme,
        request.ends_rev, request.apply, request.rated_torque_nm, request.motor_inertia_kgm2,
    )  # fmt: skip

    async def tool(session: CyclicSession, progress: Progress, keep: Keep) -> JobResult:
        found = await autotune.autotune(connected.axis, session, settings, progress, keep)
        try:
            after = {key: await connected.drive.raw(key) for key in found.before}
        except BaseException:
            # Whoever cancels now has not seen a result: it is as if it had not been.
            await take_back(connected.axis, found.before)
            raise
        if found.before:
            change_log(bench).add(
                connected.drive.id,
                Change(found.written or datetime.now(UTC), "autotune", found.before, after),
            )
        return autotune.as_json(found) | {"after": after}

    return await _start(bench, connected, request, "autotune", text("api-tuning.tune"), tool)


# --- tools with a descriptor ---------------------------------------------------------------


@router.get("/tools")
async def list_tools() -> list[ToolInfo]:
    """Every tool that has a descriptor: its words, and the form of its settings."""
    return [
        ToolInfo(
            kind=tool.kind,
            texts={
                name: [tool.text(name, "en"), tool.text(name, "zh")]
                for name in ("title", *tool.texts)
            },
            settings=tool.settings.model_json_schema(),
        )
        for tool in TOOLS
    ]  # fmt: skip


async def start_tool(
    bench: Bench, connected: ConnectedDrive, tool: AnyTool, request: ToolSettings
) -> JobInfo:
    """Start a tool that has a descriptor, as its route does for whoever acts now.

    Raises:
        DriveError: it cannot begin; nothing has moved.
    """

    async def measure(session: CyclicSession, progress: Progress, keep: Keep) -> JobResult:
        found = await tool.run(Run(connected.axis, session, progress, keep), request)
        return dict(found.model_dump(mode="json"))

    return await _start(
        bench, connected, request, tool.kind, tool.title, measure, closes_loops=tool.closes_loops
    )


async def _start_reading(
    bench: Bench, connected: ConnectedDrive, recordings: Recordings, tool: AnyTool,
    request: BaseModel,
) -> JobInfo:  # fmt: skip
    """Start a tool that moves nothing: no exchange, no grant, and no control of the axis."""
    files: list[str] = []

    def keep(
        name: str, arrays: dict[str, npt.NDArray[np.generic]], meta: dict[str, object]
    ) -> None:
        files.append(bench.measurements.save(name, connected.drive, arrays, meta))

    async def work(progress: Progress) -> JobResult:
        given = Run(
            connected.axis, None, progress, keep, recording=recordings.library.existing
        )  # fmt: skip
        result = dict((await tool.run(given, request)).model_dump(mode="json"))
        await asyncio.to_thread(_conclude, bench.measurements, files, result)
        return result | {"measurements": files}

    title = text("work.of-drive", title=tool.title, drive=connected.drive.name)
    job = bench.jobs.start(tool.kind, title, work, drive=connected.drive.id)
    bench.journal.add(job.title_text, drive=connected.drive.id)
    return convert.job(job)


def _add(tool: AnyTool) -> None:
    """The route that starts this tool."""

    async def start_reading(
        bench: TheBench, connected: TheDrive, recordings: TheRecordings, request: BaseModel
    ) -> JobInfo:
        return await _start_reading(bench, connected, recordings, tool, request)

    async def start(bench: TheBench, connected: Controlled, request: ToolSettings) -> JobInfo:
        return await start_tool(bench, connected, tool, request)

    # The body is the tool's own settings, which the interface's description shows.
    route = start if tool.motion else start_reading
    route.__annotations__["request"] = tool.settings
    router.add_api_route(
        f"/drives/{{drive_id}}/jobs/{tool.kind}", route, methods=["POST"], status_code=202,
        name=f"start_{tool.kind}", description=tool.text("help"),
    )  # fmt: skip


for each in TOOLS:
    _add(each)
