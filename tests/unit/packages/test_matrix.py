"""The table of what was tested where says no more than the reports of the tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import matrix, run_all
from tests.matrix import ABSENT, IMPORTED, ROWS, SYSTEMS, TESTED, UNTESTED, Row

ROOT = Path(__file__).resolve().parents[3]
HERE = matrix.this_system()
REPORT = """\
<testsuites><testsuite name="pytest">
<testcase classname="tests.unit.test_a" name="test_one"/>
<testcase classname="tests.unit.test_a.TestGroup" name="test_two"/>
<testcase classname="tests.unit.test_b" name="test_one"><failure message="no"/></testcase>
<testcase classname="tests.unit.test_c" name="test_one"><skipped message="no dpkg"/></testcase>
<testcase classname="tests.unit.computer.test_other_system" name="test_one"/>
</testsuite></testsuites>
"""


def reported(folder: Path, **texts: str) -> dict[str, matrix.Ran]:
    for name, text in texts.items():
        (folder / f"{name}.xml").write_text(text)
    return matrix.read([folder])


def row(name: str, *lacking: str) -> Row:
    return Row("EtherCAT", "scan", (f"tests/unit/test_{name}.py",), lacking)


@pytest.mark.parametrize(
    ("name", "said"), [("a", TESTED), ("b", UNTESTED), ("c", UNTESTED), ("never", UNTESTED)]
)
def test_only_what_has_passed_counts_as_tested(name: str, said: str, tmp_path: Path) -> None:
    assert matrix.cell(row(name), HERE, reported(tmp_path, first=REPORT)) == said


def test_windows_is_imported_only_where_that_ran_and_lacks_what_it_refuses(tmp_path: Path) -> None:
    ran = reported(tmp_path, first=REPORT)
    assert matrix.cell(row("a"), "Windows", ran) == IMPORTED
    assert matrix.cell(row("a"), "Windows", {}) == UNTESTED
    assert matrix.cell(row("a", "Windows"), "Windows", ran) == ABSENT


def test_what_stood_in_on_linux_is_no_test_of_the_system_itself(tmp_path: Path) -> None:
    ran = reported(tmp_path, first=REPORT)
    shown = Row("EtherCAT", "scan", path_shown_by=("tests/unit/test_a.py",))
    failed = Row("EtherCAT", "scan", path_shown_by=("tests/unit/test_b.py",))
    for system in ("Windows", "macOS"):
        assert matrix.cell(shown, system, ran) == matrix.STOOD_IN
        assert matrix.cell(failed, system, ran) != matrix.STOOD_IN
    assert matrix.cell(shown, HERE, ran) == UNTESTED
    said = {(failed, "Windows"): matrix.STOOD_IN}
    assert matrix.overstated(said, ran) == ["EtherCAT, scan on Windows: tests/unit/test_b.py"]


def test_a_table_that_says_more_than_ran_is_found(tmp_path: Path) -> None:
    ran = reported(tmp_path, first=REPORT)
    said = {
        (row("a"), HERE): TESTED,
        (row("b"), HERE): TESTED,
        (row("never"), HERE): TESTED,
        (row("c"), HERE): TESTED,
        (Row("all", "none"), HERE): TESTED,
    }
    assert [each.rpartition(": ")[2] for each in matrix.overstated(said, ran)] == [
        "tests/unit/test_b.py",
        "tests/unit/test_never.py",
        "no test",
    ]


def test_the_documentation_has_this_table() -> None:
    cells = matrix.read_table(matrix.written())
    assert matrix.table(cells) == matrix.written()
    for (each, system), said in cells.items():
        assert said == ABSENT if system in each.lacking else said in {
            TESTED, IMPORTED, matrix.STOOD_IN, matrix.TYPED, UNTESTED,
        }, (each, system)  # fmt: skip
        assert said != TESTED or each.shown_by, (each, system)


def test_every_file_that_shows_something_is_there_and_reports_are_checked() -> None:
    for each in ROWS:
        for file in each.shown_by:
            assert (ROOT / file).is_file(), file
    assert (ROOT / matrix.OTHER_SYSTEM).is_file()
    assert run_all.REPORTS in run_all.MATRIX[0].command
    suites = [*run_all.TIMED, *run_all.BUSES, *run_all.PAGES]
    assert all(any("--junitxml" in part for part in suite.command) for suite in suites)
    # What the column of macOS says: types alone.
    assert "types on darwin" in {check.name for check in run_all.QUICK}
    assert set(SYSTEMS) >= {"Windows", "macOS"}
