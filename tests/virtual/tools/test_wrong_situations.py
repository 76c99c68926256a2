"""Wrong situations end with a plain reason, the axis disabled and *every* setting as before.

Without a wire (what only a wire can show is in `test_trouble`); dumps of the whole drive are
compared, not the values that a tool is known to touch. Each drive begins with a notch on and its
torque filter as it comes, so that measurements have something to restore.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass

import pytest

from backend.axes.axis.axis import Envelope
from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.measuring.restore import settle
from backend.tools.measuring.temporary import put_back, write_settings
from backend.tools.mechanics.inertia.evaluation import InertiaSettings
from backend.tools.mechanics.inertia.run import inertia
from backend.tools.moving.step.evaluate import StepSettings
from backend.tools.moving.step.run import step_response
from backend.tools.tuning.autotune.run import (
    AutotuneResult,
    AutotuneSettings,
    apply_and_verify,
    autotune,
)
from backend.tools.tuning.notch.meaning import NotchMeaning, meaning_of, remember
from backend.tools.tuning.sweep.evaluation import SweepSettings, completed
from backend.tools.tuning.sweep.run import sweep
from drivers.cia402 import State
from drivers.errors import DriveError, LinkLost, NotAllowed
from drivers.link import Address
from drivers.virtual.mechanics import MechanicsSpec
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import AMPLE_S, WIDE, At, errors, mechanics, settings_of, silent

ONE = mechanics((1e-4, 60.0, 0.006))
FREE = mechanics((1e-4, 60.0, 0.006), coulomb=0.005)


@dataclass(frozen=True)
class Family:
    """``notch`` is on from the start; ``wild`` are gains with which the axis oscillates."""

    drive: str
    notch: Mapping[str, int]
    wild: Mapping[str, int]
    torque_limit: str
    polarity: int
    rotor_kgm2: float | None = None

    def autotune(self, envelope: Envelope = WIDE, *, apply: bool = True) -> AutotuneSettings:
        return AutotuneSettings(
            envelope, budget_s=AMPLE_S, apply=apply, motor_inertia_kgm2=self.rotor_kgm2
        )


#: A notch at 900 Hz, as the coefficients of MMS7 (-6 dB, 150 Hz wide) and in M6-L's Hz. Ten times
#: the rotor's inertia in 2001h:06 makes the speed gain of MMS7 ten times what fits. Bit 6 of 607Eh
#: turns the speed alone: position and torque count the other way.
MMS7 = Family(
    "mms7",
    {"2008:02": 13804, "2008:03": 42532, "2008:04": 14039, "2008:05": 42297, "2008:01": 1},
    {"2001:06": 8000, "2005:03": 5000},
    "6072:00",
    0x40,
)
M6L = Family(
    "m6l",
    {"2009:0B": 900, "2009:0C": 100},
    {"2008:01": 20000, "2009:27": 2000},
    "6072:00",
    0x40,
    5e-5,
)
families = pytest.mark.parametrize("family", [MMS7, M6L], ids=lambda family: family.drive)


async def dump(b: DirectBench) -> dict[str, object]:
    """Every setting of the drive."""
    return await settings_of(b.axis.drive)


@asynccontextmanager
async def unharmed(
    spec: MechanicsSpec, family: Family = MMS7, *, settings: Mapping[str, int] | None = None
) -> AsyncIterator[DirectBench]:
    """An axis that must be disabled, and its drive the same, when the block ends."""
    changed = {**family.notch, **(settings or {})}
    async with direct(spec, drive=family.drive, settings=changed) as b:
        before = await dump(b)
        assert len(before) > 100
        assert before.items() >= changed.items()
        yield b
        assert await b.axis.state() is not State.OPERATION_ENABLED
        after = await dump(b)
        assert after == before, {k: (before[k], after[k]) for k in before if before[k] != after[k]}


@pytest.mark.long
@families
async def test_a_wrong_sign_is_reported(family: Family) -> None:
    async with unharmed(ONE, family, settings={"607E:00": family.polarity}) as b:
        with pytest.raises(NotAllowed, match=r"against its torque|sign"):
            await sweep(b.axis, b.session, SweepSettings(WIDE), silent())
        with pytest.raises(DriveError, match=r"against its torque|sign"):
            await autotune(b.axis, b.session, family.autotune(), silent())


@pytest.mark.long
@families
async def test_a_torque_limit_of_the_drive_is_kept(family: Family) -> None:
    # The drive gives a third of the rated torque, whatever the envelope permits.
    async with unharmed(ONE, family, settings={family.torque_limit: 300}) as b:
        found = await sweep(b.axis, b.session, SweepSettings(WIDE), silent())
        assert found.saturated_share < 0.05
        near = errors(found.direct, ONE, 5, 250)
        assert near.magnitude_db < 0.3


@pytest.mark.long
@families
async def test_a_torque_that_the_drive_cuts_is_reported(
    family: Family, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A tenth, by a limit that the profile does not name.
    async def unknown(_axis: object) -> float:
        return 400.0

    monkeypatch.setattr("backend.tools.tuning.sweep.plan.drive_limit_percent", unknown)
    async with unharmed(ONE, family, settings={family.torque_limit: 100}) as b:
        with pytest.raises(DriveError, match="torque"):
            await autotune(b.axis, b.session, family.autotune(), silent())


@pytest.mark.long
@families
async def test_start_gains_that_oscillate(family: Family) -> None:
    soft = mechanics((1e-4, 60.0, 0.0005))
    async with unharmed(soft, family, settings=family.wild) as b:
        for kind in ("mechanics", "speed_loop"):
            with pytest.raises(DriveError):
                await sweep(
                    b.axis, b.session, SweepSettings(WIDE, kind=kind, loop="speed"), silent()
                )
        with pytest.raises(DriveError):
            await step_response(b.axis, b.session, StepSettings(WIDE), silent())
        # Autotune sets temporary gains for the measurement, and finds better ones.
        found = await autotune(b.axis, b.session, family.autotune(apply=False), silent())
        assert found.candidates
        units = await b.axis.units()
        assert units.velocity(b.link.highest["speed"]) < WIDE.speed_rpm


@pytest.mark.long
@families
async def test_too_little_travel_for_every_tool(family: Family) -> None:
    tight = Envelope(0.02, 600.0, 60.0, 30.0)
    async with unharmed(ONE, family) as b:
        units, start = await b.axis.units(), await b.axis.position_raw()
        tools: list[Callable[[], Awaitable[object]]] = [
            lambda: sweep(b.axis, b.session, SweepSettings(tight), silent()),
            lambda: step_response(b.axis, b.session, StepSettings(tight), silent()),
            lambda: autotune(b.axis, b.session, family.autotune(tight), silent()),
        ]
        for tool in tools:
            with pytest.raises(DriveError, match=r"travel|rev|too short|position .* beyond"):
                await tool()
        assert abs(units.position(await b.axis.position_raw() - start)) < 0.2


@pytest.mark.long(keep=1)
@families
async def test_a_blocked_axis(family: Family) -> None:
    async with unharmed(mechanics(coulomb=0.9), family) as b:
        low = Envelope(2.0, 600.0, 40.0, 30.0)
        with pytest.raises(NotAllowed, match="does not move"):
            await sweep(b.axis, b.session, SweepSettings(low), silent())
        for work in (
            inertia(b.axis, b.session, InertiaSettings(low), silent()),
            autotune(b.axis, b.session, family.autotune(low), silent()),
        ):
            with pytest.raises(DriveError, match=r"moves only|torque"):
                await work


@pytest.mark.long
@families
async def test_a_first_move_grows_within_the_envelope(family: Family) -> None:
    """A blocked axis: what is tried grows no further than the envelope, and the words fit it."""
    tight = Envelope(1.0, 300.0, 30.0, 30.0)
    async with unharmed(mechanics(coulomb=0.9), family) as b:
        units = await b.axis.units()
        begun = await b.axis.position_raw()
        with pytest.raises(NotAllowed) as reported:
            await inertia(b.axis, b.session, InertiaSettings(tight), silent())
        said = f"{reported.value.message} {reported.value.remedy}"
        assert re.search(
            r"moves only [\d.e-]+ of 0\.12 rev|takes more torque than is permitted",
            reported.value.message,
        )
        assert "brake" in said
        assert "blocked" in said
        # It is seen a cycle late, and the loop hears of it one cycle later.
        assert units.torque(b.link.highest["torque"]) <= tight.torque_percent * 1.1
        assert units.velocity(b.link.highest["speed"]) <= tight.speed_rpm
        assert abs(units.position(await b.axis.position_raw() - begun)) < 0.05


@pytest.mark.long
@families
async def test_a_closed_brake_is_distinguished_from_an_axis(family: Family) -> None:
    async with unharmed(ONE, family) as b:
        b.link.device.inject("coulomb_nm", 5.0)
        for work in (
            sweep(b.axis, b.session, SweepSettings(WIDE), silent()),
            inertia(b.axis, b.session, InertiaSettings(WIDE), silent()),
            autotune(b.axis, b.session, family.autotune(), silent()),
        ):
            with pytest.raises(DriveError) as reported:
                await work
            assert "brake" in (reported.value.remedy or "")


@pytest.mark.long
@families
async def test_an_envelope_that_is_hit_ends_the_measurement(family: Family) -> None:
    narrow = Envelope(4.0, 1500.0, 20.0, 60.0)
    async with unharmed(FREE, family) as b:
        # The loop answers its reference with more torque than the envelope allows, whatever its
        # size: gravity alone takes it.
        b.link.device.inject("load_nm", 0.5)
        with pytest.raises(NotAllowed):
            await sweep(b.axis, b.session, SweepSettings(narrow), silent())
        with pytest.raises(DriveError):
            await autotune(b.axis, b.session, family.autotune(narrow), silent())


@pytest.mark.long
@families
@pytest.mark.parametrize("tool", ["sweep", "autotune"])
async def test_a_drive_that_faults_while_it_is_measured(family: Family, tool: str) -> None:
    async with unharmed(ONE, family) as b:
        at = At("measuring, realisation 1", lambda: b.link.device.inject("over_temperature"))
        works: dict[str, Callable[[], Awaitable[object]]] = {
            "sweep": lambda: sweep(b.axis, b.session, SweepSettings(WIDE), at.progress),
            "autotune": lambda: autotune(b.axis, b.session, family.autotune(), at.progress),
        }
        with pytest.raises(DriveError, match=r"temperature|Operation enabled|[Ff]ault"):
            await works[tool]()
        assert at.done


#: What autotune found of a family's axis, so that it is found once, and what its notches do.
_FOUND: dict[str, tuple[AutotuneResult, NotchMeaning | None]] = {}


async def found_of(family: Family) -> AutotuneResult:
    """Autotune up to the table of candidates; nothing of the drive is changed by it."""
    if family.drive not in _FOUND:
        async with unharmed(ONE, family) as b:
            found = await autotune(b.axis, b.session, family.autotune(apply=False), silent())
            _FOUND[family.drive] = found, meaning_of(b.axis.drive)
    return _FOUND[family.drive][0]


async def apply(b: DirectBench, family: Family, progress: Progress) -> AutotuneResult:
    """The second half of autotune."""
    found, meaning = _FOUND[family.drive]
    if meaning is not None:
        remember(b.axis.drive, meaning)
    settings = family.autotune()
    facts = await read_facts(b.axis, motor_inertia_kgm2=family.rotor_kgm2)
    facts = completed(facts, found.mechanics)
    return await apply_and_verify(b.axis, b.session, settings, facts, found, progress, None)


@pytest.mark.long
@families
async def test_a_drive_that_faults_while_the_tuned_loop_is_verified(family: Family) -> None:
    await found_of(family)
    async with unharmed(ONE, family) as b:
        at = At("6 of 6: measuring", lambda: b.link.device.inject("over_temperature"))
        with pytest.raises(DriveError, match=r"temperature|Operation enabled|[Ff]ault"):
            await apply(b, family, at.progress)
        assert at.done


@pytest.mark.long
@families
@pytest.mark.parametrize(
    ("tool", "step"),
    [
        ("sweep", "measuring"),
        ("autotune", "2 of 6"),
        ("autotune", "3 of 6: frequency response: mea"),
        ("verification", "6 of 6: mea"),
    ],
)
async def test_a_link_that_is_lost_while_it_is_measured(
    family: Family, tool: str, step: str
) -> None:
    """What could not be restored is named, value by value, and restored when the drive answers."""
    await found_of(family)
    async with direct(ONE, drive=family.drive, settings=dict(family.notch)) as b:

        def pull() -> None:
            # The drive's own watchdog disables it.
            b.link.cut = True
            b.link.device.inject("watchdog")

        before = await dump(b)
        at = At(step, pull)
        works: dict[str, Callable[[], Awaitable[object]]] = {
            "sweep": lambda: sweep(b.axis, b.session, SweepSettings(WIDE), at.progress),
            "autotune": lambda: autotune(b.axis, b.session, family.autotune(), at.progress),
            "verification": lambda: apply(b, family, at.progress),
        }
        with pytest.raises(DriveError) as reported:
            await works[tool]()
        assert at.done
        pending = {entry.key for entry in b.axis.drive.pending_restores.entries}
        b.link.cut = False
        # Disabled in the middle of a motion it coasts for a while.
        b.link.pass_s(3.0)
        assert await b.axis.state() is not State.OPERATION_ENABLED
        # Nothing but what the list holds is other than before; reading it takes the rest off it.
        after = await dump(b)
        changed = {key for key in before if before[key] != after[key]}
        assert changed <= pending
        for key in changed:
            assert f"{key} (was {before[key]})" in reported.value.message
        if not changed:
            assert isinstance(reported.value, LinkLost)
        found = await settle(b.axis, asked=False)
        assert found["left"] == {}
        assert await dump(b) == before
        assert not b.axis.drive.pending_restores


@pytest.mark.long
@families
@pytest.mark.parametrize("step", ["1 of 6", "2 of 6", "3 of 6"])
async def test_autotune_is_cancelled_while_it_measures(family: Family, step: str) -> None:
    """At the first word of the step, so that the next thing it awaits is cut off."""
    async with unharmed(ONE, family) as b:
        at = At(step, lambda: task.cancel())  # noqa: PLW0108 (the task is made below)
        task = asyncio.create_task(autotune(b.axis, b.session, family.autotune(), at.progress))
        with pytest.raises(asyncio.CancelledError):
            await task


@pytest.mark.long
async def test_autotune_is_cancelled_while_it_designs() -> None:
    async with unharmed(ONE) as b:
        at = At("4 of 6", lambda: task.cancel())  # noqa: PLW0108
        task = asyncio.create_task(autotune(b.axis, b.session, MMS7.autotune(), at.progress))
        with pytest.raises(asyncio.CancelledError):
            await task


@pytest.mark.long
@families
@pytest.mark.parametrize(
    ("step", "fraction"),
    [
        ("5 of 6", 0.0),
        ("6 of 6: verifying", 0.0),
        # With the new gains in force and the axis moving.
        ("6 of 6: measuring", 0.0),
        ("6 of 6: measuring", 0.85),
        ("6 of 6: step", 0.0),
    ],
)
async def test_autotune_is_cancelled_after_it_has_written(
    family: Family, step: str, fraction: float
) -> None:
    await found_of(family)
    async with unharmed(ONE, family) as b:
        at = At(step, lambda: task.cancel(), fraction)  # noqa: PLW0108
        task = asyncio.create_task(apply(b, family, at.progress))
        with pytest.raises(asyncio.CancelledError):
            await task


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("tool", ["sweep", "inertia", "step"])
@pytest.mark.parametrize(
    ("family", "fraction"),
    [(MMS7, 0.0), (MMS7, 0.2), (MMS7, 0.6), (M6L, 0.6)],
    ids=["mms7-0.0", "mms7-0.2", "mms7-0.6", "m6l-0.6"],
)
async def test_single_tools_are_cancelled(family: Family, tool: str, fraction: float) -> None:
    async with unharmed(ONE, family) as b:
        at = At("", lambda: task.cancel(), fraction)  # noqa: PLW0108
        works: dict[str, Callable[[], Awaitable[object]]] = {
            "sweep": lambda: sweep(b.axis, b.session, SweepSettings(WIDE), at.progress),
            "inertia": lambda: inertia(b.axis, b.session, InertiaSettings(WIDE), at.progress),
            # Long enough to be notified of progress more than once while it moves.
            "step": lambda: step_response(
                b.axis, b.session, StepSettings(WIDE, hold_s=2.0), at.progress
            ),
        }
        task = asyncio.ensure_future(works[tool]())
        with pytest.raises(asyncio.CancelledError):
            await task


async def test_applying_is_cancelled_at_every_write() -> None:
    wanted = {"2005:03": 600, "2005:04": 120, "2001:06": 150, "2008:01": 3, "2008:06": 13000}
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
