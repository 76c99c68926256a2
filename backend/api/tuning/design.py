"""Routes of notches, gains, and design on stored responses."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path

import numpy as np
from fastapi import APIRouter

from backend.analysis.loop.loop_structure import Gains, speed_loop, step_of_closed_loop
from backend.analysis.loop.margins import closed_from_open, sensitivity
from backend.analysis.loop.measured_plant import MeasuredPlant, measured_plant
from backend.analysis.loop.notch import Notch, RealisedNotch
from backend.analysis.signals.arrays import magnitude_db, phase_deg
from backend.api.messages.errors import message_or_none, words_of
from backend.api.requests.context import Controlled, TheBench, TheDrive
from backend.api.tuning.measurements import change_log, measurement_head
from backend.api.tuning.models import (
    CandidatesInfo,
    CandidatesRequest,
    GainInfo,
    GainWrite,
    NotchPreviewInfo,
    NotchPreviewRequest,
    NotchShape,
    NotchSlotInfo,
    NotchWrite,
    PredictionInfo,
    PredictRequest,
    RealisedInfo,
    Undo,
)
from backend.axes.drive.drive import Drive
from backend.records.library.measurements import BadMeasurement, unpack
from backend.report.changes import Change
from backend.station.bench import Bench
from backend.station.drives.connected_drive import ConnectedDrive
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.measuring.temporary import put_back, write_settings
from backend.tools.tuning.autotune.design import candidates as tune_candidates
from backend.tools.tuning.autotune.design import gains
from backend.tools.tuning.autotune.tool import candidate_info
from backend.tools.tuning.notch import filters as notch
from backend.tools.tuning.notch.meaning import meaning_of
from backend.tools.tuning.sweep import evaluation as sweep_evaluation
from backend.tools.tuning.sweep.stored import reevaluated
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts import limits
from drivers.texts.message import joined, reason_of, text

router = APIRouter()
#: [Hz, dB] Above the range of every notch, and far below floating-point overflow.
_MOST = 1e12


def _shape(found: Notch | None) -> NotchShape | None:
    return (
        None
        if found is None
        else NotchShape(center_hz=found.center_hz, width_hz=found.width_hz, depth_db=found.depth_db)
    )


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


def _require_finite(figures: Sequence[float]) -> None:
    """Check figures of notches, so that no response of them overflows.

    Raises:
        OutOfRange: one is beyond every range.
    """
    for value in figures:
        if not abs(value) <= _MOST:
            raise OutOfRange(
                "api-tuning.beyond-every-range",
                value=f"{value:g}",
                limit=limits.between(-_MOST, _MOST),
            )


def _notches(wanted: Sequence[NotchShape | None]) -> list[Notch | None]:
    for w in wanted:
        if w is not None:
            _require_finite((w.center_hz, w.width_hz, w.depth_db))
    return [None if w is None else Notch(w.center_hz, w.width_hz, w.depth_db) for w in wanted]


async def _note(bench: Bench, connected: ConnectedDrive, what: str, before: dict[str, int]) -> Undo:
    """Record a change for the report, with the values read back; returns the values to undo it."""
    after = {key: await connected.drive.raw(key) for key in before}
    change_log(bench).add(connected.drive.id, Change(datetime.now(UTC), what, before, after))
    return Undo(before=before, after=after)


@router.get("/drives/{drive_id}/notches")
async def read_notches(connected: TheDrive) -> list[NotchSlotInfo]:
    """Read all notches of the drive."""
    return [
        NotchSlotInfo(
            slot=s.slot,
            enabled=s.enabled,
            notch=_shape(s.notch),
            realised=_realised(s.realised),
            raw=dict(s.raw),
            note=words_of(s.note),
            note_message=message_or_none(s.note),
        )
        for s in await notch.read_notches(connected.drive, meaning_of(connected.drive))
    ]


@router.post("/drives/{drive_id}/notches/preview")
async def preview_notches(connected: TheDrive, request: NotchPreviewRequest) -> NotchPreviewInfo:
    """Preview how the drive would realise these notches. Nothing is read or written."""
    profile, name = connected.drive.profile, connected.drive.name
    _require_finite(request.frequency_hz)
    wanted, meaning = _notches(request.notches), meaning_of(connected.drive)
    slots = [notch.encode(profile, name, n, w, None, meaning) for n, w in enumerate(wanted)]
    f = np.asarray(request.frequency_hz, dtype=np.float64)
    total = notch.combined(profile, [w for w in wanted if w is not None], f, meaning)
    return NotchPreviewInfo(
        slots=[
            NotchSlotInfo(
                slot=p.slot,
                enabled=p.asked is not None,
                notch=_shape(p.asked),
                realised=_realised(p.realised),
                raw=dict(p.raw),
                note=words_of(p.note),
                note_message=message_or_none(p.note),
            )
            for p in slots
        ],
        magnitude_db=magnitude_db(total).tolist(),
        phase_deg=np.degrees(np.angle(total)).tolist(),
    )


@router.put("/drives/{drive_id}/notches")
async def write_notches(bench: TheBench, connected: Controlled, request: NotchWrite) -> Undo:
    """Write all notches and put them into effect; saving in the drive is a separate step."""
    with bench.motion.keeping_still(connected):
        before = await notch.write_notches(
            connected.axis, _notches(request.notches), meaning_of(connected.drive)
        )
    undo = await _note(bench, connected, "notches", before)
    bench.journal.add(
        text("journal.notches-written", drive=connected.drive.name), drive=connected.drive.id
    )
    return undo


@router.get("/drives/{drive_id}/gains")
async def read_gains(connected: TheDrive) -> GainInfo:
    """Read the loop gains."""
    facts = await read_facts(connected.axis)
    found = await gains.read_gains(connected.axis, facts)
    tables = connected.drive.profile.stiffness
    return GainInfo(
        convention=found.convention, position_1_s=found.position_1_s, speed_hz=found.speed_hz,
        speed_nms=found.speed_nms, integral_hz=found.integral_hz, level=found.level,
        levels=sorted(tables[0].rows) if tables else [],
        inertia_kgm2=facts.drive_inertia_kgm2, current_bandwidth_hz=facts.current_bandwidth_hz,
        speed_filter_hz=facts.speed_filter_hz,
        rated_torque_nm=facts.rated_torque_nm if facts.torque_known else None, raw=found.raw,
    )  # fmt: skip


@router.put("/drives/{drive_id}/gains")
async def write_gains(bench: TheBench, connected: Controlled, request: GainWrite) -> Undo:
    """Write gains or a stiffness level and put them into effect; saving is a separate step."""
    if (request.gains is None) == (request.level is None):
        raise OutOfRange("api-tuning.give-either-gains-level", drive=connected.drive.name)
    if request.gains is not None:
        g = request.gains
        wanted = _gains(g.speed_bandwidth_hz, g.integral_hz, g.position_1_s, g.inertia_kgm2)
        raw = gains.plan_design(
            connected.drive, wanted, g.inertia_kgm2, await gains.rotor_inertia(connected.axis)
        )
    else:
        raw = gains.plan_level(connected.drive, request.level or 0)
    with bench.motion.keeping_still(connected):
        before = await write_settings(connected.axis, raw)
    undo = await _note(bench, connected, "gains", before)
    bench.journal.add(
        text("journal.gains-written", drive=connected.drive.name), drive=connected.drive.id
    )
    return undo


def _gains(speed_hz: float, integral_hz: float, position_1_s: float, inertia_kgm2: float) -> Gains:
    return Gains(2 * np.pi * speed_hz * inertia_kgm2, integral_hz, position_1_s, speed_hz)


@router.post("/drives/{drive_id}/tune/undo")
async def undo_tuning(bench: TheBench, connected: Controlled, request: Undo) -> Undo:
    """Restore the values that a change returned as `before`; returns the undo of that.

    If the change's `after` is given, a value that was written since is not overwritten.
    """
    with bench.motion.keeping_still(connected):
        now = {key: await connected.drive.raw(key) for key in request.before}
        _require_untouched(connected.drive, request, now)
        await put_back(connected.axis, request.before)
    undo = await _note(bench, connected, "undo", now)
    bench.journal.add(
        text("journal.tuning-undone", drive=connected.drive.name), drive=connected.drive.id
    )
    return undo


def _require_untouched(drive: Drive, undo: Undo, now: Mapping[str, int]) -> None:
    """Check that no value was written since the change.

    Raises:
        NotAllowed: a value is neither what the change wrote nor what was there before.
    """
    for key, left in (undo.after or {}).items():
        raw = now.get(key)
        if raw is not None and raw not in (left, undo.before[key]):
            raise NotAllowed(
                "api-tuning.now-change-left-changed",
                drive=drive.name,
                parameter=key,
                value=raw,
                limit=str(left),
                left=left,
            )


@lru_cache(maxsize=4)
def _evaluated(file: Path, _changed_ns: int) -> sweep_evaluation.SweepResult:
    """Evaluate a stored response; cached, as dragging a notch requests it many times a second."""
    measurement = unpack(file.read_bytes(), file.name)
    if measurement.meta.get("tool") != "sweep":
        raise BadMeasurement("api-tuning.not-frequency-response", value=file.name)
    try:
        return reevaluated(measurement.arrays, measurement.meta)
    except ValueError as error:
        raise BadMeasurement(
            "api-tuning.cannot-be-evaluated", value=file.name, cause=reason_of(error)
        ) from error


#: Running evaluations, each on its event loop.
_Running = dict[
    tuple[asyncio.AbstractEventLoop, Path, int], asyncio.Task[sweep_evaluation.SweepResult]
]
_running: _Running = {}


async def _evaluated_once(file: Path, changed_ns: int) -> sweep_evaluation.SweepResult:
    """Like `_evaluated`; concurrent requests for the same response share one evaluation.

    A page that opens a response sends several requests at once, each of which
    would occupy a processor.
    """
    place = (asyncio.get_running_loop(), file, changed_ns)
    task = _running.get(place)
    if task is None:
        task = asyncio.create_task(asyncio.to_thread(_evaluated, file, changed_ns))
        _running[place] = task
        task.add_done_callback(lambda _: _running.pop(place, None))
    return await asyncio.shield(task)


async def _plant(bench: Bench, name: str) -> tuple[MeasuredPlant, sweep_evaluation.SweepResult]:
    await asyncio.to_thread(measurement_head, bench, name)
    file = bench.measurements.path(name)
    found = await _evaluated_once(file, file.stat().st_mtime_ns)
    if found.model is None:
        why = joined(found.warnings or [text("api-tuning.not-of-mechanics")])
        raise NotAllowed("api-tuning.nothing-designed", value=name, name=name, why=why)
    return measured_plant(found.frf, found.model), found


@router.post("/drives/{drive_id}/tune/candidates")
async def candidates(
    bench: TheBench, connected: TheDrive, request: CandidatesRequest
) -> CandidatesInfo:
    """List notch sets and gains for a stored response. Nothing is written."""
    plant, found = await _plant(bench, request.measurement)
    facts = sweep_evaluation.completed(await read_facts(connected.axis), found)
    load = request.load or tune_candidates.load_class(found)
    table = await asyncio.to_thread(
        tune_candidates.candidates_for,
        connected.drive,
        facts,
        plant,
        request.inertia_kgm2,
        load,
        request.sample_rate_hz,
    )
    return CandidatesInfo(load=load, candidates=[candidate_info(each) for each in table])


@router.post("/drives/{drive_id}/tune/predict")
async def predict(bench: TheBench, connected: TheDrive, request: PredictRequest) -> PredictionInfo:
    """Predict the speed loop of a stored response with these notches and gains."""
    plant, found = await _plant(bench, request.measurement)
    facts = sweep_evaluation.completed(await read_facts(connected.axis), found)
    wanted = [n for n in _notches(request.notches) if n is not None]
    g, f = request.gains, plant.frequency_hz
    try:
        filters = notch.combined(connected.drive.profile, wanted, f, meaning_of(connected.drive))
    except ValueError as error:
        raise OutOfRange(
            "api-tuning.notch-out-of-range", drive=connected.drive.name, cause=reason_of(error)
        ) from error
    fixed = gains.loops_of(connected.drive, facts).response(f) * filters
    opened = speed_loop(
        f,
        plant.response(),
        np.asarray(fixed),
        _gains(g.speed_bandwidth_hz, g.integral_hz, g.position_1_s, g.inertia_kgm2),
    )
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
        margins=sweep_evaluation.margins_of(f, opened),
    )
