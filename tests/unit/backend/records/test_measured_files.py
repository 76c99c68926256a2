"""A measuring command whose file cannot be written: before anything moves, or without loss."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import typer

from backend.commands.measuring import measure
from backend.commands.measuring.measure import Where
from backend.foundation.store.files import StorageFailed, require_writable

WHERE = Where("canopen://can9", 1, None, None, None)
ANSWER = {"inertia_kgm2": 1.5e-4}


def _measured(
    out: Path | None, *, table: Path | None = None, as_json: bool = False, fails: bool = False
) -> list[str]:
    """What was done, in order; the file is replaced by a folder during the measurement."""
    done: list[str] = []
    failed: list[StorageFailed] = []

    async def here() -> measure.Answer:
        done.append("moved")
        if fails and out is not None:
            out.mkdir()  # noqa: ASYNC240
        if fails and table is not None:
            failed.append(StorageFailed("store.not-written", value="t", path="t", strerror="full"))
        return ANSWER

    try:
        measure.measure(
            WHERE, "inertia", here, {}, out, lambda _answer: ["a line"],
            as_json=as_json, files=(table,), failed=failed,
        )  # fmt: skip
    except typer.Exit as error:
        done.append(f"exit {error.exit_code}")
    return done


def test_nothing_moves_where_the_file_cannot_be_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    for place in (tmp_path, tmp_path / "file" / "a.json"):
        assert _measured(place) == ["exit 1"]
        assert _measured(None, table=place) == ["exit 1"]
    assert "could not be written" in capsys.readouterr().err


@pytest.mark.parametrize("as_json", [False, True])
def test_a_result_that_cannot_be_written_is_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], as_json: bool
) -> None:
    assert _measured(tmp_path / "a.json", as_json=as_json, fails=True) == ["moved", "exit 1"]
    printed = capsys.readouterr()
    assert printed.out.startswith("{" if as_json else "a line\n{")
    assert json.loads(printed.out.removeprefix("a line\n")) == ANSWER
    assert "a.json could not be written" in printed.err
    assert "written:" not in printed.out


def test_a_table_that_cannot_be_written_is_reported_after_the_result(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    done = _measured(None, table=tmp_path / "t", fails=True)
    assert done == ["moved", "exit 1"]
    assert capsys.readouterr().out == "a line\n"


def test_the_check_leaves_nothing_behind(tmp_path: Path) -> None:
    there = tmp_path / "a.json"
    there.write_text("old")
    require_writable(there)
    require_writable(tmp_path / "b.json")
    assert [each.name for each in tmp_path.iterdir()] == ["a.json"]
    assert there.read_text() == "old"
    assert _measured(tmp_path / "c.json") == ["moved"]
    assert json.loads((tmp_path / "c.json").read_text()) == ANSWER
