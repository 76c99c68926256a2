"""What works on which system, from the tests that ran: the table in docs/install.md.

    python tests/matrix.py --write REPORT…   put the table into docs/install.md
    python tests/matrix.py REPORT…           fail where it says more than the tests have shown

REPORT is a file or folder of JUnit XML files as ``pytest --junitxml`` writes them; ``make test``
leaves them in ``.pytest_cache/reports`` and checks the table with them. A row names the test files
that show it; it counts as tested on the system that they ran on when in each a test passed and none
failed.
"""

from __future__ import annotations

import platform
import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs/install.md"
BEGIN, END = "<!-- made by tests/matrix.py: begin -->\n", "<!-- made by tests/matrix.py: end -->\n"
SYSTEMS = ("Linux x86_64", "Linux aarch64", "Windows", "macOS")
TESTED, IMPORTED, TYPED = "tested here", "tested by import and types only", "types only"
STOOD_IN = "code path tested on Linux only"
UNTESTED, ABSENT = "not tested", "not available"
#: Starts the server and imports every module with what Windows lacks removed.
OTHER_SYSTEM = "tests/unit/computer/test_other_system.py"


@dataclass(frozen=True)
class Row:
    """A function on a bus, and the test files that show it; without files nothing does.

    ``lacking`` are systems that do not have it, which the program says as text.
    ``path_shown_by`` are tests on Linux of what Windows and macOS run in its place.
    """

    bus: str
    function: str
    shown_by: tuple[str, ...] = ()
    lacking: tuple[str, ...] = ()
    path_shown_by: tuple[str, ...] = ()


_NOT_POSIX = ("Windows",)
_LINUX_ALONE = ("Windows", "macOS")
_WIRE, _SERIAL = "tests/wire/ethercat_host", "tests/wire/serial_line"
_CAN = "tests/wire/canopen"
_BY_LIBRARY = (f"{_WIRE}/test_library_frames.py", f"{_WIRE}/test_library_wire.py")
_IF_PUNCTUAL = (*_BY_LIBRARY, f"{_WIRE}/test_punctuality.py")
ROWS = (
    Row("no bus", "server and page", ("tests/browser/test_frame.py",)),
    Row("no bus", "state folder: version, lock, backup",
        ("tests/store/test_state_version.py", "tests/store/test_backup.py")),
    Row("no bus", "virtual drives (`demo`)", ("tests/api/test_every_family.py",), _NOT_POSIX),
    Row("EtherCAT", "scan, parameters", (f"{_WIRE}/test_link.py", f"{_WIRE}/test_coe.py"),
        (), _BY_LIBRARY),
    Row("EtherCAT", "alarms, faults", ("tests/api/test_ethercat_faults.py",), (), _BY_LIBRARY),
    Row("EtherCAT", "cyclic motion, scope", ("tests/api/test_ethercat.py",
        f"{_WIRE}/test_cyclic.py"), (), _IF_PUNCTUAL),
    Row("EtherCAT", "STOP", (f"{_WIRE}/test_stop.py", f"{_WIRE}/test_real_time.py"),
        (), _BY_LIBRARY),
    Row("EtherCAT", "frequency response, tuning", ("tests/virtual/tools/test_accuracy.py",)),
    Row("EtherCAT", "firmware by FoE", (f"{_WIRE}/test_foe.py",), (), _BY_LIBRARY),
    Row("EtherCAT", "station with the declared capabilities alone",
        (f"{_WIRE}/test_declared_capabilities.py",), _LINUX_ALONE),
    Row("CANopen by slcan", "scan, parameters",
        (f"{_CAN}/test_canopen_link.py", f"{_CAN}/test_canopen_sdo.py")),
    Row("CANopen by slcan", "cyclic motion", (f"{_CAN}/test_canopen_axis.py",
        f"{_CAN}/test_canopen_cyclic.py")),
    Row("CANopen by slcan", "frequency response, tuning",
        ("tests/virtual/tools/test_canopen_measure.py",)),
    Row("CANopen by SocketCAN", "all", (), _LINUX_ALONE),
    Row("Modbus RTU", "search, parameters", (f"{_SERIAL}/test_modbus_link.py",
        f"{_SERIAL}/test_serial_search.py")),
    Row("MLink", "parameters", (f"{_SERIAL}/test_mlink_link.py",
        f"{_SERIAL}/test_mlink_whole_drive.py")),
    Row("all", "jog, moves, STOP of every family", ("tests/virtual/test_stop_matrix.py",)),
    Row("way in", "wheel in a fresh environment (pipx, uv)",
        ("tests/unit/packages/test_wheel.py",)),
    Row("way in", "Debian package", ("tests/unit/packages/test_debian.py",), _LINUX_ALONE),
    Row("way in", "self-contained folder", (), ("macOS",)),
    Row("way in", "container", (), _LINUX_ALONE),
)  # fmt: skip


@dataclass
class Ran:
    """What became of the tests of one file, by test."""

    passed: set[str]
    failed: set[str]
    skipped: set[str]

    @property
    def good(self) -> bool:
        """Something passed, and nothing failed."""
        return bool(self.passed) and not self.failed


def read(reports: Iterable[Path]) -> dict[str, Ran]:
    """By test file what the reports say of it."""
    ran: dict[str, Ran] = {}
    for place in reports:
        for report in sorted(place.rglob("*.xml")) if place.is_dir() else [place]:
            for case in ElementTree.parse(report).getroot().iter("testcase"):
                file = _file(case.get("classname", ""))
                one = ran.setdefault(file, Ran(set(), set(), set()))
                kinds = {child.tag for child in case}
                where = (
                    one.failed
                    if kinds & {"failure", "error"}
                    else one.skipped
                    if "skipped" in kinds
                    else one.passed
                )
                where.add(f"{case.get('classname')}::{case.get('name')}")
    return ran


def _file(classname: str) -> str:
    """The file of a test: the part of its dotted name up to the module."""
    parts = classname.split(".")
    while parts and not parts[-1].startswith("test_"):
        parts.pop()
    return "/".join(parts) + ".py"


def this_system() -> str:
    """The column of the computer that this runs on."""
    system = {"Darwin": "macOS"}.get(platform.system(), platform.system())
    return f"{system} {platform.machine()}" if system == "Linux" else system


def cell(row: Row, system: str, ran: Mapping[str, Ran]) -> str:
    """What the tests that ran here say of a function on a system."""
    if system in row.lacking:
        return ABSENT
    if system == this_system():
        shown = row.shown_by and all(file in ran and ran[file].good for file in row.shown_by)
        return TESTED if shown else UNTESTED
    path = row.path_shown_by
    if system in _LINUX_ALONE and path and all(f in ran and ran[f].good for f in path):
        return STOOD_IN
    imported = OTHER_SYSTEM in ran and ran[OTHER_SYSTEM].good
    if system == "Windows" and row.bus != "way in" and imported:
        return IMPORTED
    return TYPED if system == "macOS" and row.bus != "way in" else UNTESTED


def table(cells: Mapping[tuple[Row, str], str]) -> str:
    """The table in Markdown."""
    lines = [
        "| bus | function | " + " | ".join(SYSTEMS) + " |",
        "| --- | --- |" + " --- |" * len(SYSTEMS),
        *(
            f"| {row.bus} | {row.function} | "
            + " | ".join(cells[row, system] for system in SYSTEMS)
            + " |"
            for row in ROWS
        ),
    ]
    return "\n".join(lines) + "\n"


def written() -> str:
    """The table as it is in the documentation."""
    found = re.search(f"{re.escape(BEGIN)}(.*?){re.escape(END)}", PAGE.read_text("utf-8"), re.S)
    return found[1] if found else ""


def read_table(text: str) -> dict[tuple[Row, str], str]:
    """Cells of a table that has exactly these rows and systems.

    Raises:
        ValueError: it has others.
    """
    lines = [[each.strip() for each in line.strip("|\n").split("|")] for line in text.splitlines()]
    if len(lines) != len(ROWS) + 2 or tuple(lines[0][2:]) != SYSTEMS:
        raise ValueError("the table in docs/install.md has other rows or systems")
    cells = {}
    for row, (bus, function, *rest) in zip(ROWS, lines[2:], strict=True):
        if (bus, function, len(rest)) != (row.bus, row.function, len(SYSTEMS)):
            raise ValueError(f"the table in docs/install.md has {bus}, {function} for {row}")
        cells |= {(row, system): each for system, each in zip(SYSTEMS, rest, strict=True)}
    return cells


def overstated(cells: Mapping[tuple[Row, str], str], ran: Mapping[str, Ran]) -> list[str]:
    """What the table says and the tests have not shown.

    A test that was skipped here has stated the reason; the figures of where it ran still count.
    """
    found = []
    for (row, system), said in cells.items():
        if said not in (TESTED, IMPORTED, STOOD_IN) or said == cell(row, system, ran):
            continue
        files = {TESTED: row.shown_by, STOOD_IN: row.path_shown_by}.get(said, (OTHER_SYSTEM,))
        bad = [file for file in files if file not in ran or ran[file].failed - ran[file].passed]
        if bad or not files:
            found.append(f"{row.bus}, {row.function} on {system}: {', '.join(bad) or 'no test'}")
    return found


def main(arguments: list[str]) -> int:
    """Write the table, or check it."""
    ran = read(Path(each) for each in arguments if each != "--write")
    if "--write" in arguments:
        fresh = table({(row, system): cell(row, system, ran) for row in ROWS for system in SYSTEMS})
        text = PAGE.read_text("utf-8")
        PAGE.write_text(text.replace(BEGIN + written() + END, BEGIN + fresh + END), "utf-8")
        return 0
    wrong = overstated(read_table(written()), ran)
    for each in wrong:
        print(f"docs/install.md says more than was tested: {each}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
