"""The same move without and with a shaper, out and back, with one setpoint per cycle (CSP)."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import numpy as np

from backend.analysis.signals.arrays import FloatArray
from backend.analysis.signals.shaper import shaped
from backend.axes.drive.drive import Drive
from backend.tools.measuring.axis_facts import AxisFacts, read_facts
from backend.tools.measuring.recording import (
    Play,
    Recording,
    bus_limits,
    cycle_s,
    dwell,
    enabled,
    play,
    quiet,
    require_signals,
    share,
)
from backend.tools.measuring.temporary import stopping_hard
from backend.tools.moving.moves.go_back import go_back
from backend.tools.thresholds import shaping_run as threshold
from backend.tools.tool import Run, Tool
from backend.tools.tuning.shaping.evaluate import (
    Moves,
    choose,
    demand_of,
    designs,
    evaluate,
    pair_of,
    reevaluate,
    see,
)
from backend.tools.tuning.shaping.result import (
    DriveFilter,
    FilterSlot,
    ShapingDriveValue,
    ShapingResult,
)
from backend.tools.tuning.shaping.settings import ShapingSettings
from backend.tools.tuning.shaping.texts import TEXTS, report
from drivers.cia402 import Mode
from drivers.errors import DriveError, NotAllowed, OutOfRange
from drivers.texts.message import Text, text
from profiles.schema import Parameter


async def run(run: Run, settings: ShapingSettings) -> ShapingResult:
    """Measure the vibration, design the shapers, and play the chosen one.

    The axis ends where it began, with its settings restored.

    Raises:
        OutOfRange: the move does not fit into the envelope; nothing has moved.
        NotAllowed: the drive accepts no cyclic positions, or the envelope or a fault ended a
            motion.
    """
    axis, session, drive = run.axis, run.session, run.axis.drive
    if Mode.CSP not in drive.modes:
        raise NotAllowed("shaping.no-cyclic-position", drive=drive.name)
    require_signals(axis, session, Mode.CSP, False)
    await axis.require_certain_scales()
    rate = 1.0 / cycle_s(session)
    demand = demand_of(settings, rate)
    _require_inside(settings, demand.size / rate)
    facts = await read_facts(axis, settings.rated_torque_nm)
    home = await axis.position_raw()
    moves = Moves(
        rate,
        facts.rated_torque_nm,
        await _played(run, settings, facts, demand, (0.02, 0.45, text("shaping.unshaped"))),
        filter=_filter_of(drive),
    )
    run.progress(0.45, text("shaping.evaluating"))
    seen = await asyncio.to_thread(see, moves, settings)
    made, band = designs(seen, settings)
    # A mode that the motor does not show cannot be compared: no further move is made.
    if seen is not None and band is not None and settings.verify:
        chosen = choose(made, band, settings)
        try:
            values = shaped(demand, chosen, rate)
            pairs = await _played(run, settings, facts, values, (0.5, 0.93, text("shaping.shaped")))
        except DriveError:
            # The first measurement remains useful.
            _keep(run, moves, settings)
            raise
        moves = replace(moves, shaped=pairs, kind=chosen.kind)
    _keep(run, moves, settings)
    run.progress(0.94, text("shaping.evaluating"))
    await go_back(axis, session, home, settings.envelope, facts)
    return await asyncio.to_thread(evaluate, moves, settings, seen)


def _keep(run: Run, moves: Moves, settings: ShapingSettings) -> None:
    if run.keep is not None:
        run.keep("shaping", moves.arrays(), moves.meta(settings))


async def _played(
    run: Run,
    settings: ShapingSettings,
    facts: AxisFacts,
    demand_rev: FloatArray,
    where: tuple[float, float, Text],
) -> tuple[Recording, ...]:
    """Recordings of the moves out and back; the axis is enabled for their duration."""
    axis, session = run.axis, run.session
    units, rate = await axis.units(), 1.0 / cycle_s(session)
    low, high, step = where
    steps = np.round(pair_of(demand_rev, settings, rate) * (units.position_raw(1e6) / 1e6))
    found: list[Recording] = []
    async with (
        stopping_hard(axis, settings.envelope.speed_rpm),
        enabled(axis, session, Mode.CSP) as start,
    ):
        await quiet(axis)
        values = (start + steps).astype(np.int64)
        limits = await bus_limits(axis, settings.envelope, start)
        for number in range(settings.repetitions):
            part = (high - low) / settings.repetitions
            ends = (low + number * part, low + (number + 1) * part)
            found.append(
                await play(
                    axis,
                    session,
                    Play(Mode.CSP, values),
                    limits,
                    facts.rated_torque_nm,
                    share(run.progress, *ends, step),
                )
            )
            await dwell(axis, session, threshold.BETWEEN_S)
    return tuple(found)


def _require_inside(settings: ShapingSettings, move_s: float) -> None:
    """Check that the move and its longest shaped form fit into the envelope.

    Raises:
        OutOfRange: states what is needed and what is permitted.
    """
    envelope = settings.envelope
    if settings.speed > envelope.speed_rpm or abs(settings.size) > envelope.travel_rev:
        raise OutOfRange(
            "shaping.move-beyond-envelope",
            value=settings.size,
            limit=f"{envelope.speed_rpm:g} rpm, {envelope.travel_rev:g} rev",
            needed_rpm=settings.speed,
            needed_rev=abs(settings.size),
            speed_rpm=envelope.speed_rpm,
            travel_rev=envelope.travel_rev,
        )
    slowest_hz = settings.frequency_hz or settings.lowest_hz
    pair_s = 2.0 * (move_s + settings.hold_s + threshold.LONGEST_PERIODS / slowest_hz)
    if pair_s > envelope.time_s:
        raise OutOfRange(
            "shaping.takes-too-long",
            value=pair_s,
            limit=f"{envelope.time_s:g} s",
            needed_s=pair_s,
            time_s=envelope.time_s,
        )


def _filter_of(drive: Drive) -> DriveFilter:
    """The drive's own filter against slow vibration, by its profile."""
    spec = drive.profile.slow_vibration
    if spec is None:
        return DriveFilter(family=drive.profile.drive)
    key = spec.frequency or spec.period
    also = tuple(
        _value(drive.parameter(name), raw)
        for name, raw in spec.also.items()
        if not drive.unreachable_why(drive.parameter(name))
    )
    if key is None or drive.unreachable_why(drive.parameter(key)):
        return DriveFilter(family=drive.profile.drive)
    parameter = drive.parameter(key)
    return DriveFilter(
        family=drive.profile.drive,
        takes="frequency" if spec.frequency else "period",
        slot=FilterSlot(
            parameter=parameter.number or parameter.key,
            name=parameter.name,
            unit=parameter.unit,
            scale=parameter.scale,
            highest_raw=int(parameter.max_raw or 0),
        ),
        also=also,
        unstated=tuple(drive.parameter(name).number or name for name in spec.unstated),
    )


def _value(parameter: Parameter, raw: int) -> ShapingDriveValue:
    return ShapingDriveValue(
        parameter=parameter.number or parameter.key,
        name=parameter.name,
        raw=raw,
        value=float(raw) * parameter.scale,
        unit=parameter.unit,
    )


TOOL = Tool(
    kind="shaping",
    title=text("shaping.title"),
    settings=ShapingSettings,
    result=ShapingResult,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
)
