"""Search for the end stops of an axis: it creeps to each at limited torque until it stalls."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from backend.axes.axis.axis import Axis
from backend.axes.axis.cyclic import CyclicSession
from backend.axes.drive.optional import torque_limits
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import cycle_s
from backend.tools.measuring.temporary import temporary
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.moves import speed_move
from backend.tools.mechanics.inertia.probe import RoughFit
from backend.tools.thresholds import moves_end_search as threshold
from drivers.errors import NotAllowed, OutOfRange
from drivers.texts import limits as limit_texts
from drivers.texts.message import text

_TURN = 2 * np.pi


async def find_ends(
    axis: Axis,
    session: CyclicSession,
    settings: InertiaSettings,
    facts: AxisFacts,
    rough: RoughFit,
    progress: Progress,
) -> tuple[float, float]:
    """Creep both ways at limited torque until the axis stalls; positions of the ends in rev.

    Raises:
        OutOfRange: the torque of the search cannot move the axis.
        NotAllowed: the family has no torque limit, or there is no end within the travel.
    """
    drive, units = axis.drive, await axis.units()
    available = settings.search_torque_percent / 100.0 * facts.rated_torque_nm
    needed = 1.5 * (rough.coulomb_nm + abs(rough.gravity_nm))
    if available < needed:
        percent = 100.0 * needed / facts.rated_torque_nm
        raise OutOfRange(
            "moves.torque-cannot-move-axis",
            value=settings.search_torque_percent,
            limit=limit_texts.at_least(float(f"{percent:.3g}"), "%"),
            drive_name=drive.name,
        )
    wanted = units.torque_raw(settings.search_torque_percent)
    limits = {key: limited(await drive.raw(key), wanted) for key in await torque_limits(drive)}
    if not limits:
        raise NotAllowed("moves.family-no-torque-limit", drive=drive.name)
    found = []
    async with temporary(axis, limits):
        for number, direction in enumerate((-1.0, 1.0)):
            progress(0.1 + 0.15 * number, text("moves.looking-end-limited-torque"))
            found.append(await _creep(axis, session, settings, facts, direction))
    return found[0], found[1]


def limited(now: int, wanted: int) -> int:
    """Torque limit not above ``wanted``; in some families the negative limit is below zero."""
    return min(now, wanted) if now >= 0 else max(now, -wanted)


@dataclass
class _Stall:
    """Detects in the received samples that a creeping axis has stopped."""

    slow: float
    enough: int
    start: int
    count: int = 0
    resting: int = 0
    found: bool = False

    def seen(self, rows: npt.NDArray[np.float64]) -> bool:
        """Whether the axis is stalled; ``rows`` [n, 3] are raw position, velocity and torque."""
        # A lost sample is NaN and does not count as standstill.
        moving = np.flatnonzero(~(np.abs(rows[:, 1]) < self.slow))
        self.resting = self.resting + len(rows) if not moving.size else len(rows) - moving[-1] - 1
        self.count += len(rows)
        self.found = self.count > self.start + self.enough and self.resting >= self.enough
        return self.found


async def _creep(
    axis: Axis,
    session: CyclicSession,
    settings: InertiaSettings,
    facts: AxisFacts,
    direction: float,
) -> float:
    """Position of the end in this direction [rev].

    Raises:
        NotAllowed: no end was found within the travel.
    """
    units, rate = await axis.units(), 1.0 / cycle_s(session)
    way = settings.envelope.travel_rev
    speed = min(settings.search_speed_rpm, settings.envelope.speed_rpm)
    n = round(way / (speed / 60.0) * rate)
    ramp = np.minimum(np.arange(n) / (0.1 * rate), 1.0)
    ramp[-1] = 0.0
    slow = 0.25 * units.velocity_raw(speed)
    stall = _Stall(slow, round(threshold.STALL_S * rate), round(threshold.START_S * rate))

    envelope = replace(settings.envelope, travel_rev=way * 1.1)
    recording = await speed_move(
        axis,
        session,
        direction * speed * ramp,
        envelope,
        facts,
        lambda _fraction: None,
        stall.seen,
    )
    end = units.position(await axis.position_raw())
    if not stall.found:
        raise NotAllowed(
            "moves.found-no-end-within",
            drive=axis.drive.name,
            value=float(np.ptp(recording.position_rad)) / _TURN,
            limit=f"{way:g} rev",
            way_rev=way,
        )
    return end
