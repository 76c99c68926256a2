"""Read torque and speed while the axis is moved by others, or take them from a recording.

Nothing is written: no mode, no mapping, no state. Where an exchange of process data runs, its
samples are used; signals that it does not carry, and everything without one, are polled.
"""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from backend.analysis.duty.load import Signals
from backend.axes.axis.axis import Axis
from backend.axes.drive.optional import existing
from backend.axes.scales.units import AxisUnits
from backend.axes.scope.hub import ScopeHub
from backend.foundation.people.rights import Right
from backend.records.recording.reader import RecordingReader
from backend.tools.measuring.axis_facts import si
from backend.tools.thresholds import cycle_run as threshold
from backend.tools.tool import Run, Tool
from backend.tools.watching.cycle.evaluate import (
    CycleFacts,
    Samples,
    evaluate,
    meta_of,
    reevaluate,
)
from backend.tools.watching.cycle.result import CycleResult
from backend.tools.watching.cycle.settings import CycleSettings
from backend.tools.watching.cycle.texts import TEXTS, report
from drivers.errors import NotAllowed
from drivers.link import ScopeBlock
from drivers.texts.message import text

FloatArray = npt.NDArray[np.float64]
_NEEDED = ("torque_actual", "velocity_actual")
_BESIDE = ("dc_voltage", "load_ratio")


@dataclass
class _Course:
    """Samples of some parameters as they arrive: times, and a row for each."""

    times: list[FloatArray] = field(default_factory=list)
    rows: list[FloatArray] = field(default_factory=list)

    def take(self, block: ScopeBlock) -> None:
        """Add a block of the scope hub, without its invalid samples."""
        even: FloatArray = block.t0_s + block.dt_s * np.arange(len(block.samples), dtype=float)
        times = even if block.times_s is None else block.times_s
        self.add(times, block.samples, block.valid)

    def add(self, times: FloatArray, rows: FloatArray, valid: npt.NDArray[np.bool_] | None) -> None:
        """Add rows at these times, without invalid or non-finite ones."""
        good = np.all(np.isfinite(rows), axis=1)
        if valid is not None:
            good &= valid
        self.times.append(times[good])
        self.rows.append(rows[good])

    def column(self, number: int) -> tuple[FloatArray, FloatArray]:
        """Times (rising) and values of one parameter [n]."""
        if not self.rows:
            return np.empty(0), np.empty(0)
        times, values = np.concatenate(self.times), np.concatenate(self.rows)[:, number]
        _, places = np.unique(times, return_index=True)
        return times[places], values[places]


async def run(run: Run, settings: CycleSettings) -> CycleResult:
    """Read or load the samples, then evaluate them.

    Raises:
        NotAllowed: the drive or the recording lacks torque or speed, or too few samples arrived.
        ScaleUnknown: the unit of the speed is unknown.
        LinkLost: the link to the bus is lost.
    """
    axis = run.axis
    units = await axis.units()
    # Raises ScaleUnknown: without a known unit, the speed yields no power.
    units.velocity_raw(1.0)
    facts = await _facts(axis, units, settings)
    keys = {role: axis.drive.require(role) for role in _NEEDED}
    keys |= {role: key for role in _BESIDE if (key := await _readable(axis, role)) is not None}
    if settings.recording is None:
        courses = await _read(run, keys, settings.duration_s)
    else:
        courses = await asyncio.to_thread(_recorded, run, keys, settings.recording)
    samples = _samples(axis, units, keys, courses)
    run.progress(0.97, text("cycle.evaluating"))
    if run.keep is not None:
        run.keep("cycle", samples.arrays(), meta_of(settings, facts))
    return await asyncio.to_thread(evaluate, samples, settings, facts)


async def _facts(axis: Axis, units: AxisUnits, settings: CycleSettings) -> CycleFacts:
    drive = axis.drive
    torque = settings.motor_rated_nm or await si(drive, drive.key("rated_torque"))
    if not torque:
        constant = await si(drive, drive.key("torque_constant"))
        current = await si(drive, drive.key("rated_current"))
        torque = constant * current if constant and current else None
    peak, key = settings.peak_percent, drive.key("max_torque")
    if peak is None and key is not None and not drive.unreachable_why(drive.parameter(key)):
        reading = (await existing(drive, (key,))).get(key)
        if reading is not None and isinstance(reading.raw, int):
            peak = units.torque(reading.raw) or None
    speed = settings.motor_rated_rpm or await si(drive, drive.key("rated_speed"))
    return CycleFacts(torque or None, speed or None, peak)


async def _readable(axis: Axis, role: str) -> str | None:
    """Key of a signal read in addition to torque and speed; None where this drive lacks it."""
    key = axis.drive.key(role)
    if key is None or axis.drive.unreachable_why(axis.drive.parameter(key)):
        return None
    return key if await existing(axis.drive, (key,)) else None


async def _read(run: Run, keys: dict[str, str], duration_s: float) -> dict[str, _Column]:
    """Read by subscription and polling for this long."""
    hub, drive = ScopeHub(lambda _drive: run.axis), run.axis.drive
    found: dict[str, tuple[_Course, int]] = {}
    groups = (
        [(role, key) for role, key in keys.items() if role in _NEEDED],
        [(role, key) for role, key in keys.items() if role not in _NEEDED],
    )
    try:
        for group, period_s in zip(groups, (0.0, threshold.SLOW_S), strict=True):
            if not group:
                continue
            streams = hub.subscribe(drive.id, [key for _, key in group], period_s)
            for stream, places in streams:
                course = _Course()
                stream.sink = course.take
                for column, place in enumerate(places):
                    found[group[place][0]] = (course, column)
        begun = time.monotonic()
        while (passed := time.monotonic() - begun) < duration_s:
            run.progress(0.95 * passed / duration_s, text("cycle.reading", limit_s=duration_s))
            await asyncio.sleep(min(threshold.STEP_S, duration_s - passed))
    finally:
        await hub.close()
    return {role: course.column(column) for role, (course, column) in found.items()}


_Column = tuple[FloatArray, FloatArray]


def _recorded(run: Run, keys: dict[str, str], name: str) -> dict[str, _Column]:
    """The channels of this drive in a recording.

    Raises:
        NotAllowed: no recording has this name, or it lacks torque or speed of this drive.
    """
    path = Path(name) if run.recording is None else run.recording(name)
    with RecordingReader(path) as reader:
        drive = run.axis.drive
        own = [each for each in reader.channels if each.key in keys.values()]
        named = [each for each in own if drive.id == each.drive or drive.name == each.drive_name]
        # A recording of a single drive may come from a station that uses another name for it.
        if not named and len({each.drive for each in reader.channels}) == 1:
            named = own
        where = {each.key: (each.stream, each.column) for each in named}
        for role in _NEEDED:
            if keys[role] not in where:
                raise NotAllowed(
                    "cycle.recording-lacks-signal",
                    value=path.name,
                    drive=drive.name,
                    parameter=keys[role],
                )
        courses: dict[int, _Course] = {}
        for block in reader.blocks():
            courses.setdefault(block.stream, _Course()).add(
                block.times_s, block.values, block.valid
            )
    return {
        role: courses.get(where[key][0], _Course()).column(where[key][1])
        for role, key in keys.items()
        if key in where
    }


def _samples(
    axis: Axis, units: AxisUnits, keys: dict[str, str], columns: dict[str, _Column]
) -> Samples:
    """Samples at the times of the torque, converted to % of rated torque and rpm."""
    torque_s, torque = columns["torque_actual"]
    speed_s, speed = columns["velocity_actual"]
    if torque_s.size and speed_s.size:
        both = (torque_s >= speed_s[0]) & (torque_s <= speed_s[-1])
        torque_s, torque = torque_s[both], torque[both]
        speed = np.interp(torque_s, speed_s, speed)
    else:
        torque_s = torque = speed = np.empty(0)

    def raw(role: str, values: FloatArray) -> FloatArray:
        parameter = axis.drive.parameter(keys[role])
        return np.asarray((values - parameter.offset) / parameter.scale)

    def reading(role: str) -> FloatArray:
        return columns[role][1] if role in columns else np.empty(0)

    begin = torque_s[0] if torque_s.size else 0.0
    return Samples(
        Signals(
            torque_s - begin,
            raw("torque_actual", torque) * units.torque(1.0),
            raw("velocity_actual", speed) * units.velocity(1.0),
        ),
        reading("dc_voltage"),
        reading("load_ratio"),
    )


TOOL = Tool(
    kind="cycle",
    title=text("cycle.title"),
    settings=CycleSettings,
    result=CycleResult,
    run=run,
    reevaluate=reevaluate,
    report=report,
    texts=TEXTS,
    right=Right.FILES,
    motion=False,
)
