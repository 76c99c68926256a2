"""A baseline, then a loose coupling and a worn belt as the demo plants them: found and named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from backend.foundation.store.database import Store
from backend.tools.watching.trend.compare import compare
from backend.tools.watching.trend.records import HealthRecords
from backend.tools.watching.trend.words import message_of
from drivers.virtual.defects import LOOSE, WORN
from tests.virtual.tools.set_ups.demo import with_defect
from tests.virtual.tools.set_ups.health import (
    ASKED,
    AXIS,
    axis_of,
    changed,
    checked,
    resonance_hz,
)


@pytest.mark.long
@pytest.mark.timeout(300)
async def test_a_loose_coupling_and_a_worn_belt_are_found(tmp_path: Path) -> None:
    healthy = await checked(axis_of(), 3)
    first = {each.quantity: each.value for each in healthy.rounds[0].values}
    assert first["resonance"] == pytest.approx(resonance_hz(), rel=0.02)
    records = HealthRecords(Store(tmp_path), "hall 3")
    runs = records.add(AXIS, ASKED, healthy.rounds, {"a.sdmeas": "0" * 64}, "Ann")
    records.sign(AXIS.key, runs, "Ann")

    loose = await checked(with_defect(axis_of(), "coupling_loose"), 2)
    records.add(AXIS, ASKED, loose.rounds, {"b.sdmeas": "1" * 64}, "Ben")
    found = changed(records.condition(AXIS).findings)
    records._store.close()
    assert set(found) == {"resonance 1"}, "friction is what it was"
    assert found["resonance 1"].change == pytest.approx(np.sqrt(LOOSE) - 1, abs=0.02)
    words = message_of(found["resonance 1"])
    assert "as with a stiffness changed by -" in words.words("en")
    step = words.remedy()
    assert step is not None
    assert "check the coupling" in step.words("en")
    assert "联轴器" in step.words("zh")

    worn = await checked(with_defect(axis_of(), "belt_worn"), 2, response=False)
    found = changed(compare(healthy.rounds, worn.rounds))
    assert set(found) == {"friction 1"}
    assert found["friction 1"].direction == "higher"
    assert found["friction 1"].change == pytest.approx(WORN - 1.0, abs=0.04)
    step = message_of(found["friction 1"]).remedy()
    assert step is not None
    assert "belt" in step.words("en")
