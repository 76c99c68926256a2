"""A tuning on a computer that loses samples ends in its minute, with a design that was verified.

Time is the drive's own: how busy the computer is that simulates it does not count.
"""

from __future__ import annotations

import random
from types import SimpleNamespace

import pytest

from backend.tools.measuring import repeats
from backend.tools.tuning.autotune import time_budget as tune_time
from backend.tools.tuning.autotune.run import AutotuneSettings, autotune
from backend.tools.tuning.autotune.verification import verify as tune_verify
from backend.tools.tuning.notch import effect as notch_effect
from backend.tools.tuning.notch import in_loop as notch_in_loop
from backend.tools.tuning.sweep import play as sweep_play
from drivers.cia402 import State
from tests.virtual.tools import direct as direct_module
from tests.virtual.tools.direct import DirectBench, direct
from tests.virtual.tools.rig import WIDE, mechanics, silent
from tests.virtual.tools.test_notches_held import vertical

#: Seconds that designing takes here at most while no drive waits for it.
_COMPUTING_S = 3.0


def late(b: DirectBench, every_s: float, cycles_late: tuple[int, int]) -> None:
    """The computer is late for so many cycles, after such a time in the mean."""
    number, following, chance = 0, 400, random.Random(5)

    def cycles() -> int:
        nonlocal number, following
        number += 1
        if number < following:
            return 0
        following = number + 1 + round(chance.expovariate(1e-3 / every_s))
        return chance.randint(*cycles_late)

    b.link.late = cycles


@pytest.mark.long
@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    ("drive", "every_s", "cycles_late"),
    [("r6l", 0.7, (5, 40)), ("r6l", 2.0, (5, 40))],
)
async def test_a_vertical_axis_whose_computer_is_late(
    drive: str, every_s: float, cycles_late: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """From 1 to 3 % of all cycles, which leaves hardly a realisation whole."""
    # 4 ms for each parameter, as over EtherCAT at 1 kHz; computing is counted by _COMPUTING_S.
    monkeypatch.setattr(direct_module, "_TURN_NS", 4_000_000)
    monkeypatch.setattr(direct_module, "_REST_S", 0.01)
    async with direct(vertical(), drive=drive) as b:
        clock = SimpleNamespace(monotonic=lambda: b.link.now_ns / 1e9)
        for tool in (notch_effect, notch_in_loop, repeats, sweep_play, tune_time, tune_verify):
            monkeypatch.setattr(tool, "time", clock)
        if await b.axis.state() is State.FAULT:
            await b.axis.reset_fault()
        late(b, every_s, cycles_late)
        begun_s = clock.monotonic()
        settings = AutotuneSettings(WIDE, motor_inertia_kgm2=mechanics().motor.inertia_kgm2)
        found = await autotune(b.axis, b.session, settings, silent())
        took_s = clock.monotonic() - begun_s
    assert found.verified is not None
    assert found.verified.kept
    assert took_s < 60.0 - _COMPUTING_S
    assert not found.cautious
