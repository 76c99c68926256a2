"""Wrong situations end with a plain reason, the axis disabled and *every* setting as before.

Without a wire (what only a wire can show is in `test_trouble`); dumps of the whole drive are
compared, not the values that a tool is known to touch.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager

import pytest

from backend import parameter_set
from backend.axis import Envelope
from backend.jobs import Progress
from backend.tools.autotune import AutotuneSettings, autotune
from backend.tools.inertia import InertiaSettings, inertia
from backend.tools.step_response import StepSettings, step_response
from backend.tools.sweep import sweep
from backend.tools.sweep_evaluation import SweepSettings
from backend.tools.temporary import put_back, write_settings
from drivers.cia402 import State
from drivers.errors import DriveError, NotAllowed
from drivers.link import Address
from drivers.virtual.mechanics import MechanicsSpec
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import WIDE, errors, mechanics, silent

ONE = mechanics((1e-4, 60.0, 0.006))


async def dump(b: DirectBench) -> dict[str, object]:
    """Every setting of the drive, motor's own ones included."""
    drive = b.axis.drive
    stored = parameter_set.storable(drive.profile, motor_individual=True)
    keys = [p.key for p in stored if not p.key.startswith("60FE")]
    return {key: reading.raw for key, reading in (await drive.read_many(keys)).items()}


@asynccontextmanager
async def unharmed(
    spec: MechanicsSpec, khz: float = 1.0, *, drive: str = "mms7",
    settings: Mapping[str, int] | None = None,
) -> AsyncIterator[DirectBench]:  # fmt: skip
    """An axis that must be disabled, and its drive the same, when the block ends."""
    async with direct(spec, 1e-3 / khz, drive=drive, settings=settings) as b:
        before = await dump(b)
        assert len(before) > 100
        yield b
        assert await b.axis.state() is not State.OPERATION_ENABLED
        after = await dump(b)
        assert after == before, {k: (before[k], after[k]) for k in before if before[k] != after[k]}


async def test_a_wrong_sign_is_told() -> None:
    # 607Eh bit 6 turns the speed alone: position and torque count the other way.
    async with unharmed(ONE, settings={"607E:00": 0x40}) as b:
        with pytest.raises(NotAllowed, match=r"against its torque|sign"):
            await sweep(b.axis, b.session, SweepSettings(WIDE), silent())
        with pytest.raises(DriveError, match=r"against its torque|sign"):
            await autotune(b.axis, b.session, AutotuneSettings(WIDE), silent())


async def test_a_torque_limit_of_the_drive_is_kept() -> None:
    # The drive gives a third of the rated torque, whatever the envelope permits (6072h).
    async with unharmed(ONE, settings={"6072:00": 300}) as b:
        found = await sweep(b.axis, b.session, SweepSettings(WIDE), silent())
        assert found.saturated_share < 0.05
        near = errors(found.direct, ONE, 5, 250)
        assert near.magnitude_db < 0.3


async def test_a_torque_that_the_drive_cuts_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    # A tenth, by a limit that the profile does not name.
    async def unknown(_axis: object) -> float:
        return 400.0

    monkeypatch.setattr("backend.tools.sweep._drive_limit_percent", unknown)
    async with unharmed(ONE, settings={"6072:00": 100}) as b:
        with pytest.raises(DriveError, match="torque"):
            await autotune(b.axis, b.session, AutotuneSettings(WIDE), silent())


async def test_start_gains_that_oscillate() -> None:
    # Ten times the rotor's inertia in 2001h:06 makes the speed gain ten times what fits.
    soft = mechanics((1e-4, 60.0, 0.0005))
    async with unharmed(soft, settings={"2001:06": 8000, "2005:03": 5000}) as b:
        for kind in ("mechanics", "speed_loop"):
            with pytest.raises(DriveError):
                await sweep(
                    b.axis, b.session, SweepSettings(WIDE, kind=kind, loop="speed"), silent()
                )  # fmt: skip
        with pytest.raises(DriveError):
            await step_response(b.axis, b.session, StepSettings(WIDE), silent())


async def test_too_little_travel_for_every_tool() -> None:
    tight = Envelope(0.02, 600.0, 60.0, 30.0)
    async with unharmed(ONE) as b:
        units, start = await b.axis.units(), await b.axis.position_raw()
        tools: list[Callable[[], Awaitable[object]]] = [
            lambda: sweep(b.axis, b.session, SweepSettings(tight), silent()),
            lambda: step_response(b.axis, b.session, StepSettings(tight), silent()),
            lambda: autotune(b.axis, b.session, AutotuneSettings(tight), silent()),
        ]
        for tool in tools:
            with pytest.raises(DriveError, match=r"travel|rev|too short|position .* beyond"):
                await tool()
        assert abs(units.position(await b.axis.position_raw() - start)) < 0.2


async def test_a_blocked_axis() -> None:
    async with unharmed(mechanics(coulomb=0.9)) as b:
        low = Envelope(2.0, 600.0, 40.0, 30.0)
        with pytest.raises(NotAllowed, match="does not move"):
            await sweep(b.axis, b.session, SweepSettings(low), silent())
        with pytest.raises(DriveError, match=r"moves only|torque"):
            await inertia(b.axis, b.session, InertiaSettings(low), silent())


@pytest.mark.parametrize("step", ["1 of 6", "2 of 6", "3 of 6", "4 of 6", "5 of 6"])
async def test_autotune_is_cancelled_in_every_step(step: str) -> None:
    async with unharmed(ONE) as b:

        def at_once() -> None:
            # At the first word of the step, so that the next thing it awaits is cut off.
            if step in progress.step and not task.cancelling():
                task.cancel()

        progress = Progress(at_once)
        task = asyncio.create_task(autotune(b.axis, b.session, AutotuneSettings(WIDE), progress))
        with pytest.raises(asyncio.CancelledError):
            await task


async def test_autotune_is_cancelled_while_the_tuned_loop_turns() -> None:
    """Late in the verification, with the new gains in force and the axis moving."""
    async with unharmed(ONE) as b:
        progress = Progress(
            lambda: task.cancel() if progress.fraction > 0.85 and not task.cancelling() else None
        )
        task = asyncio.create_task(autotune(b.axis, b.session, AutotuneSettings(WIDE), progress))
        with pytest.raises(asyncio.CancelledError):
            await task


@pytest.mark.parametrize("tool", ["sweep", "inertia", "step"])
@pytest.mark.parametrize("fraction", [0.0, 0.2, 0.6])
async def test_single_tools_are_cancelled(tool: str, fraction: float) -> None:
    async with unharmed(ONE) as b:
        progress = Progress(
            lambda: (
                task.cancel() if progress.fraction >= fraction and not task.cancelling() else None
            )
        )
        works: dict[str, Callable[[], Awaitable[object]]] = {
            "sweep": lambda: sweep(b.axis, b.session, SweepSettings(WIDE), progress),
            "inertia": lambda: inertia(b.axis, b.session, InertiaSettings(WIDE), progress),
            # Long enough to be told of progress more than once while it moves.
            "step": lambda: step_response(
                b.axis, b.session, StepSettings(WIDE, hold_s=2.0), progress
            ),
        }
        task = asyncio.ensure_future(works[tool]())
        with pytest.raises(asyncio.CancelledError):
            await task


async def test_applying_is_cancelled_at_every_write() -> None:
    wanted = {"2005:03": 600, "2005:04": 120, "2001:06": 150, "2008:01": 1, "2008:02": 13000}
    async with unharmed(ONE) as b:
        send = b.link.write
        cut_at = 0

        async def cutting(station: int, address: Address, data: bytes) -> None:
            nonlocal cut_at
            cut_at -= 1
            await send(station, address, data)
            if cut_at == 0:
                task.cancel()

        b.link.write = cutting  # type: ignore[method-assign]
        for number in range(1, 20):
            cut_at = number
            task = asyncio.ensure_future(write_settings(b.axis, wanted))
            try:
                before = await task
            except asyncio.CancelledError:
                continue
            # Fewer writes than that: everything was written.
            cut_at = 0
            await put_back(b.axis, before)
            break
        assert number > len(wanted)


async def test_a_drive_that_faults_while_the_tuned_loop_is_verified() -> None:
    async with unharmed(ONE) as b:
        done = False

        def break_down() -> None:
            nonlocal done
            if "6 of 6: measuring" in progress.step and not done:
                done = True
                b.link.device.inject("over_temperature")

        progress = Progress(break_down)
        with pytest.raises(DriveError, match=r"temperature|Operation enabled|[Ff]ault"):
            await autotune(b.axis, b.session, AutotuneSettings(WIDE), progress)
        assert done
