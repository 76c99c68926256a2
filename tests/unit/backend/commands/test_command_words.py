"""Lines of commands that have words are in the language of the command."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from backend import cli
from backend.commands.buses import eeprom
from backend.commands.measuring import health, response
from backend.commands.server import preflight
from backend.tools.watching.health.result import QUANTITIES, HealthValue
from drivers.computer.timing.lateness import Histogram
from drivers.texts.answers import sentences
from drivers.texts.message import prose, speaking

ANSWER: dict[str, Any] = {
    "unit": "Nm/(rad/s)",
    "valid_band_hz": [5.0, 400.0],
    "periods_used": 12,
    "imported": {"method": "periods", "period_s": 1.25, "transient_periods": 2},
    "resonances": [
        {"kind": "resonance", "frequency_hz": 123.456, "frequency_ci95_hz": (120.0, 126.0),
         "damping": 0.0123},
    ],
    "axis": {
        "verdict": "sound", "inertia": 1.5e-4, "inertia_ci95": (1.4e-4, 1.6e-4),
        "inertia_unit": "kg·m²", "viscous": 2e-4, "viscous_unit": "Nm·s/rad",
        "candidates": [
            {"marks": ("robust", "fast"), "gains": {"speed_nms": 0.5, "integral_hz": 4.0},
             "notches": [{"center_hz": 123.0, "depth_db": -20.0}]},
            {"marks": ("balanced",), "gains": {"speed_nms": 0.4, "integral_hz": 3.0},
             "notches": []},
        ],
    },
    **sentences("warnings", [prose("short")], "warning"),
}  # fmt: skip


def test_lines_of_an_imported_response() -> None:
    assert response._reported(ANSWER) == [
        "periodic excitation, period 1.25 s: 12 periods used, 2 left out as transient; "
        "5 … 400 Hz in Nm/(rad/s)",
        "resonance        123.46 Hz  (120.00 … 126.00)  damping 0.0123",
        "inertia 0.00015 (0.00014 … 0.00016) kg·m²  viscous friction at this level 0.0002 Nm·s/rad",
        "robust/fast          gain 0.5 per rad/s, integral 4 Hz, notches: 123.0 Hz -20 dB",
        "balanced             gain 0.4 per rad/s, integral 3 Hz, notches: none",
        "note: short",
    ]
    with speaking("zh"):
        lines = response._reported(ANSWER)
    for line, word in zip(lines, ("周期激励", "谐振", "惯量", "稳健", "均衡", "注意"), strict=True):
        assert word in line


@pytest.mark.parametrize(("excitation", "word"), [("chirp", "扫频"), ("noise", "噪声")])
def test_the_method_without_periods(excitation: str, word: str) -> None:
    answer = ANSWER | {"imported": {"method": "local polynomial", "excitation": excitation}}
    first = response._reported(answer)[0]
    assert first == (f"excitation: {excitation}; local polynomial method; 5 … 400 Hz in Nm/(rad/s)")
    with speaking("zh"):
        assert word in response._reported(answer)[0]


def test_questions_and_words_of_eeprom() -> None:
    arguments = ["eeprom", "alias", "ethercat://eth9", "5", "--station", "2"]
    with speaking("en"):
        done = CliRunner().invoke(cli.app, arguments, input="n\n")
        assert "write alias 5 to station 2? [y/N]" in done.output
        assert eeprom._short(None) == "missing"
        assert eeprom._short("ab" * 64) == f"{'ab' * 32}… (64 bytes)"
    with speaking("zh"):
        done = CliRunner().invoke(cli.app, ["--language", "zh", *arguments], input="n\n")
        assert "将别名 5 写入站 2？" in done.output
        assert eeprom._short(None) == "缺少"
        assert "64 字节" in eeprom._short("ab" * 64)


@pytest.mark.parametrize(
    ("language", "question"),
    [("en", "write it now? Do not switch anything off until it is done"), ("zh", "现在写入？")],
)
def test_the_question_before_an_eeprom_is_written(
    monkeypatch: pytest.MonkeyPatch, language: Any, question: str
) -> None:
    asked: list[str] = []

    def confirm(words: str) -> bool:
        asked.append(words)
        return True

    monkeypatch.setattr(typer, "confirm", confirm)
    change = {"word": 4, "field": "alias", "first": "0000", "second": "0500"}
    with speaking(language):
        assert eeprom._confirmed(eeprom._Shown("d1", 1, False, [change]), "d1", yes=False)
    assert len(asked) == 1
    assert asked[0].startswith(question)


def test_lines_of_health() -> None:
    import datetime as dt

    signed = SimpleNamespace(
        signed=dt.datetime(2026, 3, 4, 5, 6), runs=[1, 2, 3], person="Ada", sha256="ff"
    )
    found: Any = SimpleNamespace(axis="X", profile="mms7", serial=1234567, runs=[], baseline=signed)
    assert health._baseline_lines(found) == [
        "X: baseline of 3 rounds, signed 2026-03-04 05:06 UTC by Ada",
        "sha256: ff",
    ]
    assert health._trend_lines(found) == ["X  mms7  serial 1234567"]
    with speaking("zh"):
        assert "由 Ada 于 2026-03-04 05:06 UTC 签署" in health._baseline_lines(found)[0]
        assert health._trend_lines(found) == ["X  mms7  序列号 1234567"]
    values = [HealthValue(quantity=each, value=50.25) for each in QUANTITIES]
    found.runs = [SimpleNamespace(id=7, taken=dt.datetime(2026, 3, 4, 5, 6), values=values)]
    assert "resonance 1: 50.25 Hz" in health._trend_lines(found)[1]
    assert "rise time of the step 1: 50.25 s" in health._trend_lines(found)[1]
    with speaking("zh"):
        row = health._trend_lines(found)[1]
    assert "谐振 1: 50.25 Hz" in row
    assert "step_rise" not in row


def test_names_of_measured_times(capsys: pytest.CaptureFixture[str]) -> None:
    run: Any = SimpleNamespace(
        period_us=1000, cycles=10, missed=0, fifo=True, memory_locked=True, unanswered=0,
        lateness=Histogram.empty(), round_trip=Histogram.empty(),
    )  # fmt: skip
    preflight._show_run(run)
    with speaking("zh"):
        preflight._show_run(run)
    printed = capsys.readouterr().out
    for words in ("wake-up lateness: 99.9 %", "frame round trip: 99.9 %", "唤醒延迟", "帧往返时间"):
        assert words in printed
