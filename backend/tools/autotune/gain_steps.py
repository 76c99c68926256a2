"""Raising a tuned loop's gain in steps, and watching whether it begins to oscillate.

What lies above the band that a bus cycle shows can be seen by its effect: a loop that is stable
with so much more gain has at least that gain margin, at whatever frequency it crosses. An
oscillation above half the sample rate is folded, but keeps its size.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from backend.axis.axis import Axis
from backend.axis.cyclic import CyclicSession
from backend.tools.autotune import gains as gain_tool
from backend.tools.autotune.axis_facts import si_value
from backend.tools.measuring.interrupted import ends_all
from backend.tools.measuring.temporary import temporary
from backend.tools.step.run import LEAD_S, StepResult, StepSettings, step_response
from backend.work.jobs import Progress
from drivers.errors import DriveError
from drivers.texts.message import text

Keep = Callable[[str, dict[str, npt.NDArray[np.generic]], dict[str, object]], None]
#: Gains are raised in steps of this many dB, and the last one to what is asked for.
_STEP_DB = 2.5
#: Torque of a steady part, root mean square in % of the rated: this is quiet, and noise may rise by
#: the gain and this factor.
_QUIET_PERCENT, _NOISE = 1.5, 2.5
#: An oscillation that grows by this from one half of a steady part to the other is an onset.
_GROWS = 1.5


@dataclass(frozen=True)
class GainStep:
    """One raised gain: how much, and the torque's oscillation in % of the rated (RMS)."""

    gain_db: float
    oscillation_percent: float
    stable: bool


@dataclass(frozen=True)
class GainSteps:
    """``shown_db`` is the highest gain at which the loop was stable, ``onset_db`` the next."""

    shown_db: float
    onset_db: float | None
    steps: tuple[GainStep, ...]


async def gain_steps(
    axis: Axis, session: CyclicSession, settings: StepSettings, present: StepResult,
    wanted_db: float, progress: Progress, keep: Keep | None = None,
) -> GainSteps:  # fmt: skip
    """Raise the speed gain up to ``wanted_db`` and step at each; the gain is as before afterwards.

    ``present`` is the same step with the gain as it is.

    Raises:
        DriveError: the drive has a fault, or the link is lost; an oscillation is no error.
    """
    drive = axis.drive
    key = gain_tool.spec_of(drive).speed
    if key is None:
        return GainSteps(0.0, None, ())
    parameter = drive.parameter(key)
    now = await drive.raw(key)
    value = si_value(parameter, float(parameter.to_value(now)))
    done: list[GainStep] = []
    count = steps_to(wanted_db)
    for db in wanted_db * np.arange(1, count + 1) / count:
        raw = gain_tool.raised(drive, key, now, float(10 ** (db / 20.0)))
        held = si_value(parameter, float(parameter.to_value(raw)))
        if not value or not held or held <= value * 1.01:
            break
        real_db = float(20.0 * np.log10(held / value))
        if done and real_db < done[-1].gain_db + 0.1:
            break
        progress(len(done) / count, text("autotune.db-more-gain", real_db=real_db))
        async with temporary(axis, {key: raw}):
            try:
                step = await step_response(axis, session, settings, Progress(lambda: None), keep)
            except DriveError as error:
                if await ends_all(axis, error):
                    raise
                done.append(GainStep(real_db, float("inf"), False))
                break
        done.append(judged(step, present, settings, real_db))
        if not done[-1].stable:
            break
    shown = [each.gain_db for each in done if each.stable]
    onset = next((each.gain_db for each in done if not each.stable), None)
    return GainSteps(max(shown, default=0.0), onset, tuple(done))


def steps_to(wanted_db: float) -> int:
    """How many raised gains lead up to this one."""
    return max(1, int(np.ceil(wanted_db / _STEP_DB)))


def judged(
    step: StepResult, present: StepResult, settings: StepSettings, gain_db: float
) -> GainStep:
    """Whether the torque settles, as it does of a loop that is stable.

    ``present`` is the same step with the gain as it is. A torque that goes with the place (cogging,
    a load off its axis, an inertia by place) is the same in both, and may well be larger in the
    second half: an oscillation is in the step and in what it differs from ``present`` by.
    """
    before = _steady(present, settings)
    after = _steady(step, settings)
    count = min(before.size, after.size)
    parts = (after, after[:count] - before[:count])
    size = min(float(np.std(part)) for part in parts)
    allowed = max(_QUIET_PERCENT, _NOISE * 10 ** (gain_db / 20.0) * float(np.std(before)))
    grows = all(_grows(part) for part in parts)
    return GainStep(gain_db, size, size <= allowed and not grows)


def _grows(torque: npt.NDArray[np.float64]) -> bool:
    first, second = (float(np.std(part)) for part in np.array_split(torque, 2))
    return second > _GROWS * first and second > _QUIET_PERCENT


def oscillation_percent(step: StepResult, settings: StepSettings) -> float:
    """Root mean square of the torque in the second half of the commanded speed, without trend."""
    return float(np.std(_steady(step, settings)))


def _steady(step: StepResult, settings: StepSettings) -> npt.NDArray[np.float64]:
    """Torque while the speed is held, without its trend."""
    time = step.time_s
    begin = LEAD_S + 0.5 * settings.hold_s
    part = step.torque_percent[(time >= begin) & (time < LEAD_S + settings.hold_s)]
    if part.size < 8:
        return np.zeros(8)
    x = np.linspace(-1.0, 1.0, part.size)
    return np.asarray(part - np.polynomial.Legendre.fit(x, part, 2)(x))
