"""A drive that does not report its torque is named, and not divided by."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from backend.axes.axis.axis import Envelope
from backend.foundation.work.jobs import Progress
from backend.tools.measuring import excite
from backend.tools.measuring.axis_facts import AxisFacts
from backend.tools.measuring.recording import Recording
from backend.tools.tuning.sweep import play as sweep_play
from backend.tools.tuning.sweep import speed_injection
from backend.tools.tuning.sweep.evaluation import SweepSettings
from backend.tools.tuning.sweep.plan import Setup
from drivers.errors import NotAllowed

ROOM = excite.Room(1.27, 157.0, 25.0)
FACTS = AxisFacts(1.27, True, None, None, None, None, None, True)
SETUP = Setup(1000.0, FACTS, "speed", ROOM, excite.Rigid(1e-4), 1e-3, by_speed=True)
SETTINGS = SweepSettings(Envelope(4.0, 1500.0, 100.0, 60.0))


@pytest.mark.parametrize("reported_nm", [0.0, 0.2])
async def test_a_torque_that_does_not_change_is_said(
    monkeypatch: pytest.MonkeyPatch, reported_nm: float
) -> None:
    made = speed_injection.sequences(
        1000.0, excite.band_for(1000.0, 5.0, None), ROOM, 1.0, 1, "multisine", base=True
    )
    count = made[0].excitation.samples.size
    nothing, valid = np.zeros(count), np.ones(count, np.bool_)
    torque = np.full(count, reported_nm)
    recording = Recording(1000.0, nothing, nothing, torque, nothing, nothing, valid)

    async def played(*_: Any) -> sweep_play.Records:
        return ((made[0], recording),)

    monkeypatch.setattr(sweep_play, "play_fitting", played)
    axis: Any = SimpleNamespace(drive=SimpleNamespace(name="X", require=lambda _role: "6077:00"))
    session: Any = SimpleNamespace(unwatched=lambda _drive: False)
    silent = Progress(lambda: None)
    with pytest.raises(NotAllowed, match=r"6077:00\) does not change"):
        await sweep_play.scaled_by_speed(axis, session, SETTINGS, SETUP, made, 0, silent)
