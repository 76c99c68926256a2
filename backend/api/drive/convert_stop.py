"""Conversion of STOP verdicts, and of unexpected motion, to messages of the interface."""

from __future__ import annotations

from collections.abc import Sequence

from backend.api.drive import models_axis
from backend.api.messages.errors import message_of, message_or_none, words_of
from backend.axes.axis.stop.facts import AxisStop, Verdict
from backend.axes.stopping.stop_message import stop_message
from backend.axes.stopping.turning import Turning
from backend.station.bench import Bench
from drivers.texts.message import text


def turning(found: Turning | None) -> models_axis.TurningInfo | None:
    """An axis that moves although no motion is permitted."""
    if found is None:
        return None
    return models_axis.TurningInfo(kind=found.kind.value, speed=found.speed, unit=found.unit)


def axis_stop(found: AxisStop) -> models_axis.AxisStopInfo:
    """Verdict and steps of STOP at one axis."""
    steps = [
        models_axis.StopStepInfo(
            code=step.code.value,
            at_s=round(step.at_s, 3),
            done=step.done,
            parameter=step.parameter,
            figures=step.figures,
            problem=words_of(step.problem),
            problem_message=message_or_none(step.problem),
        )
        for step in found.steps
    ]
    return models_axis.AxisStopInfo(
        drive=found.drive,
        verdict=found.verdict.value,
        took_s=round(found.took_s, 3),
        speed=found.speed,
        speed_unit=found.speed_unit,
        travelled=found.travelled,
        travel_unit=found.travel_unit,
        steps=steps,
        problem=words_of(found.problem),
        problem_message=message_or_none(found.problem),
        superseded=found.superseded,
    )


def stop_result(
    bench: Bench, wanted: Sequence[str], found: Sequence[AxisStop]
) -> models_axis.StopResult:
    """Verdicts of the drives in ``wanted``; a drive without a verdict counts as not stopped."""
    failed = {
        each.drive: why
        for each in found
        if (why := stop_message(bench.name_of(each.drive), each)) is not None
    }
    judged = {each.drive for each in found}
    failed |= {drive: text("stopping.not-on-bench") for drive in wanted if drive not in judged}
    return models_axis.StopResult(
        stopped=[each.drive for each in found if each.verdict is Verdict.STOPPED],
        failed={drive: words_of(why) for drive, why in failed.items()},
        failed_messages={drive: message_of(why) for drive, why in failed.items()},
        axes=[axis_stop(each) for each in found],
    )
