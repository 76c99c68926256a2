"""What ends a part of a tuning and is survived leaves the axis elsewhere; the next begins at home.

Travel counts from where the tuning began, however many parts were stopped by their envelope. And
what was too fast for it when notches are learned on a free axis is tried with less.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import read_facts
from backend.tools.moving.moves.go_back import go_back
from backend.tools.tuning.autotune import run as tuning
from backend.tools.tuning.autotune.design import notches as tune_notches
from backend.tools.tuning.autotune.run import AutotuneSettings, autotune
from backend.tools.tuning.autotune.verification import verify as tune_verify
from backend.tools.tuning.notch import effect as notch_effect
from backend.tools.tuning.sweep.evaluation import SweepSettings, completed
from backend.tools.tuning.sweep.run import sweep
from drivers.cia402 import State
from drivers.errors import NotAllowed, motion_halted
from drivers.halt import Halted
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import AMPLE_S, WIDE, mechanics, silent
from tests.virtual.tools.test_measured_again import SWINGING

ONE = mechanics((1e-4, 60.0, 0.006))
TOO_FAST = Halted.beyond("speed", 9, 8)


class Ended(Exception):
    """The part that is looked at begins."""


class Away:
    """A part of a tuning that is ended a turn from where it began, and the next one."""

    def __init__(self, b: DirectBench, halt: Halted = TOO_FAST) -> None:
        self._b, self._halt = b, halt
        self.begun_rev: list[float] = []

    async def part(self, *_: object, **__: object) -> Any:
        axis = self._b.axis
        units = await axis.units()
        self.begun_rev.append(units.position(await axis.position_raw()))
        if len(self.begun_rev) > 1:
            raise Ended
        there = await axis.position_raw() + units.position_raw(1.0)
        await go_back(axis, self._b.session, there, WIDE, await read_facts(axis))
        raise motion_halted("X", self._halt)


async def test_after_a_notch_that_could_not_be_learned(monkeypatch: pytest.MonkeyPatch) -> None:
    async with direct(ONE, drive="r6l") as b:
        away = Away(b)
        monkeypatch.setattr(notch_effect, "measure_meaning", away.part)
        monkeypatch.setattr(notch_effect, "path_of", lambda *_: None)
        value = SimpleNamespace(value=0.0)
        outcome: Any = SimpleNamespace(
            ends_rev=None,
            result=SimpleNamespace(gravity_nm=value, inertia_kgm2=value, coulomb_nm=value),
        )
        found: Any = SimpleNamespace(
            resonances=[SimpleNamespace(kind="resonance")],
            model="one",
            hold=None,
            delay_s=0.0,
            loop="none",
        )
        how = tune_notches.Learning(WIDE, "auto", "free")
        facts = await read_facts(b.axis)
        home = await b.axis.position_raw()
        said = await tune_notches.learn_notches(
            b.axis, b.session, how, facts, outcome, found, silent()
        )
        units = await b.axis.units()
        assert "beyond the limit" in str(said)
        assert len(away.begun_rev) == 1
        assert abs(units.position(await b.axis.position_raw() - home)) < 0.05
        assert await b.axis.state() is not State.OPERATION_ENABLED


async def test_after_a_design_that_was_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    async with direct(ONE, drive="r6l") as b:
        away = Away(b)
        monkeypatch.setattr(tune_verify.sweep_tool, "sweep", away.part)
        facts, home = await read_facts(b.axis), await b.axis.position_raw()
        check = tune_verify.Check(WIDE, facts, 1.5e-4, None, None, None, 0.03, home)
        reported, none = (silent(), silent(), silent()), cast(Any, None)
        for ended in (NotAllowed, Ended):
            with pytest.raises(ended):
                await tune_verify.verify(b.axis, b.session, check, none, none, reported, None)
        assert away.begun_rev[1] == pytest.approx(away.begun_rev[0], abs=0.05)


async def test_after_gains_that_took_all_the_torque(monkeypatch: pytest.MonkeyPatch) -> None:
    async with direct(ONE, drive="r6l") as b:
        away = Away(b, Halted.beyond("torque", 9, 8))
        monkeypatch.setattr(tuning.inertia_tool, "inertia", away.part)
        settings = AutotuneSettings(WIDE, budget_s=AMPLE_S, motor_inertia_kgm2=5e-5)
        with pytest.raises(Ended):
            await autotune(b.axis, b.session, settings, silent())
        assert away.begun_rev[1] == pytest.approx(away.begun_rev[0], abs=0.05)


@pytest.mark.long
async def test_notches_of_a_free_axis_that_becomes_too_fast_are_learned_with_less() -> None:
    async with direct(SWINGING, drive="r6l") as b:
        found = await sweep(b.axis, b.session, SweepSettings(WIDE, realisations=1), silent())
        facts = completed(await read_facts(b.axis), found)
        path = notch_effect.path_of(found.frf.sample_rate_hz, facts, found.hold, found.delay_s)
        rigid = excite.Rigid(SWINGING.total_inertia_kgm2, SWINGING.friction.coulomb_nm)
        units, home = await b.axis.units(), await b.axis.position_raw()
        b.link.highest["speed"] = 0.0
        meaning = await notch_effect.measure_meaning(
            b.axis, b.session, WIDE, facts, rigid, path, silent()
        )
        assert units.velocity(b.link.highest["speed"]) > WIDE.speed_rpm, "else it shows nothing"
        assert abs(units.position(await b.axis.position_raw() - home)) < 0.05
    assert meaning.levels is not None
    for level, share in meaning.levels.width_ratio:
        assert share == pytest.approx(level / 20.0, rel=0.08)
