"""Playing the sequences of a sweep on an axis, with less excitation where it reaches its limits."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from backend.analysis.signals.excitation import scaled
from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.foundation.work.jobs import Progress
from backend.tools.measuring import excite
from backend.tools.measuring.recording import (
    Play,
    Recording,
    bus_limits,
    enabled,
    play,
    quiet,
    share,
)
from backend.tools.measuring.repeats import Repeats
from backend.tools.moving.moves.go_back import go_back
from backend.tools.thresholds import sweep_play as threshold
from backend.tools.tuning.sweep import speed_injection
from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.plan import Setup, sequences_of
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, OutOfRange, exceeded
from drivers.halt import HaltCause
from drivers.texts.message import text

_TURN = 2 * np.pi
MODE_OF = {"none": Mode.CST, "speed": Mode.CSV, "position": Mode.CSP}

Recorded: TypeAlias = tuple[excite.Sequence, Recording]
Records = tuple[Recorded, ...]


async def scaled_by_speed(
    axis: Axis,
    session: CyclicSession,
    settings: SweepSettings,
    setup: Setup,
    sequences: tuple[excite.Sequence, ...],
    home: int,
    progress: Progress,
) -> tuple[excite.Sequence, ...]:
    """Scale the excitation so that its torque has the wanted share.

    Raises:
        NotAllowed: as `play_fitting`, or the torque that the drive reports does not change.
    """
    trial = Progress(lambda: progress(0.09, text("sweep.feeling-how-much-torque")))
    ((sent, recording),) = await play_fitting(
        axis, session, settings, setup, sequences[:1], home, trial
    )
    seen = recording.torque_nm[recording.valid]
    if not float(np.ptp(seen)) > 0.0:
        drive = axis.drive
        key = drive.require("torque_actual")
        raise NotAllowed("sweep.torque-not-change", drive=drive.name, parameter=key)
    share_nm = settings.share * setup.room.torque_nm
    size = speed_injection.fitting_size(
        sent, recording, setup.room, share_nm, watched=not session.unwatched(axis.drive)
    )
    return sized(sequences, size.peak_rad_s / speed_injection.FIRST_RAD_S, size.base_rad_s)


def sized(
    sequences: tuple[excite.Sequence, ...], factor: float, base_rad_s: float
) -> tuple[excite.Sequence, ...]:
    """The sequences with excitations scaled by ``factor`` and with this peak of the base motion."""
    made = []
    for s in sequences:
        base = s.base
        if base is not None and np.any(base):
            base = base * (base_rad_s / float(np.max(np.abs(base))))
        made.append(replace(s, excitation=scaled(s.excitation, factor), base=base))
    return tuple(made)


async def _play_all(
    axis: Axis,
    session: CyclicSession,
    settings: SweepSettings,
    setup: Setup,
    sequences: tuple[excite.Sequence, ...],
    home_raw: int,
    progress: Progress,
    spare: int,
    place: tuple[int, int] | None,
    repeats: Repeats,
) -> Records:
    """Play every realisation, from the start position where the travel requires it.

    A realisation that lost samples is played again, at most ``spare`` times in total; the best one
    is used. If it already has a whole period, it is repeated only where ``repeats`` allows it.
    """
    records: list[Recorded] = []
    before, count = place or (0, len(sequences))
    played = before

    async def one(sequence: excite.Sequence, reported: Callable[[float], None]) -> Recorded:
        nonlocal played
        if played:
            await _near_home(axis, session, settings, setup, home_raw)
        played += 1
        return await _play_one(axis, session, settings, setup, sequence, home_raw, reported)

    for number, sequence in enumerate(sequences, before):
        low, high = (0.1 + 0.85 * part / count for part in (number, number + 1))
        step = text("sweep.measuring-realisation", number=number + 1, count=count)
        begun_s = time.monotonic()
        tries = [await one(sequence, share(progress, low, high, step))]
        takes_s = time.monotonic() - begun_s
        while spare > 0 and _worth_another(tries):
            if any(_kept(*each)[0] for each in tries) and not repeats.allow(takes_s):
                break
            spare -= 1
            repeats.repeated += 1
            again = share(progress, low, high, text("sweep.once-more-samples-lost", step=step))
            tries.append(await one(sequence, again))
        repeats.played += 1
        records.append(max(tries, key=lambda each: _kept(*each)))
    return tuple(records)


async def _near_home(
    axis: Axis, session: CyclicSession, settings: SweepSettings, setup: Setup, home_raw: int
) -> None:
    """Go back to the start if the axis is so far away that the travel may not suffice."""
    away = abs((await axis.units()).position(await axis.position_raw() - home_raw))
    if away > threshold.AWAY * settings.envelope.travel_rev:
        await go_back(axis, session, home_raw, settings.envelope, setup.facts)


async def _play_one(
    axis: Axis,
    session: CyclicSession,
    settings: SweepSettings,
    setup: Setup,
    sequence: excite.Sequence,
    home_raw: int,
    reported: Callable[[float], None],
) -> Recorded:
    """Play one realisation: enable, play, disable."""
    limits = await bus_limits(axis, settings.envelope, home_raw)
    async with enabled(axis, session, MODE_OF[setup.loop]) as start:
        if setup.loop != "none":
            await quiet(axis)
        sent = await _to_raw(axis, sequence, setup, settings, start)
        recording = await play(
            axis, session, sent, limits, setup.facts.rated_torque_nm, reported, also=setup.also
        )
    return await _as_sent(axis, sequence, settings, setup, sent, start), recording


def _worth_another(tries: list[Recorded]) -> bool:
    """Whether to repeat; a realisation that already has a whole period is repeated once at most."""
    if len(tries) > threshold.AGAIN or _whole(*tries[-1]):
        return False
    return len(tries) == 1 or all(_kept(*each)[0] == 0 for each in tries)


def _kept(sequence: excite.Sequence, recording: Recording) -> tuple[int, int]:
    """Number of evaluated periods without a gap, and number of valid samples."""
    e = sequence.excitation
    if e.segments:
        return 0, int(np.count_nonzero(recording.valid))
    n = e.period_samples
    starts = [e.first_sample + p * n for p in range(e.transient_periods, e.periods)]
    # One sample more, since positions are evaluated as differences between samples.
    good = sum(bool(np.all(recording.valid[start:][: n + 1])) for start in starts)
    return good, int(np.count_nonzero(recording.valid))


def _whole(sequence: excite.Sequence, recording: Recording) -> bool:
    """Whether no relevant sample was lost; the settling counts, too, as a delayed loop disturbs it.

    Backlash and free oscillations are detected by differences between two whole periods, friction
    at reversals by a recording without any gap.
    """
    e = sequence.excitation
    last = e.samples.size if e.segments else e.first_sample + e.periods * e.period_samples + 1
    return bool(np.all(recording.valid[:last]))


async def play_fitting(
    axis: Axis, session: CyclicSession, settings: SweepSettings, setup: Setup,
    sequences: tuple[excite.Sequence, ...], home_raw: int, progress: Progress, spare: int = 0,
    place: tuple[int, int] | None = None, repeats: Repeats | None = None,
) -> Records:  # fmt: skip
    """Play as `_play_all`; where the axis reaches its envelope, repeat with less excitation.

    The torque that a closed loop takes depends on its gains, and the speed of an axis without a
    loop on its oscillating load: both are unknown before the measurement. ``place`` is the number
    of realisations played before, and their total.

    Raises:
        NotAllowed: something else ended it, or even the smallest excitation is too much.
    """
    for attempt in range(1, threshold.ATTEMPTS + 1):
        try:
            return await _play_all(
                axis, session, settings, setup, sequences, home_raw, progress, spare, place,
                repeats or Repeats(),
            )  # fmt: skip
        except NotAllowed as error:
            if attempt == threshold.ATTEMPTS or not _too_much(error, setup):
                raise
            smaller = await asyncio.to_thread(_smaller, sequences, setup, settings, attempt)
            if not smaller:
                raise
        await quiet(axis)
        await go_back(axis, session, home_raw, settings.envelope, setup.facts)
        sequences = smaller
    raise AssertionError


def _too_much(error: NotAllowed, setup: Setup) -> bool:
    """Whether less excitation may avoid the error.

    Excess torque is caused by a closed loop; without a loop the torque is as commanded. An axis
    that leaves its travel has a static load torque, or too little travel.
    """
    mendable = HaltCause.SPEED if setup.loop == "none" else HaltCause.TORQUE
    return exceeded(error) is mendable


def _smaller(
    sequences: tuple[excite.Sequence, ...], setup: Setup, settings: SweepSettings, attempt: int
) -> tuple[excite.Sequence, ...]:
    """The sequences after this many failed attempts; empty where too little is left.

    Without a loop, one torque makes both the excitation and the base motion, which must still
    overcome friction: both are designed again, for less speed.
    """
    if setup.loop != "none":
        return tuple(
            replace(
                s,
                excitation=scaled(s.excitation, threshold.WEAKER),
                base=None if s.base is None else s.base * threshold.SLOWER,
            )
            for s in sequences
        )
    share = threshold.SLOWER**attempt
    slower = replace(setup, room=replace(setup.room, speed_rad_s=share * setup.room.speed_rad_s))
    try:
        return sequences_of(slower, replace(settings, share=share * settings.share))
    except OutOfRange:
        return ()


async def _to_raw(
    axis: Axis, sequence: excite.Sequence, setup: Setup, settings: SweepSettings, start: int
) -> Play:
    units = await axis.units()
    torque = 1.0 / setup.torque_step_nm
    speed = units.velocity_raw(1e6) / 1e6 * 60.0 / _TURN
    place = units.position_raw(1e6) / 1e6 / _TURN
    samples = sequence.excitation.samples
    base = np.zeros(samples.size) if sequence.base is None else sequence.base
    if setup.loop == "none":
        return Play(Mode.CST, np.round(samples * torque).astype(np.int64))
    mode = MODE_OF[setup.loop]
    scale, shift = (place, start) if mode is Mode.CSP else (speed, 0)
    if settings.kind != "mechanics" or setup.by_speed:
        return Play(mode, shift + np.round((base + samples) * scale).astype(np.int64))
    return Play(
        mode,
        shift + np.round(base * scale).astype(np.int64),
        "torque_offset",
        np.round(samples * torque).astype(np.int64),
    )


async def _as_sent(
    axis: Axis,
    sequence: excite.Sequence,
    settings: SweepSettings,
    setup: Setup,
    sent: Play,
    start: int,
) -> excite.Sequence:
    """The excitation as given by the rounded setpoints, as estimators need what was really sent."""
    if settings.kind == "mechanics" and not setup.by_speed:
        return sequence
    units = await axis.units()
    if sent.mode is Mode.CSP:
        values = (sent.values - start) * (units.position(1.0) * _TURN)
    else:
        values = sent.values * (units.velocity(1.0) * _TURN / 60.0)
    return replace(
        sequence, excitation=replace(sequence.excitation, samples=np.asarray(values, np.float64))
    )
