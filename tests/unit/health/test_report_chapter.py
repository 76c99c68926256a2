"""The report's chapter of the condition says who signed, what changed, and what to do next."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from backend.foundation.store.database import Store
from backend.report.compose import compose
from backend.report.document import Language, Note, Table
from backend.report.facts import Facts, Identity
from backend.tools.watching.health.result import HealthRound, HealthValue
from backend.tools.watching.health.settings import HealthSettings
from backend.tools.watching.trend.records import AxisOf, Condition, HealthRecords

AXIS = AxisOf("2e1-30-7", "X", "mms7", 0x2E1, 0x30, None, 7)
SETTINGS = HealthSettings(travel_limit=2, speed_limit=900, torque_limit=80)
FACTS = Facts(
    Identity("X", "MMS7", "", "", 0x2E1, 0x30, None, 7, "", ()),
    datetime(2026, 3, 1, tzinfo=UTC),
    "0.1",
)


@pytest.fixture
def condition(tmp_path: Path) -> Condition:
    records = HealthRecords(Store(tmp_path), "hall 3")
    for month, values in ((1, (9.9, 10.0, 10.1)), (2, (12.0, 12.1))):
        rounds = [HealthRound(values=(HealthValue(quantity="friction", value=v),)) for v in values]
        taken = datetime(2026, month, 1, tzinfo=UTC)
        runs = records.add(AXIS, SETTINGS, rounds, {}, "Ann", taken)
        if month == 1:
            records.sign(AXIS.key, runs, "Ann")
    found = records.condition(AXIS)
    records._store.close()
    return found


def texts(condition: Condition | None, language: Language) -> tuple[str, str]:
    """All notes that warn, and all cells of tables."""
    blocks = compose(replace(FACTS, condition=condition), language).blocks
    notes = [each.text for each in blocks if isinstance(each, Note) and each.tone == "warn"]
    cells = [
        cell for each in blocks if isinstance(each, Table) for row in each.rows for cell in row
    ]
    return "\n".join(notes), "\n".join(cells)


@pytest.mark.parametrize(
    ("language", "said", "step"),
    [
        ("en", "friction has changed by +20.", "Next: with the power off"),
        ("zh", "摩擦相对基线变化 +20.", "下一步: 断电后检查"),
    ],
)
def test_a_change_and_its_next_step(
    condition: Condition, language: Language, said: str, step: str
) -> None:
    notes, cells = texts(condition, language)
    assert said in notes
    assert step in notes
    assert condition.baseline is not None
    assert condition.baseline.sha256 in cells
    assert "Ann" in cells


def test_a_baseline_that_was_changed_is_named(condition: Condition) -> None:
    assert condition.baseline is not None
    other = replace(condition, baseline=replace(condition.baseline, intact=False), findings=())
    assert "its checksum differs" in texts(other, "en")[0]


def test_without_a_baseline_there_is_no_chapter() -> None:
    assert "checksum" not in "".join(texts(None, "en"))
