"""What the notch values of a drive mean, measured on the drive where no manual prints it.

The same signal is played without a notch and with some of its values, all at one frequency; what
they do is read from the reported torque (:mod:`backend.analysis.loop.notch_effect`): of a free axis
without a loop (here), of one that a load pulls with its closed speed loop
(:mod:`backend.tools.notch.in_loop`). M6-L prints no depth, R6L only levels. Every value is put
back.
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
from backend.analysis.response.sampling import SignalPath
from backend.analysis.signals.arrays import ComplexArray, FloatArray
from backend.axis.axis import Axis, Envelope
from backend.axis.cyclic import CyclicSession
from backend.drive.drive import Drive
from backend.tools.autotune.axis_facts import AxisFacts
from backend.tools.measuring import excite
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
from backend.tools.moves.go_back import go_back
from backend.tools.notch.filters import plan_notches
from backend.tools.notch.meaning import NotchMeaning
from backend.tools.notch.trials import BEFORE, Trial, least_of, limits_of, raw_of, trials_of
from backend.tools.thresholds import notch_effect as threshold
from backend.work.jobs import Progress
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, exceeded
from drivers.halt import HaltCause
from drivers.texts.message import reason_of, text

_TURN = 2 * np.pi
ATTEMPTS = threshold.ATTEMPTS


def unknown(drive: Drive) -> bool:
    """Whether the family has notches whose effect no manual prints."""
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
    """Try values of the first notch on an axis that no load pulls, without a loop.

    ``path`` lies between setpoint and torque, as a measurement of the mechanics found it. With
    ``still`` the axis only trembles where it is: what a notch does to the torque shows
    without any travel, and friction is no part of it.

    Raises:
        NotAllowed: the axis cannot be measured so, or the notch does nothing that can be seen.
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
    """One way of playing the same signal again and again, and of comparing what came."""

    async def plain(self, reported: Callable[[float], None]) -> float:
        """Play without a notch, first of all; the lowest centre in Hz to try notches at.

        Raises:
            NotAllowed: no notch may be tried on this axis.
        """
        ...

    async def notched(self, reported: Callable[[float], None]) -> NotchEffect:
        """Play with the notch that the drive has now.

        Raises:
            ValueError: nothing like a notch is seen.
        """
        ...


async def tried_with(
    player: Player, axis: Axis, session: CyclicSession, envelope: Envelope, facts: AxisFacts,
    progress: Progress, near_rev: float = 0.0, repeats: Repeats | None = None,
) -> NotchMeaning:  # fmt: skip
    """Try values of the first notch; all are restored, and the axis where it was.

    Nearer to there than ``near_rev`` the next trial begins where the one before has ended.
    Values beyond those that it takes at least are tried as ``repeats`` allows.

    Raises:
        NotAllowed: the axis cannot be measured so, or the notch does nothing that can be seen.
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
    """The envelope of an axis that stays where it is; None too near to an end for it."""
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
    """The excitation of a frequency response, one realisation, or ``part`` of its size."""
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
    # Another period shows no more: tried on axes that turn and on such that tremble.
    return _one_period(made[0])


def _one_period(sequence: excite.Sequence) -> excite.Sequence:
    """With one period after the settling; a whole one moves a free axis nowhere."""
    e = sequence.excitation
    kept = e.transient_periods + 1
    cut = slice(
        e.first_sample + kept * e.period_samples, e.first_sample + e.periods * e.period_samples
    )
    return replace(sequence, excitation=replace(e, samples=np.delete(e.samples, cut), periods=kept))


@dataclass
class _Free:
    """No loop: the ratio of the torques is the notch.

    Friction leaves the axis a turn from where it began, so each trial is the one before with its
    sign turned: that brings it back.
    """

    axis: Axis
    session: CyclicSession
    envelope: Envelope
    facts: AxisFacts
    path: SignalPath
    sequence: excite.Sequence
    home: int
    smaller: Callable[[int], excite.Sequence] | None = None
    """The sequence after so many that were too fast; nothing where there is one alone."""
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
        """Reported torque over the one sent, at the lines; smaller where the axis is too fast.

        How fast it becomes depends on how its load swings. What a notch does is the same at any
        size.
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
        """Spectrum of the reported torque at the lines, over the whole periods.

        Raises:
            NotAllowed: also where samples were lost each time.
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
    """No try of a notch had as many periods without a gap as it needs."""


def samples_lost(axis: Axis, tries: int) -> SamplesLost:
    """That so many tries of one value all lost samples."""
    if tries < ATTEMPTS:
        return SamplesLost("notch.samples-lost-no-time", drive=axis.drive.name)
    return SamplesLost("notch.samples-lost", drive=axis.drive.name, tries=tries)


def _meaning(
    drive: Drive, centre: int, effects: list[tuple[Trial, NotchEffect | None]]
) -> NotchMeaning:
    """What the trials say together."""
    seen = [(trial, effect.notch) for trial, effect in effects if effect is not None]
    if not seen:
        raise NotAllowed("notch.notch-hz-nothing-torque", drive=drive.name, centre_hz=centre)
    if seen[0][0].depth is None:
        scale = float(np.mean([notch.width_hz / trial.width for trial, notch in seen]))
        depth = float(np.mean([notch.depth_db for _trial, notch in seen]))
        return NotchMeaning(float(centre), None, scale, depth)
    # The same width was tried with several depths: the deep ones show it best.
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
    """Depth of each level between those that were tried, by what is left of the amplitude."""
    spec = drive.profile.notch
    assert spec is not None
    low, high = limits_of(drive, spec.slots[0].depth_key)
    ordered = sorted(points)
    levels = np.arange(max(low, ordered[0][0]), min(high, ordered[-1][0]) + 1)
    left = np.interp(levels, [p[0] for p in ordered], [10 ** (p[1] / 20) for p in ordered])
    return tuple((int(n), float(20 * np.log10(a))) for n, a in zip(levels, left, strict=True))


def path_of(rate: float, facts: AxisFacts, hold: str | None, delay_s: float) -> SignalPath:
    """The path between setpoint and torque, as a frequency response found it."""
    path = SignalPath(
        rate, current_bandwidth_hz=facts.current_bandwidth_hz, command_delay_s=delay_s
    )
    return replace(path, hold="linear") if hold == "linear" else path
