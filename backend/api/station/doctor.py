"""Routes of the doctor: why stations of a bus are not in Operational, and trials of settings."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response

from backend.api.messages import convert
from backend.api.messages.errors import NotFound
from backend.api.messages.models import JobInfo
from backend.api.requests.context import Connection, TheBench
from backend.api.station.models_doctor import (
    DoctorCause,
    DoctorFact,
    DoctorTrial,
    StationDiagnosis,
    TrialRequest,
    TrialResult,
)
from backend.api.station.routes import require_bus
from backend.foundation.work.jobs import JobResult, Progress
from backend.records.audit.asked import note_before
from backend.station.bench import Bench
from backend.tools.wire_message import MessageInfo
from drivers.doctor.diagnosis import Cause
from drivers.doctor.examined import Examines
from drivers.doctor.trials import Trial
from drivers.errors import NotAllowed
from drivers.texts.message import text

router = APIRouter()


@router.get("/buses/doctor")
async def bus_doctor(
    bench: TheBench,
    url: Annotated[str, Query()],
    station: Annotated[int | None, Query(ge=1)] = None,
) -> list[StationDiagnosis]:
    """Find what keeps the stations of an opened EtherCAT or CANopen bus from Operational.

    The most likely cause comes first. Reads registers and objects as they
    are now; changes no state.
    """
    doctor = _doctor(bench, url)
    seen = [station] if station is not None else sorted(await doctor.stations_known())
    return [await _diagnosis(bench, url, number) for number in seen]


@router.post("/buses/doctor/trials", status_code=202)
async def try_setting(
    bench: TheBench, request: TrialRequest, connection: Connection = None
) -> JobInfo:
    """Take a drive to Operational with one setting changed, then undo it.

    Nothing is written to the drive's parameters and no axis is enabled. The
    job's result is TrialResult.
    """
    require_bus(bench, request.url, connection)
    _doctor(bench, request.url)

    async def work(progress: Progress) -> JobResult:
        progress(0.0, text("api-station.trying-setting"))
        found = await bench.doctor.run(request.url, request.station, request.setting, request.after)
        why = None if found.refusal is None else found.refusal.text.to_wire()
        result = TrialResult(
            station=request.station,
            setting=request.setting,
            after=request.after,
            reached=found.reached,
            refusal=None if why is None else MessageInfo.model_validate(why),
        )
        return result.model_dump(mode="json")

    facts = {"setting": request.setting, "after": request.after, "url": request.url}
    title = text("api-station.try-setting", **facts, station=request.station)
    return convert.job(bench.jobs.start("doctor-trial", title, work))


@router.put("/buses/doctor/kept")
async def keep_setting(
    bench: TheBench, request: TrialRequest, connection: Connection = None
) -> DoctorTrial:
    """Use a setting that has just reached Operational, until the drive is connected again.

    It is not stored: to use it permanently, write it into the profile.
    """
    require_bus(bench, request.url, connection)
    _doctor(bench, request.url)
    kept = bench.doctor.keep(request.url, request.station, request.setting, request.after)
    note_before(setting=kept.trial.setting, value=kept.trial.before)
    return _trial(kept.trial)


@router.delete("/buses/doctor/kept", status_code=204)
async def undo_setting(
    bench: TheBench,
    url: Annotated[str, Query()],
    station: Annotated[int, Query(ge=1)],
    connection: Connection = None,
) -> Response:
    """Undo a kept setting of this station: its profile applies again."""
    require_bus(bench, url, connection)
    _doctor(bench, url)
    kept = bench.doctor.kept(url, station)
    bench.doctor.undo(url, station)
    if kept is not None:
        note_before(setting=kept.trial.setting, value=kept.trial.after)
    return Response(status_code=204)


def _doctor(bench: Bench, url: str) -> Examines:
    link = bench.buses.opened.get(url)
    if link is None:
        raise NotFound("api-station.no-opened-bus", value=url)
    if link.doctor is None:
        raise NotAllowed("station.doctor-knows-not", value=url)
    return link.doctor


async def _diagnosis(bench: Bench, url: str, station: int) -> StationDiagnosis:
    examined, offered = await bench.doctor.examination(url, station)
    kept = bench.doctor.kept(url, station)
    return StationDiagnosis(
        station=station,
        reached=examined.reached,
        causes=[_cause(each) for each in examined.causes],
        trials=[_trial(each) for each in offered],
        kept=None if kept is None else _trial(kept.trial),
    )


def _trial(trial: Trial) -> DoctorTrial:
    return DoctorTrial(
        setting=trial.setting,
        before=trial.before,
        after=trial.after,
        of_profile=trial.of_profile,
    )


def _cause(cause: Cause) -> DoctorCause:
    words = cause.text
    return DoctorCause(
        code=cause.code,
        weight=cause.weight,
        title=words.title,
        title_zh=words.zh,
        remedy=words.remedy,
        remedy_zh=words.zh_remedy,
        facts=[
            DoctorFact(
                name=fact.name,
                label=fact.text.en,
                label_zh=fact.text.zh,
                actual=fact.actual,
                expected=fact.expected,
                shown=fact.shown,
                shown_expected=fact.shown_expected,
            )
            for fact in cause.facts
        ],
    )
