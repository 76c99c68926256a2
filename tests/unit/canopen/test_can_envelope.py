"""Setpoints outside the envelope are refused as a whole, before the first of them is sent."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drivers.canopen.exchange.cyclic import CanopenCyclic
from drivers.canopen.url import parse_canopen_url
from drivers.errors import OutOfRange
from drivers.ethercat.exchange.trajectory import message_of
from drivers.link import Address, Envelope, Trajectory

POSITION, SPEED, TORQUE = (
    Address(0x607A, 0, "INT32"),
    Address(0x60FF, 0, "INT32"),
    Address(0x6071, 0, "INT16"),
)
OUTSIDE = [
    Trajectory(5, POSITION, np.arange(0, 600, 10), Envelope(position_max=500)),
    Trajectory(5, POSITION, np.arange(0, -600, -10), Envelope(position_min=-500)),
    Trajectory(5, SPEED, np.array([0, 500, 501, 0]), Envelope(speed_max=500)),
    Trajectory(5, TORQUE, np.array([0, -31]), Envelope(torque_max=30)),
    Trajectory(5, POSITION, np.array([], np.int64), Envelope()),
]


class NoLoop:
    """A running loop of axis 5 that must not be reached."""

    cycle_s = 0.002
    images: Any = type("Images", (), {"axes": {5: None}})

    def __init__(self) -> None:
        self.played: list[object] = []

    def play(self, motions: object) -> int:
        self.played.append(motions)
        return 0


@pytest.mark.parametrize("trajectory", OUTSIDE)
async def test_the_loop_of_a_can_bus_gets_no_setpoint_outside_the_envelope(
    trajectory: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only the range of their type was checked: the axis was stopped after it had left."""
    nothing: Any = None
    url = parse_canopen_url("canopen://virtual/can0")
    cyclic = CanopenCyclic(nothing, url, nothing, nothing, nothing)
    cyclic._loop = loop = NoLoop()  # type: ignore[assignment]

    async def seen(_loop: object, _station: int) -> None: ...

    monkeypatch.setattr(cyclic, "_until_seen_enabled", seen)
    with pytest.raises(OutOfRange) as on_can:
        await cyclic.play([trajectory])
    assert loop.played == []
    with pytest.raises(OutOfRange) as on_ethercat:
        message_of(trajectory)
    assert on_can.value.text == on_ethercat.value.text, "by the same check on both buses"
