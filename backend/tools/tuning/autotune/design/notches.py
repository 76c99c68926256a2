"""Measuring the effect of a drive's notches, where no manual documents it, during a tuning."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.interrupted import ends_all
from backend.tools.measuring.recording import cycle_s, quiet
from backend.tools.measuring.repeats import Repeats
from backend.tools.mechanics.inertia import evaluation as inertia_evaluation
from backend.tools.mechanics.inertia.probe import PULLED
from backend.tools.moving.moves.go_back import go_back
from backend.tools.thresholds import autotune_notches as threshold
from backend.tools.tuning.autotune.time_budget import TimeLeft
from backend.tools.tuning.notch import effect as notch_effect
from backend.tools.tuning.notch import trials as notch_trials
from backend.tools.tuning.notch.in_loop import measure_meaning_in_loop
from backend.tools.tuning.notch.meaning import NotchMeaning, meaning_of, remember
from backend.tools.tuning.sweep import evaluation as sweep_evaluation
from drivers.errors import NotAllowed
from drivers.texts.message import Text, text

_NO_TIME = text("autotune.without-notches-time")
_PARTLY = text("autotune.notch-values-left-out")


@dataclass(frozen=True)
class Learning:
    """What the user permits: the envelope, the loop to close, and how the axis may travel."""

    envelope: Envelope
    loop: sweep_evaluation.Loop
    scheme: inertia_evaluation.Scheme


async def learn_notches(
    axis: Axis,
    session: CyclicSession,
    how: Learning,
    facts: AxisFacts,
    outcome: inertia_evaluation.InertiaOutcome,
    mechanics: sweep_evaluation.SweepResult,
    progress: Progress,
    time_left: TimeLeft | None = None,
) -> Text | None:
    """Measure the undocumented effect of the notches where useful, with a loop where one is needed.

    A loop is needed where the load exerts a static torque, and where the mechanics were measured
    with one.

    Returns why the design does without notches; None where it can use them.
    """
    if _known(axis):
        return None
    if not any(r.kind == "resonance" for r in mechanics.resonances):
        return out_of_sight(mechanics)
    if mechanics.model is None:
        return None
    found = outcome.result
    clock = time_left or TimeLeft()
    # With dominant friction, a small error in torque makes a large error in speed.
    ruled = how.scheme == "free" and mechanics.loop != "none"
    in_loop = _held(how, facts, outcome) or ruled
    takes_s = notch_trials.least_s(axis.drive) * (1.0 if in_loop else threshold.FREE)
    repeats = clock.learning()
    if not repeats.allow((1.0 + clock.lossy) * takes_s):
        if meaning_of(axis.drive) is None:
            return _NO_TIME
        clock.give_up(_PARTLY)
        return None
    home = await axis.position_raw()
    try:
        if in_loop:
            meaning = await measure_meaning_in_loop(
                axis, session, how.envelope, facts, mechanics, found.inertia_kgm2.value,
                progress, repeats,
            )  # fmt: skip
        else:
            meaning = await _learn_free(
                axis, session, how, facts, outcome, mechanics, progress, repeats
            )
    except NotAllowed as error:
        if await ends_all(axis, error):
            raise
        # The attempt ended at an unknown place; travel counts from where the tuning began.
        await quiet(axis)
        await go_back(axis, session, home, how.envelope, facts)
        return text("autotune.without-notches", cause=error.text)
    remember(axis.drive, meaning)
    if meaning.left_out:
        clock.give_up(_PARTLY)
    return None


def learning_s(
    axis: Axis, how: Learning, facts: AxisFacts, outcome: inertia_evaluation.InertiaOutcome
) -> float:
    """Estimated duration of `learn_notches` [s], before the mechanics are measured."""
    if _known(axis):
        return 0.0
    takes_s = notch_trials.every_s(axis.drive)
    return takes_s if _held(how, facts, outcome) else threshold.FREE * takes_s


def _known(axis: Axis) -> bool:
    """Whether nothing about the drive's notches is left to be measured."""
    known = meaning_of(axis.drive)
    return not notch_effect.unknown(axis.drive) or (known is not None and not known.left_out)


def _held(how: Learning, facts: AxisFacts, outcome: inertia_evaluation.InertiaOutcome) -> bool:
    """Whether a loop is needed: the load exerts a static torque, or the user chose a loop."""
    pulled = abs(outcome.result.gravity_nm.value) > PULLED * facts.rated_torque_nm
    return pulled or how.loop not in ("auto", "none")


def out_of_sight(mechanics: sweep_evaluation.SweepResult) -> Text | None:
    """Text that a resonance above the measured lines limits the gain; None otherwise."""
    model, frf = mechanics.model, mechanics.frf
    highest_hz = float(np.max(frf.frequency_hz[frf.in_band], initial=0.0))
    above = [m for m in model.modes if m.frequency_hz > highest_hz] if model is not None else []
    rising = [m for m in above if model is not None and model.height_db(m) > threshold.RISES_DB]
    if not rising:
        return None
    near_hz = min(mode.frequency_hz for mode in rising)
    return text("autotune.resonance-out-of-sight", near_hz=near_hz, highest_hz=highest_hz)


async def _learn_free(
    axis: Axis,
    session: CyclicSession,
    how: Learning,
    facts: AxisFacts,
    outcome: inertia_evaluation.InertiaOutcome,
    mechanics: sweep_evaluation.SweepResult,
    progress: Progress,
    repeats: Repeats,
) -> NotchMeaning:
    """Measure it without a loop, on an axis whose load exerts no static torque."""
    envelope: Envelope | None = how.envelope
    still = how.scheme != "free"
    if still:
        at_rev = (await axis.units()).position(await axis.position_raw())
        envelope = notch_effect.room_to_tremble(how.envelope, at_rev, outcome.ends_rev)
    if envelope is None:
        raise NotAllowed(
            "autotune.stands-too-near-end", drive=axis.drive.name, value=round(at_rev, 4)
        )
    found = outcome.result
    rigid = excite.Rigid(found.inertia_kgm2.value, found.coulomb_nm.value)
    rate = 1.0 / cycle_s(session)
    path = notch_effect.path_of(rate, facts, mechanics.hold, mechanics.delay_s)
    return await notch_effect.measure_meaning(
        axis, session, envelope, facts, rigid, path, progress, still=still, repeats=repeats
    )
