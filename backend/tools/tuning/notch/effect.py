"""Measurement of what a drive's notch values do, where no manual documents it.

The same signal is played without a notch and with some of its values, all at one frequency; their
effect is read from the reported torque (:mod:`backend.analysis.loop.notch_effect`): on a free axis
without a loop (here), on one with a static load torque under its closed speed loop
(:mod:`backend.tools.tuning.notch.in_loop`). The manual of M6-L states no depth, that of R6L only
levels. All values are restored.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from backend.analysis.loop.notch import LevelCalibration, Notch
from backend.analysis.loop.notch_effect import NotchEffect, fit_effect
from backend.analysis.response.signal_path.sampling import SignalPath
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.drive import Drive
from backend.foundation.work.jobs import Progress
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import (
    Play,
    Recording,
    bus_limits,
    cycle_s,
    enabled,
    play,
    quiet,
    require_signals,
    share,
)
from backend.tools.measuring.repeats import Repeats
from backend.tools.measuring.temporary import stopping_hard, temporary
from backend.tools.moving.moves.go_back import go_back
from backend.tools.thresholds import notch_effect as threshold
from backend.tools.tuning.notch.filters import plan_notches
from backend.tools.tuning.notch.meaning import NotchMeaning
from backend.tools.tuning.notch.trials import BEFORE, Trial, least_of, limits_of, raw_of, trials_of
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, exceeded
from drivers.halt import HaltCause
from drivers.texts.message import reason_of, text

_TURN = 2 * np.pi
ATTEMPTS = threshold.ATTEMPTS


def unknown(drive: Drive) -> bool:
    """Whether the family has notches whose effect no manual documents."""
    spec = drive.profile.notch
    return spec is not None and spec.encoding in ("hz_width", "hz_levels")


async def measure_meaning(
    axis: Axis,
    session: CyclicSession,
    envelope: Envelope,
    facts: AxisFacts,
    rigid: excite.Rigid,
    path: SignalPath,
    progress: Progress,
    *,
    still: bool = False,
    repeats: Repeats | None = None,
) -> NotchMeaning:
    """Try values of the first notch without a loop, on an axis without static load torque.

    ``path`` is the signal path between setpoint and torque, as a measurement of the mechanics found
    it. With ``still`` the axis only vibrates about its position: the effect of a notch on the
    torque is visible without travel, and friction does not affect it.

    Raises:
        NotAllowed: the axis cannot be measured in this way, or the notch has no visible effect.
    """
    require_signals(axis, session, Mode.CST, False)
    rate = 1.0 / cycle_s(session)

    def designed(attempt: int) -> excite.Sequence:
        return _sequence(rate, envelope, facts, rigid, still, threshold.SLOWER**attempt)

    sequence = await asyncio.to_thread(designed, 0)
    home = await axis.position_raw()
    repeats = repeats or Repeats()
    free = _Free(axis, session, envelope, facts, path, sequence, home, designed, repeats)
    near_rev = 0.0 if still else threshold.NEAR * envelope.travel_rev
    return await tried_with(free, axis, session, envelope, facts, progress, near_rev, repeats)


class Player(Protocol):
    """A way of playing the same signal repeatedly and of comparing the responses."""

    async def plain(self, reported: Callable[[float], None]) -> float:
        """Play without a notch, as the first step; the lowest centre to try notches at [Hz].

        Raises:
            NotAllowed: no notch may be tried on this axis.
        """
        ...

    async def notched(self, reported: Callable[[float], None]) -> NotchEffect:
        """Play with the drive's present notch.

        Raises:
            ValueError: no effect of a notch is visible.
        """
        ...


async def tried_with(
    player: Player, axis: Axis, session: CyclicSession, envelope: Envelope, facts: AxisFacts,
    progress: Progress, near_rev: float = 0.0, repeats: Repeats | None = None,
) -> NotchMeaning:  # fmt: skip
    """Try values of the first notch; afterwards all values and the position are restored.

    Where the axis is within ``near_rev`` of its start, the next trial begins where the previous one
    ended. Values beyond the necessary minimum are tried as ``repeats`` allows.

    Raises:
        NotAllowed: the axis cannot be measured in this way, or the notch has no visible effect.
    """
    drive = axis.drive
    spec = drive.profile.notch
    if spec is None or not unknown(drive):
        raise NotAllowed("notch.notches-printed-manual", drive=drive.name)
    slot = spec.slots[0]
    units, home = await axis.units(), await axis.position_raw()
    off = await plan_notches(drive, [])
    count = len(trials_of(drive, slot, 1))
    part = 1.0 / (count + 1)
    clock, longest_s = repeats or Repeats(), 0.0
    async with stopping_hard(axis, envelope.speed_rpm):
        begun_s = time.monotonic()
        async with temporary(axis, off):
            lowest = await player.plain(
                share(progress, 0.0, part, text("notch.trying-without-notch"))
            )
        centre = round(
            min(
                max(threshold.PLACE / cycle_s(session), threshold.LOWEST_HZ, lowest),
                threshold.HIGHEST_HZ,
            )
        )
        if not clock.allow(least_of(slot) * (time.monotonic() - begun_s) / BEFORE):
            raise samples_lost(axis, 0)
        effects: list[tuple[Trial, NotchEffect | None]] = []
        for number, trial in enumerate(trials_of(drive, slot, centre), 1):
            enough = len(effects) >= least_of(slot)
            if enough and not clock.allow(longest_s):
                break
            begun_s, low = time.monotonic(), number * part
            reported = share(
                progress, low, low + part, text("notch.trying-notch", number=number, count=count)
            )
            away_rev = units.position(await axis.position_raw() - home)
            if abs(away_rev) > near_rev:
                await go_back(axis, session, home, envelope, facts)
            async with temporary(axis, off | raw_of(drive, slot, centre, trial)):
                try:
                    effects.append((trial, await player.notched(reported)))
                except ValueError:
                    effects.append((trial, None))
                except SamplesLost:
                    if not enough:
                        raise
                    break
            longest_s = max(longest_s, time.monotonic() - begun_s)
        await go_back(axis, session, home, envelope, facts)
    return replace(_meaning(drive, centre, effects), left_out=count - len(effects))


def room_to_tremble(
    envelope: Envelope, at_rev: float, ends_rev: tuple[float, float] | None
) -> Envelope | None:
    """Envelope of an axis that vibrates about its position; None where it is too near to an end."""
    to_end = (
        threshold.STILL_REV if ends_rev is None else min(at_rev - ends_rev[0], ends_rev[1] - at_rev)
    )
    room_rev = min(threshold.STILL_REV, envelope.travel_rev, 0.8 * to_end)
    if room_rev < threshold.LEAST_ROOM_REV:
        return None
    speed_rpm = min(envelope.speed_rpm, threshold.STILL_RPM)
    return replace(envelope, travel_rev=room_rev, speed_rpm=speed_rpm)


def _sequence(
    rate: float,
    envelope: Envelope,
    facts: AxisFacts,
    rigid: excite.Rigid,
    still: bool,
    part: float = 1.0,
) -> excite.Sequence:
    """Excitation of a frequency response, one realisation, at ``part`` of its size."""
    rated = facts.rated_torque_nm
    room = excite.Room(
        envelope.torque_percent / 100.0 * rated,
        part * envelope.speed_rpm * _TURN / 60.0,
        envelope.travel_rev * _TURN,
    )
    band = excite.band_for(rate, threshold.STILL_FROM_HZ if still else 5.0, None)
    try:
        made = excite.torque_mode(
            rate,
            band,
            room,
            rigid,
            0.0,
            share=part * threshold.SHARE_OF_TORQUE,
            realisations=1,
            base=not still,
        )
    except ValueError as error:
        raise NotAllowed("notch.envelope-not-allow-measure", cause=reason_of(error)) from error
    # Further periods add no accuracy: tried on turning and on vibrating axes.
    return _one_period(made[0])


def _one_period(sequence: excite.Sequence) -> excite.Sequence:
    """The sequence with one period after the settling; a whole period moves a free axis nowhere."""
    e = sequence.excitation
    kept = e.transient_periods + 1
    cut = slice(
        e.first_sample + kept * e.period_samples, e.first_sample + e.periods * e.period_samples
    )
    return replace(sequence, excitation=replace(e, samples=np.delete(e.samples, cut), periods=kept))


@dataclass
class _Free:
    """Trial without a loop: the ratio of the torques is the response of the notch.

    Friction leaves the axis about a revolution from its start, so each trial has the opposite sign
    of the one before: that returns it.
    """

    axis: Axis
    session: CyclicSession
    envelope: Envelope
    facts: AxisFacts
    path: SignalPath
    sequence: excite.Sequence
    home: int
    smaller: Callable[[int], excite.Sequence] | None = None
    """Makes the sequence after this many that were too fast; None where there is only one."""
    repeats: Repeats = field(default_factory=Repeats)
    _plain: ComplexArray | None = None
    _sign: int = 1
    _lessened: int = 0

    async def plain(self, reported: Callable[[float], None]) -> float:
        self._plain = await self._by_sent(reported)
        return 0.0

    async def notched(self, reported: Callable[[float], None]) -> NotchEffect:
        assert self._plain is not None
        seen = await self._by_sent(reported)
        return fit_effect(self.sequence.excitation.line_hz, seen / self._plain, self.path)

    async def _by_sent(self, reported: Callable[[float], None]) -> ComplexArray:
        """Reported torque over commanded torque [lines]; weaker where the axis is too fast.

        The speed that it reaches depends on how its load oscillates. The effect of a notch does not
        depend on the size.
        """
        while True:
            try:
                torque = await self._torque(reported)
                break
            except NotAllowed as error:
                too_fast = exceeded(error) is HaltCause.SPEED
                if self.smaller is None or self._lessened == ATTEMPTS or not too_fast:
                    raise
                self._lessened += 1
                try:
                    self.sequence = await asyncio.to_thread(self.smaller, self._lessened)
                except NotAllowed:
                    raise error from None
            await quiet(self.axis)
            await go_back(self.axis, self.session, self.home, self.envelope, self.facts)
        e = self.sequence.excitation
        return np.asarray(torque / np.fft.rfft(e.one_period)[e.lines])

    async def _torque(self, reported: Callable[[float], None]) -> ComplexArray:
        """Spectrum of the reported torque over the whole periods [lines].

        Raises:
            NotAllowed: also where samples were lost in every attempt.
        """
        axis, facts = self.axis, self.facts
        units = await axis.units()
        step = units.torque(1.0) / 100.0 * facts.rated_torque_nm
        begun_s, tries = time.monotonic(), 0
        while tries < ATTEMPTS:
            if tries and not self.repeats.allow((time.monotonic() - begun_s) / tries):
                break
            tries += 1
            sign, self._sign = self._sign, -self._sign
            raw = sign * np.round(self.sequence.excitation.samples / step).astype(np.int64)
            async with enabled(axis, self.session, Mode.CST):
                recording = await play(
                    axis,
                    self.session,
                    Play(Mode.CST, raw),
                    await bus_limits(axis, self.envelope, self.home),
                    facts.rated_torque_nm,
                    reported,
                )
            torque, _ = periods_of(self.sequence, recording)
            if len(torque):
                return np.asarray(sign * np.mean(torque, axis=0))
        raise samples_lost(axis, tries)


def periods_of(
    sequence: excite.Sequence, recording: Recording
) -> tuple[ComplexArray, ComplexArray]:
    """Spectra of torque (Nm) and speed (rad/s), [periods without a gap, lines] each."""
    e = sequence.excitation
    torque, velocity = [], []
    for number in range(e.transient_periods, e.periods):
        first = e.first_sample + number * e.period_samples
        cut = slice(first, first + e.period_samples)
        if np.all(recording.valid[cut]):
            torque.append(np.fft.rfft(recording.torque_nm[cut])[e.lines])
            velocity.append(np.fft.rfft(recording.velocity_rad_s[cut])[e.lines])
    return np.asarray(torque), np.asarray(velocity)


class SamplesLost(NotAllowed):
    """No attempt with a notch had the necessary number of periods without a gap."""


def samples_lost(axis: Axis, tries: int) -> SamplesLost:
    """Error that all attempts with one value lost samples."""
    if tries < ATTEMPTS:
        return SamplesLost("notch.samples-lost-no-time", drive=axis.drive.name)
    return SamplesLost("notch.samples-lost", drive=axis.drive.name, tries=tries)


def _meaning(
    drive: Drive, centre: int, effects: list[tuple[Trial, NotchEffect | None]]
) -> NotchMeaning:
    """Combine the trials.

    Raises:
        NotAllowed: no trial showed an effect.
    """
    seen = [(trial, effect.notch) for trial, effect in effects if effect is not None]
    if not seen:
        raise NotAllowed("notch.notch-hz-nothing-torque", drive=drive.name, centre_hz=centre)
    if seen[0][0].depth is None:
        scale = float(np.mean([notch.width_hz / trial.width for trial, notch in seen]))
        depth = float(np.mean([notch.depth_db for _trial, notch in seen]))
        return NotchMeaning(float(centre), None, scale, depth)
    # The same width was tried with several depths: the deepest ones determine it best.
    widths: dict[int, list[Notch]] = {}
    for trial, notch in seen:
        widths.setdefault(trial.width, []).append(notch)
    ratios = []
    for level, notches in sorted(widths.items()):
        deep = sorted(notches, key=lambda n: n.depth_db)[:3]
        weights: FloatArray = np.array([-n.depth_db for n in deep])
        ratio = float(np.average([n.width_hz / n.center_hz for n in deep], weights=weights))
        ratios.append((level, ratio))
    middle = effects[0][0].width
    depths = [(t.depth or 0, n.depth_db) for t, n in seen if t.width == middle]
    flat = [(t.depth or 0, 0.0) for t, e in effects if e is None and t.width == middle]
    return NotchMeaning(
        float(centre), LevelCalibration(tuple(ratios), _every_level(drive, depths + flat))
    )


def _every_level(drive: Drive, points: list[tuple[int, float]]) -> tuple[tuple[int, float], ...]:
    """Depth of each level between those tried, interpolated in the remaining amplitude."""
    spec = drive.profile.notch
    assert spec is not None
    low, high = limits_of(drive, spec.slots[0].depth_key)
    ordered = sorted(points)
    levels = np.arange(max(low, ordered[0][0]), min(high, ordered[-1][0]) + 1)
    left = np.interp(levels, [p[0] for p in ordered], [10 ** (p[1] / 20) for p in ordered])
    return tuple((int(n), float(20 * np.log10(a))) for n, a in zip(levels, left, strict=True))


def path_of(rate: float, facts: AxisFacts, hold: str | None, delay_s: float) -> SignalPath:
    """Signal path between setpoint and torque, as a frequency response found it."""
    path = SignalPath(
        rate, current_bandwidth_hz=facts.current_bandwidth_hz, command_delay_s=delay_s
    )
    return replace(path, hold="linear") if hold == "linear" else path
