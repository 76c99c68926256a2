"""What a person reads of a STOP whose verdict a new command came before."""

from __future__ import annotations

from dataclasses import replace

from backend.axes.axis.stop.facts import AxisStop, Verdict
from backend.axes.stopping.stop_message import stop_message

MOVING = AxisStop(
    drive="x", verdict=Verdict.STILL_MOVING, took_s=0.3, speed=12.0, speed_unit="rpm",
    travelled=0.1, travel_unit="rev", steps=(),
)  # fmt: skip


def test_an_axis_that_still_moves_needs_the_emergency_stop() -> None:
    message = stop_message("X", MOVING)
    assert message is not None
    assert message.code == "stopping.still-moves"


def test_an_axis_that_got_a_new_command_is_not_said_to_disregard_the_stop() -> None:
    message = stop_message("X", replace(MOVING, superseded=True))
    assert message is not None
    assert message.code == "stopping.superseded"
    assert message.remedy() is not None


def test_standstill_that_was_seen_counts_also_after_a_new_command() -> None:
    assert stop_message("X", replace(MOVING, verdict=Verdict.STOPPED, superseded=True)) is None
