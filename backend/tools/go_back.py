"""Bring an axis back to a place by a slow speed profile, whatever its position gain may be."""

from __future__ import annotations

import numpy as np

from backend.axis import Axis, Envelope
from backend.cyclic import CyclicSession
from backend.tools.axis_facts import AxisFacts
from backend.tools.recording import Play, bus_limits, cycle_s, enabled, play, quiet
from drivers.cia402 import Mode

_TURN = 2 * np.pi
#: Nearer than this (in turns) is near enough.
_NEAR_REV = 0.02
_ATTEMPTS = 3


async def go_back(
    axis: Axis, session: CyclicSession, goal_raw: int, envelope: Envelope, facts: AxisFacts
) -> None:
    """Move to ``goal_raw`` in CSV with a raised-cosine profile; repeats where the loop is soft.

    Raises:
        NotAllowed: the motion was ended by the envelope or a fault.
    """
    units = await axis.units()
    for _ in range(_ATTEMPTS):
        distance = units.position(goal_raw - await axis.position_raw())
        if abs(distance) < _NEAR_REV:
            return
        rate = 1.0 / cycle_s(session)
        # Peak speed of a raised cosine is twice its mean.
        highest_rps = 0.25 * envelope.speed_rpm / 60.0
        duration_s = max(2.0 * abs(distance) / highest_rps, 0.4)
        n = round(duration_s * rate)
        turn = (np.arange(n) + 0.5) / n
        speed_rpm = distance / duration_s * 60.0 * (1.0 - np.cos(_TURN * turn))
        values = np.array([units.velocity_raw(v) for v in speed_rpm], dtype=np.int64)
        values = np.concatenate([values, np.zeros(round(0.1 * rate), dtype=np.int64)])
        around = abs(distance) + envelope.travel_rev
        wide = Envelope(around, envelope.speed_rpm, envelope.torque_percent, duration_s + 1.0)
        async with enabled(axis, session, Mode.CSV):
            await quiet(axis)
            await play(
                axis, session, Play(Mode.CSV, values), await bus_limits(axis, wide, goal_raw),
                facts.rated_torque_nm, lambda _fraction: None,
            )  # fmt: skip
            await quiet(axis)
