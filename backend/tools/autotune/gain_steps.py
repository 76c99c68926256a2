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
import scipy

from backend.axis.axis import Axis
from backend.axis.cyclic import CyclicSession
from backend.tools.autotune import gains as gain_tool
from backend.tools.autotune.axis_facts import si_value
from backend.tools.measuring.interrupted import ends_all
from backend.tools.measuring.temporary import temporary
from backend.tools.step.evaluate import LEAD_S, StepResult, StepSettings
from backend.tools.step.run import step_response
from backend.tools.thresholds import autotune_gain_steps as threshold
from backend.work.jobs import Progress
from drivers.errors import DriveError
from drivers.texts.message import text

Keep = Callable[[str, dict[str, npt.NDArray[np.generic]], dict[str, object]], None]
_DECAYS = 0.5**0.5


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
    axis: Axis,
    session: CyclicSession,
    settings: StepSettings,
    present: StepResult,
    wanted_db: float,
    progress: Progress,
    keep: Keep | None = None,
) -> GainSteps:
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
    return max(1, int(np.ceil(wanted_db / threshold.STEP_DB)))


def judged(
    step: StepResult, present: StepResult, settings: StepSettings, gain_db: float
) -> GainStep:
    """Whether the torque settles, as it does of a loop that is stable.

    ``present`` is the same step with the gain as it is. A torque that goes with the place (cogging,
    a load off its axis, an inertia by place) is the same in both, and may well be larger in the
    second half: an oscillation is in the step and in what it differs from ``present`` by.

    An oscillation is narrow, and persists or grows. What decays in its own band is what the step
    leaves, such as the swing of the load; it counts with what is left of it at the end.
    What persists may rise with the gain and by what a sensitivity with 1 dB left makes of noise
    (`threshold.NOISE` over all frequencies). A band grows where it is above what noise of the
    present step reaches there by chance (`threshold.FALSE_ALARM`, F distribution) and larger at the
    end than before.
    """
    before = _steady(present, settings)
    after = _steady(step, settings)
    count = min(before.size, after.size)
    parts = (after, after[:count] - before[:count])
    size = min(_persistent(part) for part in parts)
    factor = threshold.NOISE * 10 ** (gain_db / 20.0)
    allowed = max(threshold.QUIET_PERCENT, factor * float(np.std(before)))
    grows = all(_grows(part, before, factor) for part in parts)
    return GainStep(gain_db, size, size <= allowed and not grows)


def _powers(torque: npt.NDArray[np.float64]) -> npt.NDArray[np.float64] | None:
    """Power [piece, line] of a steady part by the time; None where there are too few samples.

    The lines of one piece add up to its mean square (Parseval).
    """
    samples = torque.size // threshold.PIECES
    if samples < threshold.FEW:
        return None
    pieces = torque[-samples * threshold.PIECES :].reshape(threshold.PIECES, samples)
    window = np.hanning(samples + 2)[1:-1]
    lines = np.abs(np.fft.rfft(pieces * window, axis=1)) ** 2
    lines[:, 1 : (samples + 1) // 2] *= 2.0
    return np.asarray(lines / (samples * np.sum(window**2)))


def _persistent(torque: npt.NDArray[np.float64]) -> float:
    """Root mean square over time, of a band that decays over the last piece.

    What persists in a band that decays is no larger than what is there at the end.
    """
    powers = _powers(torque)
    if powers is None:
        return float(np.std(torque))
    decays = np.all(powers[1:] < _DECAYS * powers[:-1], axis=0)
    usual = np.mean(powers, axis=0)
    total, left = np.sum(usual), np.sum(np.where(decays, powers[-1], usual))
    return float(np.std(torque) * np.sqrt(left / total)) if total > 0 else 0.0


def _grows(torque: npt.NDArray[np.float64], before: npt.NDArray[np.float64], factor: float) -> bool:
    """Whether a band grows beyond what ``factor`` makes of the noise ``before``."""
    powers, noise = _powers(torque), _powers(before)
    if powers is None or noise is None:
        first, second = (float(np.std(part)) for part in np.array_split(torque, 2))
        return second > threshold.GROWS * first and second > threshold.QUIET_PERCENT
    bands = np.array([np.convolve(row, np.ones(3), "same") for row in powers])
    usual = np.convolve(np.mean(noise, axis=0), np.ones(3), "same")
    chance = threshold.FALSE_ALARM / bands.shape[1]
    beyond = float(scipy.special.fdtri(threshold.DEGREES, threshold.DEGREES_BEFORE, 1.0 - chance))
    least = np.maximum(threshold.QUIET_PERCENT**2, factor**2 * beyond * usual)
    return bool(np.any((bands[-1] > least) & (bands[-1] > threshold.GROWS**2 * bands[0])))


def _steady(step: StepResult, settings: StepSettings) -> npt.NDArray[np.float64]:
    """Torque while the speed is held, without its trend."""
    time = step.time_s
    begin = LEAD_S + 0.5 * settings.hold_s
    part = step.torque_percent[(time >= begin) & (time < LEAD_S + settings.hold_s)]
    if part.size < 8:
        return np.zeros(8)
    x = np.linspace(-1.0, 1.0, part.size)
    return np.asarray(part - np.polynomial.Legendre.fit(x, part, 2)(x))
