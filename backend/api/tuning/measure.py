"""Routes of the tools: measurements, automatic tuning, and their settings."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import AsyncExitStack

import numpy as np
import numpy.typing as npt
from fastapi import APIRouter
from pydantic import BaseModel

from backend.api.health.kept import keep_health
from backend.api.messages import convert
from backend.api.messages.models import JobInfo
from backend.api.report import routes as routes_report
from backend.api.requests.context import Connection, Controlled, Me, TheBench, TheDrive, ThePeople
from backend.api.scope.recordings import TheRecordings
from backend.api.security.gate import require_right
from backend.api.tuning import design as routes_design
from backend.api.tuning import measurements as routes_measurements
from backend.api.tuning import response_import as routes_response_import
from backend.api.tuning.measurements import change_log
from backend.api.tuning.models import ExcitationInfo, ToolInfo
from backend.axes.axis.cyclic_mode import keeping_mode
from backend.axes.axis.restoring import shielded
from backend.foundation.work import libraries
from backend.foundation.work.jobs import JobResult, Progress
from backend.records.library.measurements import MeasurementStore
from backend.report.changes import Change
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.station.measuring import EXCHANGE_ENDS_S, exchange_for
from backend.station.recording.service import Recordings
from backend.tools.registry import TOOLS
from backend.tools.tool import AnyTool, Run, ToolResult, ToolSettings
from backend.tools.tuning.autotune.result import AutotuneAnswer
from backend.tools.tuning.sweep import profile_speed
from backend.tools.tuning.sweep.preview import preview
from backend.tools.tuning.sweep.settings import SweepRequest
from backend.tools.watching.health.result import HealthResult
from backend.tools.watching.health.settings import HealthSettings
from drivers.errors import DriveError, NotAllowed
from drivers.texts.message import text

router = APIRouter()
for part in (routes_design, routes_measurements, routes_report, routes_response_import):
    router.include_router(part.router)


def partner_of(
    bench: Bench, connected: ConnectedDrive, name: str, connection: str | None
) -> ConnectedDrive:
    """The other axis of a machine, by its name or id. Nobody else may have control of it.

    Raises:
        NotAllowed: there is none on the same bus, or several have this name.
        Busy: somebody else has control of it, or it is moved.
    """
    known = list(bench.connected_drives.values())
    named = [m for m in known if m.drive.id == name]
    named = named or [m for m in known if m.drive.name == name]
    links = {port.link for port in connected.drive.ports}
    found = [m for m in named if m is not connected and links & {p.link for p in m.drive.ports}]
    if not found:
        raise NotAllowed("station.no-partner", drive=connected.drive.name, value=name)
    if len(found) > 1:
        # A guess might move an axis that nobody meant.
        ids = ", ".join(each.drive.id for each in found)
        raise NotAllowed("station.partners-of-one-name", value=name, ids=ids)
    bench.leases.require(found[0].drive.id, connection)
    bench.motion.require_idle(found[0])
    return found[0]


async def start_tool(
    bench: Bench,
    connected: ConnectedDrive,
    tool: AnyTool,
    request: ToolSettings,
    partner: ConnectedDrive | None = None,
) -> JobInfo:
    """Start a tool as a job, like its route, for the person who acts now.

    Raw data are stored before they are evaluated. ``partner`` is moved as well, see `Tool.pair`.

    Raises:
        DriveError: it cannot begin; nothing has moved.
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
            # A server that has just started still loads libraries, and could not
            # renew a motion meanwhile.
            await asyncio.to_thread(libraries.load)
            async with AsyncExitStack() as held:
                for each in (axis,) if partner is None else (axis, partner.axis):
                    await held.enter_async_context(
                        profile_speed.prepared(each, session, limits, request.consent)
                        if tool.closes_loops
                        else keeping_mode(each, session)
                    )
                other = None if partner is None else partner.axis
                given = Run(axis, session, progress, keep, partner=other)
                found: ToolResult = await tool.run(given, request)
                left = tool.written(found)
                if left is not None:
                    change = Change(left.time, tool.kind, left.before, left.after)
                    change_log(bench).add(connected.drive.id, change)
            await asyncio.to_thread(_conclude, bench.measurements, files, tool, found)
            if isinstance(request, HealthSettings) and isinstance(found, HealthResult):
                await keep_health(bench, connected.drive, request, found, files)
        finally:
            await shielded(exchange.end, EXCHANGE_ENDS_S, connected.drive.name)
        return _answer(found, files)

    try:
        if tool.closes_loops:
            profile_speed.require_consent(session, connected.drive, request.consent)
        job = bench.jobs.start(
            tool.kind,
            text("work.of-drive", title=tool.title, drive=connected.drive.name),
            work,
            drive=connected.drive.id,
            partner=None if partner is None else partner.drive.id,
            motion=True,
        )
    except DriveError:
        # Another motion may have begun while the exchange was started.
        await exchange.end()
        raise
    exchange.ends_with(job)
    bench.journal.add(job.title_text, drive=connected.drive.id)
    return convert.job(job)


_LOOP = "sweep-speed_loop"


def _loop_verdict(result: ToolResult) -> dict[str, object] | None:
    """The verdict of a tuning on its loop, which also rests on other measurements."""
    if not isinstance(result, AutotuneAnswer) or result.verified is None:
        return None
    verdict = result.verified.verdict
    return None if verdict is None else dict(verdict.model_dump(mode="json"))


def _answer(found: ToolResult, files: Sequence[str]) -> JobResult:
    """The result of a job, with the names of its stored raw data."""
    whole = found.model_copy(update={"measurements": tuple(files)})
    return dict(whole.model_dump(mode="json"))


def _conclude(
    store: MeasurementStore, files: Sequence[str], tool: AnyTool, result: ToolResult
) -> None:
    """Store the result with the raw data that it was evaluated from.

    If there are several files of a kind (of designs that were undone), the
    result is of the last one.
    """
    kinds = {store.head(file).kind: file for file in files}
    parts = dict.fromkeys(kinds, result) if tool.parts is None else tool.parts(result)
    for kind, file in kinds.items():
        part = parts.get(kind)
        if part is not None:
            verdict = _loop_verdict(result) if kind == _LOOP else None
            store.conclude(file, part.model_dump(mode="json"), verdict)


@router.post("/drives/{drive_id}/tune/excitation")
async def preview_excitation(connected: TheDrive, request: SweepRequest) -> ExcitationInfo:
    """Preview the excitation of a frequency response. Nothing moves."""
    found = await preview(connected.axis, request.inner, 1e3 / request.cycle_ms)
    return ExcitationInfo(
        unit=found.unit, time_s=found.time_s.tolist(), value=found.value.tolist(),
        frequency_hz=found.frequency_hz.tolist(), amplitude=found.amplitude.tolist(),
        peak=found.peak, crest=found.crest, duration_s=found.duration_s,
        realisations=found.realisations, inertia_kgm2=found.inertia_kgm2,
    )  # fmt: skip


@router.get("/tools")
async def list_tools() -> list[ToolInfo]:
    """List all tools with their texts and the schema of their settings."""
    return [
        ToolInfo(
            kind=tool.kind,
            texts={
                name: [tool.text(name, "en"), tool.text(name, "zh")]
                for name in ("title", *tool.texts)
            },
            settings=tool.settings.model_json_schema(),
            motion=tool.motion,
        )
        for tool in TOOLS
    ]


async def _start_reading(
    bench: Bench,
    connected: ConnectedDrive,
    recordings: Recordings,
    tool: AnyTool,
    request: BaseModel,
) -> JobInfo:
    """Start a tool that moves nothing: no exchange, no grant, and no control of the axis."""
    files: list[str] = []

    def keep(
        name: str, arrays: dict[str, npt.NDArray[np.generic]], meta: dict[str, object]
    ) -> None:
        files.append(bench.measurements.save(name, connected.drive, arrays, meta))

    async def work(progress: Progress) -> JobResult:
        given = Run(connected.axis, None, progress, keep, recording=recordings.library.existing)
        found: ToolResult = await tool.run(given, request)
        await asyncio.to_thread(_conclude, bench.measurements, files, tool, found)
        return _answer(found, files)

    title = text("work.of-drive", title=tool.title, drive=connected.drive.name)
    job = bench.jobs.start(tool.kind, title, work, drive=connected.drive.id)
    bench.journal.add(job.title_text, drive=connected.drive.id)
    return convert.job(job)


def _add(tool: AnyTool) -> None:
    """Add the route that starts this tool."""

    async def start_reading(
        bench: TheBench, connected: TheDrive, recordings: TheRecordings, request: BaseModel
    ) -> JobInfo:
        return await _start_reading(bench, connected, recordings, tool, request)

    async def start(bench: TheBench, connected: Controlled, request: ToolSettings) -> JobInfo:
        return await start_tool(bench, connected, tool, request)

    async def start_pair(
        bench: TheBench,
        connected: Controlled,
        request: ToolSettings,
        people: ThePeople,
        me: Me,
        connection: Connection = None,
    ) -> JobInfo:
        name = str(request.model_dump()["partner"])
        partner = partner_of(bench, connected, name, connection)
        # The gate checks the drive in the path only; a guest may have rights on that one alone.
        require_right(people, me, tool.right, partner.drive.id)
        return await start_tool(bench, connected, tool, request, partner)

    # The body is the tool's own settings model, which the OpenAPI document then shows.
    moving = start_pair if tool.pair else start
    route = moving if tool.motion else start_reading
    route.__annotations__["request"] = tool.settings
    router.add_api_route(
        f"/drives/{{drive_id}}/jobs/{tool.kind}",
        route,
        methods=["POST"],
        status_code=202,
        name=f"start_{tool.kind}",
        description=tool.text("help"),
    )


for each in TOOLS:
    _add(each)
