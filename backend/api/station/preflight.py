"""Routes of the preflight: whether this computer is punctual enough, and what would help most."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Annotated

from fastapi import APIRouter, Query

from backend.api.messages import convert
from backend.api.messages.models import JobInfo
from backend.api.requests.context import TheBench
from backend.api.station.models_preflight import (
    FixRequest,
    PreflightFinding,
    PreflightInfo,
    PreflightRequest,
    PreflightRun,
    PreflightUndone,
    PreflightVerdict,
)
from backend.foundation.preflight import kept
from backend.foundation.preflight.findings import Finding
from backend.foundation.preflight.fixes import Fixes
from backend.foundation.preflight.run import judged, preflight
from backend.foundation.preflight.texts import (
    Language,
    fix_name,
    purpose_name,
    verdict_words,
    words,
)
from backend.foundation.preflight.verdicts import Verdict
from backend.foundation.work.jobs import JobResult, Progress
from backend.station.bench import Bench
from backend.station.install.box.roles import require_not_office
from drivers.computer.timing.lateness import EDGES_US, Measured
from drivers.errors import Busy
from drivers.texts.message import text

router = APIRouter()
_MEDIAN, _NEARLY_ALL = 0.5, 0.999


@router.get("/preflight")
async def look(
    bench: TheBench,
    interface: Annotated[str, Query(max_length=15)] = "",
    language: Annotated[Language, Query()] = "en",
) -> PreflightInfo:
    """Examine the computer now; verdicts rest on the last measurement of this interface."""
    return await _info(bench, interface, language)


@router.post("/preflight", status_code=202)
async def start_preflight(bench: TheBench, request: PreflightRequest) -> JobInfo:
    """Measure wake-ups, with an interface also frames, at 1 and 4 kHz; stores the result."""
    if request.interface:
        # EtherCAT frames are sent to this interface.
        require_not_office(bench.state_folder, f"ethercat://{request.interface}")
    if any(job.kind == "preflight" and job.state == "running" for job in bench.jobs.all()):
        raise Busy("api-station.preflight-runs-already-two")

    async def work(progress: Progress) -> JobResult:
        def shown(fraction: float, period_us: int) -> None:
            progress(fraction, f"{period_us} µs" if period_us else "")

        result = await preflight(request.interface, request.seconds, progress=shown)
        await asyncio.to_thread(kept.keep, bench.state_folder, request.interface, result.measured)
        return {"verdicts": {one.purpose: one.grade for one in result.verdicts}}

    return convert.job(bench.jobs.start("preflight", text("api-station.preflight-computer"), work))


@router.post("/preflight/fixes")
async def apply_fix(
    bench: TheBench, request: FixRequest, language: Annotated[Language, Query()] = "en"
) -> PreflightInfo:
    """Change settings of the computer; the old values are stored and can be restored."""
    fixes = Fixes(bench.state_folder)
    await asyncio.to_thread(fixes.apply, request.fix, request.interface)
    return await _info(bench, request.interface, language)


@router.delete("/preflight/fixes")
async def undo_fixes(bench: TheBench) -> PreflightUndone:
    """Restore the settings that the preflight has changed."""
    undone = await asyncio.to_thread(Fixes(bench.state_folder).undo)
    return PreflightUndone(
        restored=[str(one.setting) for one in undone.restored],
        left=[str(one.setting) for one in undone.left],
    )


async def _info(bench: Bench, interface: str, language: Language) -> PreflightInfo:
    now = await preflight(interface)
    known = kept.read(bench.state_folder).get(interface)
    result = judged(interface, now.facts, known.measured) if known else now
    changed = [str(one.setting) for one in Fixes(bench.state_folder).pending()]
    return PreflightInfo(
        interface=interface,
        kernel=result.facts.kernel,
        preemption=result.facts.preemption,
        cores=result.facts.cores,
        findings=[_finding(one, language) for one in result.findings],
        verdicts=[_verdict(one, language) for one in result.verdicts],
        runs=_runs(result.measured),
        measured=convert.moment(known.ended) if known else None,
        changed=changed,
    )


def _finding(one: Finding, language: Language) -> PreflightFinding:
    what, remedy = words(one, language)
    return PreflightFinding(
        code=one.code,
        effect=one.effect.name.lower(),
        delay_us=one.delay_us,
        params=one.params,
        what=what,
        remedy=remedy,
        fix=one.fix,
        fix_name=fix_name(one.fix, language) if one.fix else "",
    )


def _verdict(one: Verdict, language: Language) -> PreflightVerdict:
    return PreflightVerdict(
        purpose=one.purpose,
        grade=one.grade,
        name=purpose_name(one.purpose, language),
        words=verdict_words(one, language),
        missed_bound=one.missed_bound,
        allowed=one.allowed,
    )


def _runs(measured: Mapping[int, Measured]) -> list[PreflightRun]:
    return [_run(one) for one in measured.values()]


def _run(one: Measured) -> PreflightRun:
    trip = one.round_trip
    return PreflightRun(
        period_us=one.period_us,
        cycles=one.cycles,
        missed=one.missed,
        fifo=one.fifo,
        memory_locked=one.memory_locked,
        edges_us=list(EDGES_US),
        lateness=one.lateness.counts,
        lateness_median_us=one.lateness.below_us(_MEDIAN),
        lateness_999_us=one.lateness.below_us(_NEARLY_ALL),
        lateness_most_us=one.lateness.most_us,
        round_trip=trip.counts if trip else None,
        round_trip_median_us=trip.below_us(_MEDIAN) if trip else None,
        round_trip_most_us=trip.most_us if trip else None,
        unanswered=one.unanswered,
    )
