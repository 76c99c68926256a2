"""Raising the gain of a tuned loop in steps, and checking whether it begins to oscillate.

Behaviour above the band that a bus cycle resolves can be detected by its effect: a loop that is
stable with a raised gain has at least that gain margin, at whatever frequency its phase crosses
-180 degrees. An oscillation above half the sample rate is aliased, but keeps its amplitude.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import AxisFacts, si_value
from backend.tools.measuring.interrupted import ends_all
from backend.tools.measuring.temporary import stopping_hard, temporary
from backend.tools.moving.moves.go_back import go_back
from backend.tools.moving.step.evaluate import LEAD_S, StepResult, StepSettings
from backend.tools.moving.step.run import one_more_step
from backend.tools.thresholds import autotune_gain_steps as threshold
from backend.tools.tuning.autotune.design import gains as gain_tool
from drivers.errors import DriveError
from drivers.texts.message import text

_DECAYS = 0.5**0.5


@dataclass(frozen=True)
class GainStep:
    """One raised gain [dB], and the torque's oscillation in % of the rated torque (RMS)."""

    gain_db: float
    oscillation_percent: float
    stable: bool


@dataclass(frozen=True)
class GainSteps:
    """Result: ``shown_db``, the highest gain with a stable loop, and ``onset_db``, the next one."""

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
    *,
    facts: AxisFacts,
    surely_db: float = 0.0,
    begun_raw: int | None = None,
) -> GainSteps:
    """Raise the speed gain up to ``wanted_db`` with a step at each; restore the gain afterwards.

    Up to ``surely_db`` every loop that the axis may have is stable: fewer steps lead there.
    ``present`` is the same step at the unchanged gain. A step of which too many samples were lost
    shows nothing: no gain is raised further then. Where ``present`` left the axis at its end,
    ``begun_raw`` is the position where it began; the axis returns there.

    A slow loop takes longer to return than to step. Steps therefore lead away and back in turn,
    each compared with one of the same direction at the unchanged gain.

    Raises:
        DriveError: the drive has a fault, or the link is lost; an oscillation is not an error.
    """
    key = gain_tool.spec_of(axis.drive).speed
    away = begun_raw is not None
    home = await axis.position_raw() if begun_raw is None else begun_raw
    series = _Series(axis, session, settings, facts, home, {False: present}, away, away)
    done: list[GainStep] = []
    async with stopping_hard(axis, settings.envelope.speed_rpm):
        if key is not None and received(present, settings):
            levels = levels_to(wanted_db, surely_db)
            if await series.begins(len(levels)):
                done = await series.raised(key, levels, progress)
        if series.moved:
            await series.return_home()
    shown = [each.gain_db for each in done if each.stable]
    onset = next((each.gain_db for each in done if not each.stable), None)
    return GainSteps(max(shown, default=0.0), onset, tuple(done))


@dataclass
class _Series:
    """Steps away from ``home_raw`` and back in turn; a quick stop brakes hard meanwhile.

    ``unchanged`` holds the steps at the unchanged gain, away (False) and back (True). ``moved``:
    whether the axis has to return at the end.
    """

    axis: Axis
    session: CyclicSession
    settings: StepSettings
    facts: AxisFacts
    home_raw: int
    unchanged: dict[bool, StepResult]
    away: bool
    moved: bool

    async def begins(self, count: int) -> bool:
        """Whether so many steps can begin: at home, and where several do, with one back."""
        if self.away and count == 1:
            await self.return_home()
        elif self.away:
            return await self._back_unchanged()
        return True

    async def raised(self, key: str, levels: Sequence[float], progress: Progress) -> list[GainStep]:
        """Steps at these raises [dB] of the gain ``key``, up to the first that is not stable."""
        drive, parameter = self.axis.drive, self.axis.drive.parameter(key)
        now = await drive.raw(key)
        value = si_value(parameter, float(parameter.to_value(now)))
        done: list[GainStep] = []
        for db in levels:
            raw = gain_tool.raised(drive, key, now, float(10 ** (db / 20.0)))
            held = si_value(parameter, float(parameter.to_value(raw)))
            if not value or not held or held <= value * 1.01:
                break
            real_db = float(20.0 * np.log10(held / value))
            if done and real_db < done[-1].gain_db + 0.1:
                break
            progress(len(done) / len(levels), text("autotune.db-more-gain", real_db=real_db))
            back = self.away
            async with temporary(self.axis, {key: raw}):
                try:
                    step = await self._step(back=back)
                except DriveError as error:
                    if await ends_all(self.axis, error):
                        raise
                    done.append(GainStep(real_db, float("inf"), False))
                    self.moved = False
                    break
            self.away, self.moved = not back, True
            if not received(step, self.settings):
                break
            done.append(judged(step, self.unchanged[back], self.settings, real_db))
            if not done[-1].stable or len(done) == len(levels):
                break
            if True not in self.unchanged:
                if not await self._back_unchanged():
                    break
            elif not self.away:
                await self._home_again()
        return done

    async def return_home(self) -> None:
        """Go back to where steps begin."""
        envelope = self.settings.envelope
        await go_back(self.axis, self.session, self.home_raw, envelope, self.facts)
        self.away = False

    async def _back_unchanged(self) -> bool:
        """Step back at the unchanged gain; False where too many of its samples were lost."""
        self.unchanged[True] = await self._step(back=True)
        self.away = False
        if not received(self.unchanged[True], self.settings):
            return False
        await self._home_again()
        return True

    async def _step(self, *, back: bool) -> StepResult:
        size = -self.settings.size if back else self.settings.size
        settings = replace(self.settings, size=size)
        return await one_more_step(self.axis, self.session, settings, self.facts)

    async def _home_again(self) -> None:
        """Go back where the axis came back too far from where its steps begin to be compared."""
        off = await self.axis.position_raw() - self.home_raw
        off_rev = (await self.axis.units()).position(off)
        way_rev = self.settings.size / 60.0 * self.settings.hold_s
        if abs(off_rev) > threshold.BACK * abs(way_rev):
            await self.return_home()


def levels_to(wanted_db: float, surely_db: float = 0.0) -> list[float]:
    """Raised gains up to ``wanted_db`` [dB], in larger steps up to ``surely_db``."""
    surely_db = float(np.clip(surely_db, 0.0, wanted_db))
    large = int(np.ceil(surely_db / threshold.SURE_STEP_DB))
    # Where they save no step, all are equal.
    rest = max(0 if large else 1, int(np.ceil((wanted_db - surely_db) / threshold.STEP_DB)))
    usual = max(1, int(np.ceil(wanted_db / threshold.STEP_DB)))
    if large + rest >= usual:
        return [float(db) for db in wanted_db * np.arange(1, usual + 1) / usual]
    first = surely_db * np.arange(1, large + 1) / large
    then = surely_db + (wanted_db - surely_db) * np.arange(1, rest + 1) / max(rest, 1)
    return [float(db) for db in (*first, *then)]


def steps_to(wanted_db: float, surely_db: float = 0.0) -> int:
    """Number of raised gains up to ``wanted_db``."""
    return len(levels_to(wanted_db, surely_db))


def judged(
    step: StepResult, present: StepResult, settings: StepSettings, gain_db: float
) -> GainStep:
    """Judge whether the torque settles, as it does in a stable loop.

    ``present`` is the same step at the unchanged gain. Torque that depends on position (cogging, an
    eccentric load, an inertia that varies with position) is the same in both steps and may be
    larger in the second half; an oscillation is therefore present both in the step and in its
    difference from ``present``.

    An oscillation is narrow-band, and persists or grows. What decays within its own band is the
    transient of the step, such as swinging of the load; only its level at the end counts.

    The persistent part may rise with the gain, and by the factor by which a loop with 1 dB of gain
    margin amplifies noise (`threshold.NOISE` over all frequencies). A band grows if it is larger at
    the end than before and above what noise of the present step reaches there by chance
    (`threshold.FALSE_ALARM`, F distribution).
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
    """Power [piece, line] of successive pieces of a steady part; None with too few samples.

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
    """RMS of the persistent part; bands that decay count with the power of the last piece.

    What persists in a decaying band is no larger than its level at the end.
    """
    powers = _powers(torque)
    if powers is None:
        return float(np.std(torque))
    decays = np.all(powers[1:] < _DECAYS * powers[:-1], axis=0)
    usual = np.mean(powers, axis=0)
    total, left = np.sum(usual), np.sum(np.where(decays, powers[-1], usual))
    return float(np.std(torque) * np.sqrt(left / total)) if total > 0 else 0.0


def _grows(torque: npt.NDArray[np.float64], before: npt.NDArray[np.float64], factor: float) -> bool:
    """Whether a band grows beyond the noise ``before`` times ``factor``."""
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


def received(step: StepResult, settings: StepSettings) -> bool:
    """Whether the torque that is judged was received: interpolated samples do not oscillate."""
    if step.valid is None:
        return True
    return float(np.mean(step.valid[_judged_part(step, settings)])) >= threshold.RECEIVED


def _judged_part(step: StepResult, settings: StepSettings) -> npt.NDArray[np.bool_]:
    """The second half of the constant-speed phase [n]."""
    begin, end = LEAD_S + 0.5 * settings.hold_s, LEAD_S + settings.hold_s
    return np.asarray((step.time_s >= begin) & (step.time_s < end))


def _steady(step: StepResult, settings: StepSettings) -> npt.NDArray[np.float64]:
    """Torque in the second half of the constant-speed phase, without its quadratic trend."""
    part = step.torque_percent[_judged_part(step, settings)]
    if part.size < 8:
        return np.zeros(8)
    x = np.linspace(-1.0, 1.0, part.size)
    return np.asarray(part - np.polynomial.Legendre.fit(x, part, 2)(x))
