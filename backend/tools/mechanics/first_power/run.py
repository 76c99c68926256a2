"""The first power: readings, turning by hand, then torque pulses in CST.

No loop is closed at any time: a speed loop over a wrongly phased motor or an inverted encoder would
accelerate it. Torques are small, each pulse moves the shaft by some degrees, and during the test a
quick stop or STOP removes the power (605Ah = 0).
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from datetime import UTC, datetime
from typing import Literal

import numpy as np

from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.axes.drive.optional import existing, torque_limits
from backend.axes.drive.terminals import read_terminals
from backend.axes.scales.units import AxisUnits
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.measuring.recording import (
    Play,
    bus_limits,
    cycle_s,
    dwell,
    enabled,
    play,
    require_signals,
    takes_torque,
)
from backend.tools.mechanics.first_power.evaluate import (
    GOAL,
    STILL_REV,
    Seen,
    arrays_of,
    counts_sound,
    ended_for_room,
    evaluate,
    facts_of,
    fits_again,
    reevaluate,
    strongest,
    supply_sound,
)
from backend.tools.mechanics.first_power.result import FirstPowerResult, Guide, Phases, Pulse
from backend.tools.mechanics.first_power.settings import FirstPowerSettings
from backend.tools.mechanics.first_power.texts import TEXTS, report
from backend.tools.thresholds import first_power_run as threshold
from backend.tools.tool import Run, Tool
from drivers import link as bus
from drivers.cia402 import Mode, State
from drivers.errors import EnvelopeExceeded, NotAllowed
from drivers.halt import HaltCause
from drivers.texts.message import text

#: Quick stop, shutdown and disable operation remove the power: a ramp would need a loop.
_COASTING = ("605A:00", "605B:00", "605C:00")
_WAYS: tuple[Literal[1, -1], ...] = (1, -1)


async def run(run: Run, settings: FirstPowerSettings) -> FirstPowerResult:
    """Carry out the checklist; afterwards the axis is disabled and its settings are restored.

    Raises:
        NotAllowed: the axis is enabled, or the settings do not state what hangs at the axis
            although
            it is to be energised.
    """
    axis, drive = run.axis, run.axis.drive
    if await axis.state() is State.OPERATION_ENABLED:
        raise NotAllowed("first-power.enabled", drive=drive.name)
    stated = settings.nothing_hangs or settings.load_supported
    if settings.powered and not stated:
        raise NotAllowed("first-power.say-what-hangs", drive=drive.name)
    run.progress(0.02, text("first-power.reading"))
    seen = await _read(axis)
    if settings.hand_turn or settings.hand_switches:
        seen = await _by_hand(run, settings, seen)
    pulses: list[Pulse] = []
    obstacle = _obstacle(run, settings, seen)
    if obstacle is None:
        await _energised(run, settings, pulses)
    seen = replace(seen, obstacle=obstacle)
    if run.keep is not None:
        run.keep(
            "first-power",
            arrays_of(pulses),
            {
                "tool": "first-power",
                "settings": settings.model_dump(mode="json"),
                "seen": facts_of(seen),
            },
        )
    return evaluate(seen, pulses, settings)


async def _read(axis: Axis) -> Seen:
    drive = axis.drive
    key = drive.key("dc_voltage")
    voltage = None
    if key is not None and not drive.unreachable_why(drive.parameter(key)):
        reading = (await existing(drive, (key,))).get(key)
        if reading is not None and isinstance(reading.value, (int, float)):
            voltage = float(reading.value)
    units = await axis.units()
    inputs = await _limit_inputs(drive)
    faults = len(await axis.active_faults()) if await axis.state() is State.FAULT else 0
    return Seen(
        measured_at=datetime.now(UTC).isoformat(timespec="seconds"),
        supply_v=voltage,
        faults=faults,
        counts_per_rev=abs(float(units.position_raw(1.0))) if _certain(units) else None,
        certain=_certain(units),
        switch_inputs=inputs is not None,
        guide=_guide(drive),
    )


def _certain(units: AxisUnits) -> bool:
    return units.scales.position.certain


def _guide(drive: Drive) -> Guide | None:
    """The drive's own procedure for phase order or commutation angle; None where it has none."""
    functions = drive.profile.functions
    if any(each.name == "pole_identification" for each in functions.guides):
        return "pole_identification"
    return None if functions.identification is None else "identification"


async def _limit_inputs(drive: Drive) -> tuple[bool | None, bool | None] | None:
    """State of the negative and positive limit switch; None where an input for either is missing.

    A drive whose inputs have no selectable functions reports them in 60FDh (CiA 402-2: bit 0
    negative, bit 1 positive).
    """
    terminals = [each for each in await read_terminals(drive) if each.terminal.direction == "in"]
    if not any(each.terminal.function_key for each in terminals):
        key = drive.key("digital_inputs")
        if key is None:
            return None
        raw = await drive.raw(key)
        return bool(raw & 1), bool(raw >> 1 & 1)
    found = []
    for name in ("negative limit", "positive limit"):
        ours = [each for each in terminals if each.function_name.startswith(name)]
        if not ours:
            return None
        found.append(ours[0].on)
    return found[0], found[1]


async def _by_hand(run: Run, settings: FirstPowerSettings, seen: Seen) -> Seen:
    """Observe the disabled axis while a person turns it and operates its limit switches."""
    axis, units = run.axis, await run.axis.units()
    begun = time.monotonic()
    start = last = await axis.position_raw()
    moved_at, states = begun, (set[bool](), set[bool]())
    watches = settings.hand_switches and seen.switch_inputs
    tolerance = max(units.rest_tolerance(), abs(units.position_raw(0.005)))
    step = text("first-power.turn", revolutions=settings.hand_revolutions)
    while (passed := time.monotonic() - begun) < settings.hand_time_s:
        run.progress(0.05 + 0.45 * passed / settings.hand_time_s, step)
        position = await axis.position_raw()
        if abs(position - last) > tolerance:
            last, moved_at = position, time.monotonic()
        if watches and (now := await _limit_inputs(axis.drive)) is not None:
            for known, state in zip(states, now, strict=True):
                if state is not None:
                    known.add(state)
        turned = (
            abs(units.position(position - start)) >= threshold.HAND_LEAST or not settings.hand_turn
        )
        operated = not watches or all(len(each) == 2 for each in states)
        if turned and operated and time.monotonic() - moved_at >= threshold.HAND_STILL_S:
            break
        await asyncio.sleep(threshold.HAND_POLL_S)
    way = units.position(await axis.position_raw() - start)
    both = (len(states[0]) == 2, len(states[1]) == 2) if watches else None
    turned_rev = way if settings.hand_turn and abs(way) >= threshold.HAND_LEAST else None
    return replace(seen, turned_rev=turned_rev, switches=both)


def _obstacle(run: Run, settings: FirstPowerSettings, seen: Seen) -> Phases | None:
    """Why the motor is not energised; None where it may be."""
    if not settings.powered:
        return "not_done"
    if not seen.certain:
        return "resolution_first"
    if not supply_sound(seen):
        return "supply_first"
    if counts_sound(seen, settings.hand_revolutions) is False:
        # With wrong counts, the travel limit would not hold.
        return "counts_first"
    return None if takes_torque(run.axis, run.session) else "no_torque_mode"


@asynccontextmanager
async def _without_loops(axis: Axis, settings: FirstPowerSettings) -> AsyncIterator[None]:
    """Make stops remove the power, and set the drive's own torque limit.

    Raises:
        RestoreFailed: on leaving, states what could not be restored.
    """
    drive = axis.drive
    options = [key for key in _COASTING if key in drive.profile.by_key]
    present = await existing(drive, tuple(options))
    limits = await torque_limits(drive)
    with axis.granted(text("motion.purpose-first-power"), settings.envelope):
        async with axis.restoring(*present, *limits):
            await axis.limit_torque(limits, settings.torque_limit)
            for key in present:
                await drive.write(key, 0)
            yield


async def _energised(run: Run, settings: FirstPowerSettings, pulses: list[Pulse]) -> None:
    axis, session = run.axis, run.session
    require_signals(axis, session, Mode.CST, False)
    units = await axis.require_certain_scales()
    facts = await read_facts(axis, settings.rated_torque_nm)
    async with _without_loops(axis, settings):
        start = await axis.position_raw()
        limits = replace(await bus_limits(axis, settings.envelope, start), torque_off_only=True)
        test = _Test(run, settings, units, start, limits, facts.rated_torque_nm, pulses)
        for direction in _WAYS:
            await test.direction(direction)
        # Backwards it has made room, where one pulse took it far.
        if ended_for_room(pulses, settings):
            await test.direction(_WAYS[0])


class _Test:
    """Torque pulses of one test; each one made is appended to ``pulses``."""

    def __init__(
        self, run: Run, settings: FirstPowerSettings, units: AxisUnits, start: int,
        limits: bus.Envelope, rated_nm: float, pulses: list[Pulse],
    ) -> None:  # fmt: skip
        self._run, self._settings, self._units = run, settings, units
        self._start, self._limits, self._rated_nm = start, limits, rated_nm
        self._pulses = pulses
        self._cap = strongest(settings)
        self._goal = GOAL * settings.travel_limit
        self._percent, self._still, self._made = threshold.FIRST_PERCENT, 0, 0

    async def direction(self, direction: Literal[1, -1]) -> None:
        """Make pulses of one sign until the shaft has moved far enough or the strongest fails.

        A pulse that moves the shaft by more than `threshold.CUT_REV`, or makes it faster than
        `threshold.CUT_RPM`, is cut off by the cyclic loop, which removes the power: the axis is
        enabled again for the next pulse.
        """
        self._percent, self._still, self._made = threshold.FIRST_PERCENT, 0, 0
        begin = await self._place()
        while True:
            async with enabled(self._run.axis, self._run.session, Mode.CST):
                going_on = await self._until_cut(direction, begin)
            if not going_on:
                return

    async def _until_cut(self, direction: Literal[1, -1], begin: float) -> bool:
        """Make pulses until one is cut off; True where further pulses are needed after it."""
        while self._made < threshold.MOST_PULSES:
            low = 0.5 if direction > 0 else 0.75
            done = low + 0.24 * self._made / threshold.MOST_PULSES
            self._run.progress(done, text("first-power.pulses"))
            pulse, cut = await self._pulse(direction)
            self._pulses.append(pulse)
            self._made += 1
            if abs(pulse.to_rev - begin) >= self._goal or abs(pulse.to_rev) >= self._far(begin):
                return False
            moved = abs(pulse.to_rev - pulse.from_rev)
            self._still = self._still + 1 if moved <= STILL_REV else 0
            if self._percent >= 0.999 * self._cap and self._still >= 2:
                return False
            if not fits_again(pulse, self._settings.travel_limit):
                return False
            self._adapt(moved, cut=cut)
            if cut:
                return True
        return False

    def _adapt(self, moved: float, *, cut: bool) -> None:
        if moved < (STILL_REV if cut else threshold.SMALL_REV):
            self._percent = min(self._percent * threshold.STRONGER, self._cap)
        elif moved > threshold.LARGE_REV:
            self._percent = max(self._percent / threshold.WEAKER, threshold.FIRST_PERCENT)

    def _far(self, begin: float) -> float:
        """Distance from the start beyond which no further pulse fits into the travel [rev]."""
        return max(self._settings.travel_limit - threshold.LARGE_REV / 2, abs(begin) + STILL_REV)

    async def _place(self) -> float:
        return float(self._units.position(await self._run.axis.position_raw() - self._start))

    async def _pulse(self, direction: Literal[1, -1]) -> tuple[Pulse, bool]:
        """Make one pulse; the pulse, and whether a limit of travel or speed cut it off."""
        axis, session, percent = self._run.axis, self._run.session, self._percent
        before, cut = await self._place(), False
        raw = self._sequence(direction * percent)
        try:
            await play(
                axis,
                session,
                Play(Mode.CST, raw),
                self._around(before),
                self._rated_nm,
                lambda _: None,
            )
            await self._settled()
        except EnvelopeExceeded as error:
            if error.halt.cause not in (HaltCause.POSITION, HaltCause.SPEED):
                raise
            cut = True
            await axis.standstill(threshold.SETTLES_S)
        after = await self._place()
        pulse = Pulse(direction=direction, torque_percent=percent, from_rev=before, to_rev=after)
        return pulse, cut

    def _around(self, place_rev: float) -> bus.Envelope:
        """Limits of one pulse: some degrees and a low speed, within those of the whole test.

        A shaft that sticks accelerates at its break-away by nearly the whole pulse, and coasts
        afterwards: the speed decides how far. One that coasted out of the travel may move back.
        """
        limits, here = self._limits, self._start + self._units.position_raw(place_rev)
        way = abs(self._units.position_raw(threshold.CUT_REV))
        slow = abs(self._units.velocity_raw(threshold.CUT_RPM))
        still = abs(self._units.position_raw(STILL_REV))
        assert limits.position_min is not None and limits.position_max is not None  # noqa: PT018
        return replace(
            limits,
            position_min=max(min(limits.position_min, here - still), here - way),
            position_max=min(max(limits.position_max, here + still), here + way),
            speed_max=slow if limits.speed_max is None else min(limits.speed_max, slow),
        )

    def _sequence(self, percent: float) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
        rate = 1.0 / cycle_s(self._run.session)
        edge = np.linspace(0.0, 1.0, max(2, round(threshold.RAMP_S * rate)))
        shape = np.concatenate(
            [
                np.zeros(max(1, round(threshold.LEAD_S * rate))),
                edge,
                np.ones(max(1, round(threshold.PULSE_S * rate))),
                edge[::-1],
                np.zeros(max(1, round(threshold.AFTER_S * rate))),
            ]
        )
        return np.array([self._units.torque_raw(percent * each) for each in shape], np.int64)

    async def _settled(self) -> None:
        """Wait without torque until standstill: with little friction the shaft coasts."""
        deadline, last = time.monotonic() + threshold.SETTLES_S, await self._place()
        while time.monotonic() < deadline:
            await dwell(self._run.axis, self._run.session, threshold.SETTLE_LOOK_S)
            now = await self._place()
            if abs(now - last) < STILL_REV / 4:
                return
            last = now


TOOL = Tool(
    kind="first-power",
    title=text("first-power.title"),
    settings=FirstPowerSettings,
    result=FirstPowerResult,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
    closes_loops=False,
)
