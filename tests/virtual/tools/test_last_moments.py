"""Trouble in the last moments of a measurement, when its samples are there and nobody looks."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from typing import Any

import pytest

from backend.foundation.work.jobs import Progress
from backend.tools.measuring.alignment import aligned
from backend.tools.measuring.interrupted import Interrupted
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.run import inertia
from backend.tools.moving.step.evaluate import StepSettings
from backend.tools.moving.step.run import step_response
from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.run import sweep
from drivers.cia402 import State
from drivers.errors import DriveError
from drivers.link import Address, Trajectory
from drivers.virtual.device import Device
from drivers.virtual.firmware.cia402.states import State as FirmwareState
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import WIDE, mechanics, settings_of

ONE = mechanics((1e-4, 60.0, 0.006))
TOOLS: dict[str, tuple[str, Callable[[DirectBench, Progress], Awaitable[object]]]] = {
    "inertia": (
        "reciprocating move",
        lambda b, p: inertia(b.axis, b.session, InertiaSettings(WIDE), p),
    ),
    "step": ("stepping", lambda b, p: step_response(b.axis, b.session, StepSettings(WIDE), p)),
}


@pytest.mark.long
@pytest.mark.parametrize(
    ("drive", "tool", "trouble"),
    [("mms7", "inertia", "tripped"), ("r6l", "step", "tripped"), ("ep3e", "step", "stopped")],
)
async def test_trouble_after_the_last_sample_is_reported(
    drive: str, tool: str, trouble: str
) -> None:
    """It was measured to its end, and the drive was out before it was disabled."""
    async with direct(ONE, drive=drive) as b:
        before = await settings_of(b.axis.drive)
        step, work = TOOLS[tool]
        progress = Progress(lambda: None)
        struck: list[float] = []

        def strike(*arguments: Any, **more: Any) -> Any:
            if progress.step == step and not struck:
                struck.append(progress.fraction)
                if trouble == "tripped":
                    b.link.device.inject("over_temperature")
                else:
                    take_torque_off(b.link.device)
            return aligned(*arguments, **more)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("backend.tools.measuring.recording.aligned", strike)
            with pytest.raises(Interrupted, match=r"emperature|Switch on disabled"):
                await work(b, progress)
        assert struck
        assert await b.axis.state() is not State.OPERATION_ENABLED
        assert await settings_of(b.axis.drive) == before


def take_torque_off(device: Device) -> None:
    """What an open safe-torque-off input does: no fault, and no power."""
    control = device.control  # type: ignore[attr-defined]
    control._switch_off(at_once=True)
    control.state = FirmwareState.SWITCH_ON_DISABLED


async def test_a_load_whose_drive_was_stopped_does_not_seem_to_pull_nothing() -> None:
    """Disabled it reports no torque: the sweep would open the loop that has to hold the load."""
    # A brake holds the load while the drive is disabled (2108h:01).
    loaded = mechanics((1e-4, 200.0, 0.005), gravity=0.15)
    async with direct(loaded, settings={"2108:01": 1}) as b:
        control = b.link.device.control  # type: ignore[attr-defined]
        opened: list[int] = []
        play = b.link.play

        async def played(trajectories: Sequence[Trajectory]) -> int:
            opened.append(len(trajectories))
            return await play(trajectories)

        async def stopped(station: int, addresses: Sequence[Address]) -> list[bytes | DriveError]:
            if control.state is FirmwareState.OPERATION_ENABLED:
                take_torque_off(b.link.device)
            return await read_many(station, addresses)

        read_many = b.link.read_many
        b.link.play = played  # type: ignore[method-assign]
        b.link.read_many = stopped  # type: ignore[method-assign]
        with pytest.raises(Interrupted, match="Switch on disabled"):
            await sweep(b.axis, b.session, SweepSettings(WIDE), Progress(lambda: None))
        assert not opened


async def test_a_load_that_the_drive_cannot_hold_is_not_measured() -> None:
    """Its torque is limited to a twentieth of the rated, which says nothing of what pulls it."""
    async with direct(ONE, drive="m6l", settings={"6072:00": 50}) as b:
        read_many = b.link.read_many

        async def pulled(station: int, addresses: Sequence[Address]) -> list[bytes | DriveError]:
            if b.link.axis_state(station)[0] == State.OPERATION_ENABLED.value:
                b.link.device.inject("load_nm", 0.15)
            return await read_many(station, addresses)

        b.link.read_many = pulled  # type: ignore[method-assign]
        with pytest.raises(
            Interrupted, match=r"turns at .* although its speed loop commands standstill"
        ) as reported:
            await sweep(b.axis, b.session, SweepSettings(WIDE), Progress(lambda: None))
        assert "torque limits" in (reported.value.remedy or "")
        assert await b.axis.state() is not State.OPERATION_ENABLED
