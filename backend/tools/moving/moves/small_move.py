"""A small move by increments, which needs no scale and helps to find it.

The axis follows a smooth path of this many increments in CSP, slowly and with little torque; a
person observes how far its shaft turns. As that is not known beforehand, the first move is short,
and each may be ten times as long as the longest before it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession, channel
from backend.axes.axis.cyclic_mode import keeping_mode
from backend.axes.drive.optional import torque_limits
from backend.axes.drive.ports import address_of
from backend.axes.scales.compare import FloatArray, measured_scale
from backend.foundation.work.jobs import JobResult, Progress
from backend.tools.measuring.recording import cycle_s, enabled, quiet, require_signals
from backend.tools.moving.jog.cyclic import play_through
from backend.tools.thresholds import moves_small_move as threshold
from drivers import link as bus
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts.message import text

FIRST_INCREMENTS = threshold.FIRST_INCREMENTS
LONGER = threshold.LONGER
_MOST_INCREMENTS = 2**30


@dataclass(frozen=True, slots=True)
class SmallMoveSettings:
    """Signed ``increments``; ``torque_percent`` of rated torque, above which the axis stops."""

    increments: int
    torque_percent: float = 20.0


def longest_allowed(axis: Axis) -> int:
    """Largest number of increments for the next move of this axis."""
    known = axis.small_moves
    return FIRST_INCREMENTS if known is None else min(LONGER * known.longest, _MOST_INCREMENTS)


async def small_move(
    axis: Axis, session: CyclicSession, settings: SmallMoveSettings, progress: Progress
) -> JobResult:
    """Move, and measure the scale of 606Ch; the axis stays where it arrived, disabled.

    Raises:
        OutOfRange: no increments, more than may be moved now, or a torque outside its bounds.
        NotAllowed: no CSP in this exchange, or the axis did not follow.
    """
    drive = axis.drive
    # The scales may have changed since the last small move, which determines the permitted length.
    await axis.read_scales()
    _check(axis, settings)
    require_signals(axis, session, Mode.CSP, False)
    cycle = cycle_s(session)
    path = _path(settings.increments, cycle)
    limits = await torque_limits(drive)
    progress(0.0, text("moves.enabling"))
    async with axis.restoring(*limits), keeping_mode(axis, session):
        await axis.limit_torque(limits, settings.torque_percent)
        async with enabled(axis, session, Mode.CSP, by_increments=True) as start:
            await quiet(axis)
            target = drive.parameter(drive.require("position_target"))
            trajectory = bus.Trajectory(
                session.station(drive),
                address_of(target),
                start + path,
                await _envelope(axis, settings, start),
            )
            seen = _Seen(axis)
            leave = session.cyclic.blocks(seen.take)
            try:
                await play_through(axis, session, trajectory, len(path) * cycle, progress)
            finally:
                leave()
            await quiet(axis)
            moved = await axis.position_raw() - start
    if abs(moved - settings.increments) > threshold.ARRIVED * abs(settings.increments) + 2:
        raise NotAllowed(
            "moves.moved-increments",
            drive=drive.name,
            value=moved,
            limit=str(settings.increments),
            increments=settings.increments,
        )
    scale = measured_scale(*seen.evenly(), cycle)
    axis.moved_small(moved, scale)
    return {
        "moved_increments": moved,
        "raw_per_inc_s": scale,
        "next_most": longest_allowed(axis),
    }


class _Seen:
    """Raw 6064h and 606Ch by cycle number, as received."""

    def __init__(self, axis: Axis) -> None:
        drive = axis.drive
        keys = [drive.require(role) for role in ("position_actual", "velocity_actual")]
        self._names = [channel(drive, key) for key in keys]
        self._rows: list[tuple[float, float, float]] = []

    def take(self, block: bus.ScopeBlock) -> None:
        """Add samples of the exchange, without lost or untrusted ones."""
        columns = [block.channels.index(name) for name in self._names]
        for number, row in enumerate(block.samples[:, columns]):
            good = block.valid is None or bool(block.valid[number])
            if good and block.cycle is not None and not np.isnan(row).any():
                self._rows.append((block.cycle + number, float(row[0]), float(row[1])))

    def evenly(self) -> tuple[FloatArray, FloatArray]:
        """Position and speed of every cycle; interpolated linearly where some are missing."""
        if len(self._rows) < 2:
            return np.zeros(0), np.zeros(0)
        cycle, position, speed = np.array(self._rows).T
        grid = np.arange(cycle[0], cycle[-1] + 1)
        return np.interp(grid, cycle, position), np.interp(grid, cycle, speed)


def _check(axis: Axis, settings: SmallMoveSettings) -> None:
    most = longest_allowed(axis)
    if not 0 < abs(settings.increments) <= most:
        raise OutOfRange(
            "moves.increments-small-move-may",
            drive=axis.drive.name,
            value=settings.increments,
            limit=f"1…{most}",
            most=most,
        )
    low, high = threshold.TORQUE_PERCENT
    if not low <= settings.torque_percent <= high:
        raise OutOfRange(
            "moves.small-move-takes-rated",
            drive=axis.drive.name,
            value=settings.torque_percent,
            limit=f"{low:g}…{high:g} %",
            low=low,
            high_percent=high,
        )


def _path(increments: int, cycle: float) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Raised cosine from 0 to the end, with a dwell before and after."""
    count, rest = round(threshold.MOVE_S / cycle), round(threshold.REST_S / cycle)
    way = 0.5 * increments * (1.0 - np.cos(np.pi * np.arange(count + 1) / count))
    ends = np.zeros(rest), np.full(rest, float(increments))
    return np.round(np.concatenate([ends[0], way, ends[1]])).astype(np.int64)


async def _envelope(axis: Axis, settings: SmallMoveSettings, start: int) -> bus.Envelope:
    """Limits of position and torque alone: the scale of the speed is not known yet."""
    margin = round(threshold.MARGIN * abs(settings.increments)) + threshold.MARGIN_INCREMENTS
    low, high = sorted((start, start + settings.increments))
    torque = (await axis.units()).torque_raw(settings.torque_percent)
    return bus.Envelope(
        position_min=low - margin,
        position_max=high + margin,
        torque_max=torque,
        following_error_max=margin,
    )
