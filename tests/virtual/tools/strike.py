"""Trouble in the middle of a motion of an automatic tuning, and what must be so afterwards.

Run as a script it tries every kind of trouble in every motion of the parts that are named:

    python -m tests.virtual.tools.strike [--drive r6l m6l] [--vertical] [--part inertia sweep ...]
"""

from __future__ import annotations

import argparse
import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass

from backend.foundation.work.jobs import Progress
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.measuring.restore import settle
from backend.tools.mechanics.inertia.evaluation import InertiaOutcome, InertiaSettings
from backend.tools.mechanics.inertia.run import inertia
from backend.tools.tuning.autotune.design.notches import Learning, learn_notches
from backend.tools.tuning.autotune.run import (
    AutotuneResult,
    AutotuneSettings,
    apply_and_verify,
    autotune,
)
from backend.tools.tuning.notch.meaning import NotchMeaning, meaning_of, remember
from backend.tools.tuning.sweep.evaluation import SweepResult, SweepSettings, completed
from backend.tools.tuning.sweep.run import sweep
from drivers.cia402 import State
from drivers.errors import DriveError
from drivers.link import Trajectory
from drivers.virtual.mechanics import MechanicsSpec
from tests.virtual.tools.can_rig import CanBench
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import AMPLE_S, WIDE, Bench, mechanics, settings_of, silent

#: From the trouble to the end of the work: the loop's second without samples, the braking, and one
#: cleanup after the other that gives up after five seconds.
BOUND_S = 30.0
#: The control supply is off for this long; with the mains gone the axis coasts to rest meanwhile.
OFF_S = 2.0
KINDS = ("cable", "control power", "main power", "cancelled")
PARTS = ("inertia", "sweep", "notches", "verify")
ROTOR = {"mms7": None, "m6l": 5e-5, "r6l": 5e-5}


def axis_of(*, vertical: bool) -> MechanicsSpec:
    """One resonance; a vertical axis has its brake."""
    if not vertical:
        return mechanics((1e-4, 60.0, 0.006))
    spec = mechanics((1e-4, 40.0, 0.003), coulomb=0.04, gravity=0.2)
    return spec.model_copy(update={"motor": spec.motor.model_copy(update={"brake": True})})


class Strike:
    """Does something once, in the middle of the ``number``-th motion whose step has ``words``."""

    def __init__(
        self,
        b: DirectBench,
        words: str,
        number: int,
        act: Callable[[], object],
        after: float = 0.5,
    ) -> None:
        self.progress = Progress(lambda: None)
        self.done_at: float | None = None
        self.step = ""
        self.seen = 0
        """Motions of that step so far."""
        self._words, self._number, self._act, self._after = words, number, act, after
        self._cycles, self._play = -1, b.link.play
        b.link.play = self._played  # type: ignore[method-assign]
        b.link.late = self._each_cycle

    async def _played(self, trajectories: Sequence[Trajectory]) -> int:
        if self._words in self.progress.step:
            self.seen += 1
            if self.seen == self._number:
                self._cycles = round(self._after * len(trajectories[0].values))
        return await self._play(trajectories)

    def _each_cycle(self) -> int:
        if self._cycles >= 0:
            self._cycles -= 1
            if self._cycles < 0 and self.done_at is None:
                self.done_at, self.step = time.monotonic(), self.progress.step
                self._act()
        return 0


@dataclass(frozen=True)
class Known:
    """What comes before the part that is struck, measured once."""

    outcome: InertiaOutcome
    mechanics: SweepResult
    tuned: AutotuneResult | None = None
    meaning: NotchMeaning | None = None


@asynccontextmanager
async def bench(drive: str, spec: MechanicsSpec) -> AsyncIterator[DirectBench]:
    brake = {"2108:01": 1} if drive == "mms7" and spec.friction.gravity_nm else None
    async with direct(spec, drive=drive, settings=brake) as b:
        if await b.axis.state() is State.FAULT:
            await b.axis.reset_fault()
        yield b


async def measured(drive: str, spec: MechanicsSpec, *, tune: bool = False) -> Known:
    async with bench(drive, spec) as b:
        if tune:
            settings = AutotuneSettings(
                WIDE, budget_s=AMPLE_S, apply=False, motor_inertia_kgm2=ROTOR[drive]
            )
            found = await autotune(b.axis, b.session, settings, silent())
            return Known(found.inertia, found.mechanics, found, meaning_of(b.axis.drive))
        outcome = await inertia(b.axis, b.session, InertiaSettings(WIDE), silent())
        return Known(outcome, await sweep(b.axis, b.session, SweepSettings(WIDE), silent()))


async def work(
    b: DirectBench | Bench | CanBench, part: str, known: Known | None, progress: Progress
) -> object:
    """One part of a tuning as the whole does it."""
    axis, session, name = b.axis, b.session, b.axis.drive.profile.drive
    settings = AutotuneSettings(WIDE, budget_s=AMPLE_S, motor_inertia_kgm2=ROTOR[name])
    if part in ("inertia", "sweep"):
        return await autotune(axis, session, settings, progress)
    assert known is not None
    facts = await read_facts(axis, motor_inertia_kgm2=ROTOR[name])
    facts = completed(facts, known.mechanics)
    if part == "notches":
        how = Learning(WIDE, "auto", "free")
        said = await learn_notches(
            axis, session, how, facts, known.outcome, known.mechanics, progress
        )
        assert not said, said
        return said
    assert known.tuned is not None
    if known.meaning is not None:
        remember(axis.drive, known.meaning)
    return await apply_and_verify(axis, session, settings, facts, known.tuned, progress, None)


WORDS = {"inertia": "2 of 6", "sweep": "3 of 6", "notches": "trying", "verify": "6 of 6"}


async def struck(
    drive: str, spec: MechanicsSpec, part: str, number: int, kind: str, known: Known | None = None
) -> str:
    """Strike, and hold what comes of it against what must be; the reason that was reported.

    Empty where the part has fewer motions than ``number``.
    """
    async with bench(drive, spec) as b:
        before = await settings_of(b.axis.drive)
        task: asyncio.Task[object]

        def pull() -> None:
            b.link.cut = True
            b.link.device.inject("watchdog")

        acts: dict[str, Callable[[], object]] = {
            "cable": pull,
            "control power": lambda: b.link.device.inject("power_off", OFF_S),
            "main power": lambda: b.link.device.inject("under_voltage"),
            "cancelled": lambda: task.cancel(),  # noqa: PLW0108 (the task is made below)
        }
        strike = Strike(b, WORDS[part], number, acts[kind])
        task = asyncio.create_task(_object(work(b, part, known, strike.progress)))
        reported = ""
        try:
            await task
        except DriveError as error:
            reported = error.message
            assert f"{b.axis.drive.name}:" in reported, reported
        except asyncio.CancelledError:
            reported = "cancelled"
        if strike.done_at is None:
            assert not reported, f"ended before the trouble came: {reported}"
            return ""
        assert reported, f"went on after {kind} in {strike.step}"
        assert (reported == "cancelled") == (kind == "cancelled"), reported
        took_s = time.monotonic() - strike.done_at
        assert took_s < BOUND_S, f"{took_s:.0f} s until: {reported}"
        await _calm(b, before, reported, gone=kind in ("cable", "control power"))
        return f"{strike.step}: {reported}"


async def _object(doing: Awaitable[object]) -> object:
    return await doing


async def _calm(b: DirectBench, before: dict[str, object], reported: str, *, gone: bool) -> None:
    """Nothing moves or is enabled; every setting is as before, or pending and restored."""
    axis, pending = b.axis, {entry.key for entry in b.axis.drive.pending_restores.entries}
    b.link.cut = False
    b.link.pass_s(OFF_S + 3.0)
    if axis.stop_pending:
        assert await axis.repeat_stop()
    assert await axis.state() is not State.OPERATION_ENABLED
    assert await axis.standstill(2.0)
    units, stood = await axis.units(), await axis.position_raw()
    after = await settings_of(axis.drive)
    changed = {key for key in before if before[key] != after[key]}
    assert changed <= pending, {key: (before[key], after[key]) for key in changed - pending}
    if not gone:
        assert not changed, changed
    for key in changed:
        assert f"{key} (was {before[key]})" in reported, (key, reported)
    if gone:
        found = await settle(axis, asked=False)
        assert found["left"] == {}, found
        assert await settings_of(axis.drive) == before
    assert not axis.drive.pending_restores, axis.drive.pending_restores
    b.link.pass_s(1.0)
    assert abs(units.position(await axis.position_raw() - stood)) < 0.01, "it still moves"
    assert await axis.state() is not State.OPERATION_ENABLED


async def _campaign(options: argparse.Namespace) -> None:
    for drive in options.drive:
        spec = axis_of(vertical=options.vertical)
        late = {"notches", "verify"} & set(options.part)
        known = await measured(drive, spec, tune="verify" in options.part) if late else None
        for part in options.part:
            for kind in options.kind:
                for number in range(1, options.most + 1):
                    try:
                        reported = await struck(drive, spec, part, number, kind, known)
                    except AssertionError as wrong:
                        reported = f"WRONG: {wrong}"
                    if not reported:
                        break
                    print(f"{drive:5} {part:8} {number:2} {kind:13} {reported}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--drive", nargs="+", default=["r6l"], choices=list(ROTOR))
    parser.add_argument("--part", nargs="+", default=list(PARTS), choices=PARTS)
    parser.add_argument("--kind", nargs="+", default=list(KINDS), choices=KINDS)
    parser.add_argument("--vertical", action="store_true")
    parser.add_argument("--most", type=int, default=20, help="motions of each part")
    asyncio.run(_campaign(parser.parse_args()))
