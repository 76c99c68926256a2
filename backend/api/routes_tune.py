"""Routes of tuning: measurements that move the axis, notches, gains, design and files."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Sequence
from datetime import UTC
from typing import Annotated

import numpy as np
import numpy.typing as npt
from fastapi import APIRouter, Query, Request, Response

from backend.analysis.arrays import magnitude_db, phase_deg
from backend.analysis.design import (
    Gains,
    MeasuredPlant,
    measured_plant,
    speed_loop,
    step_of_closed_loop,
)
from backend.analysis.margins import closed_from_open, sensitivity
from backend.analysis.notch import Notch, RealisedNotch
from backend.api import convert
from backend.api.context import Controlled, TheBench, TheMember
from backend.api.errors import NotFound
from backend.api.models import JobInfo
from backend.api.models_tune import (
    AutotuneRequest,
    CandidatesInfo,
    CandidatesRequest,
    GainInfo,
    GainWrite,
    InertiaRequest,
    MeasurementContent,
    MeasurementInfo,
    NotchPreviewInfo,
    NotchPreviewRequest,
    NotchShape,
    NotchSlotInfo,
    NotchWrite,
    PredictionInfo,
    PredictRequest,
    RealisedInfo,
    StepRequest,
    SweepRequest,
    TuneLimits,
    Undo,
)
from backend.axis import Envelope
from backend.bench import Bench, Member
from backend.cyclic import CyclicSession
from backend.jobs import JobResult, Progress
from backend.measurements import SUFFIX, BadMeasurement, Measurement, recompute
from backend.tools import autotune, gains, inertia, notch, step_response, sweep
from backend.tools.axis_facts import read_facts
from backend.tools.temporary import put_back, write_settings
from drivers.errors import DriveError, NotAllowed, OutOfRange

router = APIRouter()
_MAX_BYTES = 64 * 1024 * 1024

Keep = Callable[[str, dict[str, npt.NDArray[np.generic]], dict[str, object]], None]
Tool = Callable[[CyclicSession, Progress, Keep], Awaitable[JobResult]]


# --- measurements that move ------------------------------------------------------------


async def _start(
    bench: Bench, member: Member, request: TuneLimits, kind: str, title: str, tool: Tool
) -> JobInfo:
    """Start a measurement as a job; raw data are stored before they are evaluated."""
    bench.require_idle(member)
    url = bench.url_of(member.drive.ports[0])
    running = member.axis.session
    ran = running is not None and running.running
    if running is None or not ran:
        running = await bench.start_cyclic(url, request.cycle_ms / 1e3)
    session = running
    files: list[str] = []

    def keep(
        name: str, arrays: dict[str, npt.NDArray[np.generic]], meta: dict[str, object]
    ) -> None:
        files.append(bench.measurements.save(name, member.drive, arrays, meta))

    async def work(progress: Progress) -> JobResult:
        try:
            result = await tool(session, progress, keep)
        finally:
            if not ran:
                with contextlib.suppress(DriveError):
                    await bench.stop_cyclic(url)
        return result | {"measurements": files}

    job = bench.jobs.start(
        kind, f"{title}: {member.drive.name}", work, drive=member.drive.id, motion=True
    )
    bench.journal.add(f"{member.drive.name}: {title}", drive=member.drive.id)
    return convert.job(job)


def _envelope(request: TuneLimits) -> Envelope:
    return Envelope(
        request.travel_limit, request.speed_limit, request.torque_limit, request.time_limit_s
    )


@router.post("/drives/{drive_id}/jobs/sweep", status_code=202)
async def start_sweep(bench: TheBench, member: Controlled, request: SweepRequest) -> JobInfo:
    """Measure a frequency response. The result has the form of ``servodeck sweep --out``."""
    settings = sweep.SweepSettings(
        _envelope(request), request.kind, request.loop, request.f_min_hz, request.f_max_hz,
        request.share, request.realisations, request.base_motion, request.rated_torque_nm,
    )  # fmt: skip

    async def tool(session: CyclicSession, progress: Progress, keep: Keep) -> JobResult:
        return sweep.as_json(await sweep.sweep(member.axis, session, settings, progress, keep))

    return await _start(bench, member, request, "sweep", "Frequency response", tool)


@router.post("/drives/{drive_id}/jobs/inertia", status_code=202)
async def start_inertia(bench: TheBench, member: Controlled, request: InertiaRequest) -> JobInfo:
    """Measure inertia and friction. The result has the form of ``servodeck inertia --out``."""
    settings = inertia.InertiaSettings(
        _envelope(request), request.scheme, request.ends_rev, request.search_torque,
        request.search_speed, request.repetitions, request.rated_torque_nm,
        request.motor_inertia_kgm2,
    )  # fmt: skip

    async def tool(session: CyclicSession, progress: Progress, keep: Keep) -> JobResult:
        return inertia.as_json(
            await inertia.inertia(member.axis, session, settings, progress, keep)
        )

    return await _start(bench, member, request, "inertia", "Inertia and friction", tool)


@router.post("/drives/{drive_id}/jobs/step", status_code=202)
async def start_step(bench: TheBench, member: Controlled, request: StepRequest) -> JobInfo:
    """Step of speed, or a move, with its numbers."""
    settings = step_response.StepSettings(
        _envelope(request), request.kind, request.size, request.hold_s, request.speed,
        request.acceleration, request.window, request.rated_torque_nm,
    )  # fmt: skip

    async def tool(session: CyclicSession, progress: Progress, keep: Keep) -> JobResult:
        return step_response.as_json(
            await step_response.step_response(member.axis, session, settings, progress, keep)
        )

    return await _start(bench, member, request, "step", "Step response", tool)


@router.post("/drives/{drive_id}/jobs/autotune", status_code=202)
async def start_autotune(bench: TheBench, member: Controlled, request: AutotuneRequest) -> JobInfo:
    """All steps from inertia to verification; `before` of the result undoes what was applied."""
    settings = autotune.AutotuneSettings(
        _envelope(request), request.mark, request.load, request.loop, request.scheme,
        request.ends_rev, request.apply, request.rated_torque_nm, request.motor_inertia_kgm2,
    )  # fmt: skip

    async def tool(session: CyclicSession, progress: Progress, keep: Keep) -> JobResult:
        return autotune.as_json(
            await autotune.autotune(member.axis, session, settings, progress, keep)
        )

    return await _start(bench, member, request, "autotune", "Tune", tool)


# --- notches and gains -----------------------------------------------------------------


def _shape(found: Notch | None) -> NotchShape | None:
    return None if found is None else NotchShape(
        center_hz=found.center_hz, width_hz=found.width_hz, depth_db=found.depth_db
    )  # fmt: skip


def _realised(found: RealisedNotch | None) -> RealisedInfo | None:
    if found is None:
        return None
    return RealisedInfo(
        center_hz=found.center_hz,
        width_hz=found.width_hz if np.isfinite(found.width_hz) else None,
        depth_db=found.depth_db,
        dc_gain_db=found.dc_gain_db if np.isfinite(found.dc_gain_db) else None,
        stable=found.stable,
    )


def _notches(wanted: Sequence[NotchShape | None]) -> list[Notch | None]:
    return [None if w is None else Notch(w.center_hz, w.width_hz, w.depth_db) for w in wanted]


@router.get("/drives/{drive_id}/notches")
async def read_notches(member: TheMember) -> list[NotchSlotInfo]:
    """All notches of the drive, read now."""
    return [
        NotchSlotInfo(
            slot=s.slot, enabled=s.enabled, notch=_shape(s.notch), realised=_realised(s.realised),
            raw=dict(s.raw), note=s.note,
        )
        for s in await notch.read_notches(member.drive)
    ]  # fmt: skip


@router.post("/drives/{drive_id}/notches/preview")
async def preview_notches(member: TheMember, request: NotchPreviewRequest) -> NotchPreviewInfo:
    """What the drive would make of these notches. Nothing is read or written."""
    profile, name = member.drive.profile, member.drive.name
    wanted = _notches(request.notches)
    slots = [notch.encode(profile, name, n, w, None) for n, w in enumerate(wanted)]
    f = np.asarray(request.frequency_hz, dtype=np.float64)
    total = notch.combined(profile, [w for w in wanted if w is not None], f)
    return NotchPreviewInfo(
        slots=[
            NotchSlotInfo(
                slot=p.slot, enabled=p.asked is not None, notch=_shape(p.asked),
                realised=_realised(p.realised), raw=dict(p.raw), note=p.note,
            )
            for p in slots
        ],
        magnitude_db=magnitude_db(total).tolist(),
        phase_deg=np.degrees(np.angle(total)).tolist(),
    )  # fmt: skip


@router.put("/drives/{drive_id}/notches")
async def write_notches(bench: TheBench, member: Controlled, request: NotchWrite) -> Undo:
    """Write all notches and make them act; saving is another step."""
    bench.require_idle(member)
    before = await notch.write_notches(member.axis, _notches(request.notches))
    bench.journal.add(f"{member.drive.name}: notches written", drive=member.drive.id)
    return Undo(before=before)


@router.get("/drives/{drive_id}/gains")
async def read_gains(member: TheMember) -> GainInfo:
    """Loop gains, read now."""
    facts = await read_facts(member.axis)
    found = await gains.read_gains(member.axis, facts)
    tables = member.drive.profile.stiffness
    return GainInfo(
        convention=found.convention, position_1_s=found.position_1_s, speed_hz=found.speed_hz,
        speed_nms=found.speed_nms, integral_hz=found.integral_hz, level=found.level,
        levels=sorted(tables[0].rows) if tables else [],
        inertia_kgm2=facts.drive_inertia_kgm2, current_bandwidth_hz=facts.current_bandwidth_hz,
        speed_filter_hz=facts.speed_filter_hz,
        rated_torque_nm=facts.rated_torque_nm if facts.torque_known else None, raw=found.raw,
    )  # fmt: skip


@router.put("/drives/{drive_id}/gains")
async def write_gains(bench: TheBench, member: Controlled, request: GainWrite) -> Undo:
    """Write gains or a stiffness level and make them act; saving is another step."""
    bench.require_idle(member)
    if (request.gains is None) == (request.level is None):
        raise OutOfRange("give either gains or a level", drive=member.drive.name)
    if request.gains is not None:
        g = request.gains
        wanted = _gains(g.speed_bandwidth_hz, g.integral_hz, g.position_1_s, g.inertia_kgm2)
        raw = gains.plan_gains(member.drive, wanted, g.inertia_kgm2)
    else:
        raw = gains.plan_level(member.drive, request.level or 0)
    before = await write_settings(member.axis, raw)
    bench.journal.add(f"{member.drive.name}: gains written", drive=member.drive.id)
    return Undo(before=before)


def _gains(speed_hz: float, integral_hz: float, position_1_s: float, inertia_kgm2: float) -> Gains:
    return Gains(2 * np.pi * speed_hz * inertia_kgm2, integral_hz, position_1_s, speed_hz)


@router.post("/drives/{drive_id}/tune/undo")
async def undo_tuning(bench: TheBench, member: Controlled, request: Undo) -> Undo:
    """Put back what a change returned as `before`; returns what was there until now."""
    bench.require_idle(member)
    now = {key: await member.drive.raw(key) for key in request.before}
    await put_back(member.axis, request.before)
    bench.journal.add(f"{member.drive.name}: tuning taken back", drive=member.drive.id)
    return Undo(before=now)


# --- design on stored measurements -----------------------------------------------------


async def _plant(bench: Bench, name: str) -> tuple[MeasuredPlant, sweep.SweepResult]:
    measurement = _load(bench, name)
    if measurement.meta.get("tool") != "sweep":
        raise BadMeasurement(f"{name} is not a frequency response", value=name)
    try:
        found = await asyncio.to_thread(sweep.reevaluate, measurement.arrays, measurement.meta)
    except ValueError as error:
        raise BadMeasurement(f"{name}: {error}", value=name) from error
    if found.model is None:
        raise NotAllowed(
            f"{name}: nothing can be designed on it: "
            + ("; ".join(found.warnings) or "it is not of the mechanics"),
            value=name, remedy="measure the mechanics, with enough excitation",
        )  # fmt: skip
    return measured_plant(found.frf, found.model), found


@router.post("/drives/{drive_id}/tune/candidates")
async def candidates(
    bench: TheBench, member: TheMember, request: CandidatesRequest
) -> CandidatesInfo:
    """Notch sets and gains for a stored response. Nothing is written."""
    plant, found = await _plant(bench, request.measurement)
    facts = await read_facts(member.axis)
    load = request.load or autotune.load_class(found)
    table = await asyncio.to_thread(
        autotune.candidates_for, member.drive, facts, plant, request.inertia_kgm2, load,
        request.sample_rate_hz,
    )  # fmt: skip
    return CandidatesInfo(load=load, candidates=[autotune.candidate_json(c) for c in table])


@router.post("/drives/{drive_id}/tune/predict")
async def predict(bench: TheBench, member: TheMember, request: PredictRequest) -> PredictionInfo:
    """The speed loop that notches and gains would make of a stored response."""
    plant, _found = await _plant(bench, request.measurement)
    facts = await read_facts(member.axis)
    wanted = [n for n in _notches(request.notches) if n is not None]
    g, f = request.gains, plant.frequency_hz
    try:
        filters = notch.combined(member.drive.profile, wanted, f)
    except ValueError as error:
        raise OutOfRange(f"{member.drive.name}: {error}", drive=member.drive.name) from error
    fixed = gains.loops_of(member.drive, facts).response(f) * filters
    opened = speed_loop(
        f, plant.response(), np.asarray(fixed),
        _gains(g.speed_bandwidth_hz, g.integral_hz, g.position_1_s, g.inertia_kgm2),
    )  # fmt: skip
    closed = closed_from_open(opened)
    time, value = step_of_closed_loop(f, closed, duration_s=0.5)
    thin = slice(None, None, max(1, time.size // 2000))
    return PredictionInfo(
        frequency_hz=f.tolist(),
        open_db=magnitude_db(opened).tolist(),
        open_deg=phase_deg(opened).tolist(),
        closed_db=magnitude_db(closed).tolist(),
        closed_deg=phase_deg(closed).tolist(),
        sensitivity_db=magnitude_db(sensitivity(opened)).tolist(),
        step_time_s=time[thin].tolist(),
        step=value[thin].tolist(),
        margins=sweep.margins_of(f, opened),
    )


# --- files -----------------------------------------------------------------------------


def _load(bench: Bench, name: str) -> Measurement:
    try:
        return bench.measurements.load(name)
    except BadMeasurement:
        raise
    except NotAllowed as error:
        raise NotFound(error.message, value=name) from error


def _info(name: str, found: Measurement) -> MeasurementInfo:
    identity = found.meta.get("identity")
    serial = identity.get("serial") if isinstance(identity, dict) else None
    return MeasurementInfo(
        file=name, kind=found.kind, drive=found.drive, profile=str(found.meta.get("profile", "")),
        serial=serial, saved=found.saved.astimezone(UTC),
    )  # fmt: skip


@router.get("/measurements")
async def list_measurements(bench: TheBench) -> list[MeasurementInfo]:
    """Stored measurements, newest first; unusable ones say why."""
    rows = []
    for name in bench.measurements.names():
        try:
            rows.append(_info(name, bench.measurements.load(name)))
        except BadMeasurement as error:
            rows.append(
                MeasurementInfo(
                    file=name, kind="", drive="", profile="", serial=None, saved=None,
                    problem=error.message,
                )
            )  # fmt: skip
    return rows


@router.get("/measurements/{name}")
async def read_measurement(bench: TheBench, name: str) -> MeasurementContent:
    """One measurement, evaluated anew from its raw data."""
    found = _load(bench, name)
    result = await asyncio.to_thread(recompute, found)
    settings = found.meta.get("settings")
    return MeasurementContent(
        info=_info(name, found),
        settings=settings if isinstance(settings, dict) else {},
        result=result,
    )


@router.get("/measurements/{name}/file", response_class=Response)
async def download_measurement(bench: TheBench, name: str) -> Response:
    """The file itself, raw signals included."""
    _load(bench, name)
    return Response(
        bench.measurements.read(name),
        media_type="application/octet-stream",
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )


@router.post("/measurements", status_code=201)
async def upload_measurement(
    bench: TheBench, request: Request, name: Annotated[str, Query(max_length=100)]
) -> MeasurementInfo:
    """Take a file of another computer; the body is the file."""
    data = await request.body()
    if len(data) > _MAX_BYTES:
        raise OutOfRange(f"{name} is too large", value=len(data), limit=f"{_MAX_BYTES} bytes")
    stored = bench.measurements.store(name.removesuffix(SUFFIX) + SUFFIX, data)
    return _info(stored, bench.measurements.load(stored))


@router.delete("/measurements/{name}", status_code=204)
async def delete_measurement(bench: TheBench, name: str) -> None:
    """Delete a file."""
    _load(bench, name)
    bench.measurements.delete(name)
