"""The brake test: torque against the closed brake in CST, both directions.

At the slip limit, the cyclic loop of the exchange itself ends the test, in the cycle after the
sample that exceeds it: it sets the torque to zero, and begins a quick stop where no brake slows the
shaft down (`drivers.motion.playback`).
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import channel
from backend.axes.functions.closed_brake import forcing_keys, kept_closed, obstacle_of
from backend.axes.scales.units import AxisUnits
from backend.tools.measuring.axis_facts import AxisFacts, brake_opens_s, read_facts
from backend.tools.measuring.recording import (
    Play,
    bus_limits,
    cycle_s,
    enabled,
    play,
    quiet,
    require_signals,
    share,
    takes_torque,
)
from backend.tools.measuring.temporary import stopping_hard
from backend.tools.mechanics.brake.evaluate import (
    PRELOAD,
    Phase,
    Trial,
    Trials,
    evaluate,
    reevaluate,
)
from backend.tools.mechanics.brake.result import BrakeResult, Means, Obstacle
from backend.tools.mechanics.brake.settings import BrakeSettings
from backend.tools.mechanics.brake.texts import TEXTS, report
from backend.tools.thresholds import brake_run as threshold
from backend.tools.tool import Run, Tool
from drivers import link as bus
from drivers.cia402 import Mode
from drivers.errors import EnvelopeExceeded, NotAllowed, OutOfRange
from drivers.halt import HaltCause
from drivers.texts.message import text

FloatArray = npt.NDArray[np.float64]
_DIRECTIONS: tuple[Literal[1, -1], ...] = (1, -1)


@dataclass
class _Catch:
    """Rows of position, torque and setpoint by cycle, from before to after the motion."""

    names: tuple[str, str, str]
    blocks: list[bus.ScopeBlock] = field(default_factory=list)

    def rows(self) -> tuple[npt.NDArray[np.int64], FloatArray, npt.NDArray[np.bool_]]:
        """Cycle [n], values [n, 3] and validity [n]; lost cycles are missing."""
        cycles, values, valid = [], [], []
        for block in self.blocks:
            assert block.cycle is not None, "what a cyclic exchange delivers is numbered"
            part = block.samples[:, [block.channels.index(name) for name in self.names]]
            good = np.ones(len(part), np.bool_) if block.valid is None else block.valid
            cycles.append(block.cycle + np.arange(len(part)))
            values.append(part)
            valid.append(good & ~np.isnan(part).any(axis=1))
        if not cycles:
            return np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0, np.bool_)
        return np.concatenate(cycles), np.concatenate(values), np.concatenate(valid)


def sequence(
    peak: float, ramp_s: float, lead_s: float, rate: float
) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Torque of one direction [n], in the unit of ``peak``, and the phase of each sample [n]."""
    low = PRELOAD * peak
    parts = [
        (Phase.LEAD, 0.0, 0.0, lead_s),
        (Phase.PRELOADING, 0.0, low, threshold.PRELOAD_S),
        (Phase.PRELOADED, low, low, threshold.STILL_S),
        (Phase.RAMP, low, peak, ramp_s),
        (Phase.TOP, peak, peak, threshold.TOP_S),
        (Phase.UNLOADING, peak, low, threshold.DOWN_S),
        (Phase.UNLOADED, low, low, threshold.STILL_S),
        (Phase.END, low, 0.0, threshold.PRELOAD_S),
        (Phase.END, 0.0, 0.0, threshold.END_S),
    ]
    values, phases = [], []
    for phase, begin, end, seconds in parts:
        n = max(1, round(seconds * rate))
        values.append(np.linspace(begin, end, n))
        phases.append(np.full(n, phase, np.int64))
    return np.concatenate(values), np.concatenate(phases)


async def run(run: Run, settings: BrakeSettings) -> BrakeResult:
    """Test; afterwards the axis is disabled, its brake closed, and its settings are restored.

    Raises:
        NotAllowed: the settings do not state what hangs at the axis, or something other than slip
            ended the test.
        OutOfRange: the permitted torque is less than the test torque needs.
    """
    axis, drive = run.axis, run.axis.drive
    measured_at = datetime.now(UTC).isoformat(timespec="seconds")
    if not settings.nothing_hangs and not settings.load_supported:
        raise NotAllowed("brake.say-what-hangs", drive=drive.name)
    facts = await read_facts(axis, settings.rated_torque_nm)
    percent = _test_percent(settings, facts, drive.name)
    obstacle = await _obstacle(run, settings)
    if obstacle is not None:
        return _cannot(obstacle, settings, facts, percent, measured_at)
    require_signals(axis, run.session, Mode.CST, False)
    units = await axis.require_certain_scales()
    await quiet(axis)
    means: Means = "supply" if settings.brake_supply_cut else "output"
    trials: list[Trial] = []
    # A shaft whose brake lets go under torque is faster than the limit before it is braked.
    fastest = max(settings.speed_limit, facts.rated_speed_rpm or 0.0)
    async with _closed(axis, settings), stopping_hard(axis, fastest):
        for number, direction in enumerate(_DIRECTIONS):
            trial = await _trial(run, settings, facts, units, direction, percent, number)
            trials.append(trial)
            reached = np.any(trial.phase[_sent(trial)] >= Phase.RAMP)
            if trial.halted and (not reached or _ran_on(trial, settings.envelope.travel_rev)):
                break  # no brake holds it: the other direction would only turn the axis as well
    run.progress(0.95, text("brake.evaluating"))
    test = Trials(
        tuple(trials),
        1.0 / cycle_s(run.session),
        abs(units.torque(1.0)) / 100.0 * facts.rated_torque_nm,
        percent,
        means,
        measured_at,
    )
    if run.keep is not None:
        meta = {"settings": settings.model_dump(mode="json"), "facts": asdict(facts)}
        run.keep("brake-test", test.arrays(), {"tool": "brake-test", **meta, **test.facts()})
    return await asyncio.to_thread(evaluate, test, settings, facts)


def _sent(trial: Trial) -> npt.NDArray[np.bool_]:
    return np.abs(trial.sent_nm) > 0


def _ran_on(trial: Trial, limit_rev: float) -> bool:
    """Whether the shaft ran on beyond the limit without torque, as no brake stopped it."""
    position = trial.position_rad[trial.valid]
    if not position.size:
        return False
    away_rev = float(np.max(np.abs(position - position[0]))) / (2 * np.pi)
    return away_rev > limit_rev + threshold.RAN_ON_REV


async def _obstacle(run: Run, settings: BrakeSettings) -> Obstacle | None:
    if not takes_torque(run.axis, run.session):
        return "no_torque_mode"
    means = run.axis.drive.profile.functions.brake_test
    if settings.brake_supply_cut:
        # The supply of a brake built into a motor with an integrated drive cannot be cut
        # separately.
        return "built_in" if means is not None and means.obstacle == "built_in" else None
    return await obstacle_of(run.axis.drive)


def _test_percent(settings: BrakeSettings, facts: AxisFacts, name: str) -> float:
    """Test torque in % of the motor's rated torque.

    Raises:
        NotAllowed: it is given in Nm, and the rated torque is not known.
        OutOfRange: less torque is permitted.
    """
    wanted_nm = settings.test_torque_nm
    if wanted_nm is None and settings.brake_rated_nm is not None:
        wanted_nm = settings.test_percent / 100.0 * settings.brake_rated_nm
    percent = settings.test_percent
    if wanted_nm is not None:
        if not facts.torque_known:
            raise NotAllowed("brake.rated-torque-not-known", drive=name)
        percent = 100.0 * wanted_nm / facts.rated_torque_nm
    needed = threshold.ABOVE_SHARE * percent + threshold.ABOVE_PERCENT
    if needed > settings.torque_limit:
        raise OutOfRange(
            "brake.torque-not-permitted",
            drive=name,
            value=round(percent, 2),
            limit=f"{settings.torque_limit:g} %",
            percent=percent,
            needed=needed,
        )
    return percent


def _cannot(
    obstacle: Obstacle, settings: BrakeSettings, facts: AxisFacts, percent: float, measured_at: str
) -> BrakeResult:
    return BrakeResult(
        verdict="cannot_be_tested",
        obstacle=obstacle,
        measured_at=measured_at,
        rated_torque_nm=facts.rated_torque_nm if facts.torque_known else None,
        brake_rated_nm=settings.brake_rated_nm,
        test_percent=percent,
        slip_limit_rev=settings.envelope.travel_rev,
        torque_percent=None,
        of_brake_percent=None,
    )


@asynccontextmanager
async def _closed(axis: Axis, settings: BrakeSettings) -> AsyncIterator[None]:
    """Hold the grant of the test, block forcing of outputs meanwhile, and keep the brake closed."""
    purpose = text("motion.purpose-brake-test")
    with contextlib.ExitStack() as stack:
        if keys := forcing_keys(axis.drive):
            stack.enter_context(axis.granted(purpose, keys=keys))
        stack.enter_context(axis.granted(purpose, settings.envelope))
        if settings.brake_supply_cut:
            yield
            return
        async with kept_closed(axis):
            yield


async def _trial(
    run: Run, settings: BrakeSettings, facts: AxisFacts, units: AxisUnits,
    direction: Literal[1, -1], percent: float, number: int,
) -> Trial:  # fmt: skip
    """Test one direction: a preload, which shows whether the brake is closed at all, then the ramp.

    Beyond a limit, the preload ends with a quick stop, as an open brake does not hold. Later only
    the torque becomes zero; a quick stop follows where the shaft does not slow down.
    """
    axis, session = run.axis, run.session
    rate = 1.0 / cycle_s(session)
    lead_s = threshold.LEAD_S + await brake_opens_s(axis.drive)
    values, phases = sequence(direction * percent, settings.ramp_s, lead_s, rate)
    raw = np.array([units.torque_raw(value) for value in values], np.int64)
    begins = int(np.flatnonzero(phases == Phase.RAMP)[0])
    step = text("brake.forwards") if direction > 0 else text("brake.backwards")
    parts: list[Trial] = []
    async with enabled(axis, session, Mode.CST) as start:
        limits = await bus_limits(axis, settings.envelope, start)
        for part, closed in ((slice(0, begins), False), (slice(begins, None), True)):
            low = 0.05 + 0.45 * number + (0.2 if closed else 0.0)
            done = share(run.progress, low, low + 0.22, step)
            bounds = replace(limits, torque_off_only=closed, stopped_if_it_runs_on=closed)
            catch, halted = await _played(run, facts, raw[part], bounds, done)
            parts.append(_placed(catch, raw[part], phases[part], units, facts, direction, halted))
            if halted:
                break
    return _joined(parts)


async def _played(
    run: Run,
    facts: AxisFacts,
    raw: npt.NDArray[np.int64],
    limits: bus.Envelope,
    progress: Callable[[float], None],
) -> tuple[_Catch, bool]:
    """Play the setpoints: what was received, and whether a limit of travel or speed ended it."""
    axis, session, drive = run.axis, run.session, run.axis.drive
    keys = [drive.require(role) for role in ("position_actual", "torque_actual", "torque_target")]
    first, second, third = (channel(drive, key) for key in keys)
    catch, halted = _Catch((first, second, third)), False
    unsubscribe = session.cyclic.blocks(catch.blocks.append)
    try:
        await play(axis, session, Play(Mode.CST, raw), limits, facts.rated_torque_nm, progress)
    except EnvelopeExceeded as error:
        if error.halt.cause not in (HaltCause.POSITION, HaltCause.SPEED):
            raise
        halted = True
        await asyncio.sleep(threshold.AFTER_HALT_S)
    finally:
        unsubscribe()
    return catch, halted


def _joined(parts: Sequence[Trial]) -> Trial:
    def of(name: str) -> Any:
        return np.concatenate([getattr(each, name) for each in parts])

    return Trial(
        direction=parts[0].direction, position_rad=of("position_rad"), torque_nm=of("torque_nm"),
        sent_nm=of("sent_nm"), phase=of("phase"), valid=of("valid"), halted=parts[-1].halted,
    )  # fmt: skip


def _placed(
    catch: _Catch, raw: npt.NDArray[np.int64], phases: npt.NDArray[np.int64], units: AxisUnits,
    facts: AxisFacts, direction: Literal[1, -1], halted: bool,
) -> Trial:  # fmt: skip
    """Assign to each sample the phase of the sequence that its cycle belongs to.

    The sequence is found by its setpoints read back, wherever the first of them were lost.
    """
    cycles, values, valid = catch.rows()
    row = cycles - _begun(cycles[valid], values[valid, 2], raw, int(cycles[0]))
    inside = (row >= 0) & (row < len(raw) + (0 if not halted else len(raw)))
    row, values, valid = row[inside], values[inside], valid[inside]
    nm = units.torque(1.0) / 100.0 * facts.rated_torque_nm
    return Trial(
        direction=direction,
        position_rad=values[:, 0] * (units.position(1.0) * 2 * np.pi),
        torque_nm=values[:, 1] * nm,
        sent_nm=values[:, 2] * nm,
        phase=phases[np.clip(row, 0, len(raw) - 1)],
        valid=valid,
        halted=halted,
    )


def _begun(
    cycles: npt.NDArray[np.int64], sent: FloatArray, raw: npt.NDArray[np.int64], first: int
) -> int:
    """Cycle in which the sequence began, from the valid setpoints read back [n].

    Of all places of the first setpoint that differs from the one before the motion it is the one
    where the most of the others agree as well. ``first`` where none differs.
    """
    rises = int(np.argmax(raw != raw[0]))
    went = np.flatnonzero(sent != raw[0])
    if not went.size:
        return first - rises
    begins = int(cycles[went[0]])
    places = np.flatnonzero(raw == sent[went[0]])
    # A motion that ended by force has zero for its setpoint; that is no place in the sequence.
    if not places.size or sent[went[0]] == 0.0:
        return begins - rises

    def agree(place: int) -> int:
        row = cycles - (begins - place)
        inside = (row >= 0) & (row < raw.size)
        return int(np.count_nonzero(raw[row[inside]] == sent[inside]))

    return begins - max(map(int, places), key=agree)


TOOL = Tool(
    kind="brake-test",
    title=text("brake.title"),
    settings=BrakeSettings,
    result=BrakeResult,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
)
