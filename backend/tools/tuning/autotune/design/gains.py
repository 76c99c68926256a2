"""Loop gains of a drive in physical units, by the convention of its profile.

Bandwidth convention (MMS7): speed gain = 2π·bandwidth·J with J as the drive holds it, integral
corner = 2π·value times that, position gain = 2π·value (004:2847). Gain convention: position in 1/s,
speed in Hz with J from the inertia ratio, integral as a time. Gains without a documented meaning
are shown raw; no design is made for them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from backend.analysis.loop.loop_structure import DriveLoops, Gains, LoopFilters
from backend.axes.axis.axis import Axis
from backend.axes.drive.drive import Drive
from backend.tools.measuring.axis_facts import AxisFacts, read_facts, si, si_raw, si_value
from backend.tools.thresholds import autotune_gains as threshold
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts.message import Text, text
from profiles.schema import GainSpec, StiffnessTable

TURN = 2 * np.pi


@dataclass(frozen=True)
class GainState:
    """Present gains in Hz, 1/s and Nm·s; None where the family lacks one or documents no unit.

    ``speed_nms`` is the gain in Nm per rad/s with the drive's own inertia. ``level`` is the
    stiffness level that replaces the single gains, None where the single gains act.
    """

    convention: str
    position_1_s: float | None
    speed_hz: float | None
    speed_nms: float | None
    integral_hz: float | None
    level: int | None
    raw: dict[str, int]


def spec_of(drive: Drive) -> GainSpec:
    """Gain parameters of the profile.

    Raises:
        NotAllowed: the profile has no gains.
    """
    if drive.profile.gains is None:
        raise NotAllowed(
            "autotune.profile-not-name-gains", drive=drive.name, profile_title=drive.profile.title
        )
    return drive.profile.gains


def _table(drive: Drive) -> StiffnessTable | None:
    return drive.profile.stiffness[0] if drive.profile.stiffness else None


async def read_gains(axis: Axis, facts: AxisFacts | None = None) -> GainState:
    """Read the present gains.

    Raises:
        DriveError: a parameter cannot be read.
    """
    drive, spec = axis.drive, spec_of(axis.drive)
    facts = facts or await read_facts(axis)
    keys = [k for k in (spec.position, spec.speed, spec.integral) if k is not None]
    raw = {key: await drive.raw(key) for key in keys}
    values = {
        key: si_value(drive.parameter(key), _engineering(drive, key, r)) for key, r in raw.items()
    }
    table, level = _table(drive), None
    if table is not None and table.mode_key is not None:
        raw[table.mode_key] = await drive.raw(table.mode_key)
        if raw[table.mode_key] == table.table_raw:
            level = await drive.raw(table.level_key)
            values |= _row(drive, table, level)
    if spec.convention == "unit":
        return GainState(spec.convention, None, None, None, None, level, raw)
    position = values.get(spec.position or "")
    integral = values.get(spec.integral or "")
    if spec.convention == "bandwidth" and position is not None:
        position *= TURN
    if spec.convention == "gain" and integral:
        integral = 1.0 / (TURN * integral)
    speed = values.get(spec.speed or "")
    inertia = facts.drive_inertia_kgm2
    return GainState(
        spec.convention,
        position,
        speed,
        None if speed is None or inertia is None else TURN * speed * inertia,
        integral,
        level,
        raw,
    )


def _engineering(drive: Drive, key: str, raw: int) -> float:
    value = drive.parameter(key).to_value(raw)
    return float(value) if not isinstance(value, str) else 0.0


def _row(drive: Drive, table: StiffnessTable, level: int) -> dict[str, float | None]:
    row = table.rows.get(level)
    if row is None:
        return {}
    values: dict[str, float | None] = {}
    for key, value in zip(table.columns, row, strict=True):
        engineering = value if table.column_units else _engineering(drive, key, round(value))
        values[key] = si_value(drive.parameter(key), engineering)
    return values


def plan_gains(
    drive: Drive, gains: Gains, inertia_kgm2: float, rotor_kgm2: float | None = None
) -> dict[str, int]:
    """Raw values that give the drive's loops these gains, its inertia parameter included.

    ``rotor_kgm2`` is needed where that parameter is a ratio to the motor's own inertia: a speed
    gain has no physical value before the ratio is right. The values are limited to what the
    parameters can hold.

    Raises:
        NotAllowed: a family whose gains have no documented meaning.
        OutOfRange: later, by the write, when a value exceeds the parameter's limits.
    """
    spec = spec_of(drive)
    if spec.convention == "unit":
        raise NotAllowed(
            "autotune.manual-not-print-gains",
            drive=drive.name,
            remedy=_by_hand(drive),
            profile_title=drive.profile.title,
        )
    raw: dict[str, int] = {}
    if spec.inertia is not None and spec.inertia_meaning is not None:
        raw[spec.inertia] = _inertia_raw(drive, spec, inertia_kgm2, rotor_kgm2)
    if spec.speed is not None:
        raw[spec.speed] = si_raw(drive.parameter(spec.speed), gains.speed_bandwidth_hz)
    if spec.integral is not None:
        integral = gains.integral_hz
        if spec.convention == "gain":
            integral = 1.0 / (TURN * gains.integral_hz)
        raw[spec.integral] = si_raw(drive.parameter(spec.integral), integral)
    if spec.position is not None:
        position = gains.position_1_s
        if spec.convention == "bandwidth":
            position /= TURN
        raw[spec.position] = si_raw(drive.parameter(spec.position), position)
    table = _table(drive)
    if table is not None and table.mode_key is not None and table.manual_raw is not None:
        raw[table.mode_key] = table.manual_raw
    return {key: _within(drive, key, value) for key, value in raw.items()}


def plan_design(
    drive: Drive, gains: Gains, inertia_kgm2: float, rotor_kgm2: float | None = None
) -> dict[str, int]:
    """Raw values of a design as `plan_gains`; rounded towards less gain where the nearest is more.

    A drive multiplies its speed gain by the inertia that it holds, which is rounded as well.

    Raises:
        NotAllowed: as `plan_gains`.
        OutOfRange: a parameter cannot hold as little gain as designed.
    """
    spec, raw = spec_of(drive), plan_gains(drive, gains, inertia_kgm2, rotor_kgm2)
    heavier = _held_inertia(drive, spec, raw, rotor_kgm2, inertia_kgm2) / inertia_kgm2
    position = gains.position_1_s / (TURN if spec.convention == "bandwidth" else 1.0)
    time = spec.convention == "gain"
    integral = 1.0 / (TURN * gains.integral_hz) if time else gains.integral_hz
    for key, value, by_time in (
        (spec.speed, gains.speed_bandwidth_hz / heavier if heavier else np.inf, False),
        (spec.integral, integral, time),
        (spec.position, position, False),
    ):
        if key is None:
            continue
        more = _more(drive, key, raw[key], value, by_time)
        if more <= threshold.MORE:
            continue
        nearest = math.ceil(raw[key] * more) if by_time else math.floor(raw[key] / more)
        raw[key] = _within(drive, key, nearest)
        more = _more(drive, key, raw[key], value, by_time)
        if more > threshold.MORE:
            raise OutOfRange(
                "autotune.gain-below-least",
                drive=drive.name,
                parameter=key,
                gain=drive.parameter(key).name,
                more=more,
            )
    return raw


def _more(drive: Drive, key: str, raw: int, value: float, by_time: bool) -> float:
    """Gain of a raw value over that of a value in SI units; ``by_time``: a time, which divides."""
    held = si_value(drive.parameter(key), _engineering(drive, key, raw)) or 0.0
    if by_time:
        # No time at all has no gain to compare with: families read it as no integral part.
        return value / held if held else 0.0
    return held / value


def _held_inertia(
    drive: Drive, spec: GainSpec, raw: dict[str, int], rotor_kgm2: float | None, otherwise: float
) -> float:
    """Inertia of the axis that the drive holds with these raw values; ``otherwise`` if none."""
    if spec.inertia is None or spec.inertia not in raw:
        return otherwise
    value = _engineering(drive, spec.inertia, raw[spec.inertia])
    if spec.inertia_meaning in ("ratio", "ratio_percent"):
        percent = 100.0 if spec.inertia_meaning == "ratio_percent" else 1.0
        return (rotor_kgm2 or 0.0) * (1.0 + value / percent)
    held = si_value(drive.parameter(spec.inertia), value) or 0.0
    return held + (rotor_kgm2 or 0.0) if spec.inertia_meaning == "load" else held


def raised(drive: Drive, key: str, raw: int, factor: float) -> int:
    """Raw value of a gain multiplied by a factor, limited to the parameter's range."""
    parameter = drive.parameter(key)
    value = _engineering(drive, key, raw)
    return _within(drive, key, round(parameter.to_raw(value * factor)))


def filter_choices(drive: Drive, now: LoopFilters) -> tuple[LoopFilters, ...]:
    """Wider filters that the drive can be given in place of its present ones."""
    spec = spec_of(drive)
    found: list[LoopFilters] = []
    last = now
    for _ in range(threshold.WIDENINGS):
        speed, torque = last.speed_hz, last.torque_hz
        if spec.speed_filter is not None and speed is not None:
            speed = max(speed, _held(drive, spec.speed_filter, speed * 2**0.5))
        if spec.torque_filter is not None and torque is not None:
            shorter = max(0.5 / (TURN * torque), threshold.SHORTEST_S)
            shorter = _held(drive, spec.torque_filter, shorter)
            torque = max(torque, 1.0 / (TURN * shorter) if shorter else torque)
        wider = LoopFilters(speed, torque)
        if wider == last:
            break
        found.append(wider)
        last = wider
    return tuple(found)


def _held(drive: Drive, key: str, value: float) -> float:
    """A value in SI units, rounded to what the parameter can hold."""
    parameter = drive.parameter(key)
    raw = _within(drive, key, si_raw(parameter, value))
    return si_value(parameter, _engineering(drive, key, raw)) or 0.0


def plan_filters(drive: Drive, filters: LoopFilters) -> dict[str, int]:
    """Raw values that give the drive's filters these corners; None leaves a filter unchanged."""
    spec = spec_of(drive)
    raw: dict[str, int] = {}
    if spec.speed_filter is not None and filters.speed_hz is not None:
        raw[spec.speed_filter] = si_raw(drive.parameter(spec.speed_filter), filters.speed_hz)
    if spec.torque_filter is not None and filters.torque_hz is not None:
        time_s = 1.0 / (TURN * filters.torque_hz)
        raw[spec.torque_filter] = si_raw(drive.parameter(spec.torque_filter), time_s)
    return {key: _within(drive, key, value) for key, value in raw.items()}


def _by_hand(drive: Drive) -> Text:
    """Advice for manual tuning where nothing can be computed."""
    return text("autotune.by-level" if _table(drive) else "autotune.by-gains")


def _inertia_raw(
    drive: Drive, spec: GainSpec, inertia_kgm2: float, rotor_kgm2: float | None
) -> int:
    """Raw value of the drive's inertia parameter for a whole axis of ``inertia_kgm2``."""
    parameter = drive.parameter(spec.inertia or "")
    if spec.inertia_meaning == "total":
        return si_raw(parameter, inertia_kgm2)
    if not rotor_kgm2:
        raise NotAllowed(
            "autotune.load-inertia-ratio-motor", drive=drive.name, parameter=parameter.key
        )
    load = max(inertia_kgm2 - rotor_kgm2, 0.0)
    if spec.inertia_meaning == "load":
        return si_raw(parameter, load)
    percent = 100.0 if spec.inertia_meaning == "ratio_percent" else 1.0
    return round(parameter.to_raw(load / rotor_kgm2 * percent))


async def rotor_inertia(axis: Axis, given_kgm2: float | None = None) -> float | None:
    """The motor's own inertia: the given one, or the drive's where it states one."""
    return given_kgm2 or await si(axis.drive, axis.drive.key("motor_inertia"))


def _within(drive: Drive, key: str, raw: int) -> int:
    """Limit a raw value to the parameter's range."""
    low, high = drive.parameter(key).raw_limits
    raw = raw if high is None else min(raw, int(high))
    return raw if low is None else max(raw, int(low))


def plan_level(drive: Drive, level: int) -> dict[str, int]:
    """Raw values that select a stiffness level.

    Raises:
        NotAllowed: the family has no table.
    """
    table = _table(drive)
    if table is None:
        raise NotAllowed("autotune.no-stiffness-levels", drive=drive.name)
    raw = {table.level_key: level}
    if table.mode_key is not None and table.table_raw is not None:
        raw[table.mode_key] = table.table_raw
    return raw


def loops_of(drive: Drive, facts: AxisFacts) -> DriveLoops:
    """The fixed parts of the drive's loop, for prediction.

    The speed is the difference of two samples (half a period of delay); the torque is held for one
    period (half a period of delay).

    Raises:
        NotAllowed: the current loop's bandwidth is not known.
    """
    if facts.current_bandwidth_hz is None:
        raise NotAllowed(
            "autotune.bandwidth-current-loop-not", drive=drive.name, remedy=_by_hand(drive)
        )
    spec = spec_of(drive)
    highest = None
    if spec.speed is not None:
        _low, high = drive.parameter(spec.speed).raw_limits
        if high is not None:
            highest = si_value(
                drive.parameter(spec.speed), _engineering(drive, spec.speed, int(high))
            )
    return DriveLoops(
        current_bandwidth_hz=facts.current_bandwidth_hz,
        delay_s=threshold.LOOP_PERIOD_S,
        speed_filter_hz=facts.speed_filter_hz,
        torque_filter_hz=facts.torque_filter_hz,
        highest_speed_bandwidth_hz=highest,
    )
