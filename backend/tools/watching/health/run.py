"""Measurements of a health check, in sequence. Each also stores its own raw data."""

from __future__ import annotations

from backend.foundation.work.jobs import Progress
from backend.tools.mechanics.friction.result import FrictionResult
from backend.tools.mechanics.friction.run import TOOL as FRICTION
from backend.tools.mechanics.friction.settings import FrictionSettings
from backend.tools.mechanics.inertia.result import InertiaAnswer
from backend.tools.mechanics.inertia.run import TOOL as INERTIA
from backend.tools.mechanics.inertia.settings import InertiaRequest
from backend.tools.moving.step.evaluate import StepSettings, unknown_figures
from backend.tools.moving.step.run import step_response
from backend.tools.tool import Run, Tool
from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.run import sweep
from backend.tools.watching.health.evaluate import arrays_of, friction, reevaluate, resonances
from backend.tools.watching.health.result import HealthResult, HealthRound, HealthValue, Quantity
from backend.tools.watching.health.settings import HealthSettings
from backend.tools.watching.health.texts import TEXTS, report
from drivers.texts.message import text


async def run(run: Run, settings: HealthSettings) -> HealthResult:
    """Measure; every measurement returns the axis to where it began.

    Raises:
        OutOfRange, NotAllowed, LinkLost: from the measurement that failed; the earlier ones have
            stored their raw data, and no health check is stored.
    """
    rounds = []
    for index in range(settings.rounds):
        part = _Part(run, index / settings.rounds, 1.0 / settings.rounds)
        rounds.append(await _round(run, settings, part))
    if run.keep is not None:
        meta: dict[str, object] = {"tool": "health", "settings": settings.model_dump(mode="json")}
        run.keep("health", arrays_of(rounds), meta)
    return HealthResult(rounds=tuple(rounds))


class _Part:
    """A round's part of the job's progress, divided among its measurements."""

    def __init__(self, run: Run, start: float, width: float) -> None:
        self._run, self._start, self._width = run, start, width

    def of(self, low: float, high: float) -> Progress:
        def changed() -> None:
            fraction = self._start + self._width * (low + (high - low) * inner.fraction)
            self._run.progress(fraction, inner.step_text)

        inner = Progress(changed)
        return inner


async def _round(run: Run, settings: HealthSettings, part: _Part) -> HealthRound:
    values: list[HealthValue] = []
    missing: list[Quantity] = []

    def take(name: Quantity, found: HealthValue | None) -> None:
        if found is None:
            missing.append(name)
        else:
            values.append(found)

    if settings.inertia:
        take("inertia", await _inertia(run, settings, part.of(0.0, 0.2)))
    if settings.response:
        asked = SweepSettings(
            settings.envelope, f_min_hz=settings.lowest_hz, rated_torque_nm=settings.rated_torque_nm
        )
        answer = await sweep(run.axis, run.session, asked, part.of(0.2, 0.5), run.keep, run.repeats)
        found = resonances(answer.resonances)
        values += found
        if not any(each.quantity == "resonance" for each in found):
            missing.append("resonance")
    if settings.friction:
        take("friction", await _friction(run, settings, part.of(0.5, 0.95)))
    if settings.step_rpm:
        for name, step_value in (await _step(run, settings, part.of(0.95, 1.0))).items():
            take(name, step_value)
    return HealthRound(values=tuple(values), missing=tuple(missing))


def _inner(run: Run, progress: Progress) -> Run:
    return Run(run.axis, run.session, progress, run.keep, run.repeats)


async def _inertia(run: Run, settings: HealthSettings, progress: Progress) -> HealthValue | None:
    asked = InertiaRequest(**_envelope(settings))
    found = InertiaAnswer.model_validate(
        (await INERTIA.run(_inner(run, progress), asked)).model_dump()
    )
    if not found.identifiable or found.inertia_kgm2 is None or found.unit != "SI":
        return None
    low, high = found.ci95.inertia_kgm2
    return HealthValue(quantity="inertia", value=found.inertia_kgm2, low=low, high=high)


async def _friction(run: Run, settings: HealthSettings, progress: Progress) -> HealthValue | None:
    asked = FrictionSettings(
        **_envelope(settings),
        speeds=settings.speeds,
        slowest_rpm=settings.slowest_rpm,
        ripple=False,
    )
    found = FrictionResult.model_validate(
        (await FRICTION.run(_inner(run, progress), asked)).model_dump()
    )
    return friction(found.points)


async def _step(
    run: Run, settings: HealthSettings, progress: Progress
) -> dict[Quantity, HealthValue | None]:
    asked = StepSettings(
        settings.envelope, size=settings.step_rpm, rated_torque_nm=settings.rated_torque_nm
    )
    found = (await step_response(run.axis, run.session, asked, progress, run.keep)).step
    unknown = () if found is None else unknown_figures(found)
    rise = None if found is None or "rise_s" in unknown else found.rise_s
    over = None if found is None or "overshoot_percent" in unknown else found.overshoot_percent
    return {
        "step_rise": None if rise is None else HealthValue(quantity="step_rise", value=rise),
        "step_overshoot": None
        if over is None
        else HealthValue(quantity="step_overshoot", value=over),
    }


def _envelope(settings: HealthSettings) -> dict[str, float | None]:
    """Limits and options that the settings of all tools share."""
    return {
        "travel_limit": settings.travel_limit,
        "speed_limit": settings.speed_limit,
        "torque_limit": settings.torque_limit,
        "time_limit_s": settings.time_limit_s,
        "rated_torque_nm": settings.rated_torque_nm,
        "cycle_ms": settings.cycle_ms,
    }


TOOL = Tool(
    kind="health",
    title=text("health.title"),
    settings=HealthSettings,
    result=HealthResult,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
    # The results of the single measurements are not results of the health check.
    parts=lambda result: {"health": result},
)
