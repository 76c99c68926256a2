"""Recording while the axis moves and a person triggers the safety function by hand.

The drive ends the motion. The tool commands no stop before the observation is over, nothing enables
the axis again, and each further check is started by a person (ISO 13850).
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime

import numpy as np
import numpy.typing as npt

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import channel
from backend.axes.scales.units import AxisUnits
from backend.foundation.people.identity import acting_person
from backend.tools.measuring.axis_facts import brake_opens_s, read_facts
from backend.tools.measuring.interrupted import Interrupted
from backend.tools.measuring.recording import (
    Play,
    bridged,
    bus_limits,
    cycle_s,
    enabled,
    play,
    quiet,
    require_signals,
    share,
)
from backend.tools.thresholds import safety_check_evaluate
from backend.tools.thresholds import safety_check_run as threshold
from backend.tools.tool import Run, Tool
from backend.tools.watching.safety_check.evaluate import Trace, evaluate, reevaluate
from backend.tools.watching.safety_check.result import SafetyResult
from backend.tools.watching.safety_check.settings import SafetySettings
from backend.tools.watching.safety_check.texts import TEXTS, report
from drivers import link as bus
from drivers.cia402 import Mode, State
from drivers.errors import NotAllowed, OutOfRange
from drivers.halt import HaltCause
from drivers.texts import limits
from drivers.texts.message import Text, text

FloatArray = npt.NDArray[np.float64]
#: Column of the status word in the rows of the exchange.
STATUS = 4


@dataclass
class _Catch:
    """All rows of the exchange from before the axis is enabled until the observation is over."""

    names: tuple[str, ...]
    blocks: list[bus.ScopeBlock] = field(default_factory=list)

    @property
    def newest(self) -> int:
        """Number of the cycle after the last one received."""
        if not self.blocks:
            return 0
        last = self.blocks[-1]
        assert last.cycle is not None, "what a cyclic exchange delivers is numbered"
        return last.cycle + len(last.samples)

    def table(self) -> tuple[int, FloatArray, npt.NDArray[np.bool_]]:
        """Number of the first cycle, rows [n, k], and whether each was received."""
        first = self.blocks[0].cycle or 0
        table = np.zeros((self.newest - first, len(self.names)))
        valid = np.zeros(len(table), np.bool_)
        for block in self.blocks:
            part = block.samples[:, [block.channels.index(name) for name in self.names]]
            good = np.ones(len(part), np.bool_) if block.valid is None else block.valid
            rows = slice((block.cycle or 0) - first, (block.cycle or 0) - first + len(part))
            table[rows], valid[rows] = part, good & ~np.isnan(part).any(axis=1)
        states = held(table[:, STATUS], valid)
        table = bridged(table, valid)
        # Between two status words lies no third one, and its bits could show any state.
        table[:, STATUS] = states
        return first, table, valid


def held(words: FloatArray, valid: npt.NDArray[np.bool_]) -> FloatArray:
    """Status words [n], each row that is not ``valid`` [n] with the last valid word before it.

    Rows before the first valid one have that one.
    """
    if not np.any(valid):
        return words
    rows = np.where(valid, np.arange(len(words)), -1)
    last = np.maximum.accumulate(rows)
    last[last < 0] = int(np.flatnonzero(valid)[0])
    return np.asarray(words[last])


async def run(run: Run, settings: SafetySettings) -> SafetyResult:
    """Record one function; afterwards the axis is disabled and its settings are restored.

    Raises:
        NotAllowed: the settings do not state what hangs at the axis, the axis is enabled, or
            something other than the function ended the motion.
        OutOfRange: the motion does not fit into the envelope.
    """
    axis, session, drive = run.axis, run.session, run.axis.drive
    if not settings.nothing_hangs and not settings.load_supported:
        raise NotAllowed("safety-check.say-what-hangs", drive=drive.name)
    if await axis.state() is State.OPERATION_ENABLED:
        raise NotAllowed("safety-check.enabled", drive=drive.name)
    units, rate = await axis.require_certain_scales(), 1.0 / cycle_s(session)
    require_signals(axis, session, Mode.CSV, False)
    _require_status(run)
    plan = plan_of(settings, rate, await brake_opens_s(drive))
    raw_per_rpm = units.velocity_raw(1e6) / 1e6
    raw = np.round(plan * raw_per_rpm).astype(np.int64)
    if not np.any(raw):
        raise OutOfRange(
            "safety-check.below-resolution",
            drive=drive.name,
            value=settings.speed_rpm,
            limit=limits.at_least(1.0 / raw_per_rpm, "rpm"),
        )
    facts = await read_facts(axis, settings.rated_torque_nm)
    person = settings.person or acting_person()
    settings = settings.model_copy(update={"person": person})
    await quiet(axis)
    measured_at = datetime.now(UTC).isoformat(timespec="seconds")
    roles = (
        "position_actual",
        "velocity_actual",
        "torque_actual",
        "velocity_target",
        "status_word",
    )
    catch = _Catch(tuple(channel(drive, drive.require(role)) for role in roles))
    unsubscribe = session.cyclic.blocks(catch.blocks.append)
    asked_until: int | None = None
    try:
        await asyncio.sleep(threshold.LEAD_S)
        watch = _Watch(plan, settings, rate, catch, units)
        try:
            async with enabled(axis, session, Mode.CSV) as start:
                await play(
                    axis,
                    session,
                    Play(Mode.CSV, raw),
                    await bus_limits(axis, settings.envelope, start),
                    facts.rated_torque_nm,
                    share(run.progress, 0.05, 0.9, _step_of(settings)),
                    until=watch,
                )
                asked_until = watch.ended_at or catch.newest
        except Interrupted as error:
            if error.halt is None or error.halt.cause is not HaltCause.LEFT_ENABLED:
                raise
            run.progress(0.9, text("safety-check.watching"))
            await asyncio.sleep(settings.watch_s)
    finally:
        unsubscribe()
    trace = _trace(catch, plan, units, axis, rate, asked_until, measured_at)
    trace = replace(trace, reports=await _reports(axis))
    if run.keep is not None:
        meta = {"tool": "safety-check", "settings": settings.model_dump(mode="json")}
        run.keep("safety-check", trace.arrays(), {**meta, **trace.facts()})
    return await asyncio.to_thread(evaluate, trace, settings)


async def _reports(axis: Axis) -> tuple[str, ...]:
    if await axis.state() not in (State.FAULT, State.FAULT_REACTION):
        return ()
    return tuple(f"{fault.code} {fault.name}" for fault in await axis.active_faults())


def _require_status(run: Run) -> None:
    """Check that the status word comes with every cycle: polling would be too slow.

    Raises:
        NotAllowed: it does not.
    """
    drive = run.axis.drive
    key = drive.key("status_word")
    if key is None or not run.session.carries(drive, key):
        raise NotAllowed("safety-check.no-status", drive=drive.name, parameter=key)


def _step_of(settings: SafetySettings) -> Text:
    if settings.function == "speed_limit":
        return text("safety-check.switch-on-now", wait_s=settings.wait_s)
    return text("safety-check.trigger-now", wait_s=settings.wait_s)


def plan_of(settings: SafetySettings, rate: float, lead_s: float) -> FloatArray:
    """Commanded speed [n] in rpm: one way where the travel suffices, else reciprocating.

    Raises:
        OutOfRange: it does not fit into the envelope.
    """
    function, speed = settings.function, settings.speed_rpm
    if speed > settings.speed_limit:
        raise OutOfRange(
            "safety-check.speed-not-permitted", value=speed, limit=f"{settings.speed_limit:g} rpm"
        )
    lead = np.zeros(round((0.2 + lead_s) * rate))
    ramp = np.linspace(0.0, 1.0, max(2, round(threshold.RAMP_S * rate)))
    end = np.zeros(round(threshold.END_S * rate))
    if function == "speed_limit":
        return _above_limit(settings, rate, lead, ramp, end)
    sign = -1.0 if function == "limit_negative" else 1.0
    whole_s = settings.wait_s + settings.watch_s
    room = threshold.USED * settings.travel_limit
    way = speed / 60.0 * (whole_s + threshold.RAMP_S)
    if way <= room:
        parts = [lead, ramp, np.ones(round(whole_s * rate)), ramp[::-1], end]
        return np.asarray(sign * speed * np.concatenate(parts))
    if function in ("limit_positive", "limit_negative"):
        raise _no_room(settings, way / threshold.USED)
    one_way_s = room / (speed / 60.0) - threshold.RAMP_S
    if one_way_s < 2.0 * safety_check_evaluate.STEADY_S:
        raise _no_room(
            settings,
            speed
            / 60.0
            * (2.0 * safety_check_evaluate.STEADY_S + threshold.RAMP_S)
            / threshold.USED,
        )
    flat = np.ones(round(one_way_s * rate))
    there = np.concatenate([ramp, flat, ramp[::-1]])
    pairs = int(np.ceil(whole_s / (2.0 * (one_way_s + 2.0 * threshold.RAMP_S))))
    return np.asarray(speed * np.concatenate([lead, *([there, -there] * pairs), end]))


def _above_limit(
    settings: SafetySettings, rate: float, lead: FloatArray, ramp: FloatArray, end: FloatArray
) -> FloatArray:
    """Speed below the limit while the person activates it, then above it [n] in rpm.

    Raises:
        OutOfRange: no suitable speed limit is given, or the travel does not suffice.
    """
    limited, speed = settings.limited_rpm, settings.speed_rpm
    if limited is None or speed < 1.2 * limited:
        raise OutOfRange(
            "safety-check.no-limited-speed",
            value=speed,
            limit=f"{1.2 * (limited or speed):g} rpm",
        )
    low = threshold.BELOW_LIMIT * limited
    way = (
        low * (settings.wait_s + threshold.RAMP_S) + speed * (settings.watch_s + threshold.RAMP_S)
    ) / 60.0
    if way > threshold.USED * settings.travel_limit:
        raise _no_room(settings, way / threshold.USED)
    return np.concatenate(
        [
            lead,
            low * ramp,
            np.full(round(settings.wait_s * rate), low),
            low + (speed - low) * ramp,
            np.full(round(settings.watch_s * rate), speed),
            speed * ramp[::-1],
            end,
        ]
    )


def _no_room(settings: SafetySettings, needed_rev: float) -> OutOfRange:
    return OutOfRange(
        "safety-check.no-room",
        value=settings.travel_limit,
        limit=f"{needed_rev:.3g} rev",
        needed_rev=needed_rev,
    )


class _Watch:
    """Ends the motion ``watch_s`` after the speed has left the commanded one.

    Called with the rows received since the last call. When the drive leaves Operation enabled, the
    cyclic loop reports that itself.
    """

    def __init__(
        self, plan: FloatArray, settings: SafetySettings, rate: float, catch: _Catch,
        units: AxisUnits,
    ) -> None:  # fmt: skip
        self._plan, self._catch, self._rpm = plan, catch, units.velocity(1.0)
        self._after = round(settings.watch_s * rate)
        self._steady = max(1, round(safety_check_evaluate.STEADY_S * rate))
        self._seen, self._slow, self._reached = 0, 0, False
        self._left_at: int | None = None
        self.ended_at: int | None = None

    def __call__(self, rows: FloatArray) -> bool:
        for speed in rows[:, 1] * self._rpm:
            at = min(self._seen, self._plan.size - 1)
            self._seen += 1
            wanted = float(self._plan[at])
            if wanted == 0.0 or self._plan[max(0, at - self._steady)] != wanted:
                self._slow = 0
                continue
            follows = speed * np.sign(wanted) >= threshold.SIGN_SHARE * abs(wanted)
            self._reached = self._reached or follows
            self._slow = 0 if follows or not self._reached else self._slow + 1
            if self._slow >= threshold.SIGN_ROWS and self._left_at is None:
                self._left_at = self._seen
        if self._left_at is None or self._seen - self._left_at < self._after:
            return False
        self.ended_at = self._catch.newest
        return True


def _trace(
    catch: _Catch, plan: FloatArray, units: AxisUnits, axis: Axis, rate: float,
    asked_until: int | None, measured_at: str,
) -> Trace:  # fmt: skip
    """Trace in engineering units; the plan is aligned by the first setpoint that is not zero."""
    first, table, valid = catch.table()
    went = np.flatnonzero(valid & (table[:, 3] != 0.0))
    begun = int(went[0]) if went.size else len(table)
    commanded = np.zeros(len(table))
    # Rounded to the drive's unit, the first values of the plan may be zero.
    raw = np.round(plan * (units.velocity_raw(1e6) / 1e6))
    lead = int(np.flatnonzero(raw)[0])
    known = plan[lead : lead + len(table) - begun]
    commanded[begun : begun + known.size] = known
    words = {int(w): axis.drive.decode_state(int(w)) for w in np.unique(table[:, STATUS])}
    position = np.unwrap(table[:, 0], period=2.0**32)
    states = np.array([words[int(word)].value for word in table[:, STATUS]])
    return Trace(
        position_rev=position * units.position(1.0), speed_rpm=table[:, 1] * units.velocity(1.0),
        torque_percent=table[:, 2] * units.torque(1.0), commanded_rpm=commanded,
        enabled=states == State.OPERATION_ENABLED.value,
        quick_stop=states == State.QUICK_STOP_ACTIVE.value, valid=valid, sample_rate_hz=rate,
        asked_until=len(table) if asked_until is None else min(asked_until - first, len(table)),
        measured_at=measured_at,
    )  # fmt: skip


TOOL = Tool(
    kind="safety-check",
    title=text("safety-check.title"),
    settings=SafetySettings,
    result=SafetyResult,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
)
