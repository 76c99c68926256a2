"""Return an axis to a position by a slow speed profile, independent of its position gain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backend.axes.axis.axis import Axis, Envelope
from backend.axes.axis.cyclic import CyclicSession
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Play, bus_limits, cycle_s, enabled, play, quiet
from backend.tools.moving.moves.raised_cosine import raised_cosine
from backend.tools.thresholds import moves_go_back as threshold
from drivers.cia402 import Mode
from drivers.errors import NotAllowed, exceeded
from drivers.halt import HaltCause


async def go_back(
    axis: Axis, session: CyclicSession, goal_raw: int, envelope: Envelope, facts: AxisFacts
) -> None:
    """Move to ``goal_raw`` in CSV with a raised-cosine profile; repeated where the loop is soft.

    A static load torque subtracts the same distance from each move, until the loop's integral
    compensates it, and a loop without an integral covers only a share of the commanded distance:
    the next move is commanded longer. A heavy load that takes more torque than permitted is moved
    more slowly. At most `threshold.ATTEMPTS` moves are made in succession.

    Raises:
        NotAllowed: the motion was ended by the envelope or a fault, or the axis did not arrive.
    """
    units = await axis.units()
    rest = units.position(goal_raw - await axis.position_raw())
    most = min(threshold.MISSED_REV, threshold.MISSED * envelope.travel_rev)
    moves: list[tuple[float, float]] = []
    slower = 1.0
    while len(moves) < threshold.ATTEMPTS:
        if abs(rest) < max(threshold.NEAR_REV, threshold.NEAR * envelope.travel_rev):
            return
        distance = float(np.clip(_to_ask(rest, moves), rest - most, rest + most))
        around = abs(rest) + envelope.travel_rev
        try:
            await _move(
                axis,
                session,
                goal_raw,
                distance,
                slower,
                replace(envelope, travel_rev=around),
                facts,
            )
        except NotAllowed as error:
            if slower >= threshold.SLOWEST or exceeded(error) is not HaltCause.TORQUE:
                raise
            slower *= 2.0
            await quiet(axis)
            # An aborted move does not predict the next one.
            moves.clear()
            rest = units.position(goal_raw - await axis.position_raw())
            continue
        before, rest = rest, units.position(goal_raw - await axis.position_raw())
        moves.append((distance, before - rest))
    require_back(axis, rest, envelope.travel_rev)


def require_back(axis: Axis, rest_rev: float, travel_rev: float) -> None:
    """Check that an axis has come back: whatever comes next would count its travel from elsewhere.

    Raises:
        NotAllowed: it is farther away than its accuracy explains.
    """
    far = max(threshold.FAR_REV, threshold.FAR * travel_rev)
    if abs(rest_rev) > far:
        raise NotAllowed(
            "moves.not-back",
            drive=axis.drive.name,
            value=round(rest_rev, 4),
            limit=f"{far:.3g} rev",
            away_rev=abs(rest_rev),
        )


async def _move(
    axis: Axis,
    session: CyclicSession,
    goal_raw: int,
    distance: float,
    slower: float,
    envelope: Envelope,
    facts: AxisFacts,
) -> None:
    """Make one move by ``distance`` rev in ``slower`` times the shortest duration."""
    units, rate = await axis.units(), 1.0 / cycle_s(session)
    # The peak speed of a raised cosine is twice its mean.
    highest_rps = 0.25 * envelope.speed_rpm / 60.0
    duration_s = slower * max(2.0 * abs(distance) / highest_rps, 0.4)
    speed_rpm = 60.0 * raised_cosine(distance, duration_s, rate)
    values = np.array([units.velocity_raw(v) for v in speed_rpm], dtype=np.int64)
    values = np.concatenate([values, np.zeros(round(0.1 * rate), dtype=np.int64)])
    limits = await bus_limits(axis, envelope, goal_raw)
    async with enabled(axis, session, Mode.CSV):
        await quiet(axis)
        await play(
            axis,
            session,
            Play(Mode.CSV, values),
            limits,
            facts.rated_torque_nm,
            lambda _fraction: None,
        )
        await quiet(axis)


def _to_ask(rest: float, moves: list[tuple[float, float]]) -> float:
    """Distance to command so that the axis moves ``rest``, by the earlier moves [rev]."""
    if not moves:
        return rest
    asked, gone = moves[-1]
    share = 1.0
    if len(moves) > 1 and abs(asked - moves[-2][0]) > threshold.DISTINGUISHED_REV:
        share = (gone - moves[-2][1]) / (asked - moves[-2][0])
        share = float(np.clip(share, *threshold.SHARES))
    return (rest + share * asked - gone) / share
