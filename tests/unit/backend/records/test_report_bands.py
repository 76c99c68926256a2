"""The report of a tuned loop says what the page says: measured, and predicted above it."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest

from backend.api.tuning import measure
from backend.axes.drive.drive import Drive
from backend.records.library.measurements import BadMeasurement, MeasurementStore
from backend.report.chapters import chapter
from backend.report.compose import _verdict
from backend.report.document import Block, Note, Table
from backend.report.facts import Measured
from backend.report.gather import measured_from
from backend.report.texts import Words
from backend.report.tools import verdict_of
from backend.tools.registry import BY_KIND
from backend.tools.tuning.autotune.result import AutotuneAnswer, VerdictInfo, VerifiedInfo
from backend.tools.tuning.sweep.result import SweepAnswer
from tests.support import measurements as known

GOALS = {"gain_margin_db": 9.5, "phase_margin_deg": 46.0, "ms": 1.7}


def interval(value: float, low: float, high: float) -> dict[str, float]:
    return {"value": value, "low": low, "high": high}


def verdict(**changes: object) -> dict[str, object]:
    band = {
        "low_hz": 5.0,
        "high_hz": 246.0,
        "phase_margin_deg": interval(58.0, 55.0, 61.0),
        "gain_margin_db": None,
        "peak_sensitivity": interval(1.3, 1.2, 1.4),
    }
    above = {
        "low_hz": 246.0,
        "high_hz": 4000.0,
        "phase_margin_deg": interval(46.0, 41.0, 46.0),
        "gain_margin_db": interval(9.5, 7.1, 9.5),
        "peak_sensitivity": interval(1.7, 1.7, 1.9),
    }
    return {
        "measured": band, "predicted": above, "last_crossover_hz": 474.0,
        "coverage": "gain_steps", "shown_gain_db": 7.0, "stated": GOALS,
        "worst": {"gain_margin_db": 7.1, "phase_margin_deg": 41.0, "ms": 1.9}, "stable": True,
        "delay_s": interval(0.0, -3e-5, 3e-5), "gain_db": interval(0.0, -0.4, 0.4),
        "contradicted": False, "designed": above,
    } | changes  # fmt: skip


def measured(drive: Drive, folder: Path, found: dict[str, object]) -> Measured:
    """As the job of a tuning leaves it in the store."""
    store = MeasurementStore(folder)
    store.store("1-loop.sdmeas", known.file_of(drive, known.speed_loop(), datetime.now(UTC)))
    verified = VerifiedInfo.model_construct(
        sweep=SweepAnswer.model_construct(kind="speed_loop"),
        verdict=VerdictInfo.model_validate(found),
    )
    answer = AutotuneAnswer.model_construct(
        inertia=None, mechanics=None, step=None, verified=verified
    )
    measure._conclude(store, ["1-loop.sdmeas"], BY_KIND["autotune"], answer)
    (one,), unusable = measured_from(store, [("1-loop.sdmeas", "")])
    assert not unusable
    return one


def rows(blocks: list[Block]) -> str:
    found = [" | ".join(row) for b in blocks if isinstance(b, Table) for row in (b.head, *b.rows)]
    return "\n".join([*found, *(b.text for b in blocks if isinstance(b, Note))])


def test_both_bands_and_how_far_the_verdict_reaches(drive: Drive, tmp_path: Path) -> None:
    one = measured(drive, tmp_path, verdict())
    note = _verdict(one, Words("en"))
    # 1.3 and 58° hold in the measured band; the worse of both counts.
    assert (note.tone, "46°" in note.text, "9.5 dB" in note.text) == ("good", True, True)
    english, chinese = (rows(chapter(one, Words(language))) for language in ("en", "zh"))
    assert "measured, 5 Hz – 246 Hz | 58° (55 – 61) | — | 1.30 (1.20 – 1.40)" in english
    assert "predicted, 246 Hz – 4 kHz | 46° (41 – 46) | 9.5 dB (7.1 – 9.5)" in english
    assert "up to 474 Hz" in english
    assert "stable with 7.0 dB more gain" in english
    assert "预测, 246 Hz" in chinese
    assert "474 Hz" in chinese


@pytest.mark.parametrize(
    ("changes", "tone"),
    [
        ({"coverage": "predicted", "shown_gain_db": None}, "warn"),
        ({"stated": GOALS | {"gain_margin_db": 7.0}}, "warn"),
        ({"stated": GOALS | {"phase_margin_deg": 10.0}}, "fault"),
        ({"stated": GOALS | {"gain_margin_db": None}}, "warn"),
        ({"stable": False}, "fault"),
    ],
)
def test_a_prediction_or_a_missing_figure_is_never_called_sound(
    drive: Drive, tmp_path: Path, changes: dict[str, object], tone: str
) -> None:
    assert _verdict(measured(drive, tmp_path, verdict(**changes)), Words("en")).tone == tone


def test_a_loop_that_no_tuning_verified_has_no_bands(drive: Drive, tmp_path: Path) -> None:
    store = MeasurementStore(tmp_path)
    store.store("1-loop.sdmeas", known.file_of(drive, known.speed_loop(), datetime.now(UTC)))
    (one,), _ = measured_from(store, [("1-loop.sdmeas", "")])
    assert one.verdict is None
    assert "predicted" not in rows(chapter(one, Words("en")))
    with pytest.raises(BadMeasurement):
        verdict_of({"measured": 5})
