"""Motions of a gantry measurement: both axes at one steady speed, with a multisine added.

The steady speed is higher than the amplitude of the multisine, so that no motor reverses during the
measurement: dry friction is then a constant torque and not part of the response.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AsyncExitStack
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt

from backend.analysis.coupled.excitation import Experiment, orthogonal_multisines
from backend.analysis.loop.loop_structure import LoopFilters
from backend.analysis.response.signal_path.sampling import lag_response
from backend.analysis.signals.excitation import choose_lines
from backend.axes.axis.axis import Axis
from backend.tools.measuring.axis_facts import AxisFacts, read_facts
from backend.tools.measuring.computing import meanwhile
from backend.tools.measuring.pair import Pair, play_pair
from backend.tools.measuring.recording import Recording, cycle_s, require_signals, share
from backend.tools.measuring.temporary import stopping_hard
from backend.tools.moving.moves.go_back import require_back
from backend.tools.moving.moves.raised_cosine import raised_cosine
from backend.tools.thresholds import gantry_run as threshold
from backend.tools.tool import Run, Tool
from backend.tools.tuning.autotune.design.gains import read_gains
from backend.tools.tuning.autotune.verification.verdict import fixed_of
from backend.tools.tuning.gantry.evaluate import Experiments, Shape, evaluate, reevaluate
from backend.tools.tuning.gantry.result import GantryResult
from backend.tools.tuning.gantry.settings import GantrySettings
from backend.tools.tuning.gantry.texts import TEXTS, report
from backend.tools.tuning.notch.filters import read_notches
from backend.tools.tuning.notch.meaning import meaning_of
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, OutOfRange, exceeded
from drivers.halt import HaltCause
from drivers.texts.message import text

FloatArray = npt.NDArray[np.float64]
_TURN = 2 * np.pi
#: Direction of each experiment: every realisation and every sign is measured in both directions.
DIRECTIONS = (1, -1, -1, 1)


@dataclass(frozen=True)
class Plan:
    """Experiments about a steady speed; ``ramp`` is the number of samples of each ramp."""

    experiments: tuple[Experiment, ...]
    shape: Shape
    steady_rad_s: float
    peak_rad_s: float
    ramp: int

    def speeds_rpm(self, number: int, share: float) -> FloatArray:
        """Setpoints [2, n] of an experiment with this share of the excitation, in rpm."""
        made = self.experiments[number]
        excited = share * self.peak_rad_s * made.excitation.samples
        rise = 0.5 * (1.0 - np.cos(np.pi * (np.arange(self.ramp) + 0.5) / self.ramp))
        base = np.concatenate([rise, np.ones(excited.size), rise[::-1], np.zeros(self.ramp // 4)])
        both = np.empty((2, base.size))
        for row, sign in zip(both, made.signs, strict=True):
            row[:] = DIRECTIONS[number] * self.steady_rad_s * base
            row[self.ramp : self.ramp + excited.size] += sign * excited
        return both * 60.0 / _TURN


def planned(settings: GantrySettings, rate: float) -> Plan:
    """Plan experiments that fit into travel, speed and time.

    Raises:
        OutOfRange: the limits are too small.
    """
    n = round(rate / settings.resolution_hz)
    top = min(settings.highest_hz or threshold.TOP * rate, threshold.TOP * rate)
    lowest = max(threshold.LOWEST_HZ, 2.0 * settings.resolution_hz)
    lines = choose_lines(lowest, top, rate / n, count=threshold.LINES)
    corner = np.hypot(1.0, lines * (rate / n) / threshold.CORNER_HZ)
    made = orthogonal_multisines(
        sample_rate_hz=rate,
        period_samples=n,
        lines=lines,
        periods=threshold.PERIODS + 1,
        transient_periods=1,
        realisations=threshold.REALISATIONS,
        ramp_samples=n // 2,
        amplitude=1.0 / corner,
    )
    ramp = round(threshold.RAMP_S * rate)
    way_s = (made[0].excitation.samples.size + ramp) / rate
    highest = max(float(np.max(np.abs(each.excitation.samples))) for each in made)
    speed = settings.speed_limit * _TURN / 60.0
    steady = min(
        threshold.USED * settings.travel_limit * _TURN / way_s,
        threshold.FAST * speed / (1.0 + threshold.EXCITED * highest),
    )
    if steady < threshold.LEAST_RPM * _TURN / 60.0:
        raise OutOfRange("gantry.no-room", value=settings.travel_limit)
    total_s = len(made) * (way_s + 1.25 * ramp / rate)
    if total_s > settings.time_limit_s:
        raise OutOfRange("gantry.no-time", value=settings.time_limit_s, takes_s=total_s)
    first = ramp + made[0].excitation.first_sample
    shape = Shape(rate, n, threshold.PERIODS + 1, 1, first)
    return Plan(made, shape, steady, threshold.EXCITED * steady, ramp)


async def run(run: Run, settings: GantrySettings) -> GantryResult:
    """Measure; both axes end where they began, with their settings restored.

    Raises:
        NotAllowed: there is no second axis, the bus can only move single axes, or the envelope, the
            skew limit or a fault ended a motion; states which.
        OutOfRange: the limits are too small; nothing has moved.
    """
    axis, session, partner = run.axis, run.session, run.partner
    if partner is None:
        raise NotAllowed("gantry.no-partner", drive=axis.drive.name)
    if session.cyclic.pairs is None:
        raise NotAllowed("axis.bus-moves-single-axes", url=session.link.url)
    axes = (axis, partner)
    for each in axes:
        require_signals(each, session, Mode.CSV, False)
        await each.require_certain_scales()
    plan = planned(settings, 1.0 / cycle_s(session))
    facts = [await read_facts(each, settings.rated_torque_nm) for each in axes]
    home = (await axis.position_raw(), await partner.position_raw())
    rated = (facts[0].rated_torque_nm, facts[1].rated_torque_nm)
    pair = Pair(axes, session, -1 if settings.mirrored else 1, home, rated)
    async with AsyncExitStack() as held:
        for each in axes:
            await held.enter_async_context(stopping_hard(each, settings.speed_limit))
        recordings, used = await _experiments(run, pair, plan, settings)
        run.progress(0.93, text("gantry.going-back-evaluating"))
        data = await _data(pair, plan, recordings, used, facts)
        if run.keep is not None:
            meta = {
                "tool": "gantry",
                "settings": settings.model_dump(mode="json"),
                "shape": asdict(data.shape),
                "rated_torque_nm": list(rated),
                "torque_known": data.torque_known,
                "partner": data.partner,
                "interpolates": data.interpolates,
            }
            run.keep("gantry", data.arrays(), meta)
        return await meanwhile(lambda: evaluate(data, settings), _go_back(pair, settings))


async def _experiments(
    run: Run, pair: Pair, plan: Plan, settings: GantrySettings
) -> tuple[list[tuple[Recording, Recording]], float]:
    """All recordings, and the share of the excitation used: reduced where torque ended a motion.

    The torque that the excitation causes depends on the gains of the loops, which are unknown.
    """
    used = 1.0
    for attempt in range(threshold.ATTEMPTS):
        try:
            count = len(plan.experiments)
            recordings = []
            for number in range(count):
                step = text("gantry.experiment", number=number + 1, count=count)
                low, high = (0.02 + 0.9 * part / count for part in (number, number + 1))
                reported = share(run.progress, low, high, step)
                recordings.append(await _one(pair, plan, settings, number, used, reported))
        except NotAllowed as error:
            if attempt == threshold.ATTEMPTS - 1 or exceeded(error) is not HaltCause.TORQUE:
                raise
            used *= threshold.WEAKER
            await _go_back(pair, settings)
            continue
        return recordings, used
    raise AssertionError


async def _one(
    pair: Pair,
    plan: Plan,
    settings: GantrySettings,
    number: int,
    used: float,
    reported: Callable[[float], None],
) -> tuple[Recording, Recording]:
    """Carry out one experiment; every second one starts from home."""
    if number % 2 == 0:
        await _go_back(pair, settings)
    speeds = plan.speeds_rpm(number, used)
    return await play_pair(pair, speeds, settings.envelope, settings.skew_limit_rev, reported)


async def _go_back(pair: Pair, settings: GantrySettings) -> None:
    """Move both axes home together, each by its own distance, so that the skew ends as it began.

    Raises:
        NotAllowed: the envelope, the skew limit or a fault ended the motion, or an axis did not
            arrive.
    """
    rate = 1.0 / cycle_s(pair.session)
    highest_rps = threshold.BACK * settings.speed_limit / 60.0
    for _ in range(threshold.BACK_ATTEMPTS):
        ways = await pair.ways_rev()
        if max(abs(way) for way in ways) < threshold.NEAR_REV:
            return
        # The peak speed of a raised cosine is twice its mean.
        duration_s = max(2.0 * max(abs(way) for way in ways) / highest_rps, threshold.BACK_S)
        still = np.zeros(round(0.1 * rate))
        speeds = np.array(
            [np.concatenate([raised_cosine(-way, duration_s, rate), still]) for way in ways]
        )
        await play_pair(
            pair, 60.0 * speeds, settings.envelope, settings.skew_limit_rev, lambda _done: None
        )
    for axis, way in zip(pair.axes, await pair.ways_rev(), strict=True):
        require_back(axis, way, settings.travel_limit)


async def _data(
    pair: Pair,
    plan: Plan,
    recordings: list[tuple[Recording, Recording]],
    used: float,
    facts: list[AxisFacts],
) -> Experiments:
    """Raw data with equal signs for equal motion, and the controllers of both axes on the lines."""
    sense = np.array([1.0, pair.sense])[None, :, None]
    lines = plan.experiments[0].excitation.lines
    f = lines * (plan.shape.sample_rate_hz / plan.shape.period_samples)
    positions = np.array([[r.position_rad for r in two] for two in recordings]) * sense
    zero = [
        (await axis.units()).position(home) * _TURN
        for axis, home in zip(pair.axes, pair.home, strict=True)
    ]
    ways = positions - (np.array(zero) * sense[0, :, 0])[None, :, None]
    speeds = [plan.speeds_rpm(number, used) * _TURN / 60.0 for number in range(len(recordings))]
    both = np.concatenate([f, plan.shape.sample_rate_hz - f])
    found = [
        await _controller(axis, each, both) for axis, each in zip(pair.axes, facts, strict=True)
    ]
    known = [each for each in found if each is not None]
    loops = np.stack(known, axis=1) if len(known) == len(found) else np.empty((0, 2))
    return Experiments(
        plan.shape, lines, np.array(speeds),
        np.array([[r.torque_nm for r in two] for two in recordings]) * sense,
        np.array([[r.velocity_rad_s for r in two] for two in recordings]) * sense,
        np.array([two[0].valid & two[1].valid for two in recordings]),
        np.array(DIRECTIONS[: len(recordings)], np.float64), ways[:, 0] - ways[:, 1],
        np.asarray(loops[: f.size], np.complex128), np.asarray(loops[f.size :], np.complex128),
        np.stack([lag_response(f, each.speed_filter_hz) for each in facts], axis=1),
        all(each.interpolates for each in facts),
        pair.rated_torque_nm, all(each.torque_known for each in facts), pair.axes[1].drive.name,
    )  # fmt: skip


async def _controller(
    axis: Axis, facts: AxisFacts, f: npt.NDArray[np.floating]
) -> npt.NDArray[np.complexfloating] | None:
    """Response from speed error to torque on these lines; None where a part of it is unknown.

    Gains or notches without a known meaning, or an unknown rated torque, make it unknown. The speed
    filter is not included: the reported speed has already passed it.
    """
    drive = axis.drive
    notches = []
    try:
        gains = await read_gains(axis, facts)
        if drive.profile.notch is not None:
            for slot in await read_notches(drive, meaning_of(drive)):
                if slot.enabled and slot.notch is None:
                    return None
                if slot.enabled and slot.notch is not None:
                    notches.append(slot.notch)
        filters = LoopFilters(None, facts.torque_filter_hz)
        fixed = fixed_of(axis, facts, tuple(notches), filters, np.asarray(f, np.float64))
    except (NotAllowed, ValueError):
        return None
    if not gains.speed_nms or not facts.torque_known:
        return None
    pi = 1.0 + (gains.integral_hz or 0.0) / (1j * f)
    return np.asarray(gains.speed_nms * pi * fixed)


TOOL = Tool(
    kind="gantry",
    title=text("gantry.title"),
    settings=GantrySettings,
    result=GantryResult,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
    pair=True,
)
