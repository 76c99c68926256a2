"""The installation benchmark reports a way that fails, and goes on with the others."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from benchmarks import install
from benchmarks.install import Walk, WayFailed


def test_a_failed_step_gives_its_exit_code_and_last_message(tmp_path: Path) -> None:
    walk = Walk(tmp_path, offline=False)
    with pytest.raises(WayFailed, match="pip install: exit code 3: no wheel"):
        walk.do("pip install", [sys.executable, "-c", "import sys; print('no wheel'); sys.exit(3)"])
    assert walk.steps == []


def test_a_server_that_ends_before_it_serves_is_a_failed_step(tmp_path: Path) -> None:
    with pytest.raises(WayFailed, match="servodeck serve: no server: exit code 0\nhello"):
        Walk(tmp_path, offline=False).page(
            "servodeck serve", sys.executable, "-c", "print('hello')"
        )


def test_the_other_ways_are_tried_and_the_exit_code_is_1(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "wheels").mkdir()
    ways = {"first": (fails, 60.0), "second": (succeeds, 60.0)}
    monkeypatch.setattr(install, "WAYS", ways)
    monkeypatch.setattr(sys, "argv", ["install", str(tmp_path)])
    assert install.main() == 1
    printed = capsys.readouterr().out
    assert "first: failed: serve: no server" in printed
    assert "NOT MET  first" in printed
    assert "second: 1 steps" in printed


def fails(_walk: Walk, _dist: Path) -> None:
    raise WayFailed("serve: no server")


def succeeds(walk: Walk, _dist: Path) -> None:
    walk.do("nothing", [sys.executable, "-c", ""])
