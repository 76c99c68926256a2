"""Effect of notch values on an axis that must be held: measured under its closed speed loop.

A load with static torque is never released. The speed loop's reference is the excitation, as where
a drive accepts no torque offset (:mod:`backend.tools.tuning.sweep.speed_injection`); torque and
speed together show the notch (:mod:`backend.analysis.loop.notch_effect`). No value is tried before
the measured loop is known to stay stable with any notch at that frequency.
"""

from __future__ import annotations

import asyncio
import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from backend.analysis.loop.loop_goals import sensitivity_peak, stable
from backend.analysis.loop.measured_plant import MeasuredPlant, measured_plant
from backend.analysis.loop.notch import Notch
from backend.analysis.loop.notch_effect import LoopLines, NotchEffect, fit_effect_in_loop
from backend.analysis.response.signal_path.sampled_model import LoopModel
from backend.analysis.response.signal_path.sampling import SignalPath
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Recording, require_signals
from backend.tools.measuring.repeats import Repeats
from backend.tools.measuring.temporary import temporary
from backend.tools.thresholds import notch_in_loop as threshold
from backend.tools.tuning.autotune.design import gains
from backend.tools.tuning.notch.effect import ATTEMPTS, periods_of, samples_lost, tried_with
from backend.tools.tuning.notch.meaning import NotchMeaning
from backend.tools.tuning.sweep import speed_injection
from backend.tools.tuning.sweep.evaluation import SweepResult, SweepSettings
from backend.tools.tuning.sweep.plan import Setup, sequences_of, setup_of
from backend.tools.tuning.sweep.play import play_fitting, scaled_by_speed
from backend.tools.tuning.sweep.run import filters_off
from drivers.cia402 import Mode
from drivers.errors import NotAllowed
from drivers.texts.message import reason_of

_TURN = 2.0 * np.pi
#: Centre frequencies to try [Hz].
_CENTRES = np.geomspace(50.0, 400.0, 19)


async def measure_meaning_in_loop(
    axis: Axis,
    session: CyclicSession,
    envelope: Envelope,
    facts: AxisFacts,
    mechanics: SweepResult,
    inertia_kgm2: float,
    progress: Progress,
    repeats: Repeats | None = None,
) -> NotchMeaning:
    """Measure as `notch_effect.measure_meaning`, with the speed loop closed all the time.

    Raises:
        NotAllowed: the axis cannot be measured in this way, a notch might make its loop unstable,
            or it has no visible effect.
    """
    require_signals(axis, session, Mode.CSV, False)
    if mechanics.model is None:
        raise NotAllowed("notch.whether-loop-stays-stable", drive=axis.drive.name)
    settings = SweepSettings(
        envelope,
        loop="speed",
        realisations=1,
        rated_torque_nm=facts.rated_torque_nm,
        inertia_kgm2=inertia_kgm2,
        hold=mechanics.hold,
    )
    setup = await setup_of(axis, session, settings, facts, "speed", None)
    if not setup.by_speed:
        # Also where a torque offset is possible: no manual states whether it passes the notch.
        reported = await gains.read_gains(axis, facts)
        setup = replace(setup, by_speed=True, integral_hz=reported.integral_hz)
    plant = measured_plant(mechanics.frf, mechanics.model)
    repeats = repeats or Repeats()
    player = _ClosedLoopTrial(
        axis, session, settings, setup, plant, await axis.position_raw(), repeats
    )
    async with temporary(axis, await filters_off(axis, settings)):
        return await tried_with(
            player,
            axis,
            session,
            envelope,
            facts,
            progress,
            threshold.NEAR * envelope.travel_rev,
            repeats,
        )


@dataclass
class _ClosedLoopTrial:
    """Trial with the speed loop closed and its reference excited."""

    axis: Axis
    session: CyclicSession
    settings: SweepSettings
    setup: Setup
    plant: MeasuredPlant
    home: int
    repeats: Repeats = field(default_factory=Repeats)
    _sequence: excite.Sequence | None = None
    _lines: LoopLines | None = None
    _loop: LoopModel | None = None
    _path: SignalPath | None = None

    async def plain(self, reported: Callable[[float], None]) -> float:
        settings, setup = self.settings, self.setup
        sequences = await asyncio.to_thread(sequences_of, setup, settings)
        (self._sequence,) = await scaled_by_speed(
            self.axis, self.session, settings, setup, sequences[:1], self.home, _progress(reported)
        )
        sent, recording, self._lines = await self._played(self._sequence, reported)
        facts, rate = setup.facts, setup.rate
        hold = settings.hold or ("linear" if facts.interpolates else "zero")
        path = SignalPath(rate, hold=hold, current_bandwidth_hz=facts.current_bandwidth_hz)
        name = self.axis.drive.name
        try:
            found = speed_injection.speed_gain(
                ((sent, recording),), path, setup.integral_hz, hold_known=False
            )
        except ValueError as error:
            raise NotAllowed(
                "notch.loop-not-identified", drive=name, cause=reason_of(error)
            ) from error
        self._loop, self._path = found.loop.controller, found.loop.path
        fixed = gains.loops_of(self.axis.drive, replace(facts, torque_filter_hz=None))
        lowest = safe_centre_hz(self._loop, self.plant, fixed.response)
        if lowest is None:
            raise NotAllowed("notch.speed-loop-stiff-notch", drive=name)
        return lowest

    async def notched(self, reported: Callable[[float], None]) -> NotchEffect:
        assert self._sequence is not None
        assert self._lines is not None
        assert self._loop is not None
        assert self._path is not None
        sent, _recording, lines = await self._played(self._sequence, reported)
        return fit_effect_in_loop(
            sent.excitation.line_hz, self._lines, lines, self._loop, self._path
        )

    async def _played(
        self, sequence: excite.Sequence, reported: Callable[[float], None]
    ) -> tuple[excite.Sequence, Recording, LoopLines]:
        """Play the sequence, weaker where the loop takes too much torque; lines per rad/s sent.

        Raises:
            NotAllowed: also where samples are lost in every attempt, so that the noise is unknown.
        """
        begun_s, tries = time.monotonic(), 0
        kept: tuple[ComplexArray, ComplexArray] | None = None
        before: FloatArray | None = None
        while tries < ATTEMPTS:
            if tries and not self.repeats.allow((time.monotonic() - begun_s) / tries):
                break
            tries += 1
            ((sent, recording),) = await play_fitting(
                self.axis,
                self.session,
                self.settings,
                self.setup,
                (sequence,),
                self.home,
                _progress(reported),
            )
            e = sent.excitation
            period = e.samples[e.first_sample :][: e.period_samples]
            found = periods_of(sent, recording)
            if kept and before is not None and np.array_equal(before, e.samples):
                # The same signal was played before: its periods can be used as well.
                found = (np.concatenate([kept[0], found[0]]), np.concatenate([kept[1], found[1]]))
            kept, before = (found, e.samples) if len(found[0]) else (kept, before)
            if len(found[0]) >= threshold.FEWEST_PERIODS:
                lines = LoopLines.of(np.fft.rfft(period)[e.lines], *found)
                return sent, recording, lines
        raise samples_lost(self.axis, tries)


def safe_centre_hz(
    loop: LoopModel, plant: MeasuredPlant, fixed: Callable[[FloatArray], ComplexArray]
) -> float | None:
    """Lowest centre at which no notch brings the loop near to instability [Hz]; None without one.

    Valid for all variants of the plant; ``fixed`` is the response of the rest of the loop: current
    loop, speed filter and delay.
    """
    f = plant.frequency_hz
    bare = plant.shifted() * (loop.response(f) * fixed(f))
    for centre in _CENTRES:
        shapes = itertools.product(threshold.WIDTHS, threshold.DEPTHS)
        notches = [Notch(centre, w * centre, depth).response(f) for w, depth in shapes]
        loops = np.concatenate([bare, *(bare * notch for notch in notches)])
        if bool(np.all(stable(loops))) and sensitivity_peak(loops) < threshold.HIGHEST_MS:
            return float(centre)
    return None


def _progress(reported: Callable[[float], None]) -> Progress:
    own = Progress(lambda: reported(own.fraction))
    return own
